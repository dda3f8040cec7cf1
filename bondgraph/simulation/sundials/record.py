"""A record through CVODES or IDAS of SUNDIALS, accepted as our own steps are.

Between two accepted steps CasADi's integrator runs on its own error control, anew from each: there
inputs turn, and memory is replaced. IDAS keeps algebraic unknowns open; for CVODES, and beside laws
with corners, they are solved at every evaluation.

What becomes of the memory of a law:

- one that obeys a differential equation in time is a state (`bondgraph.simulation.flowing`): LuGre,
  Dahl, heat, creep;
- one of the argument alone (plays, stops, Maxwell, Bouc-Wen, Preisach) is exact along a monotone
  way; every step ends where an argument turns. The line on which the turn is looked for leaves an
  error of third to fourth order in the step, and two turns within an eighth of it are not seen;
- any other (a slip along the way, a slew limit, a rate of the last step) is held from step to step:
  first to second order.

The two last are followed in steps halved until outputs settle. Hindmarsh et al., ACM Trans. Math.
Software 31 (2005) 363.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from dataclasses import replace
from io import StringIO
from typing import Final

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Switched
from bondgraph.simulation.exact_run import LARGEST, Memories, relative_change
from bondgraph.simulation.flowing import flowing
from bondgraph.simulation.posing import Posed, pose
from bondgraph.simulation.radau.jumping import jumping_laws
from bondgraph.simulation.radau.native import (
    PreparedGeneral,
    inputs_between,
    run_general,
)
from bondgraph.simulation.start import even_grid
from bondgraph.simulation.sundials.functions import (
    integrator_of,
    kept_laws,
    turning_of,
    unknowns_of,
)
from bondgraph.simulation.sundials.stepper import Accepted, Stepper
from bondgraph.simulation.trajectory import Trajectory, units_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.interrupts import interrupts

FINER: Final = 1e-3
"""Tolerance of the integrator over the accuracy asked for: errors of many steps add up."""
TIGHTEST: Final = 1e-12
PROBES: Final = (1, 4, 16)
"""Sub-steps a sample of the coarse run that finds the sizes."""


def simulate_sundials(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None,
    parameters: Mapping[str, float] | None,
    integrator: str,
    *,
    x0: object = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
    observed: Sequence[str] = (),
    memory: Memories | None = None,
) -> Trajectory:
    """Simulate `graph` with an integrator of SUNDIALS; `bondgraph.simulate` calls it.

    Parameters
    ----------
    integrator : {"cvodes", "idas"}

    Raises
    ------
    UnusableInput
        What it cannot carry: laws that jump, switched junctions, a model without states.
    BondsightError
        It gave up, or the outputs do not settle.
    """
    asked = pose(graph, even_grid(graph.name, time), commands, parameters, observed)
    hold = asked.between(hold)
    _require_smooth(graph, asked.program, integrator)
    begin = begun(asked, x0, memory)
    tolerance = max(FINER * accuracy, TIGHTEST)
    stepper, begin = stepper_of(asked, begin, integrator, tolerance, hold)
    program = stepper.program
    at_once = _settles_at_once(program, hold)
    n_sub, last, steps = (2 if hold == "band-limited" else 1), None, 0
    while n_sub <= LARGEST:
        y, end, count = march(stepper, asked, begin, hold, n_sub)
        steps += count
        watched = y[:, asked.columns]
        if at_once or (last is not None and relative_change(last, watched) < accuracy):
            return Trajectory(
                graph.name, np.asarray(time, float), asked.outputs(y), {}, n_sub,
                end.x[: len(asked.program.states)], program.memory_by_law(end.m),
                asked.program.states, inner_steps=steps, hold=hold,
                units=units_of(graph),
            )  # fmt: skip
        last, n_sub = watched, 2 * n_sub
    raise BondsightError(
        f"{graph.name}: with {integrator} the outputs do not settle within {LARGEST} accepted "
        "steps a sample: the memory of its laws is followed too coarsely; sample faster, or leave "
        "integrator out"
    )


def stepper_of(
    asked: Posed, begin: Accepted, integrator: str, tolerance: float, hold: str
) -> tuple[Stepper, Accepted]:
    """Return what takes the steps of a record, and its start with the memories that are states."""
    program = flowing(asked.program)
    rows = [program.memory.index(n) for n in program.states[len(begin.x) :]]
    begin = replace(begin, x=np.concatenate([begin.x, begin.m[rows]]))
    size = _sizes(program, asked, begin, hold)
    functions = (
        integrator_of(program, integrator, size, tolerance),
        unknowns_of(program, size),
        turning_of(asked.program, program),
    )
    return Stepper(integrator, program, asked.p, size, tolerance, *functions), begin


def _require_smooth(graph: BondGraph, program: Program, integrator: str) -> None:
    if switches := [e.name for e in graph.of_type(Switched)]:
        raise UnusableInput(
            f"{graph.name}: {', '.join(switches)} can switch, across which {integrator} cannot "
            "integrate; use simulate_modes, or simulate one mode, in_mode(graph, ...)"
        )
    if jumps := [program.laws[i].element for i in jumping_laws(program)]:
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
    kept = any(not c.law.flows for c in kept_laws(program))
    beside = program.memory and not any(n in program.states for n in program.memory)
    return not (kept or beside or program.recorded or hold == "band-limited")


def begun(asked: Posed, x0: object, memory: Memories | None) -> Accepted:
    """Return the start of a record, see `simulate_sundials`."""
    x, z, m = asked.start(x0, memory)
    return Accepted(0.0, x, z, m, m)


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
        made = run_general(ready, asked.u, begin.x, hold, memory=memory, unknowns=begin.z)
        good = made.y[np.isfinite(made.y).all(axis=1)]
        size = np.maximum(size, np.abs(good).max(axis=0, initial=0.0))
        if made.settled:
            break
    return np.where(size > 0.0, size, 1.0)


def march(
    stepper: Stepper, asked: Posed, begin: Accepted, hold: str, n_sub: int
) -> tuple[Array, Accepted, int]:
    """Run over the record with `n_sub` steps a sample; outputs, end and steps inside."""
    ready = PreparedGeneral(stepper.program, asked.p, asked.step, n_sub, (), False, False)
    u, fine = inputs_between(ready, asked.u, hold)
    h, a, steps = asked.step / n_sub, begin, 0
    rows = [stepper.reading(a, u[0])]
    try:
        # what IDAS writes there on its own, the error says; CasADi makes an error of Ctrl-C
        with redirect_stderr(StringIO()), interrupts() as pressed:
            for k, (left, right) in enumerate(fine):
                if pressed.heard:
                    raise KeyboardInterrupt
                if hold == "hold" and a.z.size:  # inputs jump here, and unknowns with them
                    a = stepper.jumped(a, left)
                made, count = stepper.onward(a, h, left, right)
                a, steps = replace(made, t=(k + 1) * h), steps + count
                if (k + 1) % n_sub == 0:
                    rows.append(stepper.reading(a, right))
    except RuntimeError as error:
        raise BondsightError(
            f"{stepper.program.name}: {stepper.plugin} gave up after {a.t:.6g} s ({_said(error)}); "
            "sample faster, ask for less accuracy, take the other integrator, or leave it out"
        ) from None
    return np.array(rows), a, steps


def _said(error: RuntimeError) -> str:
    found = re.search(r"\b((?:CV|IDA)_[A-Z_]+)", str(error))
    return found[1] if found else "its algebraic loop is not solved there"
