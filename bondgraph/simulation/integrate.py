"""General integrator: any `Program`, stiff, with algebraic unknowns and memory.

Radau IIA with two stages: order 3, L-stable, stiffly accurate (Hairer and Wanner, Solving
Ordinary Differential Equations II, 1996, sec. IV.5), so stiffness asks for nothing and algebraic
unknowns are exact at the end of every step. Newton's method takes a fixed number of steps, which
makes it blind to the scales of the variables; the last correction is measured and must vanish.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name

__all__ = ["IntegratedSolution", "inputs_of", "integrate", "rest"]

Array = np.ndarray

NEWTON = 5
CONVERGED = 1e-6
SOLVED = 1e-12
LOOSE = 1e-7
LARGEST = 256
A = ((5 / 12, -1 / 12), (3 / 4, 1 / 4))
NODES = (1 / 3, 1.0)


@dataclass(frozen=True, slots=True)
class IntegratedSolution:
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


def integrate(
    program: Program,
    time: Array,
    u: Array,
    p: Array,
    *,
    x0: Array | None = None,
    memory: Array | None = None,
    accuracy: float = 1e-4,
) -> IntegratedSolution:
    """Integrate over even samples; sub-steps double until the outputs settle.

    Parameters
    ----------
    time : ndarray, shape (N,), s
    u : ndarray, shape (N, n_u)
        Inputs at the samples, linear in between; input rates included.
    p : ndarray, shape (n_p,)
    x0 : ndarray, shape (n_x,), optional
        The rest under the first inputs when not given.
    memory : ndarray, shape (n_m,), optional
        Virgin when not given.
    accuracy : float
        Largest change of an output (of a state without outputs) by the last doubling, relative to
        its range.

    Raises
    ------
    BondsightError
        No rest, no convergence, or the outputs do not settle within 256 sub-steps.
    """
    m0 = np.array(program.virgin if memory is None else memory, float)
    start, z0 = _start(program, float(time[0]), u[0], p, x0, m0)
    step = float(np.diff(time).mean())
    run = _Runner(program)
    last: IntegratedSolution | None = None
    n_sub = 1
    while n_sub <= LARGEST:
        made, bad = run(time, step, u, p, start, z0, m0, n_sub)
        if made is not None and last is not None and _change(last, made) < accuracy:
            return made
        last, n_sub = made, 2 * n_sub
    where = f" near {time[0] + bad * step:.6g} s" if last is None else ""
    what = "Newton's method does not converge" if last is None else "the outputs do not settle"
    jumps = [c.element for c in program.laws if c.law.set_valued]
    if jumps:
        what += f" ({', '.join(jumps)} has a law that jumps, which a smooth step cannot follow)"
    raise BondsightError(
        f"{program.name}: {what}{where} within {LARGEST} sub-steps a sample; sample faster, start "
        "closer (x0=), or check that the model has a solution there"
    )


def _change(a: IntegratedSolution, b: IntegratedSolution) -> float:
    first, second = (v.y if v.y.shape[1] else v.x for v in (a, b))
    floor = np.maximum(1e-12 * np.abs(second).max(axis=0, initial=0.0), 1e-150)
    span = np.maximum(np.ptp(second, axis=0), floor)
    return float(np.sqrt(np.mean(((second - first) / span) ** 2, axis=0)).max(initial=0.0))


def _start(
    program: Program, t: float, u: Array, p: Array, x0: Array | None, memory: Array
) -> tuple[Array, Array]:
    if x0 is None:
        return rest(program, u, p, memory=memory, time=t)
    start = np.asarray(x0, float)
    n = len(program.states)
    if start.shape != (n,) or not np.isfinite(start).all():
        raise UnusableInput(
            f"{program.name}: x0 has shape {start.shape}; it needs {n} finite numbers, one a "
            f"state: {', '.join(program.states)}"
        )
    return start, _consistent(program, t, start, u, p, memory)


def _consistent(program: Program, t: float, x: Array, u: Array, p: Array, memory: Array) -> Array:
    """Algebraic unknowns that belong to a state."""
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


class _Runner:
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
    ) -> tuple[IntegratedSolution | None, int]:
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
        return IntegratedSolution(x, z, y, states[n:, -1] if n_steps else m0, n_sub), 0


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
        if name in commands:
            u[:, i] = commands[name]
        elif name == "one":
            u[:, i] = 1.0
        elif re.fullmatch(r"ramp\d*", name):
            u[:, i] = np.linspace(0.0, 1.0, time.size) ** int(name[4:] or 1)
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
