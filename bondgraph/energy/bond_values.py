"""Bonds along a motion, as values; which bonds carry power.

Sizes: N samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True)
class BondPower:
    """A bond along a motion; power is positive along the half arrow.

    Attributes
    ----------
    tail, head : str
    effort, flow, power : ndarray, shape (N,), SI
    work : ndarray, shape (N,), J
        Integral of the power since the start.
    error : float
        Estimate of the error of the work at the end, J.
    """

    tail: str
    head: str
    effort: FloatArray
    flow: FloatArray
    power: FloatArray
    work: FloatArray
    error: float

    @property
    def name(self) -> str:
        """Text such as ``loop>R_e``."""
        return f"{self.tail}>{self.head}"


@dataclass(frozen=True)
class SignalPath:
    """Every signal of a model along a trajectory.

    Attributes
    ----------
    model : System
    time : ndarray, shape (N,), s
    signals : dict of str to ndarray, shape (N,)
    parameters : dict of str to float
    bonds : tuple of BondPower
    """

    model: System
    time: FloatArray
    signals: Mapping[str, FloatArray]
    parameters: Mapping[str, float]
    bonds: tuple[BondPower, ...]


def power_bonds(graph: BondGraph) -> tuple[Bond, ...]:
    """Return the bonds that carry power: all but the taps of sensors."""
    return tuple(
        b
        for b in graph.bonds
        if not isinstance(graph[b.tail], Sensor) and not isinstance(graph[b.head], Sensor)
    )
