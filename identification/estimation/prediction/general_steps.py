"""The filter's steps for any program: Radau IIA with a covariance, in matrix expressions.

The stages of a step (see `bondgraph.simulation.radau.native`) are found by Newton's method; one
more of its steps makes them functions with exact derivatives. With ``J`` the Jacobian of the
stages' equations, ``R = J^-1`` says how the end follows what is added to the rows of the states:
``F = R_1 + R_2`` is its derivative by the begin. Process noise enters the same rows as ``xi_1``,
``xi_2`` of covariance ``h [[7/27, 1/3], [1/3, 1]]``, about the Wiener process at a third and at the
end of the step: ``R`` then makes of it the covariance ``integral of exp(A s) S exp(A' s)`` up to
and including ``h^3``, the order of the method, and stays bounded for stiff models as that does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from identification.estimation.prediction.correction import corrected, full, packed, with_tangent
from identification.estimation.prediction.plant import FilterSteps, packed_size

NODES = (1.0 / 3.0, 1.0)
BUTCHER = np.array([[5.0, -1.0], [9.0, 3.0]]) / 12.0
WIENER = np.array([[7.0, 9.0], [9.0, 27.0]]) / 27.0
"""Covariance of what process noise adds to the rows of the two stages, over the step."""
NEWTON = {"max_iter": 30, "abstol": 1e-12, "abstolStep": 1e-9, "error_on_fail": False}
STRAY = 1e-4
"""Largest last step of Newton's method, in sizes of the states: beyond, a step has no solution."""


@dataclass(frozen=True)
class GeneralPlaces:
    """Where a program's numbers stand in ``m``.

    Attributes
    ----------
    p, x, y : slice
        Parameters; sizes of states and readings.
    diffusion, force : slice
        Intensity of the noise in each rate (scaled), and in each input (SI).
    """

    program: Program
    p: slice
    x: slice
    y: slice
    diffusion: slice
    force: slice

    @classmethod
    def of(cls, program: Program) -> GeneralPlaces:
        """Places for `program`."""
        names = (
            program.parameters,
            program.states,
            program.outputs,
            program.states,
            program.inputs,
        )
        ends = accumulate(map(len, names))
        return cls(program, *(slice(e - len(n), e) for e, n in zip(ends, names, strict=True)))

    @property
    def step(self) -> int:
        """Length of a sub-step, s, at the end of them all."""
        return int(self.force.stop)

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """States, algebraic unknowns, inputs, memory."""
        q = self.program
        return len(q.states), len(q.algebraic), len(q.inputs), len(q.memory)


def evaluation(at: GeneralPlaces) -> ca.Function:
    """Return ``(x, z, u, q, memory, h) -> (v, dv/d(x, z, u), memory')``, in scaled units.

    ``v`` are rates, residuals and readings; `u` has the time behind the inputs, `q` are the numbers
    of the program.
    """
    n_x, n_z, n_u, n_m = at.sizes
    program = at.program
    x, z, u = ca.SX.sym("x", n_x), ca.SX.sym("z", n_z), ca.SX.sym("u", n_u + 1)
    q, memory, h = ca.SX.sym("q", at.step + 1), ca.SX.sym("memory", n_m), ca.SX.sym("h")
    given = (u[n_u], x * q[at.x], z, u[:n_u], q[at.p], memory, h)
    rates, readings = program.rhs(*given)
    value = ca.vertcat(rates / q[at.x], program.residual(*given), readings / q[at.y])
    slope = ca.jacobian(value, ca.vertcat(x, z, u[:n_u]))
    out = [ca.densify(value), slope, ca.densify(program.advance(*given))]
    return ca.Function("bondsight_evaluation", [x, z, u, q, memory, h], out, {"cse": True})


def general_steps(program: Program) -> FilterSteps:
    """Build the functions of a program."""
    made = _Building(GeneralPlaces.of(program))
    n_x, _, n_u, _ = made.at.sizes
    functions = [made.roots(), *made.predict(), *made.update()]
    return FilterSteps(
        n_x, n_u + 1, made.n_y, made.n_roots, made.n_c, made.at.step + 1 + 2 * made.n_y,
        made.at.step, {f.name(): f for f in functions},
    )  # fmt: skip


class _Building:
    """Expressions of one program."""

    def __init__(self, at: GeneralPlaces) -> None:
        self.at, self.evaluation = at, evaluation(at)
        n_x, n_z, n_u, n_m = at.sizes
        self.n, self.n_y = n_x + n_z, len(at.program.outputs)
        self.n_before = n_z if n_m else 0
        self.n_stages = 2 * self.n
        self.n_roots = self.n_before + self.n_stages * (1 + self.n_stages)
        self.n_c = n_x + packed_size(n_x) + n_z + n_m
        self.c = ca.MX.sym("c", self.n_c)
        self.m = ca.MX.sym("m", at.step + 1 + 2 * self.n_y)
        self.u0, self.u1 = ca.MX.sym("u0", n_u + 1), ca.MX.sym("u1", n_u + 1)
        self.elapsed = ca.MX.sym("elapsed")
        self.q, self.h = self.m[: at.step + 1], self.m[at.step]
        cuts = np.cumsum([0, n_x, packed_size(n_x), n_z, n_m]).tolist()
        self.x, self.p, self.z, self.memory = ca.vertsplit(self.c, cuts)

    def _accepted(self, z: ca.MX) -> ca.MX:
        """Memory once the begin is accepted, where the unknowns are `z`."""
        if not self.at.sizes[3]:
            return self.memory
        return self.evaluation(self.x, z, self.u0, self.q, self.memory, self.elapsed)[2]

    def _polished(self, z: ca.MX) -> ca.MX:
        """Unknowns at the begin after one more of Newton's steps."""
        if not self.n_before:
            return z
        given = (self.u0, self.q, self.memory, self.elapsed)
        value, slope, _ = self.evaluation(self.x, z, *given)
        at = slice(self.at.sizes[0], self.n)
        return z - _solved(slope[at, at], value[at])

    def _stages(self, v: ca.MX, memory: ca.MX) -> tuple[ca.MX, ca.MX, list[ca.MX]]:
        """Residual of the stages, its Jacobian, and the slopes of the program in each."""
        n_x, n, two = self.at.sizes[0], self.n, range(len(NODES))
        stages = ca.reshape(v, n, 2)
        values, slopes = [], []
        for s in two:
            u = self.u0 + NODES[s] * (self.u1 - self.u0)
            given = (stages[:n_x, s], stages[n_x:, s], u, self.q, memory, NODES[s] * self.h)
            value, slope, _ = self.evaluation(*given)
            values.append(value)
            slopes.append(slope)
        both = ca.horzcat(*values)
        states = stages[:n_x, :] - ca.repmat(self.x, 1, 2) - self.h * both[:n_x, :] @ BUTCHER.T
        residual = ca.vec(ca.vertcat(states, both[n_x:n, :]))
        one, none = ca.MX.eye(n)[:n_x, :], ca.MX(n - n_x, n)
        blocks = [
            ca.vertcat(
                (one if i == j else 0.0) - self.h * float(BUTCHER[i, j]) * slopes[j][:n_x, :n],
                slopes[j][n_x:n, :n] if i == j else none,
            )
            for j in two
            for i in two
        ]
        jacobian = ca.horzcat(ca.vertcat(*blocks[:2]), ca.vertcat(*blocks[2:]))
        return residual, jacobian, slopes

    def roots(self) -> ca.Function:
        """Return unknowns at the begin and stages, by Newton's method, and the inverse of J."""
        n_x = self.at.sizes[0]
        roots = ca.MX.sym("roots", self.n_before + self.n_stages)
        z, v = roots[: self.n_before], roots[self.n_before :]
        residual, _, _ = self._stages(v, self._accepted(z))
        if self.n_before:
            first = self.evaluation(self.x, z, self.u0, self.q, self.memory, self.elapsed)[0]
            residual = ca.vertcat(first[n_x : self.n], residual)
        given = [self.c, self.u0, self.u1, self.m, self.elapsed]
        whole = ca.Function("residual", [roots, *given], [residual])
        known = ca.MX.sym("known", sum(g.numel() for g in given))
        parts = ca.vertsplit(known, np.cumsum([0, *(g.numel() for g in given)]).tolist())
        problem = {"x": roots, "p": known, "g": whole(roots, *parts)}
        solver = ca.rootfinder("bondsight_newton", "fast_newton", problem, NEWTON)
        guess = [self.z] * (self.n_before > 0) + [self.x, self.z] * 2
        found = solver(ca.vertcat(*guess), ca.vertcat(*given))
        memory = self._accepted(found[: self.n_before])
        _, jacobian, _ = self._stages(found[self.n_before :], memory)
        inverse = _solved(jacobian, ca.MX.eye(self.n_stages))
        out = ca.vertcat(found, ca.vec(inverse))
        return ca.Function("bondsight_roots", given, [ca.densify(out)], {"cse": True})

    def predict(self) -> list[ca.Function]:
        """Return the step of mean and covariance."""
        n_x, k = self.at.sizes[0], self.n_stages
        roots = ca.MX.sym("roots", self.n_roots)
        memory = self._accepted(self._polished(roots[: self.n_before]))
        v = roots[self.n_before : self.n_before + k]
        inverse = ca.reshape(roots[self.n_before + k :], k, k)
        last = inverse @ self._stages(v, memory)[0]
        v = v - last
        _, jacobian, slopes = self._stages(v, memory)
        # ``(2 - inverse J) inverse`` is the inverse, and so is its derivative
        end = inverse[self.n : self.n + n_x, :]
        turned = end @ jacobian
        parts = []
        for rows in (slice(0, n_x), slice(self.n, self.n + n_x)):
            parts.append(2.0 * end[:, rows] - turned @ inverse[:, rows])
        f = parts[0] + parts[1]
        covariance = f @ full(self.p, n_x) @ f.T
        own = ca.diag(self.q[self.at.diffusion])
        forces = [self._by_inputs(s) @ ca.diag(self.q[self.at.force]) for s in slopes]
        shown = [ca.horzcat(r @ own, r @ b) for r, b in zip(parts, forces, strict=True)]
        for weights in np.linalg.cholesky(WIENER).T.tolist():
            one = sum(w * r for w, r in zip(weights, shown, strict=True))
            covariance += self.h * one @ one.T
        strayed = ca.logic_not(ca.norm_inf(last[self.n : self.n + n_x]) < STRAY)
        mean = v[self.n : self.n + n_x] + ca.if_else(strayed, np.nan, 0.0)
        new = ca.vertcat(mean, packed(covariance), v[self.n + n_x :], memory)
        given = [self.c, roots, self.u0, self.u1, self.m, self.elapsed]
        return with_tangent("predict", given, [new], [0, 4])

    def _by_inputs(self, slope: ca.MX) -> ca.MX:
        """How rates follow the inputs, through the unknowns too."""
        n_x = self.at.sizes[0]
        return self._through(slope, slice(0, n_x), slice(self.n, None))

    def _through(self, slope: ca.MX, of: slice, by: slice) -> ca.MX:
        """Total derivative: what moves the unknowns moves the rest through them."""
        n_x, n = self.at.sizes[0], self.n
        if n == n_x:
            return slope[of, by]
        return slope[of, by] - slope[of, n_x:n] @ _solved(slope[n_x:n, n_x:n], slope[n_x:n, by])

    def update(self) -> list[ca.Function]:
        """Return the correction by the readings."""
        n_x = self.at.sizes[0]
        value, slope, _ = self.evaluation(self.x, self.z, self.u1, self.q, self.memory, self.h)
        c = self._through(slope, slice(self.n, None), slice(0, n_x))
        rest = ca.vertcat(self.z, self.memory)
        reading = value[self.n :]
        return corrected(self.c, self.u1, self.m, self.x, full(self.p, n_x), reading, c, rest)


def _solved(a: ca.MX, b: ca.MX) -> ca.MX:
    return ca.solve(a, b, "qr")
