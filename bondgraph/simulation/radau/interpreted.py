"""The general step in CasADi's virtual machine, for machines without a compiler.

The same equations as the loop in C: Radau IIA with two stages, tangents by the implicit function
theorem. Newton's method takes a fixed number of steps from rest; its last correction tells failure.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from bondgraph.simulation.radau.native_source import SHARED, GeneralFunctions
from bondgraph.support.arrays import Array

NEWTON = 8
CONVERGED = 1e-8
STILL = 1e-12
"""Part of what forces of held laws would move within a step that is none, as in the loop in C."""
CHUNK = 128
NODES = (1 / 3, 1.0)
INVERSE = ((1.5, 0.5), (-4.5, 2.5))
"""Of the matrix of Butcher."""


@dataclass(frozen=True, slots=True)
class Carried:
    """What a step hands to the next one.

    Attributes
    ----------
    v : ndarray, shape (n_x + n_z,)
    m : ndarray, shape (n_m,)
    tv : ndarray, shape (n_x + n_z, n_d)
    tm : ndarray, shape (n_m, n_d)
    """

    v: Array
    m: Array
    tv: Array
    tm: Array


def machine_step(functions: GeneralFunctions, n_x: int, n_d: int) -> ca.Function:
    """One step ``(v, m, tv, tm, u0, u1, t, h, p, P) -> (v+, m+, tv+, tm+, correction, y, dy)``.

    P of shape (n_p, n_d) holds the directions among the parameters.
    """
    _, n_v, n_u, n_p, n_m, _ = (functions.stage.numel_in(i) for i in range(6))
    v, m = ca.MX.sym("v", n_v), ca.MX.sym("m", n_m)
    tv, tm = ca.MX.sym("tv", n_v, n_d), ca.MX.sym("tm", n_m, n_d)
    u0, u1 = ca.MX.sym("u0", n_u), ca.MX.sym("u1", n_u)
    t, h, p = ca.MX.sym("t"), ca.MX.sym("h"), ca.MX.sym("p", n_p)
    picked = ca.MX.sym("P", n_p, n_d)
    change = ca.diag(ca.vertcat(ca.DM.ones(n_x), ca.DM.zeros(n_v - n_x))) / h
    sign = ca.diag(ca.vertcat(-ca.DM.ones(n_x), ca.DM.ones(n_v - n_x)))
    held = functions.held
    shared = SHARED * ca.diag(ca.vertcat(ca.DM.zeros(n_v - held), ca.DM.ones(held)))

    def at(i: int, stage: ca.MX) -> tuple[ca.MX, ...]:
        return (t + NODES[i] * h, stage, u0 + NODES[i] * (u1 - u0), p, m, NODES[i] * h)

    begun = (v, m, tv, tm)
    if functions.jumps:  # inputs may have jumped to u0, and the memory follows in no time
        v, m, tv, tm = _followed(functions, begun, (t, u0, p), picked)
    stages, correction = [v, v], ca.MX.zeros(2 * n_v)
    matrix = ca.MX.zeros(2 * n_v, 2 * n_v)
    for _ in range(NEWTON if n_v else 0):
        rows, blocks = [], []
        for i in range(2):
            value, slope = functions.stage(*at(i, stages[i]))
            moved = INVERSE[i][0] * (stages[0] - v) + INVERSE[i][1] * (stages[1] - v)
            rows.append(change @ moved + sign @ value)
            parts = [INVERSE[i][0] * change, INVERSE[i][1] * change]
            parts[i] = parts[i] + sign @ slope + shared
            blocks.append(ca.horzcat(*parts))
        matrix = ca.densify(ca.vertcat(*blocks))
        correction = ca.solve(matrix, ca.vertcat(*rows), "csparse")
        stages = [stages[0] - correction[:n_v], stages[1] - correction[n_v:]]
    tangent = tv
    if n_d and n_v:
        rows = []
        for i in range(2):
            by_p, by_m = functions.seed(*at(i, stages[i]))
            seed = by_p @ picked + (by_m @ tm if n_m else 0)
            rows.append(sum(INVERSE[i]) * (change @ tv) - sign @ seed)
        tangent = ca.solve(matrix, ca.vertcat(*rows), "csparse")[n_v:, :]
    last = stages[1]
    if held:
        last, tangent = _rested(n_x, (v, tv), stages, tangent, h * slope, held)
    end = (t + h, last, u1, p, m, h)

    def moved_along(function: ca.Function) -> ca.MX:
        by_v, by_p, by_m = function(*end)
        total = by_p @ picked
        if n_v:
            total = total + by_v @ tangent
        return ca.densify(total + by_m @ tm if n_m else total)

    next_m = functions.advance(*end)
    next_tm = moved_along(functions.moving) if n_d and n_m else tm
    dy = moved_along(functions.slope) if n_d else ca.MX(functions.reading.numel_out(0), 0)
    arguments = [*begun, u0, u1, t, h, p, picked]
    results = [last, next_m, tangent, next_tm, correction, functions.reading(*end), dy]
    return _packed(ca.Function("step", arguments, results), n_v, n_m, n_d)


def _rested(
    n: int,
    begun: tuple[ca.MX, ca.MX],
    stages: list[ca.MX],
    tangent: ca.MX,
    slope: ca.MX,
    held: int,
) -> tuple[ca.MX, ca.MX]:
    """Return the end of a step; a motion that is held, and what follows it, do not move at all."""
    (v, tv), end = begun, stages[1]
    force = sum((ca.fabs(w[-held:]) for w in (v, *stages)), ca.MX(0))
    size = ca.fabs(slope[:n, -held:]) @ force
    least = STILL * (size + ca.fabs(slope[:n, :n]) @ size)
    moves = ca.fabs(end[:n]) > least
    same = ca.logic_and(moves, ca.fabs(end[:n] - v[:n]) <= least)
    goes = ca.logic_and(moves, ca.logic_not(same))

    def kept(ends: ca.MX, begins: ca.MX) -> ca.MX:
        wide = (1, ends.size2())
        first = ca.repmat(goes, *wide) * ends[:n, :] + ca.repmat(same, *wide) * begins[:n, :]
        return ca.vertcat(first, ends[n:, :])

    return kept(end, v), kept(tangent, tv) if tangent.size2() else tangent


Columns = tuple[ca.MX, ca.MX, ca.MX, ca.MX]


def _followed(
    functions: GeneralFunctions, begun: Columns, given: tuple[ca.MX, ca.MX, ca.MX], picked: ca.MX
) -> Columns:
    """Return what a step of no length makes of unknowns and memory, with their tangents."""
    v, m, tv, tm = begun
    t, u, p = given
    n_x, n_v = functions.n_x, v.numel()
    x, z = v[:n_x], v[n_x:]
    slope = ca.MX.zeros(n_v, n_v)
    for _ in range(NEWTON if n_v > n_x else 0):
        value, slope = functions.stage(t, ca.vertcat(x, z), u, p, m, 0)
        z = z - ca.solve(slope[n_x:, n_x:], value[n_x:], "csparse")
    v = ca.vertcat(x, z)
    at = (t, v, u, p, m, 0)
    if tv.size2() and n_v > n_x:
        by_p, by_m = functions.seed(*at)
        moved = slope[n_x:, :n_x] @ tv[:n_x, :] + (by_p @ picked + by_m @ tm)[n_x:, :]
        tv = ca.vertcat(tv[:n_x, :], -ca.solve(slope[n_x:, n_x:], moved, "csparse"))
    by_v, by_p, by_m = functions.moving(*at)
    followed = by_v @ tv + by_p @ picked + by_m @ tm if tv.size2() else tm
    return v, functions.advance(*at), tv, ca.densify(followed)


def _packed(step: ca.Function, n_v: int, n_m: int, n_d: int) -> ca.Function:
    """Return the step with one carried column, as an accumulation wants it."""
    sizes = (n_v, n_m, n_v * n_d, n_m * n_d)
    column = ca.MX.sym("z", sum(sizes))
    v, m, tv, tm = ca.vertsplit(column, [int(i) for i in np.cumsum([0, *sizes])])
    rest = step.mx_in()[4:]
    parts = step(v, m, ca.reshape(tv, n_v, n_d), ca.reshape(tm, n_m, n_d), *rest)
    carried = ca.vertcat(*[ca.vec(part) for part in parts[:4]])
    return ca.Function(
        "packed", [column, *rest], [carried, parts[4], ca.horzcat(parts[5], parts[6])]
    )


def machine_record(
    step: ca.Function,
    carried: Carried,
    time: float,
    h: float,
    n_sub: int,
    u: Array,
    p: Array,
    picked: Array,
    held: int = 0,
) -> tuple[Array, Carried, int]:
    """Run over sub-steps `u`, shape (n, 2, n_u).

    The `held` last unknowns need not stand still: contacts may share one force in many ways.

    Returns
    -------
    out : ndarray, shape (n // n_sub, n_y, 1 + n_d)
        Outputs and their derivatives.
    carried : Carried
    done : int
        Samples that are good.
    """
    n_v, n_m, n_d = carried.v.size, carried.m.size, carried.tv.shape[1]
    z = np.concatenate([carried.v, carried.m, carried.tv.ravel("F"), carried.tm.ravel("F")])
    n, k = u.shape[0], 0
    columns, corrections, outs = [], [], []
    many = step.mapaccum("record", CHUNK, 1)
    n_out = step.size2_out(2)
    while k < n:
        count = CHUNK if n - k >= CHUNK else 1
        times = time + h * np.arange(k, k + count)
        ends = (u[k : k + count, 0].T, u[k : k + count, 1].T, times[None, :])
        fixed = (np.full((1, count), h), np.tile(p[:, None], count), np.tile(picked, count))
        found = (many if count > 1 else step)(z, *ends, *fixed)
        states, correction, out = (np.asarray(a.full()) for a in found)
        columns.append(states[:n_v])
        corrections.append(np.abs(correction))
        outs.append(out.reshape(-1, count, n_out).transpose(1, 0, 2))
        z = states[:, -1]
        k += count
    done = n // n_sub
    if columns:
        path = np.abs(np.hstack([carried.v[:, None], *columns]))
        size = np.tile(path.max(axis=1, initial=0.0), 2)[:, None] + 1e-150
        left = np.hstack(corrections)
        left.reshape(2, n_v, -1)[:, n_v - held :] = 0.0
        bad = ~(np.isfinite(path[:, 1:]).all(axis=0) & (left <= CONVERGED * size).all(axis=0))
        if bad.any():
            done = int(np.argmax(bad)) // n_sub
    at = np.cumsum([n_v, n_m, n_v * n_d])
    v, m, tv, tm = np.split(z, at)
    last = Carried(v, m, tv.reshape(n_v, n_d, order="F"), tm.reshape(n_m, n_d, order="F"))
    whole = np.concatenate(outs) if outs else np.zeros((0, step.size1_out(2), n_out))
    return whole[n_sub - 1 :: n_sub], last, done
