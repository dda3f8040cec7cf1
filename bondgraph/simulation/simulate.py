"""Simulation of a whole record: exact linear part, implicit laws, memory on accepted steps only."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Sensor, Source
from bondgraph.signals.band_limited import between_samples
from bondgraph.signals.fractional_delay import delayed
from bondgraph.signals.varying_delay import at_clock
from bondgraph.support.errors import BondsightError, UnusableInput, real_number, unknown_name

if TYPE_CHECKING:
    from bondgraph.laws.law import Law
    from bondgraph.simulation.lure import Compiled
    from bondgraph.simulation.radau.native import GeneralRun

# compiled, discrete and kernel need CasADi; they are imported when something is simulated

Array = np.ndarray
Memories = Mapping[str, Sequence[float]]
LARGEST = 256
"""Sub-steps between two samples."""
HOLDS = ("hold", "linear", "band-limited")


@dataclass(frozen=True)
class Trajectory:
    """Simulated outputs over time.

    Attributes
    ----------
    time : ndarray, shape (N,), s
    outputs : dict of str to ndarray, shape (N,), SI
        Sensor readings, then observed signals.
    laws : dict of str to tuple of ndarray
        For each nonlinear law its argument and its deviation, shape (N,) each.
    steps_per_sample : int
        Sub-steps that met the accuracy asked for.
    state : ndarray, shape (n_x,)
        State at the last sample; with `memory` a later run goes on from here.
    memory : dict of str to tuple of float
        Memory of each law that has one, at the last sample, by element.
    states : tuple of str
        Names of the states, in the order of `state`.
    settled : bool
        Whether the last doubling of the sub-steps changed the outputs by less than the accuracy
        asked for; not where an output only rests, or jumps between samples.
    """

    name: str
    time: Array
    outputs: dict[str, Array]
    laws: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    steps_per_sample: int = 1
    state: Array = field(default_factory=lambda: np.zeros(0))
    memory: dict[str, tuple[float, ...]] = field(default_factory=dict)
    states: tuple[str, ...] = ()
    settled: bool = True

    def __getitem__(self, name: str) -> Array:
        """Output by name."""
        if name not in self.outputs:
            raise unknown_name("output", name, self.name, self.outputs)
        return self.outputs[name]

    def __repr__(self) -> str:
        """Short text."""
        unsettled = "" if self.settled else ", not settled"
        outputs = ", ".join(self.outputs)
        return f"Trajectory({self.name!r}, {self.time.size} samples, {outputs}{unsettled})"

    def to_pandas(self) -> Any:
        """Return a data frame with time as index (needs pandas)."""
        try:
            import pandas as pd
        except ImportError as error:
            raise BondsightError(
                "to_pandas needs pandas: pip install 'bondsight[tables]'"
            ) from error
        return pd.DataFrame(self.outputs, index=pd.Index(self.time, name="t"))


@dataclass(frozen=True)
class KernelRun:
    """One pass of the kernel: values and derivatives.

    Attributes
    ----------
    y : ndarray, shape (N, n_y)
    dy : ndarray, shape (N, n_y, n_d)
    s, w : ndarray, shape (N, n_w)
        Arguments and deviations of the laws.
    x : ndarray, shape (n_x,)
        State at the last sample.
    memory : dict of str to tuple of float
        Memory of each law that has one, at the last sample, by element.
    settled : bool
        See `Trajectory.settled`.
    dx : ndarray, shape (n_x, n_d)
        Derivatives of the last state.
    """

    y: Array
    dy: Array
    s: Array
    w: Array
    x: Array
    memory: dict[str, tuple[float, ...]]
    settled: bool = True
    dx: Array = field(default_factory=lambda: np.zeros((0, 0)))


def equilibrium(compiled: Compiled, p: Array, u: Array) -> Array:
    """State at rest under constant inputs `u` (shape (n_u,)); integrators stay at zero."""
    from bondgraph.simulation.first_order_hold import blocks

    block = np.asarray(compiled.matrices(p).full(), float)
    parts = blocks(compiled, block)
    a, b = parts.a, parts.b[:, : compiled.n_u] @ u
    if not a.size:
        return np.zeros(0)
    largest = np.abs(a).max(axis=1)
    held = largest > 0.0  # a row of zeros is a pure integral of the inputs: it never rests
    scale = np.sqrt(largest[held])
    x, *_ = np.linalg.lstsq(a[held] / scale[:, None], -b[held] / scale, rcond=1e-12)
    return np.asarray(x)


def fine_inputs(u: Array, n_sub: int, hold: str) -> Array:
    """Return the inputs at both ends of each sub-step, shape ((N - 1) * n_sub, 2, n_u).

    Parameters
    ----------
    u : ndarray, shape (N, n_u)
    hold : {"hold", "linear", "band-limited"}
        What the input does between samples.
    """
    if hold not in HOLDS:
        raise unknown_name("inter-sample behaviour", hold, "simulate", HOLDS)
    n = u.shape[0] - 1
    if hold == "hold":
        left = np.repeat(u[:-1], n_sub, axis=0)
        return np.stack([left, left], axis=1)
    if hold == "linear":
        part = np.arange(n_sub + 1) / n_sub
        nodes = u[:-1, None, :] + (u[1:] - u[:-1])[:, None, :] * part[None, :, None]
    else:
        fine = between_samples(u, n_sub)
        index = np.arange(n)[:, None] * n_sub + np.arange(n_sub + 1)[None, :]
        nodes = fine[index]
    pairs = np.stack([nodes[:, :-1], nodes[:, 1:]], axis=2)
    return pairs.reshape(n * n_sub, 2, u.shape[1])


@dataclass(frozen=True)
class Prepared:
    """A model at one parameter vector, ready to run over any inputs.

    Attributes
    ----------
    still, moving : tuple of ndarray
        Packed matrices and their derivatives for a step of zero and for a sub-step.
    """

    compiled: Compiled
    n_p: int
    n_d: int
    n_sub: int
    q: Array
    dq: Array
    still: tuple[Array, Array]
    moving: tuple[Array, Array]


def prepare(
    compiled: Compiled,
    p: Array,
    step: float,
    n_sub: int = 1,
    directions: Sequence[int] = (),
    state_directions: bool = False,
) -> Prepared:
    """Discretise `compiled` at parameters `p` (SI, shape (n_p,)) for samples `step` (s) apart."""
    from bondgraph.simulation.first_order_hold import discretise

    wanted = np.asarray(directions, int)
    n_p = wanted.size
    n_d = n_p + (compiled.n_x if state_directions else 0)
    law_positions = np.asarray(compiled.law_parameters, int)
    dq = np.zeros((law_positions.size, n_d))
    for column, i in enumerate(wanted):
        dq[law_positions == i, column] = 1.0

    def packed(h: float) -> tuple[Array, Array]:
        d = discretise(compiled, p, h, wanted)
        return d.packed, np.hstack([d.derivative, np.zeros((d.packed.size, n_d - n_p))])

    return Prepared(
        compiled, n_p, n_d, n_sub, p[law_positions], dq, packed(0.0), packed(step / n_sub)
    )


def run_prepared(
    ready: Prepared,
    u: Array,
    x0: Array,
    hold: str = "linear",
    fine: Array | None = None,
    *,
    every_substep: bool = False,
    memory: Memories | None = None,
) -> KernelRun:
    """Simulate inputs `u` (shape (N, n_u)) from state `x0`; `fine` are their sub-step values.

    With `every_substep` the result has ``(N - 1) * n_sub + 1`` rows instead of N. `memory` replaces
    the virgin memory of the laws it names.
    """
    from bondgraph.simulation.lure_kernel import layout, runner

    compiled, n_p, n_x = ready.compiled, ready.n_p, ready.compiled.n_x
    lay = layout(compiled, ready.n_d)
    run = runner(compiled, ready.n_d)
    z = np.zeros((lay.n_z, 1 + ready.n_d))
    z[:n_x, 0] = x0
    if ready.n_d > n_p:
        z[:n_x, 1 + n_p :] = np.eye(n_x)
    _initial_memory(compiled, lay, *ready.still, u[0], z)
    _given_memory(compiled, lay, memory or {}, z)
    at_rest = np.stack([u[:1], u[:1]], axis=1)
    first, z = run(at_rest, z, 1, ready.still[0], ready.q, ready.still[1], ready.dq)
    if fine is None:
        fine = fine_inputs(u, ready.n_sub, hold)
    stride = 1 if every_substep else ready.n_sub
    rest, z = run(fine, z, stride, ready.moving[0], ready.q, ready.moving[1], ready.dq)
    out = np.concatenate([first, rest])
    n_y, n_w = lay.n_y, lay.n_w
    return KernelRun(
        out[:, :n_y, 0],
        out[:, :n_y, 1:],
        out[:, n_y : n_y + n_w, 0],
        out[:, n_y + n_w :, 0],
        z[:n_x, 0].copy(),
        {e: tuple(z[rows, 0].tolist()) for e, rows, _ in _memories(compiled, lay)},
        dx=z[:n_x, 1:].copy(),
    )


def run_record(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    *,
    n_sub: int = 1,
    hold: str = "linear",
    directions: Sequence[int] = (),
    state_directions: bool = False,
    memory: Memories | None = None,
) -> KernelRun:
    """Simulate a record and, if asked, its derivatives.

    Parameters
    ----------
    p : ndarray, shape (n_p,), SI
    u : ndarray, shape (N, n_u), SI
        Inputs at the samples, pseudo-inputs included.
    step : float
        Time between samples, s.
    x0 : ndarray, shape (n_x,)
        State at the first sample.
    directions : sequence of int
        Parameters (positions in `p`) to differentiate by.
    state_directions : bool
        Differentiate by the initial state too (last n_x columns of ``dy``).
    memory : dict of str to sequence of float, optional
        Memory to start from, by element; virgin where not given.
    """
    ready = prepare(compiled, p, step, n_sub, directions, state_directions)
    return run_prepared(ready, u, x0, hold, memory=memory)


def _memories(compiled: Compiled, lay: Any) -> list[tuple[str, slice, Law]]:
    """Element, rows among the carried numbers and law of each memory."""
    from bondgraph.simulation.lure import law_slices

    at = lay.n_x + lay.n_w
    return [
        (port.element, slice(at + ms.start, at + ms.stop), port.law)
        for port, ms, _ in law_slices(compiled)
        if port.law.n_memory
    ]


def _given_memory(compiled: Compiled, lay: Any, memory: Memories, z: Array) -> None:
    """Replace virgin memories by those given; they do not depend on the parameters."""
    known = {element: (rows, law) for element, rows, law in _memories(compiled, lay)}
    for element, states in memory.items():
        if element not in known:
            raise unknown_name("law with memory", element, compiled.space.name, known)
        rows, law = known[element]
        z[rows, 0] = law.checked_memory(states)
        z[rows, 1:] = 0.0


def _initial_memory(
    compiled: Compiled, lay: Any, packed: Array, dpacked: Array, u: Array, z: Array
) -> None:
    """Relax the memories at the initial arguments (and their derivatives)."""
    if not lay.n_m:
        return
    at = sum(r * c for r, c in lay.pieces[:3])
    end = at + lay.n_w * (lay.n_x + lay.n_u)
    known = np.concatenate([z[: lay.n_x, 0], u])
    c = packed[at:end].reshape(lay.n_w, known.size, order="F")
    s = c[:, : lay.n_x] @ z[: lay.n_x]
    s[:, 0] += c[:, lay.n_x :] @ u
    for d in range(dpacked.shape[1]):
        s[:, 1 + d] += dpacked[at:end, d].reshape(c.shape, order="F") @ known
    place = {port.element: j for j, port in enumerate(compiled.space.laws)}
    for element, rows, law in _memories(compiled, lay):
        j = place[element]
        z[rows, 0] = law.initial_memory(float(s[j, 0]))
        z[rows, 1:] = np.outer(law.memory_sensitivity(float(s[j, 0])), s[j, 1:])


def inputs_of(compiled: Compiled, commands: Mapping[str, Array], n: int) -> Array:
    """Input matrix, shape (n, n_u), from commands by source name; pseudo-inputs are filled in."""
    u = np.empty((n, compiled.n_u))
    for i, name in enumerate(compiled.space.input_names):
        if name in commands:
            u[:, i] = commands[name]
        elif name == "one":
            u[:, i] = 1.0
        elif re.fullmatch(r"ramp\d*", name):
            u[:, i] = np.linspace(0.0, 1.0, n) ** int(name[4:] or 1)
        else:
            raise unknown_name("input", name, "the commands", list(commands))
    return u


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
    if isinstance(model, BondGraph) and _timing(model):
        held = _dead_times(model, parameters or {})
        ratios = _clock_errors(model, parameters or {})
        made = simulate(
            _without_timing(model), time, _late(commands or {}, held, time), parameters,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
        return replace(made, outputs=_clocked(_late(made.outputs, held, made.time), ratios))
    compiled = exact_form(model, observed)
    if compiled is not None and isinstance(x0, Mapping):
        known = tuple(str(v.symbol) for v in compiled.space.states)
        if any(n.startswith("z_") for n in known) and isinstance(model, BondGraph):
            compiled = None  # its states are no displacements and momenta
        else:
            x0 = _by_name(compiled.space.name, x0, known)
    if compiled is None:
        assert isinstance(model, BondGraph)
        return simulate_general(
            model, time, commands, parameters,
            x0=x0, hold=hold, accuracy=accuracy, observed=observed, memory=memory,
        )  # fmt: skip
    time = _even(compiled.space.name, time)
    commands = _checked(compiled.space.name, commands, time)
    for name in commands:
        if name not in compiled.space.input_names:
            raise unknown_name("input", name, compiled.space.name, compiled.space.input_names)
    u = inputs_of(compiled, commands, time.size)
    p = compiled.vector(parameters or {})
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
    # without a sensor the states must settle
    watched = model.output_names or program.states
    program = with_signals(program, model, (*watched[len(model.output_names) :], *observed))
    time = _even(graph.name, time)
    if hold != "linear":
        raise UnusableInput(
            f"{graph.name}: the general integrator takes inputs linear between samples, not "
            f"{hold!r}; sample faster"
        )
    u = general_inputs(program, _checked(graph.name, commands, time), time)
    p = program.vector(parameters or {})
    start, _ = program.start_memory(memory)
    if isinstance(x0, Mapping):
        x0 = _by_name(graph.name, x0, program.states)
    at, wanted = float(time[0]), {*model.output_names, *observed}
    if x0 is None:
        x0, z0 = rest(program, u[0], p, memory=start, time=at)
    else:
        x0 = initial_state(graph.name, x0, program.states)
        z0 = unknowns_at(program, at, x0, u[0], p, start)
    step, n_watched = float(np.diff(time).mean()), len(watched)
    last: GeneralRun | None = None
    n_sub = 1
    while n_sub <= LARGEST:
        # unchecked: a law that jumps is tried, too, for the motion may never reach its jump
        ready = PreparedGeneral(program, p, step, n_sub, (), False, False)
        made = run_general(ready, u, x0, memory=memory, time=at, unknowns=z0)
        change = np.inf
        if made.settled and last is not None and last.settled:
            change = _change(last.y[:, :n_watched], made.y[:, :n_watched])
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


def _change(before: Array, after: Array) -> float:
    """Return the largest root mean square of a change, relative to the range of its column."""
    floor = np.maximum(1e-12 * np.abs(after).max(axis=0, initial=0.0), 1e-150)
    span = np.maximum(np.ptp(after, axis=0), floor)
    return float(np.sqrt(np.mean(((after - before) / span) ** 2, axis=0)).max(initial=0.0))


def initial_state(name: str, x0: object, states: Sequence[str]) -> Array:
    """Return a state given as an array, shape (n_x,), refused unless it is finite and fits."""
    start = np.asarray(x0, float)
    if start.shape != (len(states),) or not np.isfinite(start).all():
        raise UnusableInput(
            f"{name}: x0 has shape {start.shape}; it needs {len(states)} finite numbers, one a "
            f"state: {', '.join(states)}"
        )
    return start


def _dead_times(graph: BondGraph, parameters: Mapping[str, float]) -> dict[str, float]:
    """Dead time in seconds of sources and sensors that have one."""
    names = {e.name: e.drive.delay for e in graph.of_type(Source) if e.drive and e.drive.delay}
    names |= {e.name: e.delay for e in graph.of_type(Sensor) if e.delay}
    return _values_of(graph, names, parameters)


def _clock_errors(graph: BondGraph, parameters: Mapping[str, float]) -> dict[str, float]:
    """Ratio errors of the sensors' clocks, where they have one of their own."""
    names = {e.name: e.clock for e in graph.of_type(Sensor) if e.clock}
    return _values_of(graph, names, parameters)


def _values_of(
    graph: BondGraph, names: Mapping[str, str], parameters: Mapping[str, float]
) -> dict[str, float]:
    """Values of the parameters that elements name, by element."""
    known = graph.parameters if names else {}
    found = {}
    for element, n in names.items():
        if n not in known:
            graph.require_sound()
        found[element] = real_number(n, parameters.get(n, known[n].value))
    return found


def _timing(graph: BondGraph) -> bool:
    """Whether anything is late or has a clock of its own."""
    late = any(e.drive and e.drive.delay for e in graph.of_type(Source))
    return late or any(e.delay or e.clock for e in graph.of_type(Sensor))


def _clocked(signals: Mapping[str, Array], ratios: Mapping[str, float]) -> dict[str, Array]:
    """Take the signals at the times of their sensors' clocks."""
    found = dict(signals)
    for n, ratio in ratios.items():
        found[n] = at_clock(found[n], ratio)
    return found


def _without_timing(graph: BondGraph) -> BondGraph:
    for e in graph.of_type(Source):
        if e.drive and e.drive.delay:
            graph = graph.with_element(e.name, drive=replace(e.drive, delay=None))
    for e in graph.of_type(Sensor):
        if e.delay or e.clock:
            graph = graph.with_element(e.name, delay=None, clock=None)
    return graph


def _late(signals: Mapping[str, Array], held: Mapping[str, float], time: Array) -> dict[str, Array]:
    """Delay the signals that have a dead time; before the first sample they rest."""
    step = float(np.diff(time).mean()) if time.size > 1 else 1.0
    return {
        n: delayed(np.asarray(v, float), held[n] / step)[0] if held.get(n) else v
        for n, v in signals.items()
    }


def _by_name(name: str, x0: Mapping[str, float], states: Sequence[str]) -> Array:
    """Return an initial state given by names; all must be there."""
    for n in x0:
        if n not in states:
            raise unknown_name("state", n, name, states)
    if missing := [n for n in states if n not in x0]:
        raise UnusableInput(f"{name}: x0 has no value for {', '.join(missing)}; give all states")
    return np.array([float(x0[n]) for n in states])


def _even(name: str, time: Array) -> Array:
    time = np.asarray(time, float)
    if time.ndim != 1 or time.size < 2:
        raise UnusableInput(f"{name}: time needs at least two samples on one axis")
    steps = np.diff(time)
    if not np.allclose(steps, steps.mean(), rtol=1e-3, atol=0) or steps.mean() <= 0:
        raise UnusableInput(f"{name}: time must rise evenly; resample it first")
    return time


def _checked(model: str, commands: Mapping[str, Array] | None, time: Array) -> dict[str, Array]:
    try:
        commands = {k: np.asarray(v, float) for k, v in (commands or {}).items()}
    except (TypeError, ValueError):
        raise UnusableInput(f"{model}: a command is not made of numbers; give arrays") from None
    for name, v in commands.items():
        if v.shape != time.shape:
            raise UnusableInput(f"{model}: input {name} has shape {v.shape}, time has {time.shape}")
        if not np.isfinite(v).all():
            raise UnusableInput(f"{model}: input {name} holds NaN or infinity; clean it first")
    return commands


def settle(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    accuracy: float,
    largest: int = LARGEST,
    memory: Memories | None = None,
    loud: bool = False,
) -> tuple[int, KernelRun]:
    """Double the sub-steps until the outputs settle; returns the number and the last run.

    A run that does not settle says so in `KernelRun.settled`.

    Raises
    ------
    BondsightError
        If `loud`: they are not finite.
    """
    n_sub = 1 if hold != "band-limited" else 2
    run = run_record(compiled, p, u, step, x0, n_sub=n_sub, hold=hold, memory=memory)
    if compiled.n_w == 0 and hold != "band-limited":
        return n_sub, run
    change = float("inf")
    while n_sub < largest:
        finer = run_record(compiled, p, u, step, x0, n_sub=2 * n_sub, hold=hold, memory=memory)
        change = _change(run.y, finer.y)
        run, n_sub = finer, 2 * n_sub
        if change < accuracy:
            return n_sub, run
    if loud and not np.isfinite(run.y).all():
        first = int(np.argmin(np.isfinite(run.y).all(axis=1)))
        raise BondsightError(
            f"{compiled.space.name}: the outputs are not finite from sample {first} on, at "
            f"{largest} sub-steps a sample; check parameters and start, or sample faster"
        )
    run = replace(run, settled=False)
    return n_sub, run
