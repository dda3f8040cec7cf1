"""The Maxwell resistive capacitor: parallel springs that slip at their breakaway force.

Sizes: n elements, n memory states, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import ClassVar, Literal, Self, final

import numpy as np

from bondgraph.hysteresis.checks import (
    non_negative,
    numbers,
    parameters,
    same_length,
    strictly_increasing,
)
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.linear import OnPlays
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.play import play, play_chunks, sum_of_plays
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.hysteresis.plays.stop import stop
from bondgraph.hysteresis.plays.swing import swing_record, worth_swinging
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class MaxwellResistiveCapacitor(OnPlays):
    """Sum of stops ``f = sum_i k_i stop_(q_i)[q]`` with ``q_i = v_i / k_i``.

    Electrically k_i = 1/C_i in V/C, v_i in V, input charge in C, output voltage in V; mechanically
    a stiffness, a friction force, a displacement and a force. The memory holds the anchors q - z,
    not the stretches z, so rounding does not add up (see `stop`).

    Parameters
    ----------
    stiffnesses : sequence
        k_i > 0, shape (n,); effort per displacement.
    breakaways : sequence
        v_i > 0, shape (n,), efforts; v_i / k_i strictly increasing (`from_table` sorts).

    Raises
    ------
    BadParameter
        If the lengths differ, an entry is not positive, or the slip points are out of order;
        names the entry.

    References
    ----------
    goldfarb1997

    Examples
    --------
    >>> MaxwellResistiveCapacitor((2.0,), (1.0,)).run([0.0, 0.25, 3.0])[0].tolist()
    [0.0, 0.5, 1.0]
    """

    kind: ClassVar[str] = "maxwell_resistive_capacitor"

    stiffnesses: tuple[Expression, ...]
    breakaways: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        stiffnesses = parameters("stiffnesses", self.stiffnesses)
        breakaways = parameters("breakaways", self.breakaways)
        same_length("stiffnesses", stiffnesses, "breakaways", breakaways)
        if not stiffnesses:
            raise BadParameter("stiffnesses is empty; at least one element is needed")
        non_negative("stiffnesses", stiffnesses, strict=True)
        non_negative("breakaways", breakaways, strict=True)
        slips = tuple(v / k for k, v in zip(stiffnesses, breakaways, strict=True))
        strictly_increasing("slip points breakaways / stiffnesses", slips)
        object.__setattr__(self, "stiffnesses", stiffnesses)
        object.__setattr__(self, "breakaways", breakaways)

    @classmethod
    def from_table(cls, capacitances: Sequence[float], breakaways: Sequence[float]) -> Self:
        """Build it from capacitances, in any order; elements that slip together are merged.

        Parameters
        ----------
        capacitances : sequence of float
            C_i = 1/k_i, shape (n,), F (displacement per effort).
        breakaways : sequence of float
            v_i, shape (n,), V (effort).

        Returns
        -------
        MaxwellResistiveCapacitor
            At most n elements.

        Raises
        ------
        BadParameter
            If the lengths differ or an entry is not positive; names the entry.

        References
        ----------
        goldfarb1997
        """
        c = numbers("capacitances", parameters("capacitances", capacitances))
        v = numbers("breakaways", parameters("breakaways", breakaways))
        same_length("capacitances", c, "breakaways", v)
        non_negative("capacitances", c, strict=True)
        rows = sorted((c_i * v_i, 1.0 / c_i, v_i) for c_i, v_i in zip(c, v, strict=True))
        together = [list(group) for _, group in groupby(rows, key=lambda row: row[0])]
        return cls(
            tuple(sum(k for _, k, _ in group) for group in together),
            tuple(sum(v for _, _, v in group) for group in together),
        )

    @classmethod
    def stack_2hz(cls) -> Self:
        """Return the 15 elements printed for a piezo stack at 2 Hz, charge in C, voltage in V.

        Table 6.4 of the stack actuator thesis. The set gives the printed voltage (16.7 V at
        saturation) but, together with T = 3.52 N/V of its Table 6.1, not the measured loop.
        """
        printed = (
            (1.37, 1.42),
            (7.83, 0.75),
            (12.34, 1.16),
            (19.06, 1.24),
            (25.25, 1.33),
            (44.63, 0.99),
            (56.52, 0.98),
            (46.89, 1.42),
            (229.64, 0.34),
            (94.60, 0.95),
            (447.08, 0.23),
            (342.68, 0.33),
            (50.20, 2.52),
            (49.56, 2.80),
            (616.13, 0.24),
        )
        return cls.from_table([1e-6 * c for c, _ in printed], [v for _, v in printed])

    @property
    def thresholds(self) -> tuple[Expression, ...]:
        """Slip points q_i = v_i / k_i, shape (n,), displacement."""
        return tuple(v / k for k, v in zip(self.stiffnesses, self.breakaways, strict=True))

    @property
    def n_memory(self) -> int:
        """Number of elements, n."""
        return len(self.stiffnesses)

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal, when all elements stick: sum of k_i."""
        return sum(self.stiffnesses[1:], self.stiffnesses[0])

    @property
    def _half_widths(self) -> Sequence[Expression]:
        return self.thresholds

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return sum_of_plays(ops, x, self.thresholds, self.stiffnesses, memory, stops=True)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        k = np.array(numbers("stiffnesses", self.stiffnesses))
        r = np.array(numbers("thresholds", self.thresholds))
        anchors = np.array(memory)
        if worth_swinging(x, r, anchors):
            before = float(np.clip(x[0], anchors[0] - r[0], anchors[0] + r[0]))
            slopes = np.append(np.cumsum(k[::-1])[::-1], 0.0)
            start = float((before - anchors) @ k)
            output, anchors = swing_record(x, r, slopes, anchors, before, start)
            return output, tuple(anchors.tolist())
        output = np.empty(x.size)
        for part, states in play_chunks(x, r, anchors):
            output[part] = (x[part, None] - states) @ k
            anchors = states[-1]
        return output, tuple(anchors.tolist())

    def as_prandtl_ishlinskii(self) -> PrandtlIshlinskii:
        """Return the same operator as plays: ``(sum k_i) q - sum k_i play_(q_i)[q]``.

        The memory is the same tuple. The sum has full slope 0 (it saturates), so it has no
        inverse on its own, but `inverse_of_identity_plus` has one.

        Returns
        -------
        PrandtlIshlinskii
            With n + 1 operators.

        References
        ----------
        krejci2001
        """
        weights = (self.linear_slope, *(-k for k in self.stiffnesses))
        return PrandtlIshlinskii((0.0, *self.thresholds), weights)

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"output"``: springs and sliders can only store and lose."""
        return "output"

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        stored: Expression = 0.0
        lost: Expression = 0.0
        elements = zip(self.stiffnesses, self.breakaways, self.thresholds, memory, strict=True)
        for k, v, r, before in elements:
            stretch = stop(ops, x, r, before)
            stored = stored + 0.5 * k * stretch * stretch
            lost = lost + v * ops.absolute(play(ops, x, r, before) - before)
        return stored, lost

    def loop_loss(self, amplitude: Expression, *, ops: Ops = NUMPY) -> Expression:
        """Return ``4 sum v_i max(A - q_i, 0)``, see `PrandtlIshlinskii.loop_loss`; in J."""
        loss: Expression = 0.0
        for v, r in zip(self.breakaways, self.thresholds, strict=True):
            loss = loss + 4.0 * v * ops.maximum(amplitude - r, 0.0)
        return loss
