"""Radau IIA steps of a model of the language, as functions and as a vectorised integrator.

Hairer and Wanner, Solving Ordinary Differential Equations II (1996), sec. IV.5: `stages` stages of
order ``2 stages - 1``, L-stable, the last one at the end of the step. Algebraic unknowns close
their equations at every stage.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.signals.band_limited import between_samples
from bondgraph.signals.recorded_rates import slope_within
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput

STAGES = 3
NEWTON = 30
SETTLED = 1e-11
FINER = 8
"""Points of the band-limited interpolation a sub-step; a cubic spline joins them."""


def tableau(stages: int) -> tuple[Array, Array]:
    """Nodes c and coefficients a of Radau IIA, shapes (s,) and (s, s).

    >>> tableau(2)[1].round(4).tolist()
    [[0.4167, -0.0833], [0.75, 0.25]]
    """
    nodes = ca.collocation_points(stages, "radau")
    # slopes at the nodes of the polynomial through the begin and the nodes
    slopes = ca.collocation_coeff(nodes)[0].full()
    return np.array(nodes), np.linalg.inv(slopes[1:]).T


@dataclass(frozen=True, eq=False)
class Scales:
    """Units of the unknowns: states (n_x,), algebraic unknowns (n_z,), their equations (n_z,)."""

    x: Array
    z: Array
    g: Array


@dataclass(frozen=True, eq=False)
class CollocationStep:
    """One step as CasADi functions of scaled unknowns.

    ``v`` stacks states and algebraic unknowns stage by stage; the last stage is the next node.
    ``u`` stacks the inputs stage by stage.

    Attributes
    ----------
    defect : casadi.Function
        ``(theta, x, v, u, t, h) -> (n_x + n_z) * stages`` defects, scaled.
    newton : casadi.Function
        The same with the dense Jacobian by v.
    reading : casadi.Function
        ``(theta, x, z, u, t) -> y`` in SI, in the order of the readings.
    closing : casadi.Function
        ``(theta, x, z, u, t) -> equations of z``, scaled.
    n_x, n_z : int
    """

    defect: ca.Function
    newton: ca.Function
    reading: ca.Function
    closing: ca.Function
    n_x: int
    n_z: int


def step_of(
    program: Program, theta: ca.SX, p: ca.SX, outputs: tuple[str, ...], scales: Scales
) -> CollocationStep:
    """Functions of one step of `program` with parameters ``p(theta)``."""
    n_x, n_z, n_u = len(program.states), len(program.algebraic), len(program.inputs)
    size = n_x + n_z
    c, a = tableau(STAGES)
    x, v = ca.SX.sym("x", n_x), ca.SX.sym("v", size * STAGES)
    u, t, h = ca.SX.sym("u", n_u * STAGES), ca.SX.sym("t"), ca.SX.sym("h")
    empty = ca.SX(0, 1)
    rates, closings = [], []
    for i in range(STAGES):
        own = v[i * size : (i + 1) * size]
        at = (
            t + c[i] * h, own[:n_x] * scales.x, own[n_x:] * scales.z,
            u[i * n_u : (i + 1) * n_u], p, empty, h,
        )  # fmt: skip
        rates.append(program.rhs(*at)[0] / scales.x)
        closings.append(program.residual(*at) / scales.g)
    rows = []
    for i in range(STAGES):
        moved = x
        for j in range(STAGES):
            moved = moved + h * a[i, j] * rates[j]
        rows += [v[i * size : i * size + n_x] - moved, closings[i]]
    defect = ca.densify(ca.vertcat(*rows))
    inputs = [theta, x, v, u, t, h]
    z, one = ca.SX.sym("z", n_z), ca.SX.sym("u", n_u)
    at = (t, x * scales.x, z * scales.z, one, p, empty, ca.SX(0))
    order = [program.outputs.index(n) for n in outputs]
    y = ca.densify(program.rhs(*at)[1])[order]
    g = ca.densify(program.residual(*at)) / scales.g
    return CollocationStep(
        ca.Function("defect", inputs, [defect], {"cse": True}),
        ca.Function("newton", inputs, [defect, ca.densify(ca.jacobian(defect, v))], {"cse": True}),
        ca.Function("reading", [theta, x, z, one, t], [y], {"cse": True}),
        ca.Function("closing", [theta, x, z, one, t], [g], {"cse": True}),
        n_x, n_z,
    )  # fmt: skip


def stage_inputs(
    program: Program, u: Array, dt: float, n_sub: int, hold: str
) -> tuple[Array, Array]:
    """Return the inputs at the stages and at the nodes.

    Parameters
    ----------
    u : ndarray, shape (N, n_u)
        At the samples, in the order of the program.

    Returns
    -------
    ndarray, shape (n_u * stages, (N - 1) * n_sub)
    ndarray, shape (n_u, (N - 1) * n_sub + 1)
        What the readings at the nodes see: the end of the step before.
    """
    from scipy.interpolate import CubicSpline

    n, n_u = u.shape[0] - 1, u.shape[1]
    c = tableau(STAGES)[0]
    part = (np.arange(n_sub)[:, None] + c[None, :]).ravel() / n_sub
    if hold == "hold":
        values = np.repeat(u[:-1, None], part.size, axis=1)
        slopes = None
    elif hold == "linear":
        change = u[1:] - u[:-1]
        values = u[:-1, None] + change[:, None] * part[:, None]
        slopes = np.repeat(change[:, None] / dt, part.size, axis=1)
    else:
        fine = between_samples(u, FINER * n_sub)
        curve = CubicSpline(np.arange(fine.shape[0]) / (FINER * n_sub), fine)
        at = np.arange(n)[:, None] + part
        values, slopes = curve(at), curve(at, 1) / dt
    first = u[0].copy()
    for name in program.input_rates:
        column, source = program.inputs.index(name), name.partition("_")[2]
        if name in program.recorded:
            mean = (np.diff(u[:, program.inputs.index(source)]) / dt)[:, None]
            ends = u[:-1, column, None], u[1:, column, None]
            values[:, :, column] = slope_within(part, mean, *ends)
            continue
        if slopes is None or source not in program.inputs or source in program.input_rates:
            raise UnusableInput(
                f"collocation: {program.name} needs {name}, which inputs of hold={hold!r} do not "
                "have between samples; use hold='linear' or method='single_shooting'"
            )
        values[:, :, column] = slopes[:, :, program.inputs.index(source)]
        first[column] = values[0, 0, column]
    staged = values.reshape(n * n_sub, STAGES, n_u)
    nodes = np.concatenate([first[None], staged[:, -1]]).T
    return staged.reshape(n * n_sub, STAGES * n_u).T, nodes


def march(
    step: CollocationStep, theta: Array, begin: Array, u: Array, t: Array, h: float
) -> tuple[Array, Array]:
    """Integrate many stretches side by side.

    Parameters
    ----------
    begin : ndarray, shape (n_x + n_z, B)
        Scaled states and guesses of the algebraic unknowns.
    u : ndarray, shape (n, n_u * stages, B)
        Inputs of n steps.
    t : ndarray, shape (n, B)
        Where the steps begin, s.
    h : float

    Returns
    -------
    ndarray, shape (n, (n_x + n_z) * stages, B)
        Stages, NaN from where a step has no solution.
    ndarray, shape (n_x + n_z, B)
        Ends.
    """
    size, count = step.n_x + step.n_z, begin.shape[1]
    many = step.newton.map(count)
    wide = np.tile(np.asarray(theta)[:, None], (1, count))
    steps = np.full((1, count), h)
    found = np.full((u.shape[0], size * STAGES, count), np.nan)
    now = begin
    for k in range(u.shape[0]):
        v = np.tile(now, (STAGES, 1))
        done = np.zeros(count, bool)
        for _ in range(NEWTON):
            value, slope = many(wide, now[: step.n_x], v, u[k], t[k][None], steps)
            d = value.full().T
            j = slope.full().reshape(v.shape[0], count, v.shape[0]).transpose(1, 0, 2)
            broken = ~(np.isfinite(d).all(axis=1) & np.isfinite(j).all(axis=(1, 2)))
            j[broken], d[broken] = np.eye(v.shape[0]), np.nan
            try:
                move = np.linalg.solve(j, d[:, :, None])[:, :, 0].T
            except np.linalg.LinAlgError:
                break
            v = v - move
            done = np.abs(move).max(axis=0) <= SETTLED * (1 + np.abs(v).max(axis=0))
            if (done | broken).all():
                break
        v[:, ~done] = np.nan
        found[k], now = v, v[-size:]
    return found, now
