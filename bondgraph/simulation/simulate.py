"""Simulation of a whole record: exact linear part, implicit laws, memory on accepted steps only."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import FunctionType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.checking import require_graph, tried_problems
from bondgraph.simulation.exact_run import (
    LOCATED,
    Memories,
    run_record,
    settle,
)
from bondgraph.simulation.start import (
    begun_with,
    checked_commands,
    even_grid,
    initial_state,
    inputs_of,
    state_by_name,
    usual_hold,
)
from bondgraph.simulation.timing import is_timed, read, sent, without_timing
from bondgraph.simulation.trajectory import Trajectory, units_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, require_known, unknown_name
from bondgraph.support.spelled import spelled

if TYPE_CHECKING:
    from bondgraph.simulation.lure import Compiled
    from bondgraph.simulation.radau.native import GeneralRun

INTEGRATORS: Final = ("cvodes", "idas")
"""Of SUNDIALS, beside ours."""

# compiled models and programs need CasADi; they are imported when something is simulated


@spelled
def simulate(
    model: BondGraph | Compiled,
    time: Array,
    commands: Mapping[str, Array] | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    x0: Array | Mapping[str, float] | str | None = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
    observed: Sequence[str] = (),
    memory: Memories | None = None,
    integrator: str | None = None,
) -> Trajectory:
    """Simulate `model` on the even grid `time`.

    Nothing has to be chosen: the linear part is integrated exactly, stiff or not, and the number
    of sub-steps doubles until the outputs change by less than `accuracy` (relative to their
    range), so only the shape of the nonlinear laws within a step costs anything. Where 16 are not
    enough, and always where a law jumps, steps are halved only where they and their halves differ:
    where a law switches, such as at a stop or where a mass begins to slide, that moment is found
    within the step. Where this does not settle either, and 256 sub-steps do not, a warning says so,
    and `Trajectory.settled`.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid.
    commands : dict of str to ndarray, shape (N,), SI
        Command of each source.
    parameters : dict of str to float
        Values that differ from the declared ones.
    x0 : ndarray, shape (n_x,), or dict of str to float, optional
        Initial state: an array in the order of `Trajectory.states` (of an earlier run, or of
        ``equations(graph).lure.states``), or displacements and momenta by name as in
        ``equations(graph).states``; ``"rest"`` is the rest under the first inputs, as of a record
        that begins long after they were switched on. When not given, everything rests with all
        inputs at zero until the first sample: a constant input is a step. Laws are at rest, too,
        those with memory relaxed.
    hold : {"hold", "linear", "band-limited"}, optional
        What inputs do between samples. When not given, they are held, as by a converter; linear
        where the equations need their rates, or one is recorded by its rate or its integral.
    memory : dict of str to sequence of float, optional
        Memory of a law to start from, by element, such as `Trajectory.memory` of an earlier run;
        virgin where not given.
    integrator : {"cvodes", "idas"}, optional
        One of SUNDIALS instead of ours, for comparison: slower, its tolerance `accuracy` over a
        thousand. See `bondgraph.simulation.sundials.record` for memory; laws that jump are refused.

    Examples
    --------
    >>> moved = simulate(graph, t, {"F": force})
    >>> round(float(moved["x"].max()), 5)  # m
    0.00725
    """
    given: object = model
    if isinstance(given, FunctionType):
        require_graph(given, "simulate(graph, time, commands)")
    if integrator is not None and integrator not in INTEGRATORS:
        raise unknown_name("integrator", integrator, "simulate", INTEGRATORS)
    graph = model if isinstance(model, BondGraph) else model.model.graph
    if is_timed(graph):
        plain = without_timing(graph)
        between = hold or _usual_hold_of(plain, integrator)
        before = 0.0 if x0 is None else None
        made = simulate(
            plain, time, sent(graph, time, commands, parameters, before, between), parameters,
            x0=x0, hold=hold, accuracy=accuracy, memory=memory, integrator=integrator,
            observed=observed if isinstance(model, BondGraph) else model.observed,
        )  # fmt: skip
        return replace(made, outputs=read(graph, made.time, made.outputs, parameters))
    if isinstance(model, BondGraph) and parameters:
        if lines := tried_problems(model, parameters):
            raise UnusableInput(f"{model.name}: {'; '.join(lines)}")
    from bondgraph.simulation.lure import exact_form

    compiled = exact_form(model, observed)
    if integrator is not None:
        return _by_sundials(
            model, compiled, time, commands, parameters, integrator,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
    if compiled is not None and isinstance(x0, Mapping):
        known = compiled.states
        if any(n.startswith(("z_q_", "z_p_")) for n in known) and isinstance(model, BondGraph):
            compiled = None  # its states are no displacements and momenta
        else:
            x0 = state_by_name(compiled.model.name, x0, known)
    if compiled is None:
        assert isinstance(model, BondGraph)
        return simulate_general(
            model, time, commands, parameters,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
    time = even_grid(compiled.model.name, time)
    commands = checked_commands(compiled.model.name, commands, time)
    require_known("input", compiled.model.name, compiled.inputs, *commands)
    u = inputs_of(compiled, commands, time)
    p = compiled.vector(parameters or {})
    require_finite(compiled, p)
    known = compiled.states
    step = float(np.diff(time).mean())
    hold = hold or usual_hold(compiled.model.graph, compiled.model.recorded)
    if x0 is None or isinstance(x0, str):
        x0, memory = rested(compiled, p, u, step, x0, memory)
    start = initial_state(compiled.model.name, x0, known)
    n_sub, run = settle(compiled, p, u, step, start, hold, accuracy, memory=memory, loud=True)
    if not run.settled:
        warnings.warn(
            f"{compiled.model.name}: at {n_sub} sub-steps a sample the outputs still change by "
            f"more than {accuracy:g} of their range; sample faster, or ask for less accuracy",
            stacklevel=2,
        )
    names = (*compiled.model.output_names, *compiled.observed)
    outputs = {n: run.y[:, i] for i, n in enumerate(names)}
    laws = {port.element: (run.s[:, j], run.w[:, j]) for j, port in enumerate(compiled.laws)}
    return Trajectory(
        compiled.model.name, time, outputs, laws, n_sub, run.x, run.memory, known, run.settled,
        hold=hold, units=units_of(compiled.model.graph),
    )  # fmt: skip


def require_finite(compiled: Compiled, p: Array) -> None:
    """Refuse parameters `p`, shape (n_p,), at which the equations are no numbers."""
    if np.isfinite(compiled.block(p)).all():
        return
    none = [n for n, v in zip(compiled.parameter_names, p, strict=True) if v == 0]
    raise UnusableInput(
        f"{compiled.model.name}: the equations divide by a parameter that is 0, or by one too "
        f"small for it ({', '.join(none) or 'none is 0'}); give other values"
    )


def _usual_hold_of(graph: BondGraph, integrator: str | None) -> str:
    """Return what `simulate` takes inputs to do between samples where nobody says."""
    from bondgraph.equations.derivation import equations
    from bondgraph.simulation.lure import exact_form

    compiled = None if integrator else exact_form(graph)
    return usual_hold(
        graph, equations(graph).input_rates if compiled is None else compiled.model.recorded
    )


def rested(
    compiled: Compiled, p: Array, u: Array, step: float, x0: str | None, memory: Memories | None
) -> tuple[Array, Memories | None]:
    """Return the state and the memory of a rest before the first sample."""
    from bondgraph.simulation.law_rest import law_rest

    begun = begun_with(compiled.model.name, x0, compiled.inputs, u[0])
    x = law_rest(compiled, p, begun, memory)
    if np.array_equal(begun, u[0]):
        return x, memory
    # laws remember that rest, not what the first input makes of it; their time begins now
    kept = run_record(compiled, p, np.stack([begun, begun]), step, x, memory=memory).memory
    timed = {port.element for port in compiled.laws if port.law.counts_time}
    kept = {n: (0.0, *m[1:]) if n in timed else m for n, m in kept.items()}
    return x, {**kept, **(memory or {})}


def _by_sundials(
    model: BondGraph | Compiled,
    compiled: Compiled | None,
    time: Array,
    commands: Mapping[str, Array] | None,
    parameters: Mapping[str, float] | None,
    integrator: str,
    *,
    x0: Array | Mapping[str, float] | str | None,
    memory: Memories | None,
    **rest: Any,
) -> Trajectory:
    """Start where `simulate` would: at rest as the exact step is, where there is one."""
    from bondgraph.simulation.sundials.record import simulate_sundials

    if not isinstance(model, BondGraph):
        raise UnusableInput(f"{model.model.name}: {integrator} needs the graph; give that")
    if compiled is not None and not isinstance(x0, Mapping):
        known = compiled.states
        if x0 is None or isinstance(x0, str):
            time = even_grid(model.name, time)
            u = inputs_of(compiled, checked_commands(model.name, commands, time), time)
            p, step = compiled.vector(parameters or {}), float(np.diff(time).mean())
            x0, memory = rested(compiled, p, u, step, x0, memory)
        start = initial_state(model.name, x0, known)
        x0 = dict(zip(known, start.tolist(), strict=True))
    return simulate_sundials(
        model, time, commands, parameters, integrator,
        x0=x0, memory=memory, **rest,
    )  # fmt: skip


def simulate_general(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    x0: Array | Mapping[str, float] | str | None = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
    observed: Sequence[str] = (),
    memory: Memories | None = None,
) -> Trajectory:
    """Simulate any graph with the general step, see `bondgraph.simulation.radau.native`.

    `simulate` calls it for graphs that are not linear up to scalar laws: fields, modulated
    elements, nonlinear dependent stores.

    Raises
    ------
    BondsightError
        No rest, no convergence, or the outputs do not settle within 256 sub-steps.
    """
    from bondgraph.simulation.posing import pose
    from bondgraph.simulation.radau.located import located_general
    from bondgraph.simulation.radau.native import PreparedGeneral, run_general
    from bondgraph.simulation.radau.settling import settled_general, unsettled

    time = even_grid(graph.name, time)
    asked = pose(graph, time, commands, parameters, observed)
    program, p, u, step = asked.program, asked.p, asked.u, asked.step
    hold = asked.between(hold)
    x0, z0, begun = asked.start(x0, memory)
    memory = program.memory_by_law(begun)

    def run_with(n_sub: int) -> GeneralRun:
        # unchecked: a law that jumps is tried, too, for the motion may never reach its jump
        ready = PreparedGeneral(program, p, step, n_sub, (), False, False)
        return run_general(ready, u, x0, hold, memory=memory, unknowns=z0)

    n_sub, made = settled_general(run_with, asked.columns, accuracy, largest=LOCATED)
    if not made.settled:
        found = located_general(program, p, u, step, x0, hold, accuracy, memory, z0, asked.columns)
        n_sub, made = found or settled_general(run_with, asked.columns, accuracy)
    if not made.settled:
        raise unsettled(program, made, float(time[0]), step)
    return Trajectory(
        graph.name, time, asked.outputs(made.y), asked.laws(made.y), n_sub, made.x,
        made.memory, program.states, hold=hold, units=units_of(graph),
    )  # fmt: skip
