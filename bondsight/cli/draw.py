"""``bondsight draw``: a model with its causal strokes as SVG."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import MODEL
from bondsight.cli.output import writable


def add_draw_command(verbs: Any) -> None:
    """Add ``draw`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("draw", help="draw a model with its causal strokes as SVG")
    p.add_argument("model", help=MODEL)
    p.add_argument("--out", type=Path, default=None, help="file (default: MODEL.svg)")
    p.set_defaults(run=_draw)


def _draw(options: argparse.Namespace) -> int:
    from actuators.models.opening import load_model
    from bondgraph.drawing.svg import svg
    from bondgraph.support.whole_file import write_atomically

    graph = load_model(options.model)
    target = options.out or Path(f"{graph.name}.svg")
    writable(target.parent)
    write_atomically(target, svg(graph))
    print(target)
    return 0
