"""A record through CVODES or IDAS of SUNDIALS, for those who want another integrator than ours.

Between two accepted steps CasADi's integrator runs on its own error control, anew from each: there
inputs turn, and memory is replaced. Time runs from 0 to 1, states and algebraic unknowns are
measured in their own size (a charge of 1e-6 C beside a field of 1e5 V/m), so that one tolerance
serves all. IDAS keeps algebraic unknowns open, for CVODES they are solved at every evaluation.

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
from typing import Any, Final

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Switched
from bondgraph.simulation.exact_run import LARGEST, Memories, relative_change
from bondgraph.simulation.flowing import flowing
from bondgraph.simulation.posing import Posed, pose
from bondgraph.simulation.radau.interpreted import Carried
from bondgraph.simulation.radau.memory import relaxed_memory
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
MOST_STEPS: Final = 100_000
"""Between two accepted ones."""


@dataclass(frozen=True, eq=False)
class SundialsStart:
    """Where a record begins: state, algebraic unknowns, memory."""

    x: Array
    z: Array
    m: Array


@dataclass(frozen=True, eq=False)
class SundialsRun:
    """One pass over a record: outputs (N, n_y), state and memory at its end, steps inside."""

    y: Array
    x: Array
    m: Array
    steps: int


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
    states = len(program.states) - len(begin.x)
    if states:  # memories that became states
        rows = [program.memory.index(n) for n in program.states[-states:]]
        begin = replace(begin, x=np.concatenate([begin.x, begin.m[rows]]))
    size = _sizes(program, asked, begin, hold)
    inside = _integrator(program, integrator, size, max(FINER * accuracy, TIGHTEST))
    unknowns = _unknowns(program, size)
    settled = _settles_at_once(program, hold)
    n_sub, last, steps = (2 if hold == "band-limited" else 1), None, 0
    while n_sub <= LARGEST:
        # what IDAS writes there on its own, the error says
        with redirect_stderr(StringIO()):
            made = _run(program, inside, unknowns, integrator, asked, begin, size, hold, n_sub)
        steps += made.steps
        if settled or (
            last is not None
            and relative_change(last.y[:, asked.columns], made.y[:, asked.columns]) < accuracy
        ):
            return Trajectory(
                graph.name, np.asarray(time, float), asked.outputs(made.y), {}, n_sub,
                made.x[: len(asked.program.states)], program.memory_by_law(made.m),
                asked.program.states, inner_steps=steps,
            )  # fmt: skip
        last, n_sub = made, 2 * n_sub
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
            f"{graph.name}: {', '.join(jumps)} has a law that jumps (it sticks), across which "
            f"{integrator} cannot integrate; leave integrator out, or use LuGre or DahlFriction"
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


def _begin(asked: Posed, x0: object, memory: Memories | None, relaxed: bool) -> SundialsStart:
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
    return SundialsStart(x, z, m)


def _sizes(program: Program, asked: Posed, begin: SundialsStart, hold: str) -> Array:
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
    """Return an accepted step over local time 0 to 1, states and unknowns in their own size."""
    n_x, n_z = len(program.states), len(program.algebraic)
    kind: Any = ca.MX if n_z and plugin == "cvodes" else ca.SX
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
    return ca.integrator("accepted", plugin, problem, 0.0, 1.0, options)


def _run(
    program: Program,
    inside: ca.Function,
    unknowns: ca.Function,
    plugin: str,
    asked: Posed,
    begin: SundialsStart,
    size: Array,
    hold: str,
    n_sub: int,
) -> SundialsRun:
    """Run over the record with `n_sub` accepted steps a sample."""
    ready = PreparedGeneral(program, asked.p, asked.step, n_sub, (), False, False)
    u, fine = inputs_between(ready, asked.u, hold)
    h, p, n_x = asked.step / n_sub, asked.p, begin.x.size
    t, x, z, m, steps = asked.at, begin.x, begin.z, begin.m, 0
    y = np.empty((u.shape[0], len(program.outputs)))
    y[0] = _flat(program.rhs(t, x, z, u[0], p, m, 0.0)[1])
    for k, (left, right) in enumerate(fine):
        try:
            if hold == "hold":  # inputs jump here, and unknowns with them
                z = _flat(unknowns(t, x, z, left, p, m, 0.0))
            begun = {"z0": z / size[n_x:]} if inside.size1_in("z0") else {}
            made = inside(
                x0=x / size[:n_x], p=np.concatenate([[t, h], left, right, p, m, z]), **begun
            )
            x, steps = _flat(made["xf"]) * size[:n_x], steps + inside.stats()["nsteps"]
            near = _flat(made["zf"]) * size[n_x:] if begun else z
            z = _flat(unknowns(asked.at + (k + 1) * h, x, near, right, p, m, h))
        except RuntimeError as error:
            raise BondsightError(
                f"{program.name}: {plugin} gave up after {t:.6g} s ({_said(error)}); sample faster, "
                "ask for less accuracy, take the other integrator, or leave it out"
            ) from None
        t = asked.at + (k + 1) * h
        if (k + 1) % n_sub == 0:
            y[(k + 1) // n_sub] = _flat(program.rhs(t, x, z, right, p, m, h)[1])
        m = _flat(program.advance(t, x, z, right, p, m, h))
    return SundialsRun(y, x, m, steps)


def _flat(column: ca.DM) -> Array:
    return np.asarray(column.full(), float).ravel()


def _said(error: RuntimeError) -> str:
    found = re.search(r"\b((?:CV|IDA)_[A-Z_]+)", str(error))
    return found[1] if found else "its algebraic loop is not solved there"
