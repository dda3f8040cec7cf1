"""A model, a recording and what is free: everything a fit needs, as one frozen value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.simulation.dynamics import Dynamics, dynamics_of
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.study.data import Data
from identification.study.factors import drives, with_gains
from identification.study.origins import own_origins
from identification.study.priors import Prior
from identification.study.read_after import passing
from identification.study.scaled import Free, free_parameter
from identification.study.windows import windows_of

SAME_CLOCK = 1e-6
"""Relative difference of sampling rates that is none."""
FEW = 4
"""Windows from which they are run in one call."""
READABLE = 2000
"""Samples within which an initial state shows in the readings."""


@dataclass(frozen=True)
class Problem:
    """Fit `graph` to `data`.

    Attributes
    ----------
    starts : dict of str to float
        Start values that differ from the nominal ones.
    window : int or None
        Samples of each window with an initial state of its own (multiple shooting with the
        states eliminated); None simulates the record in one piece.
    known_states : dict of str to ndarray, shape (n_windows,)
        Start values of the windows' initial states, by name of the state.
    known_offsets : tuple of float
        Start values of the sensors' offsets, in units of their scale.
    source_offsets : bool
        Fit a constant added to each command (needed where the model integrates).
    gains : tuple of Parameter
        Factors on readings and commands, named by `gain_name`: calibrations known within bounds.
    lags, offsets : bool
        Which nuisances of the sensors are fitted.
    clock : float
        Largest ratio error of the sensors' clocks, as a fraction; 0 does not fit it.
    initial : "free", "rest" or tuple of str
        Initial state: fitted, the rest under the first inputs, or fitted for the states named
        (the others keep `known_states`, or the rest).
    whitening : tuple of ndarray
        Autoregressive polynomial of each reading's noise, 1 first; none for white noise.
    priors : dict of str to Prior
        Of parameters that have one; a weak one holds the others near their start.
    overrides : dict of str to Parameter
        Parameters with other bounds and scales than the graph declares.
    correction : ndarray, shape (N, n_y), SI, or None
        Readings with many sub-steps less those with `n_sub`, at an earlier point of the fit; added,
        so that the fit runs with few sub-steps and ends where it would with many.
    window_offsets : bool
        Fit offsets of the sensors on windows too; an integrating plant cannot tell them from its
        initial states.
    known_scale : ndarray, shape (n_x,), or None
        Spread of the states, from a problem of the same data and starts.
    built : Dynamics or None
        The dynamics of this graph, where it has been derived already.
    """

    graph: BondGraph
    data: Data
    starts: Mapping[str, float] = field(default_factory=dict)
    window: int | None = None
    n_sub: int = 1
    source_offsets: bool = False
    gains: tuple[Parameter, ...] = ()
    fixed: Sequence[str] = ()
    known_states: Mapping[str, Array] = field(default_factory=dict)
    known_offsets: tuple[float, ...] = ()
    lags: bool = True
    offsets: bool = True
    clock: float = 0.0
    initial: str | tuple[str, ...] = "free"
    whitening: tuple[Array, ...] = ()
    priors: Mapping[str, Prior] = field(default_factory=dict)
    overrides: Mapping[str, Parameter] = field(default_factory=dict)
    correction: Array | None = None
    built: Dynamics | None = None
    known_scale: Array | None = None
    window_offsets: bool = False

    def __getstate__(self) -> dict[str, object]:
        """Only the fields travel to other processes; compiled functions are rebuilt there."""
        return {f.name: getattr(self, f.name) for f in fields(self)} | {"built": None}

    @property
    def compiled(self) -> Compiled:
        """Compiled model with the measuring chain's nuisances; only of the exact dynamics."""
        return self.dynamics.lure or compile_model(self.graph)

    @cached_property
    def dynamics(self) -> Dynamics:
        """What runs the model, offsets of commands and gains of channels added as nuisances."""
        return dynamics_of(self.with_chain) if self.built is None else self.built

    @property
    def exact(self) -> bool:
        """Whether sub-steps change nothing."""
        return self.dynamics.exact_step and self.data.hold != "band-limited"

    @cached_property
    def free_states(self) -> Array:
        """Positions of the states whose initial value is fitted."""
        if self.initial == "rest":
            return np.arange(0)
        if self.initial == "free":
            return np.setdiff1d(np.arange(self.dynamics.n_x), self._at_will)
        names = self.dynamics.state_names
        return np.array([i for i, n in enumerate(names) if n in self.initial], int)

    @property
    def _at_will(self) -> tuple[int, ...]:
        """Positions of states that stay where they begin: nothing tells where that is."""
        in_one, lure = self.window is None and not self.data.breaks, self.dynamics.lure
        if lure is None or not (in_one and any(use.law.own_origin for use in lure.laws)):
            return ()
        if not self.offsets or any(s.offset is not None for s in self.graph.of_type(Sensor)):
            return ()
        loose = (f.parameter for f in self.free if f.parameter.name not in self.priors)
        return own_origins(lure, {p.name for p in loose if p.lower is None and p.upper is None})

    @cached_property
    def with_chain(self) -> BondGraph:
        """The graph with what the measuring chain may add: see `source_offsets` and `gains`."""
        g = with_gains(self.graph, self.gains)
        for s in drives(g) if self.source_offsets else ():
            command = self.data.commands[s.name]
            span = float(np.ptp(command))
            if s.offset is None and span > 0:
                name = f"offset_{s.name}"
                g = g.with_element(s.name, offset=name).with_parameters(
                    [
                        Parameter(
                            name, 0.0, s.unit or "1", positive=False,
                            lower=-0.25 * span, upper=0.25 * span, scale=0.05 * span,
                        )
                    ]
                )  # fmt: skip
        return g

    @cached_property
    def added(self) -> frozenset[str]:
        """Parameters of the measuring chain: fitted beside those of the model."""
        return frozenset(self.with_chain.parameters.keys() - self.graph.parameters.keys())

    @cached_property
    def free(self) -> tuple[Free, ...]:
        """Free model parameters, in the order of the compiled parameter vector."""
        found = []
        for n, declared in self.dynamics.parameters.items():
            p = self.overrides.get(n, declared)
            if not p.fixed and n not in self.fixed and n not in self.delays:
                found.append(free_parameter(p, self.starts.get(n)))
        return tuple(found)

    @cached_property
    def scaled_priors(self) -> dict[str, tuple[float, float]]:
        """Centre and weight (one over the standard deviation) of each prior, as theta."""
        if not self.priors:
            return {}
        late = (p for p in self.late.values() if p is not None)
        every = [*self.free, *(Free(p, 0.0, False, self.data.dt) for p in late)]
        known = self.priors
        return {n: known[n].on_theta(f) for f in every if (n := f.parameter.name) in known}

    @cached_property
    def directions(self) -> list[int]:
        """Positions of the free parameters in the parameter vector."""
        names = self.dynamics.parameter_names
        return [names.index(f.parameter.name) for f in self.free]

    def slopes(self, theta: Array) -> Array:
        """Return the derivative of each free parameter by its theta, shape (n_free,)."""
        return np.array([f.slope(float(t)) for f, t in zip(self.free, theta, strict=False)])

    @cached_property
    def delays(self) -> dict[str, tuple[int, ...]]:
        """Delay parameters declared by drives and sensors -> the outputs they shift.

        Clocks that sensors declare count among them: their delay grows with time.
        """
        found: dict[str, tuple[int, ...]] = {}
        everything = tuple(range(len(self.data.names)))
        for s in drives(self.graph):
            if s.drive is not None and s.drive.delay:
                self._require_alone(s)
                found[s.drive.delay] = everything
        for i, n in enumerate(self.data.names):
            sensor = self.graph[n]
            if isinstance(sensor, Sensor) and sensor.delay:
                found[sensor.delay] = (*found.get(sensor.delay, ()), i)
        return found | self.skews

    @cached_property
    def late(self) -> dict[str, Parameter | None]:
        """Parameters of `delays` with the bounds of this problem; None where none is declared."""
        return {n: self.overrides.get(n, self.graph.parameters.get(n)) for n in self.delays}

    @cached_property
    def late_starts(self) -> dict[str, float]:
        """Where each of `delays` starts, or is held, SI: as declared if not given."""
        declared = {n: p.value if p is not None else 0.0 for n, p in self.late.items()}
        return {n: self.starts.get(n, v) for n, v in declared.items()}

    @cached_property
    def skews(self) -> dict[str, tuple[int, ...]]:
        """Ratio errors of clocks declared by sensors -> the outputs they stretch."""
        found: dict[str, tuple[int, ...]] = {}
        for i, n in enumerate(self.data.names):
            sensor = self.graph[n]
            if isinstance(sensor, Sensor) and sensor.clock:
                found[sensor.clock] = (*found.get(sensor.clock, ()), i)
        return found

    def _require_alone(self, late: Source) -> None:
        """Refuse a dead time that not all moving commands share: it is taken at the readings."""
        for s in drives(self.graph):
            here, there = (d.delay if d is not None else None for d in (s.drive, late.drive))
            same = here == there
            if not same and float(np.ptp(self.data.commands[s.name])) > 0:
                raise UnusableInput(
                    f"{self.graph.name}: {late.name} has a dead time and {s.name} moves without "
                    "it; fits take dead times that all commands share, or those of sensors"
                )

    @cached_property
    def timed(self) -> tuple[str, ...]:
        """Elements with a law that counts time."""
        # a source has it in its drive; the law of a field is a tuple of expressions
        held = ((e, getattr(e, "drive", None)) for e in self.graph.elements.values())
        laws = ((e.name, getattr(own, "law", None)) for e, drive in held for own in (e, drive))
        found = (name for name, law in laws if getattr(law, "counts_time", False))
        return tuple(dict.fromkeys(found))

    @cached_property
    def passing(self) -> Array:
        """Which readings jump with a command that moves, shape (n_y,)."""
        return passing(self)

    @cached_property
    def apart(self) -> bool:
        """Whether there are many short windows that only a state of their own sets apart.

        Nothing reaches over their edges, and all are run by the same step.
        """
        data, lure = self.data, self.dynamics.lure
        if self.window is None or self.initial == "rest" or lure is None or len(self.windows) < FEW:
            return False
        late = bool(self.delays or self.clock or self.timed or data.reads_after or data.finer)
        coloured = any(w.size > 1 for w in self.whitening)
        one = len({data.step(w) for w in self.windows}) == 1
        return one and not (late or coloured or self.fits_lags or self.dynamics.jumps)

    @property
    def fits_lags(self) -> bool:
        """Whether delays of the sensors within a sample are unknowns; windows do not show them."""
        return self.lags and self.window is None

    @property
    def steps(self) -> int:
        """Sub-steps of a sample; dead time needs the course of the outputs within a sample.

        Commands that are known between the samples change in whole sub-steps.
        """
        least = max(self.n_sub, 4) if self.delays else self.n_sub
        return -(-least // self.data.parts) * self.data.parts

    @cached_property
    def windows(self) -> tuple[slice, ...]:
        """Where a state begins anew: if it is free at `Data.begin`, else at the first sample."""
        data, free = self.data, self.initial == "free"
        return windows_of(data.n, free * data.begin, data.breaks, data.split, self.window)

    @cached_property
    def inputs(self) -> Array:
        """Inputs at the samples, shape (N, n_u)."""
        return self.dynamics.inputs(self.data.commands, self.data.time, self.data.starts)

    @cached_property
    def mean_inputs(self) -> Array:
        """Mean of the inputs over the record, shape (n_u,); what rounding left of none is none."""
        mean = self.inputs.mean(axis=0)
        return np.asarray(np.where(np.abs(mean) > 1e-9 * np.ptp(self.inputs, axis=0), mean, 0.0))

    @cached_property
    def start_vector(self) -> Array:
        """Parameter vector with the start values, shape (n_p,)."""
        known = {k: v for k, v in self.starts.items() if k in self.dynamics.parameter_names}
        return self.dynamics.vector(known)

    @cached_property
    def rest_state(self) -> Array:
        """Equilibrium under the first inputs at the start values."""
        return self.dynamics.rest(self.start_vector, self.inputs[0])

    @cached_property
    def state_scale(self) -> Array:
        """Spread of each state in a simulation at the start values, shape (n_x,)."""
        if self.known_scale is not None:
            return self.known_scale
        spread = self.dynamics.spreads(
            self.start_vector, self.inputs, self.data.dt, self.rest_state, self.n_sub,
            self.data.between,
        )  # fmt: skip
        least = 1e-6 * np.abs(self.rest_state) + 1e-30
        return np.asarray(np.maximum.reduce([spread, self._readable_states, least]))

    @cached_property
    def _readable_states(self) -> Array:
        """Initial states that would move a reading by its spread: a free swing has no other scale.

        Zero for states that no reading shows.
        """
        directions = self.directions
        ready = self.dynamics.prepare(self.start_vector, self.data.dt, self.steps, directions, True)
        begin = slice(0, min(self.data.n, READABLE))
        run = self.dynamics.run(
            ready, self.inputs[begin], self.rest_state, self.fine_inputs(begin),
            every_substep=bool(self.delays),
        )  # fmt: skip
        n_y = len(self.data.names)
        reach = np.abs(run.dy[:, :n_y, len(directions) :]).max(axis=0)
        spread = self.data.spread
        with np.errstate(divide="ignore", invalid="ignore"):
            size = np.where(reach > 0, spread[:, None] / reach, np.inf).min(axis=0)
        return np.asarray(np.where(np.isfinite(size), size, 0.0))

    def fine_inputs(self, window: slice, n_sub: int | None = None) -> Array:
        """Return inputs at both ends of each sub-step of a window."""
        steps = self.steps if n_sub is None else n_sub
        key = (window.start, window.stop, steps)
        if key not in self._fine:
            u, within = self._inputs_within(window, steps)
            self._fine[key] = self.dynamics.fine_inputs(u, steps // within, self.data.between)
        return self._fine[key]

    def _inputs_within(self, window: slice, steps: int) -> tuple[Array, int]:
        """Return inputs of a window as finely as commands are known, how many a sample they are.

        At the samples alone where sub-steps do not meet them.
        """
        u, dynamics = self.inputs[window], self.dynamics
        within, known = self.data.commanded(window)
        if within == 1 or steps % within:
            return u, 1
        n = np.arange(u.shape[0])
        at = np.arange(n[-1] * within + 1) / within
        made = dynamics.inputs(known, np.interp(at, n, self.data.time[window]))
        for i, name in enumerate(dynamics.input_names):
            if name not in dynamics.commands and name not in dynamics.input_rates:
                made[:, i] = np.interp(at, n, u[:, i])  # counts along all recordings
        return made, within

    @cached_property
    def _fine(self) -> dict[tuple[int, int, int], Array]:
        return {}
