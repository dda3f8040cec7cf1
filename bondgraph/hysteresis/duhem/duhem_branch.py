"""Memory that relaxes exponentially with the way gone: what Bouc-Wen and Dahl share.

Along a monotone move let s be its direction, h >= 0 the way gone and q = s z the state seen in that
direction. The first-order models then all read ``dq/dh = A - k q`` with one rate k while q < 0 and
another while q > 0. That is linear on either side of 0, so a move of any length is one exact
step: nothing is integrated numerically and the samples on the way do not matter.

Sizes: two memory states, the last input and z.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Literal, final

from bondgraph.hysteresis.checks import all_numbers, numbers, positive
from bondgraph.hysteresis.duhem.relaxation import branch
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, Ops


class DuhemBranch(Operator, ABC):
    """``y = c x + d z`` with a state z that relaxes exponentially along every monotone move.

    The memory is the last input and z. Neither wiping-out nor congruency holds: a minor loop does
    not close at its turning point, and its shape depends on z.

    References
    ----------
    wen1976, ismail2009
    """

    __slots__ = ()

    @property
    @abstractmethod
    def straight_slope(self) -> Expression:
        """Slope c of the part without memory; output per input."""

    @property
    @abstractmethod
    def state_gain(self) -> Expression:
        """Output d per unit of z."""

    @property
    @abstractmethod
    def state_growth(self) -> Expression:
        """Slope A of z where z = 0; z per input."""

    @abstractmethod
    def rates(self, direction: Expression) -> tuple[Expression, Expression]:
        """Return k for s z < 0 and for s z > 0, per input, in the direction s = 1 or -1."""

    @property
    def wipes_out(self) -> bool:
        """Never: the state creeps along closed minor excursions."""
        return False

    @property
    def congruent(self) -> bool:
        """Never: the slope depends on z."""
        return False

    @property
    @final
    def n_memory(self) -> int:
        """Two: the last input and z."""
        return 2

    @property
    @final
    def linear_slope(self) -> Expression:
        """Slope at z = 0, ``c + d A``; output per input. It falls from there on."""
        return self.straight_slope + self.state_gain * self.state_growth

    @property
    @final
    def state_limits(self) -> tuple[Expression, Expression]:
        """Limits of z after a long way down and a long way up, ``-A/k(-1)`` and ``A/k(1)``."""
        down, up = self.rates(-1.0)[1], self.rates(1.0)[1]
        return -self.state_growth / down, self.state_growth / up

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is None:
            return self._advance(ops, x0, (0.0, 0.0), 0.0)
        low, high = self.state_limits
        return x0, ops.minimum(ops.maximum(states[1], low), high)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.straight_slope * x + self.state_gain * self._move(ops, x, memory)[0]

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return x, self._move(ops, x, memory)[0]

    def _move(self, ops: Ops, x: Expression, memory: Memory) -> tuple[Expression, Expression]:
        """Return z at ``x`` and the integral of z dx on the way there."""
        last, z = memory
        # A choice between whole branches: SymPy cannot cope with a direction inside them.
        up, gained = self._branch(ops, x - last, z, 1.0)
        down, lost = self._branch(ops, last - x, -z, -1.0)
        rises = x >= last
        return ops.where(rises, up, -down), ops.where(rises, gained, lost)

    def _branch(
        self, ops: Ops, way: Expression, ahead: Expression, direction: float
    ) -> tuple[Expression, Expression]:
        falling, rising = self.rates(direction)
        # Cut the wrong direction short, so that nothing overflows, but not at 0: there the
        # derivative of the maximum would be that of neither side.
        cut = ops.maximum(way, -1.0 / (ops.absolute(falling) + rising))
        return branch(ops, ahead, cut, self.state_growth, falling, rising)

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"output"`` if z is added, ``"input"`` if subtracted, None if it may create energy.

        The rates must not be negative. In the second case the slope must not be negative either,
        ``c >= |d| A``.
        """
        falling = tuple(self.rates(s)[0] for s in (-1.0, 1.0))
        c, d, growth = self.straight_slope, self.state_gain, self.state_growth
        if not all_numbers((c, d, growth, *falling)) or min(falling) < 0.0 or c < 0.0:
            return None
        if d >= 0.0:
            return "output"
        return "input" if c >= -d * growth * (1.0 - 1e-12) else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        c, d, growth = self.straight_slope, self.state_gain, self.state_growth
        z, work = self._move(ops, x, memory)
        # z dx = d(z^2)/(2 A) + k z^2 |dx|/A: a spring of stiffness 1/A, and a loss
        spring = 0.5 * z * z / growth
        lost = ops.maximum(work - spring + 0.5 * memory[1] * memory[1] / growth, 0.0)
        if self.passive_port == "output":
            return 0.5 * c * x * x + d * spring, d * lost
        return 0.5 * c * x * x + d * z * x - d * spring, -d * lost

    def loop_loss(self, amplitude: float) -> float:
        """Return the area of the steady loop of a periodic input, wherever its middle lies.

        The loop is found by root finding on the exact branches, to rounding; there is no closed
        formula because the state at the turning points solves a transcendental equation.

        Parameters
        ----------
        amplitude : float
            Half of the peak-to-peak input, A >= 0, unit of the input.

        Returns
        -------
        float
            Unit of the input times unit of the output, energy lost per cycle at `passive_port`.

        Raises
        ------
        BadParameter
            If the amplitude is negative or a parameter is symbolic.
        """
        from scipy.optimize import brentq

        (swing,) = numbers("amplitude", (2.0 * float(amplitude),))
        positive("amplitude", swing, or_zero=True)
        low, high = numbers("state limits", self.state_limits)

        def cycle(z: float) -> tuple[float, float]:
            top, up = self._move(NUMPY, swing, (0.0, z))
            bottom, down = self._move(NUMPY, 0.0, (swing, float(top)))
            return float(bottom) - z, float(up) + float(down)

        if swing == 0.0:
            return 0.0
        # beyond both limits by a rounding, so that the ends have opposite signs
        wide = 1e-12 * (high - low)
        z = brentq(lambda z: cycle(z)[0], low - wide, high, xtol=1e-300, rtol=1e-15)
        (gain,) = numbers("state gain", (self.state_gain,))
        return abs(gain) * cycle(z)[1]


def check_rates(names: str, falling: Expression, rising: Expression) -> None:
    """Raise unless z stays bounded and every state is left again.

    Parameters
    ----------
    names : str
        How the rates come from the parameters, for the message.
    falling, rising : expression
        k for s z < 0 and for s z > 0, per input; only numbers are checked.

    Raises
    ------
    BadParameter
        If the rising rate is not positive, or a negative falling rate is not above its negative.

    Examples
    --------
    >>> check_rates("beta -+ gamma", 0.5, 1.0)
    """
    if not all_numbers((falling, rising)):
        return
    if not rising > 0.0:
        raise BadParameter(
            f"{names}: the rate {rising:.6g} while |z| grows must be positive, otherwise z is not "
            "bounded; raise beta or gamma"
        )
    if not falling + rising > 0.0:
        raise BadParameter(
            f"{names}: the rates {falling:.6g} while |z| falls and {rising:.6g} while it grows "
            "must have a positive sum (beta > 0), otherwise a saturated z never comes back"
        )
