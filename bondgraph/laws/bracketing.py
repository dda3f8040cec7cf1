"""The implicit step of friction that is steep near rest and falls with speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law, split
from bondgraph.support.ops import CASADI

ROOT_STEPS = 30


def bracketed(law: Law, memory: Sequence[Any], p: Sequence[Any], largest: Any) -> Iteration:
    """Return the way to the flow that solves a step, see `Law.iteration`.

    The root lies between the free flow and the flow that the `largest` force would leave. The force
    jumps within a small velocity, where plain Newton steps cycle; a bracket that is halved whenever
    a Newton step leaves it cannot.
    """
    import casadi as ca

    t, c = ca.SX.sym("t"), ca.SX.sym("c", len(memory) + len(p))
    parts = split(c)
    w = law.deviation(CASADI, t, parts[: len(memory)], parts[len(memory) :])
    force = ca.Function("force", [t, c], [w, ca.jacobian(w, t)])
    constants = ca.vertcat(*memory, *p)

    def begin(free: Any, gain: Any, w_last: Any) -> Any:
        reach = 2.0 * ca.fabs(gain) * largest
        # friction brings the flow towards 0, however strong its damping is
        low, high = ca.fmin(free, 0.0) - reach, ca.fmax(free, 0.0) + reach
        return ca.vertcat(ca.fmin(ca.fmax(free + gain * w_last, low), high), low, high)

    def step(numbers: Any, free: Any, gain: Any) -> Any:
        at, low, high = split(numbers)
        value, slope = force(at, constants)
        miss, rise = at - free - gain * value, 1.0 - gain * slope
        low, high = ca.if_else(miss < 0, at, low), ca.if_else(miss < 0, high, at)
        newton = at - miss / ca.if_else(rise > 0, rise, 1.0)
        inside = ca.logic_and(rise > 0, ca.logic_and(newton >= low, newton <= high))
        return ca.vertcat(ca.if_else(inside, newton, 0.5 * (low + high)), low, high)

    return Iteration(begin, step, lambda numbers: force(numbers[0], constants)[0], 3, 1, ROOT_STEPS)
