"""Linear creep: a spring in series with Kelvin-Voigt units, integrated exactly.

Sizes: m units, m states and the last input, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, final

from bondgraph.hysteresis.checks import (
    all_numbers,
    is_number,
    non_negative,
    parameter,
    parameters,
    same_length,
)
from bondgraph.hysteresis.creep.first_order_lag import ramp_rate, ramp_share, relaxed_share
from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.invertible import Inverse, SolvedInSteps
from bondgraph.hysteresis.operator import Memory
from bondgraph.support.ops import NUMPY, Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class KelvinVoigtCreep(SolvedInSteps):
    """Linear creep ``y = w_0 x + sum_j c_j y_j`` with ``tau_j y_j' = x - y_j``.

    The input is linear between samples and the step is exact for that, so a step may be divided at
    will. Against `LogCreep` it has no thresholds, and the present input acts at once, also on the
    units. Seven units follow a logarithm over five decades of time to half a percent.

    For w_0, c_j >= 0 a passive chain of springs and dashpots, x the force and y the elongation.

    The memory is the last input, then the states y_j.

    Parameters
    ----------
    gain : expression
        w_0, any sign, output per input: the part without delay.
    weights : sequence
        c_j, shape (m,), any sign, output per input.
    times : sequence
        tau_j > 0, shape (m,), s.

    Raises
    ------
    BadParameter
        If there is no unit, the lengths differ or a time is not positive; names the entry.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> creep = KelvinVoigtCreep(gain=1.0, weights=(0.5,), times=(1.0,))
    >>> memory = creep.initial_memory(2.0)
    >>> creep.run([2.0, 2.0], memory, step=1.0)[0].round(3).tolist()
    [2.632, 2.865]
    """

    kind: ClassVar[str] = "kelvin_voigt_creep"
    flows: ClassVar[bool] = True

    gain: Expression
    weights: tuple[Expression, ...]
    times: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        object.__setattr__(self, "gain", parameter("gain", self.gain))
        weights, times = parameters("weights", self.weights), parameters("times", self.times)
        same_length("weights", weights, "times", times)
        if not times:
            raise BadParameter("times is empty; creep needs at least one unit")
        non_negative("times", times, strict=True)
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "times", times)

    @property
    def timed(self) -> bool:
        """Always."""
        return True

    @property
    def n_memory(self) -> int:
        """The last input and one state for each unit, 1 + m."""
        return 1 + len(self.times)

    @property
    def linear_slope(self) -> Expression:
        """Slope of a jump, w_0; `direct_gain` is the slope of a step that takes time."""
        return self.gain

    def direct_gain(self, ops: Ops, step: Expression) -> Expression:
        """Return how much of the input at the end of a step is in the output there.

        ``w_0 + sum_j c_j (1 - (1 - exp(-h/tau_j)) tau_j/h)``.

        Parameters
        ----------
        ops : Ops
            Back end of ``step`` and of symbolic parameters.
        step : expression
            h >= 0, s.

        Returns
        -------
        expression
            Output per input.
        """
        gain = self.gain
        for c, tau in zip(self.weights, self.times, strict=True):
            gain = gain + c * ramp_share(ops, step / tau)
        return gain

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return (x0, *(0.0 * x0 for _ in self.times)) if states is None else (x0, *states[1:])

    def _relaxed(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, ...]:
        before, *states = memory
        shares = [
            (relaxed_share(ops, q), ramp_share(ops, q)) for q in (step / t for t in self.times)
        ]
        return tuple(
            y + held * (before - y) + ramp * (x - before)
            for y, (held, ramp) in zip(states, shares, strict=True)
        )

    def _sum(self, x: Expression, states: Sequence[Expression]) -> Expression:
        output = self.gain * x
        for c, y in zip(self.weights, states, strict=True):
            output = output + c * y
        return output

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self._sum(x, self._relaxed(ops, x, memory, step))

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return (x, *self._relaxed(ops, x, memory, step))

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"input"`` if no weight is negative: a chain of springs and dashpots."""
        weights = (self.gain, *self.weights)
        return "input" if all_numbers(weights) and all(w >= 0.0 for w in weights) else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        """``w_0 x^2/2 + sum c_j y_j^2/2``, and ``sum c_j tau_j integral y_j'^2 dt`` of the ramp."""
        before, *states = memory
        stored = 0.5 * self.gain * x * x
        lost: Expression = 0.0
        after = self._relaxed(ops, x, (before, *states), step)
        units = zip(self.weights, self.times, states, after, strict=True)
        for c, tau, y, new in units:
            stored = stored + 0.5 * c * new * new
            # The integral of (u + (f - u) exp(-s))^2 over s = 0..q, with f = x - y at the start
            # and u q the rise of x, sorted by powers of both: nothing cancels at small q.
            q = step / tau
            lag, rise = before - y, x - before
            share, ramp = relaxed_share(ops, q), ramp_share(ops, q)
            lost_now = share * (1.0 - 0.5 * share) * lag * lag
            lost_now = lost_now + share * (1.0 - ramp) * lag * rise
            bend = ramp_rate(ops, q) - 0.5 * (1.0 - ramp) * (1.0 - ramp)
            lost = lost + c * (lost_now + bend * rise * rise)
        return stored, lost

    def check_invertible(self, step: float | None = None) -> None:
        """Raise if the output of a step does not rise with the input at its end.

        Parameters
        ----------
        step : float, optional
            Duration of the steps, s. Default: any duration, for which ``w_0`` plus the negative
            weights must be positive.

        Raises
        ------
        NotInvertible
            With index 0 for the gain, j + 1 for the first weight that makes the sum not positive.
        """
        if is_number(self.gain) and not self.gain > 0.0:
            raise NotInvertible(
                f"no inverse: gain = {self.gain:.6g} is not positive, so nothing of the input is "
                "in the output of a sudden step; give the part without delay a positive gain",
                0,
            )
        if not all_numbers((self.gain, *self.weights, *self.times)):
            return
        total = float(self.gain)
        for j, (c, tau) in enumerate(zip(self.weights, self.times, strict=True), start=1):
            total += min(c, 0.0) if step is None else c * float(ramp_share(NUMPY, step / tau))
            if step is None and not total > 0.0:
                raise NotInvertible(
                    f"no inverse for steps of any duration: gain plus the negative weights up to "
                    f"weights[{j - 1}] = {c:.6g} is {total:.6g}, not positive; give the step, or "
                    "make that weight less negative",
                    j,
                )
        if not total > 0.0:
            worst = min(range(len(self.weights)), key=lambda j: float(self.weights[j]))
            raise NotInvertible(
                f"no inverse at step = {step} s: the direct gain is {total:.6g}, not positive; "
                f"shorten the step or make weights[{worst}] = {self.weights[worst]:.6g} larger",
                worst + 1,
            )

    def inverse(self, step: float | None = None, *, ops: Ops = NUMPY) -> Inverse:
        """Return the inverse for steps of one duration: a step is linear in the input at its end.

        Parameters
        ----------
        step : float, optional
            s; any duration if not given, see `check_invertible`.
        ops : Ops, optional
            Back end of symbolic parameters.
        """
        self.check_invertible(step)
        return self._inverse(ops)

    def _memory_at(self, ops: Ops, y0: Expression, states: Memory | None) -> Memory:
        units = tuple(0.0 * y0 for _ in self.times) if states is None else states[1:]
        return ((y0 - self._sum(0.0, units)) / self.gain, *units)

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        return (y - self._value(ops, 0.0, memory, step)) / self.direct_gain(ops, step)
