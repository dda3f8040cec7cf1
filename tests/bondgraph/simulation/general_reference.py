"""The general step written again in CasADi's virtual machine, to hold the compiled one against."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.support.arrays import Array

NEWTON = 5
CONVERGED = 1e-6
A = ((5 / 12, -1 / 12), (3 / 4, 1 / 4))
NODES = (1 / 3, 1.0)


@dataclass(frozen=True, slots=True)
class Solution:
    """What the integrator found at the samples.

    Attributes
    ----------
    x, z, y : ndarray, shapes (N, n_x), (N, n_z), (N, n_y)
    memory : ndarray, shape (n_m,)
        At the end.
    n_sub : int
        Steps between two samples.
    """

    x: Array
    z: Array
    y: Array
    memory: Array
    n_sub: int


class Runner:
    """The step of a program and its run over a record in one call."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.step = self._step()
        self.readings = ca.Function(
            "readings",
            [v := ca.MX.sym("v"), *self._columns()],
            [program.rhs(v, *self._last, 0.0)[1]],
        ) if program.outputs else None  # fmt: skip

    def _columns(self) -> list[ca.MX]:
        q = self.program
        sizes = (q.states, q.algebraic, q.inputs, q.parameters, q.memory)
        self._last = [ca.MX.sym(n, len(s)) for n, s in zip("xzupm", sizes, strict=True)]
        return self._last

    def _step(self) -> ca.Function:
        q = self.program
        n_x, n_z = len(q.states), len(q.algebraic)
        n = n_x + n_z
        x, z = ca.MX.sym("x", n_x), ca.MX.sym("z", n_z)
        m, p = ca.MX.sym("m", len(q.memory)), ca.MX.sym("p", len(q.parameters))
        u0, u1 = ca.MX.sym("u0", len(q.inputs)), ca.MX.sym("u1", len(q.inputs))
        t, h = ca.MX.sym("t"), ca.MX.sym("h")
        k = ca.MX.sym("k", 2 * n)
        stages = [k[:n], k[n:]]
        right = []
        values = []
        for c, s in zip(NODES, stages, strict=True):
            u = u0 + c * (u1 - u0)
            at = (t + c * h, s[:n_x], s[n_x:], u, p, m, c * h)
            values.append(q.rhs(*at)[0])
            right.append(q.residual(*at))
        rows = []
        for i, s in enumerate(stages):
            change = A[i][0] * values[0] + A[i][1] * values[1]
            rows += [s[:n_x] - x - h * change, right[i]] if n_x else [right[i]]
        residual = ca.vertcat(*rows)
        names = [k, x, m, p, u0, u1, t, h]
        f = ca.Function("f", names, [residual, ca.jacobian(residual, k)])
        guess = ca.vertcat(x, z, x, z)
        update = guess
        for _ in range(NEWTON):
            r, j = f(guess, *names[1:])
            update = ca.solve(j, r, "csparse")
            guess = guess - update
        x1, z1 = guess[n : n + n_x], guess[n + n_x :]
        end = (t + h, x1, z1, u1, p, m, h)
        m1 = q.advance(*end) if q.memory else m
        carried = ca.vertcat(x1, z1, m1)
        state = ca.vertcat(x, z, m)
        whole = ca.Function("step", [x, z, m, t, h, u0, u1, p], [carried, update[n:]])
        v = ca.MX.sym("v", state.numel())
        split = ca.vertsplit(v, [0, n_x, n, n + len(q.memory)])
        end_state, correction = whole(*split, t, h, u0, u1, p)
        return ca.Function("step", [v, t, u0, u1, h, p], [end_state, correction])

    def __call__(
        self,
        time: Array,
        step: float,
        u: Array,
        p: Array,
        x0: Array,
        z0: Array,
        m0: Array,
        n_sub: int,
    ) -> tuple[Solution | None, int]:
        """Run; None and the sample of the first failure if Newton's method does not converge."""
        q = self.program
        n_x, n = len(q.states), len(q.states) + len(q.algebraic)
        n_steps = (time.size - 1) * n_sub
        fine = np.linspace(0.0, time.size - 1.0, n_steps + 1)
        lower = np.minimum(fine.astype(int), time.size - 2)
        part = (fine - lower)[:, None]
        v = u[lower] * (1 - part) + u[lower + 1] * part
        n_rates = len(q.input_rates)
        begin, end = v[:-1].copy(), v[1:].copy()
        if n_rates:
            # the rate of a linear piece is constant: each step has its own, not the mean of two
            begin[:, -n_rates:] = end[:, -n_rates:] = u[lower[:-1], -n_rates:]
        times = time[0] + fine[:-1] * step
        start = np.concatenate([x0, z0, m0])
        run = self.step.mapaccum(n_steps)
        states, corrections = run(start, times[None, :], begin.T, end.T, step / n_sub, p)
        states, corrections = states.full(), np.abs(corrections.full())
        size = np.maximum(np.abs(states[:n]).max(axis=1, initial=0.0), np.abs(start[:n]))[:, None]
        ok = np.isfinite(states).all(axis=0) & (corrections <= CONVERGED * size + 1e-150).all(
            axis=0
        )
        if not ok.all():
            return None, int(np.argmin(ok)) // n_sub
        picked = np.column_stack([start, states[:, n_sub - 1 :: n_sub]])
        x, z = picked[:n_x].T, picked[n_x:n].T
        y = np.zeros((time.size, 0))
        if self.readings is not None:
            # readings belong to the memory before the sample, as within the step that reached it
            memories = np.column_stack(
                [m0, np.column_stack([m0, states[n:]])[:, n_sub - 1 : -1 : n_sub]]
            )
            ends = np.vstack([u[:1], end[n_sub - 1 :: n_sub]])
            y = (
                self.readings.map(time.size)(
                    time[None, :], x.T, z.T, ends.T, np.tile(p[:, None], time.size), memories
                )
                .full()
                .T
            )
        return Solution(x, z, y, states[n:, -1] if n_steps else m0, n_sub), 0
