"""A record through CVODES or IDAS of SUNDIALS, for those who want another integrator than ours.

Between two accepted steps CasADi's integrator runs on its own error control, anew from each: there
inputs turn, and memory is replaced. Time runs from 0 to 1, states and algebraic unknowns are
measured in their own size (a charge of 1e-6 C beside a field of 1e5 V/m), so that one tolerance
serves all. IDAS keeps algebraic unknowns open; for CVODES, and beside laws with corners, they are
solved at every evaluation.

Laws whose memory obeys a differential equation in time are states (`bondgraph.simulation.flowing`):
nothing is approximated but by the tolerance. Every other memory is that of the last accepted step,
as everywhere here: a turn within a step is seen at its end. For plays and other memories of the
argument alone the error is of second order in the step; steps are halved until outputs settle.

Hindmarsh et al., ACM Trans. Math. Software 31 (2005) 363.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, replace
from io import StringIO
from typing import Any, Final, final

import casadi as ca
import numpy as np

from bondgraph.equations.program import LawCall, Program
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Switched
from bondgraph.simulation.exact_run import LARGEST, Memories, relative_change
from bondgraph.simulation.flowing import flowing
from bondgraph.simulation.posing import Posed, pose
from bondgraph.simulation.radau.interpreted import Carried
from bondgraph.simulation.radau.memory import arguments_of, relaxed_memory
from bondgraph.simulation.radau.native import (
    PreparedGeneral,
    inputs_between,
    jumping,
    run_general,
)
from bondgraph.simulation.radau.recorder import Order
from bondgraph.simulation.radau.start import unknowns_at
from bondgraph.simulation.start import even_grid
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput

FINER: Final = 1e-3
"""Tolerance of the integrator over the accuracy asked for: errors of many steps add up."""
TIGHTEST: Final = 1e-12
PROBES: Final = (1, 4, 16)
SOLVED: Final = 1e-12
"""Correction of an algebraic unknown over its size, below which it is solved."""
GRID: Final = np.arange(1, 9) / 8
"""Parts of a step at which turns are looked for."""
NEAR: Final = 1e-6
"""Part of a step below which a turn is at its end."""
MOST_STEPS: Final = 100_000
"""Between two accepted ones."""


@dataclass(frozen=True, eq=False)
class Accepted:
    """Where an accepted step ended: time, state, algebraic unknowns, memory."""

    t: float
    x: Array
    z: Array
    m: Array


def simulate_sundials(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None,
    parameters: Mapping[str, float] | None,
    integrator: str,
    *,
    x0: object = None,
    relaxed: bool = False,
    hold: str = "linear",
    accuracy: float = 1e-4,
    observed: Sequence[str] = (),
    memory: Memories | None = None,
) -> Trajectory:
    """Simulate `graph` with an integrator of SUNDIALS; `bondgraph.simulate` calls it.

    Parameters
    ----------
    integrator : {"cvodes", "idas"}
    relaxed : bool
        Whether memory starts at rest at the first arguments, as with the exact step.

    Raises
    ------
    UnusableInput
        What it cannot carry: laws that jump, switched junctions, a model without states.
    BondsightError
        It gave up, or the outputs do not settle.
    """
    asked = pose(graph, even_grid(graph.name, time), commands, parameters, observed)
    _require_smooth(graph, asked.program, integrator)
    begin = _begin(asked, x0, memory, relaxed)
    program = flowing(asked.program)
    rows = [program.memory.index(n) for n in program.states[len(begin.x) :]]
    begin = replace(begin, x=np.concatenate([begin.x, begin.m[rows]]))
    size = _sizes(program, asked, begin, hold)
    stepper = Stepper(
        integrator,
        program,
        asked.p,
        size,
        _integrator(program, integrator, size, max(FINER * accuracy, TIGHTEST)),
        _unknowns(program, size),
        _turning(asked.program, program),
    )
    at_once = _settles_at_once(program, hold)
    n_sub, last, steps = (2 if hold == "band-limited" else 1), None, 0
    while n_sub <= LARGEST:
        # what IDAS writes there on its own, the error says
        with redirect_stderr(StringIO()):
            y, end, count = _run(stepper, asked, begin, hold, n_sub)
        steps += count
        watched = y[:, asked.columns]
        if at_once or (last is not None and relative_change(last, watched) < accuracy):
            return Trajectory(
                graph.name, np.asarray(time, float), asked.outputs(y), {}, n_sub,
                end.x[: len(asked.program.states)], program.memory_by_law(end.m),
                asked.program.states, inner_steps=steps,
            )  # fmt: skip
        last, n_sub = watched, 2 * n_sub
    raise BondsightError(
        f"{graph.name}: with {integrator} the outputs do not settle within {LARGEST} accepted "
        "steps a sample: the memory of its laws is followed too coarsely; sample faster, or leave "
        "integrator out"
    )


def _require_smooth(graph: BondGraph, program: Program, integrator: str) -> None:
    if switches := [e.name for e in graph.of_type(Switched)]:
        raise UnusableInput(
            f"{graph.name}: {', '.join(switches)} can switch, across which {integrator} cannot "
            "integrate; use simulate_modes, or simulate one mode, in_mode(graph, ...)"
        )
    if jumps := jumping(program):
        raise UnusableInput(
            f"{graph.name}: {', '.join(jumps)} has a law that jumps, across which "
            f"{integrator} cannot integrate; leave integrator out, or, where it is friction that "
            "sticks, use LuGre or DahlFriction"
        )
    if not program.states:
        raise UnusableInput(
            f"{graph.name}: it has no states, so {integrator} has nothing to integrate; leave "
            "integrator out"
        )


def _settles_at_once(program: Program, hold: str) -> bool:
    """Whether nothing depends on the length of the accepted steps."""
    kept = any(c.law.n_memory and not c.law.flows for c in program.laws)
    beside = program.memory and not any(n in program.states for n in program.memory)
    return not (kept or beside or program.recorded or hold == "band-limited")


def _begin(asked: Posed, x0: object, memory: Memories | None, relaxed: bool) -> Accepted:
    q = asked.program
    m, given = q.start_memory(memory)
    x, z = asked.start(x0, m)
    if relaxed and not given.all():
        nothing = np.zeros((0, 0))
        order = Order(asked.at, 0.0, 1, asked.p, (), asked.u[0], nothing)
        width = np.zeros((x.size + z.size, 0)), np.zeros((m.size, 0))
        rest, _ = relaxed_memory(q, order, Carried(np.concatenate([x, z]), m, *width))
        m = np.where(given, m, rest)
        z = unknowns_at(q, asked.at, x, asked.u[0], asked.p, m)
    return Accepted(asked.at, x, z, m)


def _sizes(program: Program, asked: Posed, begin: Accepted, hold: str) -> Array:
    """Return the largest value of every state and algebraic unknown, by our own coarse run."""
    ins, labels = program.rhs.sx_in(), program.rhs.name_in()
    inner = ca.vertcat(ins[1], ins[2])
    everything = replace(
        program,
        outputs=(*program.states, *program.algebraic),
        rhs=ca.Function("rhs", ins, [program.rhs(*ins)[0], inner], labels, ["dx", "y"]),
    )
    size = np.abs(np.concatenate([begin.x, begin.z]))
    memory = program.memory_by_law(begin.m)
    for n_sub in PROBES:
        ready = PreparedGeneral(everything, asked.p, asked.step, n_sub, (), False, False)
        made = run_general(
            ready, asked.u, begin.x, hold, memory=memory, time=asked.at, unknowns=begin.z
        )
        good = made.y[np.isfinite(made.y).all(axis=1)]
        size = np.maximum(size, np.abs(good).max(axis=0, initial=0.0))
        if made.settled:
            break
    return np.where(size > 0.0, size, 1.0)


def _unknowns(program: Program, size: Array) -> ca.Function:
    """Return ``(t, x, z_guess, u, p, m, h) -> z``, without a line search.

    A guess is an accepted value, where plays have a corner: CasADi's line search, which asks for
    half of what the slope there promises, ends there.
    """
    v = [ca.SX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    own = size[len(program.states) :]
    given = ca.vertcat(*v[:2], *v[3:])
    problem = {"x": v[2], "p": given, "g": program.residual(*v[:2], own * v[2], *v[3:])}
    options = {"line_search": False, "abstol": 0.0, "abstolStep": SOLVED, "max_iter": 100}
    w = [ca.MX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    z = w[2]
    if own.size:
        solver = ca.rootfinder("unknowns", "newton", problem, options)
        z = own * solver(x0=z / own, p=ca.vertcat(*w[:2], *w[3:]))["x"]
    return ca.Function("unknowns", w, [z])


def _integrator(program: Program, plugin: str, size: Array, tolerance: float) -> ca.Function:
    """Return a step over local time, states and unknowns in their own size, at every `GRID`."""
    n_x, n_z = len(program.states), len(program.algebraic)
    # at a turn Newton's method of IDAS has two slopes to choose from, and no line to its solution
    solved = plugin == "cvodes" or any(not c.law.timed for c in _kept(program))
    kind: Any = ca.MX if n_z and solved else ca.SX
    shapes = {n: program.rhs.size_in(n) for n in program.rhs.name_in()}
    t, x, z, u, p, m, length = (kind.sym(n, *s) for n, s in shapes.items())
    last, part, guess = kind.sym("u1", *shapes["u"]), kind.sym("part"), kind.sym("z0", n_z)
    since = part * length
    at, now = (t + since, size[:n_x] * x), (u + (last - u) * part, p, m, since)
    problem = {"t": part, "x": x, "p": ca.vertcat(t, length, u, last, p, m, guess)}
    inner = size[n_x:] * z
    if kind is ca.MX:
        inner = _unknowns(program, size)(*at, guess, *now)
    elif n_z:
        problem |= {"z": z, "alg": program.residual(*at, inner, *now)}
    problem["ode"] = length * program.rhs(*at, inner, *now)[0] / size[:n_x]
    options = {
        "abstol": tolerance, "reltol": tolerance, "max_num_steps": MOST_STEPS,
        "disable_internal_warnings": True, "show_eval_warnings": False,
    }  # fmt: skip
    if plugin == "idas":  # their slope is not known at the start; they follow from the states
        options["suppress_algebraic"] = True
    return ca.integrator("accepted", plugin, problem, 0.0, GRID, options)


def _turning(base: Program, program: Program) -> ca.Function | None:
    """Return ``(t, x, z, u, p, m, h, du/dt) -> ds/dt`` of laws that must see every turn.

    They are those with a memory of the argument alone; None without any.
    """
    at = [i for i, c in enumerate(_kept(base)) if not c.law.timed]
    if not at:
        return None
    v = t, x, z, u, p, m, h = [ca.SX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    du, whole, n = ca.SX.sym("du", u.numel()), ca.SX(m), len(base.states)
    whole[[program.memory.index(name) for name in program.states[n:]]] = x[n:]
    inside = (t, ca.vertcat(x[:n], z), u, p, whole, 0.0 if program is not base else h)
    s, g = arguments_of(base)(*inside)[0][at], program.residual(*v)
    moving = ca.vertcat(t, x, u, h)
    rates = ca.vertcat(1.0, program.rhs(*v)[0], du, 1.0)
    total = ca.jtimes(s, moving, rates)
    if z.numel():
        followed = ca.solve(ca.jacobian(g, z), -ca.jtimes(g, moving, rates))
        total += ca.jtimes(s, z, followed)
    return ca.Function("turning", [*v, du], [ca.densify(total)])


def _kept(program: Program) -> list[LawCall]:
    return [c for c in program.laws if c.law.n_memory]


@final
@dataclass(frozen=True, eq=False)
class Stepper:
    """One accepted step after the other.

    Attributes
    ----------
    plugin : {"cvodes", "idas"}
    program : Program
        With memories that flow as states.
    p : ndarray, shape (n_p,), SI
    size : ndarray, shape (n_x + n_z,)
        Of states and algebraic unknowns.
    integrate, unknowns, turning : casadi.Function
        See `_integrator`, `_unknowns`, `_turning`.
    """

    plugin: str
    program: Program
    p: Array
    size: Array
    integrate: ca.Function
    unknowns: ca.Function
    turning: ca.Function | None

    def onward(self, a: Accepted, h: float, left: Array, right: Array) -> tuple[Accepted, int]:
        """Go `h` seconds on, inputs from `left` to `right`; accept a step at every turn."""
        slope, end, steps, turned = (right - left) / h, a.t + h, 0, False
        while True:
            rest = end - a.t
            x, z, count = self._grid(a, rest, right - slope * rest, right)
            steps += count
            part = self._turn(a, rest, x, z, right - slope * rest, slope, turned)
            if part is None:
                break
            u = right - slope * (rest * (1.0 - part))
            x, z, count = self._grid(a, rest * part, right - slope * rest, u)
            steps += count
            a, turned = self._accept(a, rest * part, x[:, -1], z[:, -1], u), True
        return replace(self._accept(a, rest, x[:, -1], z[:, -1], right), t=end), steps

    def reading(self, a: Accepted, u: Array, memory: Array, h: float) -> Array:
        """Return the outputs where a step ended, with the `memory` of its start, `h` s ago."""
        return _flat(self.program.rhs(a.t, a.x, a.z, u, self.p, memory, h)[1])

    def _grid(self, a: Accepted, h: float, left: Array, right: Array) -> tuple[Array, Array, int]:
        """Return states and unknowns at the parts `GRID` of a step, a column each."""
        n_x = a.x.size
        p = np.concatenate([[a.t, h], left, right, self.p, a.m, a.z])
        opened = bool(self.integrate.size1_in("z0"))
        begun = {"z0": a.z / self.size[n_x:]} if opened else {}
        made = self.integrate(x0=a.x / self.size[:n_x], p=p, **begun)
        x = np.asarray(made["xf"].full()) * self.size[:n_x, None]
        z = np.tile(a.z[:, None], GRID.size)
        if opened:
            z = np.asarray(made["zf"].full()) * self.size[n_x:, None]
        if a.z.size:
            u = left[:, None] + (right - left)[:, None] * GRID
            z = np.asarray(self._each(self.unknowns, a, h, x, z, u).full())
        return x, z, int(self.integrate.stats()["nsteps"])

    def _each(
        self, f: ca.Function, a: Accepted, h: float, x: Array, z: Array, u: Array, *more: Any
    ) -> ca.DM:
        since = h * GRID[None, :]
        return f.map(GRID.size)(a.t + since, x, z, u, self.p, a.m, since, *more)

    def _accept(self, a: Accepted, h: float, x: Array, z: Array, u: Array) -> Accepted:
        m = self.program.advance(a.t + h, x, z, u, self.p, a.m, h)
        return Accepted(a.t + h, x, z, _flat(m))

    def _turn(
        self, a: Accepted, h: float, x: Array, z: Array, left: Array, slope: Array, turned: bool
    ) -> float | None:
        """Return the part of the step after which an argument turns first, by a line between two.

        An error of the place is squared in the argument there.
        """
        if self.turning is None:
            return None
        u = left[:, None] + slope[:, None] * (h * GRID)
        rate = np.asarray(self._each(self.turning, a, h, x, z, u, slope).full())
        first = _flat(self.turning(a.t, a.x, a.z, left, self.p, a.m, 0.0, slope))
        if turned:  # it turns right here
            first = np.where(np.abs(first) < np.abs(rate[:, 0]), rate[:, 0], first)
        rate, at = np.column_stack([first, rate]), np.concatenate([[0.0], GRID])
        parts = [
            at[k] + (at[k + 1] - at[k]) * r[k] / (r[k] - r[k + 1])
            for r in rate
            for k in np.flatnonzero(r[:-1] * r[1:] < 0.0)[:1]
        ]
        soonest = min(parts, default=1.0)
        return soonest if NEAR < soonest < 1.0 - NEAR else None


def _run(
    stepper: Stepper, asked: Posed, begin: Accepted, hold: str, n_sub: int
) -> tuple[Array, Accepted, int]:
    """Run over the record with `n_sub` steps a sample; outputs, end and steps inside."""
    ready = PreparedGeneral(stepper.program, asked.p, asked.step, n_sub, (), False, False)
    u, fine = inputs_between(ready, asked.u, hold)
    h, a, steps = asked.step / n_sub, begin, 0
    rows = [stepper.reading(a, u[0], a.m, 0.0)]
    for k, (left, right) in enumerate(fine):
        try:
            if hold == "hold" and a.z.size:  # inputs jump here, and unknowns with them
                z = stepper.unknowns(a.t, a.x, a.z, left, asked.p, a.m, 0.0)
                a = replace(a, z=_flat(z))
            made, count = stepper.onward(a, h, left, right)
        except RuntimeError as error:
            raise BondsightError(
                f"{stepper.program.name}: {stepper.plugin} gave up after "
                f"{a.t:.6g} s ({_said(error)}); sample faster, ask for less accuracy, take the "
                "other integrator, or leave it out"
            ) from None
        made, steps = replace(made, t=asked.at + (k + 1) * h), steps + count
        if (k + 1) % n_sub == 0:
            rows.append(stepper.reading(made, right, a.m, h))
        a = made
    return np.array(rows), a, steps


def _flat(column: ca.DM) -> Array:
    return np.asarray(column.full(), float).ravel()


def _said(error: RuntimeError) -> str:
    found = re.search(r"\b((?:CV|IDA)_[A-Z_]+)", str(error))
    return found[1] if found else "its algebraic loop is not solved there"
