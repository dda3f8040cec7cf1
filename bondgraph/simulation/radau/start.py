"""How a record of a `Program` starts: its inputs, its rest, its algebraic unknowns."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from bondgraph.equations.program import Program
from bondgraph.signals.recorded_rates import slopes
from bondgraph.simulation.radau.memory import relaxed_at
from bondgraph.simulation.radau.recorder import Key
from bondgraph.simulation.start import missing, own_input
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput, require_known

SOLVED = 1e-12
LOOSE = 1e-7
ROUNDING = 1e-15
BESIDE = 1e-6
"""Where an endless slope (of a root at zero) is left behind."""


def inputs_of(
    program: Program, commands: Mapping[str, Array], time: Array, breaks: Sequence[int] = ()
) -> Array:
    """Return the inputs at the samples, shape (N, n_u); rates are those of the linear pieces.

    Those of sources that are recorded by their integral are the slopes of a spline, a new one from
    each of `breaks` on.

    Raises
    ------
    UnknownName
        An input without a command, or a command without an input.
    UnusableInput
        A second derivative of a command is needed and not given.
    """
    known: Sequence[str] = program.inputs
    require_known("input", program.name, known, *commands)
    u = np.empty((time.size, len(known)))
    for i, name in enumerate(known):
        given = commands.get(name, own_input(name, time.size))
        if given is not None:
            u[:, i] = given
        elif name in program.input_rates:
            source = name.partition("_")[2]
            if source not in commands or not name.startswith("d_"):
                source = source.rpartition("_")[2] if source.startswith("d_") else source
                raise UnusableInput(
                    f"{program.name}: the equations need {name}, a higher derivative of an input; "
                    f"record the rate of {source}, or give {name!r} as a command"
                )
            if name in program.recorded:
                step = float(np.diff(time).mean()) if time.size > 1 else 1.0
                u[:, i] = slopes(commands[source], step, breaks)
                continue
            pieces = np.diff(np.asarray(commands[source], float)) / np.diff(time)
            u[:, i] = np.append(pieces, pieces[-1])
        else:
            raise missing(program.name, name, commands)
    return u


def rest(
    program: Program, u: Array, p: Array, *, memory: Array | None = None, time: float = 0.0
) -> tuple[Array, Array]:
    """Return the state and the algebraic unknowns at which nothing moves under inputs `u`.

    See `rests`.

    Raises
    ------
    BondsightError
        None is found; give ``x0``.
    """
    found = rests(program, u, p[None], memory=memory, time=time)[0]
    if np.isnan(found).any():
        raise BondsightError(
            f"{program.name}: no rest {'under these' if u.any() else 'with all'} inputs "
            f"{'' if u.any() else 'at zero '}is found to start from; give the initial state x0 "
            f"({', '.join(program.states)}), or x0='rest' for that under the first inputs"
        )
    n_x = len(program.states)
    return found[:n_x], found[n_x:]


def rests(
    program: Program,
    u: Array,
    p: Array,
    *,
    memory: Array | None = None,
    time: float = 0.0,
    held: int = 0,
) -> Array:
    """Return states and algebraic unknowns at rest under inputs `u`, shape (S, n_x + n_z).

    Newton's method on all of them at once, with the smallest correction where rest is not unique
    (a free mass). A pure integral of the inputs never rests and stays as it starts. Rows are NaN
    where none is found.

    Parameters
    ----------
    u : ndarray, shape (n_u,)
    p : ndarray, shape (S, n_p), SI
    held : int
        So many of the first states stay as they start, and their rates are not asked for.
    """
    # where nothing moves, no input does: not even one of which the recording begins with a slope
    u = np.where([n in program.input_rates for n in program.inputs], 0.0, u)
    m = np.array(program.virgin, float) if memory is None else memory
    begin = np.concatenate([np.array(program.start, float), np.array(program.guess, float)])
    v = np.tile(begin, (p.shape[0], 1))
    f = _balance(Key(program))
    still = np.ones(p.shape[0], bool)
    for _ in range(50 if begin.size > held else 0):
        r, j = evaluated(f, np.array([time]), v, u, p, m)
        r, j = r[:, held:, 0], j[:, held:, held:]
        good = np.isfinite(r).all(axis=1) & np.isfinite(j).all(axis=(1, 2))
        r, j = np.where(good[:, None], r, 0.0), np.where(good[:, None, None], j, 0.0)
        step, rows, columns = least_correction(r, j)
        v[:, held:] -= np.where(good[:, None], step, -BESIDE)
        scale = np.abs(v[:, held:] * columns).max(axis=1) + 1e-150
        arrived = np.abs(step * columns).max(axis=1) <= SOLVED * scale
        left = np.abs(r / rows).max(axis=1) / np.maximum(scale, 1e-3)
        still = good & arrived & (left <= 1e-9)
        if (good & arrived).all():
            break
    v[~still] = np.nan
    return v


def relaxed_rest(
    program: Program,
    u: Array,
    p: Array,
    memory: Array,
    kept: NDArray[np.bool_],
    *,
    quiet: bool = False,
) -> tuple[Array, Array, Array]:
    """Return state, algebraic unknowns and memory at rest, laws with memory relaxed there.

    Newton's method from the rest with `memory`, whose rows that are `kept` stay. Where it finds
    none, that rest itself is returned, and a warning says so unless it is to be `quiet`.

    Raises
    ------
    BondsightError
        No rest with `memory` is found; give ``x0``.
    """
    x, z = rest(program, u, p, memory=memory)
    if kept.all():
        return x, z, memory
    u = np.where([n in program.input_rates for n in program.inputs], 0.0, u)
    f, v, m = _balance(Key(program)), np.concatenate([x, z]), memory
    for _ in range(50):
        m, slope = relaxed_at(program, v, u, p, m)
        m, slope = np.where(kept, memory, m), np.where(kept[:, None], 0.0, slope)
        (r,), (j,) = evaluated(f, np.zeros(1), v[None], u, p, m)
        if not r.any():
            return v[: x.size], v[x.size :], m
        j = j + _by_memory(Key(program))(0.0, v, u, p, m).full() @ slope
        if not (np.isfinite(r).all() and np.isfinite(j).all()):
            break
        (step,), (rows,), (columns,) = least_correction(r[None, :, 0], j[None])
        v = v - step
        scale = np.abs(v * columns).max(initial=0.0) + 1e-150
        if np.abs(step * columns).max(initial=0.0) <= SOLVED * scale:
            if np.abs(r[:, 0] / rows).max(initial=0.0) > 1e-9 * max(scale, 1e-3):
                break
            return v[: x.size], v[x.size :], m
    if quiet:
        return x, z, memory
    warnings.warn(
        f"{program.name}: no rest with its laws relaxed is found "
        f"({', '.join(c.element for c in program.laws if c.law.n_memory)}); they start as if they "
        "had come there from zero",
        stacklevel=5,
    )
    return x, z, memory


def least_correction(r: Array, j: Array) -> tuple[Array, Array, Array]:
    """Return the smallest solutions of ``J d = r`` (S, n) and the scales of rows and columns.

    Rows and columns are scaled first: charges and momenta differ by many decades.
    """
    rows = np.abs(j).max(axis=2, initial=0.0)
    rows[rows == 0] = 1.0
    columns = np.abs(j / rows[:, :, None]).max(axis=1, initial=0.0)
    columns[columns == 0] = 1.0
    inverse = np.linalg.pinv(j / rows[:, :, None] / columns[:, None, :], rcond=1e-12)
    return (inverse @ (r / rows)[:, :, None])[:, :, 0] / columns, rows, columns


def evaluated(f: ca.Function, *arguments: Array) -> list[Array]:
    """Return the outputs of `f` (S, rows, columns) for arguments (S, n), or (n,) for all."""
    many = max(len(a) for a in arguments if a.ndim == 2)
    made = (f if many == 1 else f.map(many)).call([ca.DM(a.T) for a in arguments])
    return [
        np.asarray(m.full(), float).reshape(f.size1_out(i), many, -1).transpose(1, 0, 2)
        for i, m in enumerate(made)
    ]


@lru_cache(maxsize=64)
def _balance(key: Key) -> ca.Function:
    """Return ``(t, v, u, p, m) -> rates and residuals, their derivatives by v``.

    The rate of a pure integral of the inputs counts as none.
    """
    arguments, r = _balanced(key.program)
    return ca.Function("f", arguments, [ca.densify(r), ca.densify(ca.jacobian(r, arguments[1]))])


@lru_cache(maxsize=64)
def _by_memory(key: Key) -> ca.Function:
    """Return ``(t, v, u, p, m) ->`` the derivatives of rates and residuals by the memory."""
    arguments, r = _balanced(key.program)
    return ca.Function("f", arguments, [ca.densify(ca.jacobian(r, arguments[4]))])


def _balanced(q: Program) -> tuple[list[ca.SX], ca.SX]:
    """Return the symbols ``t, v, u, p, m``, and rates and residuals in them."""
    n_x, n_z = len(q.states), len(q.algebraic)
    t, v, m = ca.SX.sym("t"), ca.SX.sym("v", n_x + n_z), ca.SX.sym("m", len(q.memory))
    u, p = ca.SX.sym("u", len(q.inputs)), ca.SX.sym("p", len(q.parameters))
    arguments = (t, v[:n_x], v[n_x:], u, p, m, 0.0)
    rates, residuals = q.rhs(*arguments)[0], q.residual(*arguments)
    read = set(ca.jacobian(rates, v).sparsity().row())
    r = ca.vertcat(*(rates[i] if i in read else 0.0 for i in range(n_x)), residuals)
    return [t, v, u, p, m], r


@lru_cache(maxsize=64)
def _loop(key: Key) -> ca.Function:
    """Return ``(t, x, z, u, p, m) -> residuals, derivatives by z, what they are summed of``."""
    q = key.program
    sizes = (1, *(len(n) for n in (q.states, q.algebraic, q.inputs, q.parameters, q.memory)))
    arguments = [ca.SX.sym(n, k) for n, k in zip("txzupm", sizes, strict=True)]
    g = q.residual(*arguments, 0.0)
    known = ca.vertcat(*arguments[1:5])
    size = ca.fabs(ca.jacobian(g, known)) @ ca.fabs(known)
    slope = ca.jacobian(g, arguments[2])
    return ca.Function("g", arguments, [ca.densify(c) for c in (g, slope, size)])


def unknowns_at(program: Program, t: float, x: Array, u: Array, p: Array, memory: Array) -> Array:
    """Return the algebraic unknowns that belong to a state, shape (n_z,).

    Raises
    ------
    BondsightError
        The loop has no solution there, or Newton's method does not find it.
    """
    if not program.algebraic:
        return np.zeros(0)
    from scipy.optimize import root

    loop = _loop(Key(program))

    def f(z: Array) -> tuple[Array, Array, Array]:
        residual, slope, size = (a.full() for a in loop(t, x, z, u, p, memory))
        return residual.ravel(), slope, size.ravel()

    found = root(
        lambda z: f(z)[:2],
        np.array(program.guess, float),
        jac=True,
        method="hybr",
        options={"xtol": 1e-13},
    )
    value, best = np.asarray(found.x, float), np.inf
    for _ in range(30):
        # the residual decides, not the solver's flag: Newton's correction must vanish, or it is
        # rounding (of a current that begins at zero, nothing else is small)
        residual, jacobian, of = f(value)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            break
        update = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        size = float(np.abs(update / (np.abs(value) + 1e-150)).max())
        rounded = bool((np.abs(residual) <= ROUNDING * of).all())
        if size <= SOLVED or rounded or (size >= best and best <= LOOSE):
            return value
        best = min(size, best)
        value = value - update
    raise BondsightError(
        f"{program.name}: the algebraic loop of {', '.join(program.algebraic)} has no solution "
        "at the start; give another x0"
    )
