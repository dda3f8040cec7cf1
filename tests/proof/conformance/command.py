"""``bondsight conformance``: published cases, judged for this tool and for BondGraphTools."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tests.proof.conformance.case import Case
    from tests.proof.conformance.check import Judgement


@dataclass(frozen=True)
class Column:
    """What one tool says about all cases."""

    tool: str
    judgements: tuple[Judgement, ...]

    def count(self, verdict: str) -> int:
        """Count the cases with this verdict."""
        return sum(j.verdict == verdict for j in self.judgements)

    @property
    def seconds(self) -> float:
        """Time of the tool for all cases."""
        return sum(j.seconds for j in self.judgements)


def add_conformance_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "conformance", help="published bond graphs with known results, judged case by case"
    )
    p.add_argument(
        "--peer", metavar="PYTHON", help="a Python with BondGraphTools 0.4.6, judged beside"
    )
    p.add_argument(
        "--numbers", action="store_true", help="give the peer numbers instead of symbols"
    )
    p.add_argument(
        "--case", action="append", default=[], metavar="NAME", dest="names", help="only this case"
    )
    p.add_argument("--json", action="store_true", help="print everything as JSON")
    p.set_defaults(run=_conformance)


def _conformance(options: argparse.Namespace) -> int:
    """Exit code 0 if every case of Bondsight is right, 1 if not."""
    from tests.proof.conformance.case import case, cases
    from tests.proof.conformance.check import RIGHT
    from tests.proof.conformance.ours import judge_bondsight

    chosen = tuple(case(n) for n in options.names) or cases()
    columns = []
    peer = _peer(options) if options.peer else None
    columns.append(_column("Bondsight", judge_bondsight, chosen))
    if peer is not None:
        columns.append(_column(peer[0], peer[1], chosen))
    if options.json:
        print(json.dumps(_as_json(chosen, columns), indent=2, allow_nan=False))
    else:
        print(table(columns))
    return 0 if columns[0].count(RIGHT) == len(chosen) else 1


def _peer(options: argparse.Namespace) -> tuple[str, Callable[[Case], Judgement]]:
    from tests.proof.conformance.anchors import judge_bondgraphtools, peer_version

    def run(case: Case) -> Judgement:
        return judge_bondgraphtools(case, options.peer, numbers=options.numbers)

    return f"BondGraphTools {peer_version(options.peer)}", run


def _column(tool: str, run: Callable[[Case], Judgement], chosen: Sequence[Case]) -> Column:
    from tqdm import tqdm

    bar = tqdm(chosen, desc=tool, unit="case", leave=False, disable=not sys.stderr.isatty())
    return Column(tool, tuple(run(c) for c in bar))


def table(columns: Sequence[Column]) -> str:
    """Return the verdicts of the tools side by side, then every case that is not right."""
    from tests.proof.conformance.check import RIGHT, VERDICTS

    width = max(len(v) for v in VERDICTS)
    widths = [max(len(c.tool), 6) for c in columns]
    lines = [
        " ".join([" " * width, *(c.tool.rjust(w) for c, w in zip(columns, widths, strict=True))])
    ]
    for v in VERDICTS:
        counts = (str(c.count(v)).rjust(w) for c, w in zip(columns, widths, strict=True))
        lines.append(" ".join([v.ljust(width), *counts]))
    seconds = (f"{c.seconds:.1f}".rjust(w) for c, w in zip(columns, widths, strict=True))
    lines.append(" ".join(["seconds".ljust(width), *seconds]))
    for c in columns:
        wrong = [j for j in c.judgements if j.verdict != RIGHT]
        lines.append(f"{c.tool}, not right: " + ("none" if not wrong else str(len(wrong))))
        lines += [f"  {j.case}: {j.verdict}: {j.reason}" for j in wrong]
    return "\n".join(lines)


def _as_json(chosen: Sequence[Case], columns: Sequence[Column]) -> dict[str, Any]:
    from tests.proof.conformance.check import VERDICTS

    return {
        "cases": {
            c.identity: {
                "source": c.citation,
                "published": list(c.published),
                "computed": [f for f in c.expected if f not in c.published],
            }
            for c in chosen
        },
        "tools": [
            {
                "tool": c.tool,
                "verdicts": {v: c.count(v) for v in VERDICTS},
                "cases": [asdict(j) for j in c.judgements],
            }
            for c in columns
        ],
    }
