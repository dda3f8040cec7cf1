"""``bondsight stack``: experiments on the simulated stack, printed and drawn."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def add_stack_command(verbs: Any) -> None:
    """Add ``stack`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("stack", help="experiments on the simulated stack")
    p.add_argument("what", choices=EXPERIMENTS, help="loading curve, charge drive, two clocks")
    p.add_argument("--out", type=Path, default=None, help="figure, .svg (default: none)")
    p.set_defaults(run=_stack)


def _stack(options: argparse.Namespace) -> int:
    from bondsight.cli.figures import save_figure
    from bondsight.cli.output import writable

    if options.out is not None:
        writable(options.out.parent)
    draw = EXPERIMENTS[options.what]()
    if options.out is not None:
        print(save_figure(options.out, draw))
    return 0


def _mechanical() -> Callable[[], Figure]:
    from actuators.stack import figures
    from actuators.stack import loading_study as study

    print(study.erasing())
    found = study.loading()
    print(found)
    print(study.known())
    return lambda: figures.loading_figure(found.curves)


def _charge() -> Callable[[], Figure]:
    from actuators.stack import charge_study as study
    from actuators.stack import figures

    rows = study.drive_comparisons()
    print(study.drive_table(rows))
    print(study.force_table(study.force_cycles()))
    print(study.drift_table(study.drifts()))
    print(study.leak_table(study.leaks()))
    return lambda: figures.charge_figure(rows)


def _clocks() -> Callable[[], Figure]:
    from actuators.stack import figures
    from bondsight.cli.stack_clocks import clock_skew

    loops = clock_skew()
    return lambda: figures.clock_figure(loops)


EXPERIMENTS = {"mechanical": _mechanical, "charge": _charge, "clocks": _clocks}
"""Each prints its numbers and returns what draws them."""
