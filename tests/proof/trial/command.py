"""``bondsight blind``: draw a sealed trial, diagnose it, open the seal and count."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import jobs, nonnegative, positive

FOLDER = Path("bondsight-out/blind")


def add_blind_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("blind", help="the sealed trial: recordings whose physics is concealed")
    steps = p.add_subparsers(title="steps, in this order", metavar="STEP", required=True)
    for name, run, text in (
        ("generate", _generate, "draw the truths, make the recordings, commit to both"),
        ("run", _run, "diagnose every recording that has no answer yet"),
        (
            "interim",
            _interim,
            "count the gates over the answers so far; publishes no truth",
        ),
        ("score", _score, "open the seal, ask the oracle, count, write RESULTS.md"),
        ("withheld", _withheld, "diagnose again without the true law and every law around it"),
    ):
        s = steps.add_parser(name, help=text)
        s.add_argument("--folder", type=Path, default=FOLDER, help=f"the trial (default {FOLDER})")
        s.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
        s.set_defaults(run=run)
        if name == "generate":
            s.add_argument(
                "--kind", choices=("trial", "development", "reduced"), default="development",
                help="a trial takes its salt from the operating system",
            )  # fmt: skip
            s.add_argument("--count", type=positive, default=None, help="of development only")
        if name not in ("score", "interim"):
            s.add_argument("--seed", type=nonnegative, default=None)


def _generate(options: argparse.Namespace) -> int:
    from bondsight.cli.output import writable
    from bondsight.cli.progress import Bar
    from tests.proof.trial.generating import generate_trial
    from tests.proof.trial.layout import Layout

    layout = Layout(options.folder)
    writable(layout.folder)
    with Bar(quiet=not sys.stderr.isatty()) as bar:
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
    from bondsight.cli.progress import Bar
    from tests.proof.trial.commitment import verify
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.running import run_all
    from tests.proof.trial.truths import read_public

    layout = Layout(options.folder)
    public = read_public(layout.public)
    verify(layout)
    with Bar(quiet=not sys.stderr.isatty()) as bar:
        done = run_all(
            layout, public, layout.answers, jobs=options.jobs, seed=options.seed or 0, progress=bar
        )
    print(f"{done} recordings diagnosed, {len(public) - done} were there: {layout.answers}")
    return 0


def _interim(options: argparse.Namespace) -> int:
    from tests.proof.trial.answers import read_answers
    from tests.proof.trial.gates import gates
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.matching import judge
    from tests.proof.trial.summary import gate_lines
    from tests.proof.trial.truths import read_public, read_truths

    layout = Layout(options.folder)
    public = read_public(layout.public)
    truths = read_truths(json.loads(layout.truths.read_text(encoding="utf-8")))
    answers = read_answers(layout.answers)
    outcomes = [judge(truths[i], answers[i]) for i in sorted(answers)]
    print(f"answers counted: {len(outcomes)} of {len(public)}, no oracle asked")
    print(gate_lines(gates(outcomes)))
    return 0


def _score(options: argparse.Namespace) -> int:
    from bondsight.cli.progress import Bar
    from tests.proof.trial.answers import read_answers
    from tests.proof.trial.commitment import reveal
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.oracles import ask_oracles, read_oracles
    from tests.proof.trial.publishing import publish
    from tests.proof.trial.scoring import score
    from tests.proof.trial.summary import gate_lines
    from tests.proof.trial.truths import read_public

    layout = Layout(options.folder)
    public = read_public(layout.public)
    truths = reveal(layout)
    with Bar(quiet=not sys.stderr.isatty()) as bar:
        ask_oracles(layout, public, truths, jobs=options.jobs, progress=bar)
    found = score(truths, read_answers(layout.answers), read_oracles(layout.oracle))
    commitment = json.loads(layout.commitment.read_text(encoding="utf-8"))
    path = publish(found, commitment, layout.score)
    print(gate_lines(found.gates))
    print(f"score: {path}")
    return 0 if found.passed else 1


def _withheld(options: argparse.Namespace) -> int:
    from bondsight.cli.progress import Bar
    from tests.proof.trial.answers import read_answers
    from tests.proof.trial.commitment import reveal
    from tests.proof.trial.layout import Layout
    from tests.proof.trial.leave_one_out import publish_withheld, run_withheld, score_withheld
    from tests.proof.trial.oracles import read_oracles
    from tests.proof.trial.summary import gate_lines
    from tests.proof.trial.truths import read_public

    layout = Layout(options.folder)
    public = read_public(layout.public)
    truths = reveal(layout)
    with Bar(quiet=not sys.stderr.isatty()) as bar:
        run_withheld(
            layout, public, truths, jobs=options.jobs, seed=options.seed or 0, progress=bar
        )
    found = score_withheld(truths, read_answers(layout.withheld), read_oracles(layout.oracle))
    path = publish_withheld(found, layout.score)
    print(gate_lines(found.gates))
    print(f"score: {path}")
    return 0 if found.passed else 1
