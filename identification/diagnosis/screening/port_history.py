"""What an effect may look at before it is tried: the fitted model, the data, every port's past."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element
from bondgraph.support.arrays import Array

if TYPE_CHECKING:  # the catalogue is listed without loading what fits
    from identification.estimation.single_record import Fit
    from identification.study.data import Data


@dataclass(frozen=True, eq=False)
class PortHistory:
    """Argument and output of an element's law along the fitted record.

    Attributes
    ----------
    argument : ndarray, shape (N,), SI
        Displacement of a storage, flow of a resistor or an inertia, command of a source, reading
        of a sensor, secondary effort of a two-port.
    output : ndarray, shape (N,), SI
        Effort of storages, resistors and inertias, primary flow of a two-port; the argument
        itself elsewhere.
    dt : float
        Time between samples, s.
    moved : ndarray, shape (N,), SI, or None
        Displacement that belongs to the flow of a resistor, an inertia or a two-port (from zero).
    primary_moves : bool
        Of a two-port: whether its primary side is the one that moves, and the other carries a
        current, if any.
    recorded : ndarray, shape (N,), SI, or None
        The same displacement, but for a constant, as a sensor at this junction recorded it: where
        it went, whatever the fit made of that.
    added : ndarray, shape (N,), or None
        What must have been added there, up to a factor and beside other values of the elements
        there, where it is known that nothing is missing elsewhere.
    """

    argument: Array
    output: Array
    dt: float = 1.0
    moved: Array | None = None
    primary_moves: bool = True
    added: Array | None = None
    recorded: Array | None = None

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.argument.size)

    @cached_property
    def time(self) -> Array:
        """Time from the first sample, s, shape (N,)."""
        return np.arange(self.n) * self.dt

    @cached_property
    def rate(self) -> Array:
        """Rate of the argument, SI, shape (N,)."""
        return np.asarray(np.gradient(self.argument, self.dt))

    @property
    def centre(self) -> float:
        """Middle of the argument's range."""
        return float(0.5 * (self.argument.max() + self.argument.min()))

    @property
    def half(self) -> float:
        """Half of the argument's range."""
        return 0.5 * _range(self.argument) or 1.0

    @property
    def swing(self) -> float:
        """Half of the output's range."""
        return 0.5 * _range(self.output) or 1.0

    @property
    def rms(self) -> float:
        """Root mean square of the argument."""
        return float(np.sqrt(np.mean(self.argument**2))) or 1.0

    @property
    def largest(self) -> float:
        """Largest size of the argument."""
        return float(np.abs(self.argument).max()) or 1.0

    @property
    def duration(self) -> float:
        """Time that all samples take, s."""
        return self.dt * self.n

    @property
    def slope(self) -> float:
        """Typical output over typical argument (a stiffness, a resistance)."""
        return self.swing / self.half

    def reach(self, share: float) -> float:
        """Return the argument at a share of the half range above the middle."""
        return self.centre + share * self.half


def moved_by(flow: Array, dt: float) -> Array:
    """Return the displacement that belongs to a flow, from zero, by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (flow[1:] + flow[:-1]) * dt)])


@dataclass(frozen=True, eq=False)
class FittedModel:
    """Fitted model, data, residual and the past of every port.

    Attributes
    ----------
    graph : BondGraph
        The declared graph: its values carry what is known about them, the fit has its own.
    residual : ndarray, shape (N, n_y), SI
        Measured less simulated, 0 where nothing is scored.
    past : dict of str to PortHistory
        By element; its arrays cover the whole record.
    """

    graph: BondGraph
    data: Data
    nominal: Fit
    residual: Array
    past: dict[str, PortHistory]

    @property
    def fitted(self) -> BondGraph:
        """The graph with the fitted values."""
        known = {n: v for n, v in self.nominal.values.items() if n in self.graph.parameters}
        return self.graph.with_values(known)

    def of(self, element: Element) -> PortHistory:
        """Past of one element."""
        return self.past[element.name]


def _range(values: Array) -> float:
    """Return the range of values; zero where they differ by rounding alone."""
    moved = float(np.ptp(values))
    return moved if moved > ROUNDING * float(np.abs(values).max(initial=0.0)) else 0.0


ROUNDING = 1e-12
"""Part of the largest value by which those differ that are the same."""
