"""``python -m tests.proof.benchmark``: export a trial, score any entry, draw the baselines."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.whole_file import write_atomically
from tests.proof.benchmark import scorer
from tests.proof.trial.layout import Layout


def parser() -> argparse.ArgumentParser:
    """Return the parser of the verbs."""
    p = argparse.ArgumentParser(prog="python -m tests.proof.benchmark", description=__doc__)
    verbs = p.add_subparsers(title="verbs", metavar="VERB", required=True)
    e = verbs.add_parser("export", help="write a trial or an exam as plain files")
    e.add_argument("--folder", type=Path, required=True, help="the trial or exam")
    e.add_argument("--out", type=Path, required=True)
    e.add_argument("--truths", type=Path, help="truths to be opened (default: they stay closed)")
    e.add_argument("--answers", type=Path, help="our answers: what an oracle could separate")
    e.set_defaults(work=_export)
    c = verbs.add_parser("convert", help="turn our answers into an entry, one a line")
    c.add_argument("--answers", type=Path, required=True)
    c.add_argument("--out", type=Path, required=True)
    c.set_defaults(work=_convert)
    s = verbs.add_parser("score", help="score an entry, as scorer.py does")
    s.add_argument("--truths", type=Path, required=True)
    s.add_argument("--answers", type=Path, required=True)
    s.set_defaults(work=lambda o: scorer.main([str(o.truths), str(o.answers)]))
    d = verbs.add_parser("curves", help="hold our answers against the baselines beside them")
    d.add_argument("--truths", type=Path, required=True)
    d.add_argument("--answers", type=Path, required=True, help="our answers, with what was kept")
    d.add_argument("--development", type=Path, help="an exam that trains the random forest")
    d.add_argument("--out", type=Path, help="picture, such as curves.svg or curves.png")
    d.set_defaults(work=_curves)
    return p


def _export(options: argparse.Namespace) -> int:
    from tests.proof.benchmark.exporting import export_benchmark, open_truths, read_opened
    from tests.proof.exam.said import read_exam_answers
    from tests.proof.trial.truths import read_public

    layout = Layout(options.folder)
    truths = None if options.truths is None else read_opened(options.truths)
    answers = {} if options.answers is None else read_exam_answers(options.answers)
    done = export_benchmark(layout, options.out)
    if truths is not None:
        opened = open_truths(truths, read_public(layout.public), answers)
        text = json.dumps(opened, indent=1, allow_nan=False)
        write_atomically(options.out / "truths.json", text + "\n")
    print(f"{done} recordings: {options.out}")
    return 0


def _convert(options: argparse.Namespace) -> int:
    from tests.proof.benchmark.converting import entry_of

    if not options.answers.is_dir():
        raise UnusableInput(f"{options.answers}: no answers here")
    paths = sorted(options.answers.glob("*.json"))
    entries = [entry_of(json.loads(p.read_text(encoding="utf-8"))) for p in paths]
    write_atomically(options.out, "".join(json.dumps(e) + "\n" for e in entries))
    print(f"{len(entries)} answers: {options.out}")
    return 0


def _curves(options: argparse.Namespace) -> int:
    from tests.proof.benchmark.exporting import read_opened
    from tests.proof.exam.certifying import read_contents
    from tests.proof.trial.curve_figure import draw_curves
    from tests.proof.trial.curves import (
        ahead_lines,
        at_equal_coverage,
        baseline_curves,
        statement,
    )
    from tests.proof.trial.rivals import fit_line

    def contents(folder: Path) -> dict[str, dict[str, Any]]:
        return {str(c["id"]): c for c in read_contents(folder)}

    development = None
    if options.development is not None:
        layout = Layout(options.development)
        development = read_opened(layout.truths), contents(layout.answers)
    asked = contents(options.answers)
    curves = baseline_curves(read_opened(options.truths), asked, development)
    found = at_equal_coverage(curves)
    print("\n".join([*ahead_lines(found), "", statement(found), fit_line(asked)]))
    if options.out is not None:
        draw_curves(curves).savefig(options.out)
    return 0


def main(words: Sequence[str] | None = None) -> int:
    """Run one verb; 2 for what cannot be used, with one line that says why."""
    options = parser().parse_args(words)
    try:
        return int(options.work(options))
    except BondsightError as error:
        print(f"python -m tests.proof.benchmark: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    raise SystemExit(main())
