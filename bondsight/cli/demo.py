"""``bondsight demo``: conceal an effect in a virtual plant and find it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import OUT, add_jobs, nonnegative
from bondsight.cli.output import ended_like_ctrl_c, writable


def add_demo_command(verbs: Any) -> None:
    """Add ``demo`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("demo", help="conceal an effect in a virtual plant and find it")
    p.add_argument(
        "--seed",
        type=nonnegative,
        default=None,
        help="plant, and effect or none, that are drawn (default: one case that teaches)",
    )
    p.add_argument(
        "--seeds", type=int, default=None, help="run that many draws and print the score"
    )
    p.add_argument("--first", type=nonnegative, default=1, help="first seed of --seeds")
    p.add_argument("--plant", default=None, help="conceal it in this plant, such as motor")
    p.add_argument(
        "--effect", default=None, help="conceal this effect, or none, instead of drawing one"
    )
    p.add_argument("--out", type=Path, default=OUT / "demo", help="folder (default: %(default)s)")
    add_jobs(p)
    p.set_defaults(run=_demo)


@ended_like_ctrl_c()
def _demo(options: argparse.Namespace) -> int:
    from bondsight.cli.demonstration import Wish, demo, score

    wish = Wish(options.plant, options.effect)
    writable(options.out)
    if options.seeds is not None:
        return score(options.seeds, options.first, options.out, options.jobs, wish)
    return demo(options.seed, options.out, options.jobs, wish)
