"""``bondsight ultrasonic``: the numbers of the plate actuator printed, its figures written."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import OUT


def add_ultrasonic_command(verbs: Any) -> None:
    """Add ``ultrasonic`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("ultrasonic", help="the ultrasonic plate actuator, with numbers")
    p.add_argument("topics", nargs="*", help="default: all")
    p.add_argument("--out", type=Path, default=OUT / "ultrasonic", help="folder for the figures")
    p.set_defaults(run=_ultrasonic)


def _ultrasonic(options: argparse.Namespace) -> int:
    from actuators.ultrasonic.figures import TOPICS
    from bondgraph.support.errors import UnusableInput, unknown_name
    from bondsight.cli.figures import save_figure

    for t in options.topics:
        if t not in TOPICS:
            raise unknown_name("topic", t, "ultrasonic", TOPICS)
    folder = options.out
    if folder.exists() and not folder.is_dir():
        raise UnusableInput(f"{folder} is a file; give a folder for the figures")
    for t in options.topics or TOPICS:
        study, draw = TOPICS[t]
        print(f"== {t}")
        found = study()
        print(found)
        print(f"figure: {save_figure(folder / f'ultrasonic_{t}.png', partial(draw, found))}")
    return 0
