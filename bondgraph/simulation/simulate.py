"""Simulation of a whole record: exact linear part, implicit laws, memory on accepted steps only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.equations.relation import FINE
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.checking import tried_problems
from bondgraph.simulation.exact_run import LARGEST, Memories, relative_change, settle
from bondgraph.simulation.start import (
    checked_commands,
    equilibrium,
    even_grid,
    initial_state,
    inputs_of,
    state_by_name,
)
from bondgraph.simulation.timing import (
    clock_errors,
    clocked,
    dead_times,
    is_timed,
    late,
    late_resolutions,
    rounded,
    without_timing,
)
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name

if TYPE_CHECKING:
    from bondgraph.simulation.lure import Compiled
    from bondgraph.simulation.radau.native import GeneralRun

# compiled models and programs need CasADi; they are imported when something is simulated


def simulate(
    model: BondGraph | Compiled,
    time: Array,
    commands: Mapping[str, Array] | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    x0: Array | Mapping[str, float] | None = None,
    hold: str = "linear",
    accuracy: float = 1e-4,
    observed: Sequence[str] = (),
    memory: Memories | None = None,
) -> Trajectory:
    """Simulate `model` on the even grid `time`.

    Nothing has to be chosen: the linear part is integrated exactly, stiff or not, and the number
    of sub-steps doubles until the outputs change by less than `accuracy` (relative to their
    range), so only the shape of the nonlinear laws within a step costs anything.

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
        ``derive(graph).states``), or displacements and momenta by name as in
        ``system(graph).states``; the rest under the first inputs when not given.
    memory : dict of str to sequence of float, optional
        Memory of a law to start from, by element, such as `Trajectory.memory` of an earlier run;
        virgin where not given.
    """
    if isinstance(model, BondGraph) and is_timed(model):
        held = dead_times(model, parameters or {})
        ratios = clock_errors(model, parameters or {})
        made = simulate(
            without_timing(model), time, late(commands or {}, held, time), parameters,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
        sampled = clocked(late(made.outputs, held, made.time), ratios)
        return replace(made, outputs=rounded(sampled, late_resolutions(model, parameters or {})))
    if isinstance(model, BondGraph) and parameters:
        if lines := tried_problems(model, parameters):
            raise UnusableInput(f"{model.name}: {'; '.join(lines)}")
    compiled = exact_form(model, observed)
    if compiled is not None and isinstance(x0, Mapping):
        known = tuple(str(v.symbol) for v in compiled.space.states)
        if any(n.startswith(("z_q_", "z_p_")) for n in known) and isinstance(model, BondGraph):
            compiled = None  # its states are no displacements and momenta
        else:
            x0 = state_by_name(compiled.space.name, x0, known)
    if compiled is None:
        assert isinstance(model, BondGraph)
        return simulate_general(
            model, time, commands, parameters,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
    time = even_grid(compiled.space.name, time)
    commands = checked_commands(compiled.space.name, commands, time)
    for name in commands:
        if name not in compiled.space.input_names:
            raise unknown_name("input", name, compiled.space.name, compiled.space.input_names)
    u = inputs_of(compiled, commands, time)
    p = compiled.vector(parameters or {})
    if not np.isfinite(compiled.matrices(p).full()).all():
        none = [n for n, v in zip(compiled.parameter_names, p, strict=True) if v == 0]
        raise UnusableInput(
            f"{compiled.space.name}: the equations divide by a parameter that is 0, or by one too "
            f"small for it ({', '.join(none) or 'none is 0'}); give other values"
        )
    known = tuple(str(v.symbol) for v in compiled.space.states)
    if x0 is None:
        x0 = equilibrium(compiled, p, u[0])
    start = initial_state(compiled.space.name, x0, known)
    step = float(np.diff(time).mean())
    n_sub, run = settle(compiled, p, u, step, start, hold, accuracy, memory=memory, loud=True)
    names = (*compiled.space.output_names, *compiled.observed)
    outputs = {n: run.y[:, i] for i, n in enumerate(names)}
    laws = {port.element: (run.s[:, j], run.w[:, j]) for j, port in enumerate(compiled.space.laws)}
    return Trajectory(
        compiled.space.name, time, outputs, laws, n_sub, run.x, run.memory, known, run.settled
    )


def exact_form(model: BondGraph | Compiled, observed: Sequence[str] = ()) -> Compiled | None:
    """Return the exact-step form of a model; None if it needs the general integrator."""
    from bondgraph.equations.state_space import (
        AlgebraicLoop,
        DerivativeCausality,
        NotLinearUpToLaws,
    )
    from bondgraph.simulation.lure import compile_model

    if not isinstance(model, BondGraph):
        return model
    try:
        return compile_model(model, observed)
    except (AlgebraicLoop, DerivativeCausality, NotLinearUpToLaws):
        return None


def simulate_general(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    x0: Array | Mapping[str, float] | None = None,
    hold: str = "linear",
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
    from bondgraph.equations.codegen import program_of, with_signals
    from bondgraph.equations.derivation import system
    from bondgraph.simulation.radau.native import PreparedGeneral, run_general
    from bondgraph.simulation.radau.start import inputs_of as general_inputs
    from bondgraph.simulation.radau.start import rest, unknowns_at

    model = system(graph)
    program = program_of(model)
    # readings must settle before they are rounded; without a sensor the states must
    fine = {n: f"{FINE}{n}" for n in model.output_names if f"{FINE}{n}" in model.index}
    watched = tuple(fine.get(n, n) for n in model.output_names) or program.states
    more = tuple(n for n in watched if n not in model.output_names)
    program = with_signals(program, model, (*more, *observed))
    columns = [program.outputs.index(n) for n in watched]
    time = even_grid(graph.name, time)
    if hold != "linear":
        raise UnusableInput(
            f"{graph.name}: the general integrator takes inputs linear between samples, not "
            f"{hold!r}; sample faster"
        )
    u = general_inputs(program, checked_commands(graph.name, commands, time), time)
    p = program.vector(parameters or {})
    start, _ = program.start_memory(memory)
    if isinstance(x0, Mapping):
        x0 = state_by_name(graph.name, x0, program.states)
    at, wanted = float(time[0]), {*model.output_names, *observed}
    if x0 is None:
        x0, z0 = rest(program, u[0], p, memory=start, time=at)
    else:
        x0 = initial_state(graph.name, x0, program.states)
        z0 = unknowns_at(program, at, x0, u[0], p, start)
    step = float(np.diff(time).mean())
    last: GeneralRun | None = None
    n_sub = 1
    while n_sub <= LARGEST:
        # unchecked: a law that jumps is tried, too, for the motion may never reach its jump
        ready = PreparedGeneral(program, p, step, n_sub, (), False, False)
        made = run_general(ready, u, x0, memory=memory, time=at, unknowns=z0)
        change = np.inf
        if made.settled and last is not None and last.settled:
            change = relative_change(last.y[:, columns], made.y[:, columns])
        if change < accuracy:
            outputs = {n: made.y[:, i] for i, n in enumerate(program.outputs) if n in wanted}
            return Trajectory(
                graph.name, time, outputs, {}, n_sub, made.x, made.memory, program.states
            )
        last, n_sub = made, 2 * n_sub
    what = "the outputs do not settle"
    if last is not None and not last.settled:
        what = f"Newton's method does not converge near {at + last.reached * step:.6g} s"
    if jumps := [c.element for c in program.laws if c.law.set_valued]:
        what += f" ({', '.join(jumps)} has a law that jumps, which a smooth step cannot follow)"
    raise BondsightError(
        f"{graph.name}: {what} within {LARGEST} sub-steps a sample; sample faster, start closer "
        "(x0=), or check that the model has a solution there"
    )
