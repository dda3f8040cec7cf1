"""Simulations of records that begin long after their inputs did, and whose inputs are smooth."""

from __future__ import annotations

from typing import Any

from bondgraph.simulation.simulate import simulate as simulate_from_nothing
from bondgraph.simulation.trajectory import Trajectory


def simulate(*given: Any, **more: Any) -> Trajectory:
    """Simulate from the rest under the first inputs, linear between samples, if not said."""
    return simulate_from_nothing(*given, **{"x0": "rest", "hold": "linear", **more})
