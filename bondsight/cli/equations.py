"""``bondsight equations``: a model's equations as text, in any notation."""

from __future__ import annotations

import argparse
from typing import Any

from bondgraph.export.notations import NOTATIONS
from bondsight.cli.arguments import MODEL


def add_equations_command(verbs: Any) -> None:
    """Add ``equations`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "equations", help="print the equations of a model, with its external force"
    )
    p.add_argument("model", help=MODEL)
    p.add_argument("--format", choices=NOTATIONS, default="ordered",
                   help="notation (default: %(default)s)")  # fmt: skip
    p.set_defaults(run=_equations)


def _equations(options: argparse.Namespace) -> int:
    from actuators.models.opening import load_model
    from bondgraph.export.notations import notation

    print(notation(load_model(options.model, loaded=True), options.format))
    return 0
