"""``bondsight check``: everything that is wrong with a model."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from bondsight.cli.arguments import MODEL


def add_check_command(verbs: Any) -> None:
    """Add ``check`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("check", help="say everything that is wrong with a model")
    p.add_argument("model", help=MODEL)
    p.set_defaults(run=_check)


def _check(options: argparse.Namespace) -> int:
    from actuators.models.opening import load_model
    from bondgraph.causality.assignment import assign_causality
    from bondgraph.equations.derivation import equations
    from bondgraph.graph.sensors import Sensor

    graph = load_model(options.model)
    if lines := graph.check():
        print("\n".join(lines), file=sys.stderr)
        return 2
    print(assign_causality(graph))
    print(f"sound: {len(graph.elements)} elements, states {', '.join(equations(graph).states)}")
    if not graph.of_type(Sensor):
        print("it has no sensor: add De, Df, Dq, Da or a Reading to compare it with recordings")
    return 0
