"""Friction that bends before it slides: Dahl's model with its slip length as a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law, split
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops

ROOT_STEPS = 12


@dataclass(frozen=True)
class DahlFriction(Law):
    """Dahl friction ``F = F_c z`` in a resistor, ``dz/dx = (1 - z sign(f)) / delta``.

    ``delta`` is the way after which the contact slides and ``F_c / delta`` its stiffness at rest;
    for ``delta -> 0`` it is Coulomb friction. Within a step the flow is held at a mean value and
    ``z`` follows its exact exponential, so that no step is too long for a short ``delta``.

    Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968.

    Parameters
    ----------
    force, way : float
        Start values of ``F_c`` and ``delta``.

    Examples
    --------
    >>> law = DahlFriction(0.8, 1e-4)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d', 'delta_d']
    """

    force: Positive = 1.0
    way: Positive = 1e-3
    unit: str = "N"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = ("force", "way", "unit", "way_unit")
    name: ClassVar[str] = "dahl"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level once it slides",
        "delta": "way over which the contact bends like a spring before it slides",
    }
    energy: ClassVar[str] = "dissipates"
    lives_in_time: ClassVar[bool] = True
    """The way is the flow over time."""
    flows: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (False, True)
    """Bend of the bristle, -1 to 1, and the last flow."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_c`` and ``delta``."""
        way = self.way
        return (
            Parameter(f"F_c_{element}", self.force, self.unit, lower=0.0, scale=self.force),
            Parameter(
                f"delta_{element}", way, self.way_unit, lower=1e-3 * way, upper=1e3 * way, scale=way
            ),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Bend and flow after the step."""
        mean, direction = mean_flow(ops, s, memory[1]), ops.sign(s)
        kept = ops.exp(-ops.absolute(mean) * p[-1] / p[1])
        return (direction + (memory[0] - direction) * kept, s)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``F_c z`` at the end of the step."""
        return p[0] * self.advance(ops, s, memory, p)[0]

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Climb to the root on the side to which the unbent remainder points.

        Mirrored to the positive side the relation ``s = a - b (1 - c exp(-mean(s) / l))`` has a
        rising, concave miss, so Newton steps from ``max(0, a - b)`` climb to the root without
        overshoot.
        """
        import casadi as ca

        from bondgraph.support.ops import CASADI

        rate = p[-1] / p[1]
        t, last = ca.SX.sym("t"), ca.SX.sym("last")
        value = _mean_size(CASADI, t, last)
        mean = ca.Function("mean", [t, last], [value, ca.jacobian(value, t)])

        def left(at: Any, side: Any) -> tuple[Any, Any]:
            """Return the remainder that is still unbent, and the slope of the mean flow."""
            v, slope = mean(at, side * memory[1])
            return (1.0 - side * memory[0]) * ca.exp(-v * rate), slope

        def begin(free: Any, gain: Any, w_last: Any) -> Any:
            b = -gain * p[0]
            side = ca.if_else(free - b * memory[0] >= 0, 1.0, -1.0)
            return ca.vertcat(ca.fmax(0.0, side * free - b), side)

        def step(numbers: Any, free: Any, gain: Any) -> Any:
            at, side = split(numbers)
            b = -gain * p[0]
            rest, slope = left(at, side)
            at = at + (side * free - at - b * (1.0 - rest)) / (1.0 + b * rest * rate * slope)
            return ca.vertcat(at, side)

        def end(numbers: Any) -> Any:
            at, side = split(numbers)
            return side * p[0] * (1.0 - left(at, side)[0])

        return Iteration(begin, step, end, 2, 1, ROOT_STEPS)


def mean_flow(ops: Ops, s: Any, last: Any) -> Any:
    """Mean flow of a step, with the sign of its end."""
    direction = ops.sign(s)
    return direction * _mean_size(ops, ops.absolute(s), direction * last)


def _mean_size(ops: Ops, s: Any, last: Any) -> Any:
    """Mean flow of a step that ends at ``s >= 0``, rising and concave in `s`, 0 at 0.

    The arithmetic mean would let a sticking contact swing forth and back for ever, the end value
    is exact to first order only. Here it is the arithmetic mean while the motion speeds up, the
    harmonic one while it slows down, and the end value after a reversal.
    """
    before = ops.maximum(last, 0.0)
    total = before + s
    harmonic = 2.0 * before * s / ops.where(total > 0, total, 1.0)
    return ops.where(last < 0, s, ops.where(s < before, harmonic, 0.5 * total))
