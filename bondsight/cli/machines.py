"""Commands about the actuators: the thesis checked, compensation, experiments, sizing."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import nonnegative

OUT = Path("bondsight-out")
STACK = ("mechanical", "charge", "clocks")


def add_machine_commands(verbs: Any) -> None:
    """Add the commands to the sub-parsers of ``bondsight``; each imports its machine when run."""
    p = verbs.add_parser("thesis", help="printed values of the stack models against what they give")
    p.add_argument(
        "--inconsistencies", action="store_true", help="list what is misprinted, and the right form"
    )
    p.add_argument("--pairings", action="store_true", help="every structure with every operator")
    p.set_defaults(run=_thesis)

    p = verbs.add_parser("compensate", help="hysteresis compensation of the stack, with numbers")
    p.add_argument(
        "--out", type=Path, default=OUT / "compensation.svg", help="figure, .svg or .png"
    )
    p.add_argument("--frequency", type=float, action="append", metavar="HZ", dest="frequencies")
    p.add_argument("--spread", type=float, default=0.1, help="deviation of the virtual actuator")
    p.add_argument("--seed", type=nonnegative, default=1)
    p.set_defaults(run=_compensate)

    p = verbs.add_parser("stack", help="experiments on the simulated stack")
    p.add_argument("what", choices=STACK, help="loading curve, charge drive, two clocks")
    p.add_argument("--out", type=Path, default=None, help="figure, .svg (default: none)")
    p.set_defaults(run=_stack)

    p = verbs.add_parser("ultrasonic", help="the ultrasonic plate actuator, with numbers")
    p.add_argument("topics", nargs="*", help="default: all")
    p.add_argument("--out", type=Path, default=OUT / "ultrasonic", help="folder for the figures")
    p.set_defaults(run=_ultrasonic)

    from bondsight.cli.sizing import add_arguments, sizing

    p = verbs.add_parser("sizing", help="data sheet of a stack drive: force, current, resonance")
    add_arguments(p)
    p.set_defaults(run=sizing)


def _thesis(options: argparse.Namespace) -> int:
    from bondsight.cli.thesis import thesis

    return thesis(inconsistencies=options.inconsistencies, pairings=options.pairings)


def _compensate(options: argparse.Namespace) -> int:
    from bondsight.cli.compensate import compensate

    options.out.parent.mkdir(parents=True, exist_ok=True)
    frequencies = tuple(options.frequencies or (1.0, 50.0))
    return compensate(
        options.out, frequencies=frequencies, spread=options.spread, seed=options.seed
    )


def _stack(options: argparse.Namespace) -> int:
    from bondsight.cli import stack_experiments as experiments

    if options.out is not None:
        options.out.parent.mkdir(parents=True, exist_ok=True)
    run = dict(
        zip(
            STACK,
            (experiments.mechanical, experiments.charge_drive, experiments.clock_skew),
            strict=True,
        )
    )
    return run[options.what](options.out)


def _ultrasonic(options: argparse.Namespace) -> int:
    from bondsight.cli.ultrasonic import ultrasonic

    return ultrasonic(options.out, tuple(options.topics))
