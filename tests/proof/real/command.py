"""``bondsight real``: every recording with known missing physics, diagnosed once."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import jobs as whole_jobs

__all__ = ["add_real_command", "real"]


def add_real_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "real", help="diagnose public recordings whose missing physics is known, each once"
    )
    p.add_argument("names", nargs="*", metavar="CASE", help="cases; all if none is given")
    p.add_argument("--out", type=Path, default=Path("bondsight-out/real"), help="for the results")
    p.add_argument("--recordings", metavar="FOLDER", help="folder of the recordings")
    p.add_argument("--jobs", type=whole_jobs, default=-1, help="processes (default: all cores)")
    p.add_argument("--list", action="store_true", help="print the cases and run nothing")
    p.set_defaults(run=_real)


def real(
    folder: Path, only: Sequence[str] = (), jobs: int = -1, recordings: str | None = None
) -> int:
    """Diagnose the cases, print the table.

    Finished cases of an earlier run in `folder` are not repeated.

    Parameters
    ----------
    folder : Path
        For verdicts, reports and the table.
    only : sequence of str
        Names of cases; all if empty.
    jobs : int
        Processes; -1 takes all cores.
    recordings : str, optional
        Folder of the recordings; that of the environment if not given.

    Returns
    -------
    int
        0 if every case ended without a wrong name, a wrong place or a failure and none was
        absent; else 1.
    """
    from bondsight.cli.output import writable
    from bondsight.cli.progress import Bar
    from tests.proof.real.outcome import Outcome, table
    from tests.proof.real.running import run_cases

    writable(folder)
    bad = ("wrong name", "wrong place", "failed", "absent")

    def told(o: Outcome) -> None:
        words = o.failure or f"{o.said or o.verdict} {f'at {o.place}' if o.place else ''}".strip()
        print(f"{o.case}: {o.outcome}{f': {words}' if words else ''}", file=sys.stderr)

    found: list[Outcome] = []
    for name in only or _names():
        with Bar() as bar:
            found += run_cases(folder, (name,), jobs, recordings=recordings, progress=bar)
        told(found[-1])
    print(table(found), end="")
    print(f"\ntable: {folder / 'real.md'}")
    return int(any(o.outcome in bad for o in found))


def _names() -> tuple[str, ...]:
    from tests.proof.real.registry import REAL_CASES

    return tuple(REAL_CASES)


def _real(options: argparse.Namespace) -> int:
    from tests.proof.real.outcome import documented
    from tests.proof.real.registry import chosen_cases

    cases = chosen_cases(options.names)
    if options.list:
        for c in cases:
            print(f"{c.name} ({c.label}): {documented(c)}")
        return 0
    names = [c.name for c in cases]
    return real(options.out, names, options.jobs, options.recordings)
