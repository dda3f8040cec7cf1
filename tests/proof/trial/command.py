"""``bondsight blind``: draw a sealed trial, diagnose it, open the seal and count."""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondsight.cli.arguments import jobs, nonnegative, positive

if TYPE_CHECKING:
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.scoring import TrialScore

FOLDER = Path("bondsight-out/blind")


def add_blind_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("blind", help="the sealed trial: recordings whose physics is concealed")
    steps = p.add_subparsers(title="steps, in this order", metavar="STEP", required=True)
    for name, run, text in (
        ("generate", _generate, "draw the truths, make the recordings, commit to both"),
        ("run", _run, "diagnose every recording that has no answer yet"),
        ("score", _score, "open the seal, ask the oracle, count, write RESULTS.md and report.html"),
        ("withheld", _withheld, "diagnose again without the true law and every law around it"),
        ("quick", _quick, "a trial of sixty from a seed that nobody has used, from draw to count"),
    ):
        s = steps.add_parser(name, help=text)
        usual = None if name == "quick" else FOLDER
        shown = "a new one by the time" if usual is None else usual
        s.add_argument("--folder", type=Path, default=usual, help=f"the trial (default {shown})")
        s.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
        s.set_defaults(run=run)
        if name == "score":
            s.add_argument(
                "--development", type=Path, default=None, metavar="FOLDER",
                help="a trial of development with its answers, to train the random forest on",
            )  # fmt: skip
        if name == "generate":
            s.add_argument(
                "--kind", choices=("trial", "quick", "development"), default="development",
                help="all but development take their salt from the operating system",
            )  # fmt: skip
            s.add_argument("--count", type=positive, default=None, help="of development only")
            s.add_argument("--seed", type=nonnegative, default=None, help="of development only")


def _bar() -> Any:
    from bondsight.cli.progress import Bar

    return Bar()


def _layout(options: argparse.Namespace) -> Layout:
    from tests.proof.trial.layout import Layout

    return Layout(options.folder)


def _generate(options: argparse.Namespace) -> int:
    from bondsight.cli.output import writable
    from tests.proof.trial.generating import generate_trial

    layout = _layout(options)
    writable(layout.folder)
    with _bar() as bar:
        made = generate_trial(
            layout, options.kind, count=options.count, seed=options.seed, jobs=options.jobs,
            progress=bar,
        )  # fmt: skip
    print(f"{made} recordings: {layout.recordings}")
    print(f"committed:      {layout.commitment}")
    if options.kind == "trial":
        print("commit that file to git before `bondsight blind run`; keep the data folder private")
    return 0


def _run(options: argparse.Namespace) -> int:
    from tests.proof.exam.answering import exam_answer
    from tests.proof.trial.commitment import verify
    from tests.proof.trial.running import run_all
    from tests.proof.trial.truths import read_public

    layout = _layout(options)
    public = read_public(layout.public)
    verify(layout)
    with _bar() as bar:
        done = run_all(layout, public, layout.answers, exam_answer, jobs=options.jobs, progress=bar)
    print(f"{done} recordings diagnosed, {len(public) - done} were there: {layout.answers}")
    return 0


def _score(options: argparse.Namespace) -> int:
    from tests.proof.trial.commitment import reveal
    from tests.proof.trial.oracles import ask_oracles
    from tests.proof.trial.truths import read_public

    layout = _layout(options)
    public = read_public(layout.public)
    truths = reveal(layout)
    with _bar() as bar:
        ask_oracles(layout, public, truths, jobs=options.jobs, progress=bar)
    return _told(layout, scored(layout, options.development))


def scored(layout: Layout, development: Path | None = None) -> TrialScore:
    """Open the seal and score the answers, with the oracles that were asked.

    Parameters
    ----------
    development : Path, optional
        Folder of a trial of development, on whose answers the random forest is trained.
    """
    from tests.proof.exam.said import read_each, read_exam_answers
    from tests.proof.exam.truths import read_exam_truths
    from tests.proof.trial.commitment import reveal
    from tests.proof.trial.curves import baseline_curves
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.oracles import read_oracles
    from tests.proof.trial.running import require_own
    from tests.proof.trial.scoring import score_trial

    truths = reveal(layout)
    require_own(layout, layout.answers)
    known = None
    if development is not None:
        before = Layout(development)
        require_own(before, before.answers)
        known = read_exam_truths(before.truths), read_each(before.answers, dict)
    curves = baseline_curves(truths, read_each(layout.answers, dict), known)
    return score_trial(truths, read_exam_answers(layout.answers), read_oracles(layout), curves)


def _told(layout: Layout, found: TrialScore) -> int:
    from tests.proof.trial.commitment import with_note
    from tests.proof.trial.parts import headline
    from tests.proof.trial.publishing import publish, withheld_counted

    path = publish(found, with_note(layout), layout.score)
    second = withheld_counted(layout.score)
    print("\n".join(g.words for g in (*found.gates, *second)))
    print(headline(found, second))
    print(f"score: {path}, {path.with_name('report.html')}")
    return 0 if found.passed else 1


def _withheld(options: argparse.Namespace) -> int:
    from tests.proof.exam.said import read_exam_answers
    from tests.proof.trial.commitment import reveal, verify, with_note
    from tests.proof.trial.running import require_own
    from tests.proof.trial.truths import read_public
    from tests.proof.trial.withheld import (
        publish_withheld,
        run_withheld,
        score_withheld,
        to_withhold,
    )

    layout = _layout(options)
    public = read_public(layout.public)
    truths = reveal(layout)
    require_own(layout, layout.answers)
    asked = to_withhold(truths, read_exam_answers(layout.answers))
    if any(not (layout.withheld / f"{i}.json").exists() for i in asked):
        verify(layout)  # what is asked must be the tool that has answered
    with _bar() as bar:
        run_withheld(layout, public, truths, asked, jobs=options.jobs, progress=bar)
    found = score_withheld(truths, read_exam_answers(layout.withheld))
    path = publish_withheld(found, with_note(layout), layout.score)
    print("\n".join(g.words for g in found.gates))
    print(f"score: {path}; bondsight blind score takes it up")
    return 0 if found.passed else 1


def _quick(options: argparse.Namespace) -> int:
    """Return 0 whatever the gates say: sixty recordings can miss one, never certify any."""
    if options.folder is None:
        name = f"quick-{datetime.now(UTC):%Y%m%d-%H%M%S}"
        options.folder = FOLDER.with_name(name)
    layout = _layout(options)
    options.kind, options.count, options.seed = "quick", None, None
    if not layout.commitment.exists():
        _generate(options)
    _run(options)
    _told(layout, scored(layout))
    return 0
