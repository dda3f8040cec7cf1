"""How a record of a `Program` starts: its inputs, its rest, its algebraic unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.simulation.start import own_input
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name

__all__ = ["inputs_of", "rest", "unknowns_at"]

Array = np.ndarray

SOLVED = 1e-12
LOOSE = 1e-7


def inputs_of(program: Program, commands: Mapping[str, Array], time: Array) -> Array:
    """Return the inputs at the samples, shape (N, n_u); rates are those of the linear pieces.

    Raises
    ------
    UnknownName
        An input without a command, or a command without an input.
    UnusableInput
        A second derivative of a command is needed and not given.
    """
    known: Sequence[str] = program.inputs
    for name in commands:
        if name not in known:
            raise unknown_name("input", name, program.name, known)
    u = np.empty((time.size, len(known)))
    for i, name in enumerate(known):
        given = commands.get(name, own_input(name, time.size))
        if given is not None:
            u[:, i] = given
        elif name in program.input_rates:
            source = name.partition("_")[2]
            if source not in commands or not name.startswith("d_"):
                raise UnusableInput(
                    f"{program.name}: the equations need {name}, a higher derivative of an input; "
                    f"give it as a command called {name!r}"
                )
            pieces = np.diff(np.asarray(commands[source], float)) / np.diff(time)
            u[:, i] = np.append(pieces, pieces[-1])
        else:
            raise unknown_name("command for the input", name, "the commands", list(commands))
    return u


def rest(
    program: Program, u: Array, p: Array, *, memory: Array | None = None, time: float = 0.0
) -> tuple[Array, Array]:
    """Return the state and the algebraic unknowns at which nothing moves under inputs `u`.

    Newton's method with the smallest correction where rest is not unique (a free mass).

    Raises
    ------
    BondsightError
        None is found; give ``x0``.
    """
    n_x, n_z = len(program.states), len(program.algebraic)
    v = ca.SX.sym("v", n_x + n_z)
    m = np.array(program.virgin, float) if memory is None else memory
    arguments = (time, v[:n_x], v[n_x:], u, p, m, 0.0)
    residual = ca.vertcat(program.rhs(*arguments)[0], program.residual(*arguments))
    f = ca.Function("f", [v], [ca.densify(residual), ca.densify(ca.jacobian(residual, v))])
    guess = np.concatenate([np.array(program.start, float), np.array(program.guess, float)])
    for _ in range(50):
        r, j = (a.full() for a in f(guess))
        r = r.ravel()
        if not np.isfinite(r).all() or not np.isfinite(j).all():
            break
        rows = np.abs(j).max(axis=1, initial=0.0)
        rows[rows == 0] = 1.0
        columns = np.abs(j / rows[:, None]).max(axis=0, initial=0.0)
        columns[columns == 0] = 1.0
        scaled = j / rows[:, None] / columns[None, :]
        update = np.linalg.lstsq(scaled, r / rows, rcond=1e-12)[0] / columns
        guess = guess - update
        size = np.abs(guess) + 1e-300
        if np.all(np.abs(update) <= 1e-12 * np.maximum(size, np.abs(columns * 0) + 1e-150)):
            left = np.abs(np.asarray(f(guess)[0].full()).ravel() / rows).max(initial=0.0)
            scale = np.abs(guess * columns).max(initial=0.0) + 1e-150
            if left <= 1e-9 * scale or left < 1e-12:
                return guess[:n_x], guess[n_x:]
            break
    raise BondsightError(
        f"{program.name}: no rest under the first inputs is found to start from; give the initial "
        f"state x0 ({', '.join(program.states)})"
    )


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

    z = ca.SX.sym("z", len(program.algebraic))
    g = program.residual(t, x, z, u, p, memory, 0.0)
    f = ca.Function("g", [z], [ca.densify(g), ca.densify(ca.jacobian(g, z))])
    found = root(
        lambda v: f(v)[0].full().ravel(),
        np.array(program.guess, float),
        jac=lambda v: f(v)[1].full(),
        method="hybr",
        options={"xtol": 1e-13},
    )
    value, best = np.asarray(found.x, float), np.inf
    for _ in range(30):
        # the residual decides, not the solver's flag: Newton's correction must vanish
        residual, jacobian = (a.full() for a in f(value))
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            break
        update = np.linalg.lstsq(jacobian, residual.ravel(), rcond=None)[0]
        size = float(np.abs(update / (np.abs(value) + 1e-150)).max())
        if size <= SOLVED or (size >= best and best <= LOOSE):
            return value
        best = min(size, best)
        value = value - update
    raise BondsightError(
        f"{program.name}: the algebraic loop of {', '.join(program.algebraic)} has no solution "
        "at the start; give another x0"
    )
