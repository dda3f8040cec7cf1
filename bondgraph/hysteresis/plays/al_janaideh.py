"""The Prandtl-Ishlinskii operator of Al Janaideh: five numbers for any count of plays.

Sizes: J plays with a width, J memory states, N samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self, final

from bondgraph.hysteresis.checks import all_numbers, count_of, numbers, parameter, positive
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.bounds import whole
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class AlJanaideh(InvertibleOperator[PrandtlIshlinskii]):
    """Plays on an envelope ``z = q eta + sum_(j=1..J) Theta_j play_(r_j)[eta]``, ``eta = c x``.

    Density ``Theta_j = alpha exp(-beta r_j)``, thresholds ``r_j = j sigma``. Only four of the five
    numbers can be identified: (q/L, c L, sigma L, alpha/L, beta/L) give the same output for any L,
    so hold c = 1 when fitting. The memory holds the play states in units of eta.

    The inverse ``x = eta^-1( z/q + sum Theta'_j play_(r'_j)[z] )`` is a plain weighted sum of
    plays: its weights are no exponential of its thresholds.

    Parameters
    ----------
    q : number or expression
        Weight of the linear part; output per eta.
    c : number or expression
        Gain of the envelope, c > 0; eta per input.
    sigma : number or expression
        Spacing of the thresholds, sigma > 0; unit of eta.
    alpha : number or expression
        Density at threshold 0; output per eta.
    beta : number or expression
        Decay of the density; 1 per eta.
    count : int
        J >= 0.

    Raises
    ------
    BadParameter
        If ``c`` or ``sigma`` is not positive, ``count`` is not a count, or a number is not finite.

    References
    ----------
    aljanaideh2011

    Examples
    --------
    >>> operator = AlJanaideh(q=1.0, c=2.0, sigma=1.0, alpha=0.5, beta=0.0, count=1)
    >>> operator.run([0.0, 1.0])[0].tolist()
    [0.0, 2.5]
    """

    kind: ClassVar[str] = "al_janaideh"

    q: Expression
    c: Expression
    sigma: Expression
    alpha: Expression
    beta: Expression
    count: Annotated[int, whole(0, 10_000)]

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("q", "c", "sigma", "alpha", "beta"):
            object.__setattr__(self, name, parameter(name, getattr(self, name)))
        positive("c", self.c)
        positive("sigma", self.sigma)
        count_of("count", self.count, 0)

    @classmethod
    def stack_2hz(cls) -> Self:
        """Return the operator fitted to a piezo stack at 2 Hz, V to m.

        Eq. (6.2) of the stack actuator thesis, there in nm. Over 0..100 V the steady loop goes from
        507 nm to 4915 nm and is 790 nm thick.
        """
        return cls(q=18.42e-9, c=1.21, sigma=5.28, alpha=8.11e-9, beta=0.047, count=10)

    def in_envelope(self, *, ops: Ops = NUMPY) -> PrandtlIshlinskii:
        """Return the plays that act on eta = c x; they have the memory of this operator.

        Thresholds are in units of eta, weights in output per eta.
        """
        r = [j * self.sigma for j in range(1, self.count + 1)]
        density = [self.alpha * ops.exp(-self.beta * r_j) for r_j in r]
        return PrandtlIshlinskii((0.0, *r), (self.q, *density))

    def as_prandtl_ishlinskii(self, *, ops: Ops = NUMPY) -> PrandtlIshlinskii:
        """Return the same operator without envelope; its memory is the one here divided by c.

        Thresholds r_j / c are in the unit of the input, weights c Theta_j in output per input.
        """
        plays = self.in_envelope(ops=ops)
        thresholds = (0.0, *(r / self.c for r in plays.thresholds[1:]))
        return PrandtlIshlinskii(thresholds, tuple(self.c * w for w in plays.weights))

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, J."""
        return self.count

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal, q c; output per input."""
        return self.q * self.c

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return self.in_envelope(ops=ops).initial_memory(self.c * x0, states, ops=ops)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.in_envelope(ops=ops).value(ops, self.c * x, memory)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.in_envelope(ops=ops).advance(ops, self.c * x, memory)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        for name in ("q", "c", "sigma", "alpha", "beta"):
            numbers(name, (getattr(self, name),))
        return self.in_envelope().run(self.c * x, memory)

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """Of the same operator written as plays."""
        named = (self.q, self.c, self.sigma, self.alpha, self.beta)
        return self.as_prandtl_ishlinskii().passive_port if all_numbers(named) else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        plays = tuple(y / self.c for y in memory)
        return self.as_prandtl_ishlinskii(ops=ops)._energy(ops, x, plays, step)

    def _inverse(self, ops: Ops) -> PrandtlIshlinskii:
        inner = self.in_envelope(ops=ops).inverse()
        return PrandtlIshlinskii(inner.thresholds, tuple(w / self.c for w in inner.weights))

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        return self.in_envelope(ops=ops).inverse_memory(memory)

    def loop_loss(self, amplitude: Expression, *, ops: Ops = NUMPY) -> Expression:
        """Return the area of a closed loop, see `PrandtlIshlinskii.loop_loss`."""
        return self.as_prandtl_ishlinskii(ops=ops).loop_loss(amplitude, ops=ops)
