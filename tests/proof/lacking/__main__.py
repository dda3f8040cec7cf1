"""``python -m tests.proof.lacking``: ask what each model lacks, print what came of it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from bondgraph.support.errors import BondsightError, UnusableInput
from bondsight.cli.arguments import jobs, nonnegative, positive
from tests.proof.trial.layout import Layout

FOLDER = Path("bondsight-out/lacking")
COUNT = 48


def parser() -> argparse.ArgumentParser:
    """Return the parser of both steps."""
    p = argparse.ArgumentParser(prog="python -m tests.proof.lacking", description=__doc__)
    steps = p.add_subparsers(title="steps, in this order", metavar="STEP", required=True)
    for name, work, text in (
        ("run", _run, "draw, make and diagnose every recording that has no answer yet"),
        ("score", _score, "print how often the missing element was found"),
    ):
        s = steps.add_parser(name, help=text)
        s.add_argument("--folder", type=Path, default=FOLDER, help=f"default {FOLDER}")
        s.add_argument("--seed", type=nonnegative, default=0)
        s.set_defaults(work=work)
        if name == "run":
            s.add_argument("--count", type=positive, default=COUNT, help=f"default {COUNT}")
            s.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
        else:
            s.add_argument("--list", action="store_true", help="every recording in a line")
    return p


def _run(options: argparse.Namespace) -> int:
    from bondsight.cli.progress import Bar
    from tests.proof.lacking.answering import ask_all

    layout = Layout(options.folder)
    with Bar() as bar:
        done = ask_all(
            layout, count=options.count, seed=options.seed, jobs=options.jobs, progress=bar
        )
    print(f"{done} recordings diagnosed, {options.count - done} were there: {layout.answers}")
    return 0


def _score(options: argparse.Namespace) -> int:
    from tests.proof.lacking.scoring import asked, score_lines

    layout = Layout(options.folder)
    if not (layout.folder / "elements.json").is_file():
        raise UnusableInput(f"{layout.folder}: nothing was asked here; run the step run first")
    found = asked(layout, options.seed)
    print("\n".join(score_lines(found)))
    if options.list:
        print("\n".join(["", *(a.line for a in found)]))
    return 0


def main(words: Sequence[str] | None = None) -> int:
    """Run one step; 2 for what cannot be used, with one line that says why."""
    options = parser().parse_args(words)
    try:
        return int(options.work(options))
    except BondsightError as error:
        print(f"python -m tests.proof.lacking: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    raise SystemExit(main())
