"""``python -m tests.proof.exam``: make an exam, let the tool sit it, print what came of it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bondgraph.support.errors import BondsightError
from bondsight.cli.arguments import jobs, nonnegative
from hardware.simulators.judging.truths import ExamTruth
from tests.proof.exam.cells import CELLS
from tests.proof.exam.truths import read_exam_truths
from tests.proof.trial.layout import Layout

FOLDER = Path("bondsight-out/exam")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the three steps."""
    p = argparse.ArgumentParser(prog="python -m tests.proof.exam", description=__doc__)
    steps = p.add_subparsers(title="steps, in this order", metavar="STEP", required=True)
    for name, work, text in (
        ("generate", _generate, "draw the cases and make the recordings"),
        ("run", _run, "diagnose every recording that has no answer yet"),
        ("score", _score, "print the numbers that must be watched together"),
        ("certify", _certify, "walk the knobs on stored evidence, and count what was right"),
        ("withhold", _withhold, "decide stored evidence without the true law, for every knob"),
    ):
        s = steps.add_parser(name, help=text)
        s.add_argument("--folder", type=Path, default=FOLDER, help=f"the exam (default {FOLDER})")
        s.set_defaults(work=work)
        if name == "generate":
            s.add_argument("--count", type=nonnegative, default=sum(CELLS.values()))
        else:
            s.add_argument("--answers", type=Path, default=None, help="default FOLDER/answers")
            s.add_argument("--cells", nargs="+", choices=tuple(CELLS), default=None)
        if name == "run":
            s.add_argument("--limit", type=nonnegative, default=None, help="recordings at most")
            s.add_argument(
                "--of", choices=("whole", "half", "transplant"), default="whole",
                help="the recording, its first half, or what the repaired model makes of it",
            )  # fmt: skip
        if name == "score":
            s.add_argument("--beside", type=Path, default=None, help="older answers, first column")
            s.add_argument("--half", type=Path, default=None, help="answers to half recordings")
            s.add_argument("--transplant", type=Path, default=None, help="answers to transplants")
            s.add_argument("--list", action="store_true", help="every recording gone wrong")
        if name in ("generate", "run"):
            s.add_argument("--seed", type=nonnegative, default=0)
            s.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
    return p


def _generate(options: argparse.Namespace) -> int:
    from bondsight.cli.progress import Bar
    from tests.proof.exam.generating import generate_exam

    layout = Layout(options.folder)
    with Bar() as bar:
        made = generate_exam(
            layout, count=options.count, seed=options.seed, jobs=options.jobs, progress=bar
        )
    print(f"{made} recordings: {layout.recordings}")
    return 0


def _run(options: argparse.Namespace) -> int:
    from bondsight.cli.progress import Bar
    from tests.proof.exam.answering import WORKS
    from tests.proof.trial.running import run_all
    from tests.proof.trial.truths import read_public

    layout = Layout(options.folder)
    truths = read_exam_truths(layout.truths)
    public = read_public(layout.public)
    if options.cells:
        public = tuple(p for p in public if truths[p.id].cell in options.cells)
    public = public[: options.limit]
    usual = layout.answers if options.of == "whole" else layout.folder / f"answers-{options.of}"
    target = options.answers or usual
    with Bar() as bar:
        done = run_all(
            layout, public, target, WORKS[options.of], jobs=options.jobs, seed=options.seed,
            progress=bar,
        )  # fmt: skip
    print(f"{done} recordings diagnosed, {len(public) - done} were there: {target}")
    return 0


def _asked(options: argparse.Namespace) -> tuple[Layout, dict[str, ExamTruth]]:
    layout = Layout(options.folder)
    truths = read_exam_truths(layout.truths)
    cells = options.cells
    return layout, {i: t for i, t in truths.items() if not cells or t.cell in cells}


def _score(options: argparse.Namespace) -> int:
    from tests.proof.exam.counting import score_exam
    from tests.proof.exam.printing import bad_lines, table_lines
    from tests.proof.exam.said import read_exam_answers
    from tests.proof.trial.running import require_own

    layout, truths = _asked(options)
    folder = options.answers or layout.answers
    for answers in (folder, options.beside, options.half, options.transplant):
        if answers is not None:
            require_own(layout, answers)
    new = read_exam_answers(folder)
    again = {
        word: read_exam_answers(folder)
        for word, folder in (("half a record", options.half), ("transplant", options.transplant))
        if folder is not None
    }
    old = None
    if options.beside is not None:
        beside = read_exam_answers(options.beside)
        # only recordings that both have: two rules are compared on the same questions
        new = {i: a for i, a in new.items() if i in beside}
        old = score_exam(truths, {i: a for i, a in beside.items() if i in new})
    found = score_exam(truths, new, again)
    print("\n".join(table_lines(found, old)))
    if options.list:
        print("\n".join(["", *bad_lines(found.outcomes)]))
    return 0


def _certify(options: argparse.Namespace) -> int:
    from tests.proof.exam.certifying import certify_lines

    truths, contents = _stored(options)
    print("\n".join(certify_lines(truths, contents)))
    return 0


def _withhold(options: argparse.Namespace) -> int:
    from tests.proof.exam.withholding import withheld_lines

    print("\n".join(withheld_lines(*_stored(options))))
    return 0


def _stored(options: argparse.Namespace) -> tuple[dict[str, ExamTruth], list[dict[str, Any]]]:
    from tests.proof.exam.certifying import read_contents
    from tests.proof.trial.running import require_own

    layout, truths = _asked(options)
    require_own(layout, options.answers or layout.answers)
    contents = read_contents(options.answers or layout.answers)
    return truths, [c for c in contents if str(c["id"]) in truths]


def main(words: Sequence[str] | None = None) -> int:
    """Run one step; 2 for what cannot be used, with one line that says why."""
    options = parser().parse_args(words)
    try:
        return int(options.work(options))
    except BondsightError as error:
        print(f"python -m tests.proof.exam: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    raise SystemExit(main())
