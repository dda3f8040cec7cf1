"""A model, its recordings and what is free: everything a fit needs, as one frozen value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.checking import require_graph
from bondgraph.graph.composing.binding import external_signals
from bondgraph.graph.elements import Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import map_argument
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, real_number, require_known, unknown_name
from bondgraph.support.html import html_table
from bondgraph.support.spelled import spelled
from identification.study.admission import (
    admit_counts,
    admit_noise,
    admit_offset,
    admit_recordings,
    admit_sign,
    admit_split,
    distinct_names,
    require_time_step,
)
from identification.study.calibration import gain_prior, gains_of
from identification.study.channel_names import renamed, unread
from identification.study.data import Data, data_for
from identification.study.factors import drives, with_gains
from identification.study.free_parameters import varied
from identification.study.joint import JointProblem, stack_of
from identification.study.noise_floor import noise_floor
from identification.study.problem import Problem
from identification.study.process_noise import ProcessNoise, admit_process_noise, diffusion_at
from identification.study.read_after import BEHAVIOURS
from identification.study.scaled import free_parameter
from identification.study.specification import Nuisances, Vary
from identification.study.turns import Turn, in_turn, straight_graph, straight_recording, turns_of
from identification.study.usual_split import usual_split, usual_splits

NOISES = ("white", "coloured")
INITIALS = ("free", "rest")
ESTIMATED = "estimate"
STILL = 1e-18
"""Noise floor of a reading that is always zero, SI: below what is measured anywhere."""


@dataclass(frozen=True, eq=False)
class SettledSetting:
    """What is chosen from the data rather than declared; refined while a fit goes on.

    Attributes
    ----------
    hold : str
        What the commands do between samples.
    n_sub : tuple of int
        Sub-steps a sample, recording by recording.
    floors : tuple of ndarray, shape (n_y,) each
        Standard deviation of each reading's noise (of its innovations if coloured), SI.
    whitening : tuple of tuple of ndarray
        Autoregressive polynomials of the noise, recording by recording; empty for white noise.
    n_fine : tuple of int
        Sub-steps at which the readings no longer move the unknowns.
    corrections : tuple of ndarray, shape (N, n_y), SI, or None
        Readings with `n_fine` sub-steps less those with `n_sub`.
    corrected_at : ndarray, shape (n,), or None
        Scaled unknowns at which the corrections were made.
    """

    hold: str
    n_sub: tuple[int, ...]
    floors: tuple[Array, ...]
    whitening: tuple[tuple[Array, ...], ...]
    n_fine: tuple[int, ...]
    corrections: tuple[Array | None, ...]
    corrected_at: Array | None = None


@spelled
@dataclass(frozen=True, eq=False)
class Study:
    """What is to be fitted to what.

    Parameters
    ----------
    graph : BondGraph
        Sources and sensors name the channels of the recordings.
    recordings : sequence of Recording, or one
        Of any length and rate. One that lacks a sensor is used for the others it has.
    free : sequence of str or Vary, optional
        Parameters to fit; every one that is not declared or given as fixed, if left out.
    fixed : mapping of str to float, optional
        Parameters held at these values, SI.
    initial : "free", "rest" or mapping of str to float
        Initial states: fitted in each recording; the rest under its first inputs; or some known
        (SI) and the others fitted. Under a first velocity, however small, dry friction rests as a
        slider that has moved for ever: where a machine stands still, give its states.
    hold : {"estimate", "linear", "hold", "hold-after", "band-limited"}
        What the commands do between samples; "estimate" takes linear, and hold of commands that are
        steps, unless another fits clearly better, or as well where that one needs a delay.
    noise : {"white", "coloured"} or mapping of str to float or sequence of float
        Noise of the readings: estimated as white or as autoregressive, or known standard
        deviations of some readings (SI; the others white).
    nuisances : Nuisances
        What the measuring chain may add.
    splits : sequence of Split, optional
        Training and held-out samples of each recording; the stated default rule if left out.
    validation : sequence of Recording
        Recordings that are only judged.
    init : int
        Samples of each validation recording that its initial state is fitted to, and that are not
        scored; 0 starts from rest.
    silent : sequence of str
        Sources that stay at zero where a recording has no channel for them.
    window : int, optional
        Samples of windows with an initial state of their own, on which the readings are scored in
        place of a free run.
    n_sub : int, optional
        Sub-steps a sample; refined until the readings settle if left out.
    process_noise : sequence of str or mapping of str to float, optional
        Where the model is disturbed, for the methods with a filter: a state (``p_M``), the element
        that holds it (``M``), or a source (``F``: a random command); with values to start from (SI
        by the square root of time) if wanted. Every state, if left out.

    Raises
    ------
    UnusableInput, UnknownName
        One line that says what is wrong, where, and what to do.

    Examples
    --------
    >>> from actuators.models.textbook import resonator
    >>> r = Recording.from_arrays("r", {"u[V]": [0.0, 1, 0, 1], "y[V]": [0.0, 0, 1, 1]}, fs=1.0)
    >>> [v.name for v in Study(resonator(), r, free=("d", "k")).free]
    ['d', 'k']
    """

    graph: BondGraph
    recordings: tuple[Recording, ...]
    free: tuple[Vary, ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    initial: str | Mapping[str, float] = "free"
    hold: str = ESTIMATED
    noise: str | Mapping[str, float | Sequence[float]] = "white"
    nuisances: Nuisances = field(default_factory=Nuisances)
    splits: tuple[Split, ...] = ()
    validation: tuple[Recording, ...] = ()
    init: int = 0
    silent: tuple[str, ...] = ()
    window: int | None = None
    n_sub: int | None = None
    process_noise: ProcessNoise = None

    def __init__(
        self,
        graph: BondGraph,
        recordings: Recording | Sequence[Recording],
        free: Sequence[str | Vary] | None = None,
        fixed: Mapping[str, float] | None = None,
        *,
        initial: str | Mapping[str, float] = "free",
        hold: str = ESTIMATED,
        noise: str | Mapping[str, float | Sequence[float]] = "white",
        nuisances: Nuisances | None = None,
        splits: Split | Sequence[Split] | None = None,
        validation: Recording | Sequence[Recording] = (),
        init: int = 0,
        silent: Sequence[str] = (),
        window: int | None = None,
        n_sub: int | None = None,
        process_noise: Sequence[str] | Mapping[str, float] | None = None,
    ) -> None:
        """Check everything that can be checked before a simulation."""
        require_graph(graph, "Study(graph, recordings)")
        records = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
        judged = (validation,) if isinstance(validation, Recording) else tuple(validation)
        if not records:
            raise UnusableInput(f"{graph.name}: there is no recording to fit; give at least one")
        admit_recordings((*records, *judged))
        fixed = {n: real_number(n, v) for n, v in (fixed or {}).items()}
        given: dict[str, object] = {
            "graph": graph,
            "recordings": records,
            "free": varied(graph, free, fixed),
            "fixed": fixed,
            "initial": initial if isinstance(initial, str) else dict(initial),
            "hold": hold,
            "noise": noise if isinstance(noise, str) else dict(noise),
            "nuisances": nuisances or Nuisances(),
            "validation": judged,
            "init": init,
            "silent": tuple(silent),
            "window": window,
            "n_sub": n_sub,
            "process_noise": admit_process_noise(process_noise),
        }
        for name, value in given.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "splits", self._splits(splits))
        self._check()

    def _splits(self, splits: Split | Sequence[Split] | None) -> tuple[Split, ...]:
        if splits is None:
            return usual_splits(self.graph, self.recordings)
        found = (splits,) if isinstance(splits, Split) else tuple(splits)
        if len(found) != len(self.recordings):
            raise UnusableInput(
                f"{len(found)} splits for {len(self.recordings)} recordings; give one each"
            )
        return tuple(admit_split(s, r) for s, r in zip(found, self.recordings, strict=True))

    def _check(self) -> None:
        self.graph.require_sound()
        if not self.graph.of_type(Sensor):
            raise UnusableInput(
                f"{self.graph.name} has no sensor: add De, Df or Dq where the recording measures"
            )
        require_known("inter-sample behaviour", "Study", (*BEHAVIOURS, ESTIMATED), self.hold)
        if isinstance(self.noise, str) and self.noise not in NOISES:
            raise unknown_name("noise", self.noise, "Study", NOISES)
        if isinstance(self.initial, str) and self.initial not in INITIALS:
            raise unknown_name("initial state", self.initial, "Study", INITIALS)
        sensors = [s.name for s in self.graph.of_type(Sensor)]
        if not isinstance(self.noise, str):
            for name, levels in self.noise.items():
                require_known("sensor", self.graph.name, sensors, name)
                admit_noise(name, levels, [r.n for r in self.records])
        sources = [*(s.name for s in self.graph.of_type(Source)), *external_signals(self.graph)]
        require_known("source", self.graph.name, sources, *self.silent)
        admit_counts(self.window, self.n_sub, self.init, self.validation)
        for i, recording in enumerate(self.records):
            self._one(i, recording)
        admit_sign(self.starts, self.graph.parameters)
        self.gains, self._freedom  # names, bounds and starts are checked here
        self._check_offsets()
        self.straight_records  # and that readings tell their turns
        if self.process_noise:
            dynamics = self.problem(0, self.first_setting).dynamics
            for place in self.process_noise:
                diffusion_at(dynamics, self.graph, place)

    def _check_offsets(self) -> None:
        known = self.graph.parameters
        for s in self.graph.of_type(Sensor):
            offset = self.graph.channel_value(s, "offset")
            if offset is None or str(offset) not in known:
                continue
            p = self._freedom.get(str(offset), known[str(offset)])
            bounds = _ends(p) if p.name in self._freedom else ()
            read = [np.abs(r[s.name]).max() for r in self.records if s.name in r.channels]
            values = (self.starts.get(p.name, p.value), *bounds)
            admit_offset(p.name, s.name, p.unit, values, float(max(read, default=0.0)))

    @property
    def records(self) -> tuple[Recording, ...]:
        """Recordings that are fitted, then those that are only judged."""
        return (*self.recordings, *self.validation)

    @property
    def record_names(self) -> tuple[str, ...]:
        """Names of `records`, numbered where two are the same."""
        return distinct_names([r.name for r in self.records])

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(v.name for v in self.free)

    @cached_property
    def own(self) -> frozenset[str]:
        """Parameters with a value in every recording."""
        names = {v.name for v in self.free if v.own}
        if self.nuisances.commands:
            names |= {f"offset_{s.name}" for s in drives(self.graph)}
        return frozenset(names)

    @cached_property
    def turns(self) -> dict[str, Turn]:
        """Readings that begin anew after each turn; fits take them straight."""
        begun = with_gains(self.graph.with_values(self.starts), self.gains)
        return turns_of(begun, {*self.free_names, *(p.name for p in self.gains if not p.fixed)})

    @cached_property
    def straight_graph(self) -> BondGraph:
        """The graph as it is fitted: its readings count on from turn to turn."""
        return straight_graph(self.graph)

    @cached_property
    def straight_records(self) -> tuple[Recording, ...]:
        """`records` as they are fitted."""
        return tuple(straight_recording(r, self.turns) for r in self.records)

    @cached_property
    def gains(self) -> tuple[Parameter, ...]:
        """Factors on readings and commands, as parameters."""
        return gains_of(self.graph, self.nuisances.gains)

    @cached_property
    def _freedom(self) -> dict[str, Parameter]:
        """Free parameters with the bounds of this study; starts and priors are checked."""
        known = self.graph.parameters
        free = {}
        for v in self.free:
            p = known[v.name]
            narrowed = v.lower is not None or v.upper is not None
            p = replace(
                p,
                fixed=False,
                lower=p.lower if v.lower is None else v.lower,
                upper=p.upper if v.upper is None else v.upper,
                scale=p.scale if v.scale is None else v.scale,
                spread=None if narrowed else p.spread,
            )
            start = p.value if v.start is None else v.start
            low, high = _ends(p)
            if not low <= high:
                raise UnusableInput(
                    f"{v.name}: its lower bound {low:g} is not below the upper bound {high:g}"
                )
            if not low <= start <= high:
                raise UnusableInput(
                    f"{v.name}: its declared value {start:g} lies outside of its bounds {low:g} to "
                    f"{high:g}; give Vary({v.name!r}, start=...)"
                )
            free[v.name] = p
            if v.prior is not None:
                v.prior.on_theta(free_parameter(p, start))
        return free

    @cached_property
    def starts(self) -> dict[str, float]:
        """Start values of the free parameters and values of the fixed ones, SI."""
        known = self.graph.parameters
        begin = {v.name: known[v.name].value if v.start is None else v.start for v in self.free}
        return {**self.fixed, **begin}

    def _one(self, i: int, recording: Recording) -> BondGraph:
        """Return the graph for one recording: sensors without a channel left out."""
        graph = self.straight_graph
        sensors = [s.name for s in graph.of_type(Sensor)]
        here = [n for n in sensors if n in recording.channels]
        if not here:
            hints = (renamed(n, graph, recording) for n in sensors)
            how = next(filter(None, hints), f"name the column of each: {map_argument(sensors[0])}")
            raise UnusableInput(
                f"recording {recording.name!r} has none of the sensors "
                f"{', '.join(map(repr, sensors))} of {graph.name}; "
                f"its channels are {', '.join(recording.channels)}"
                f"{unread(recording)}; {how}"
            )
        for name in (*(s.name for s in drives(graph)), *external_signals(graph)):
            if name not in recording.channels and name not in self.silent:
                known = recording.channels
                error = unknown_name("channel for input", name, recording.name, known)
                how = renamed(name, graph, recording) or "select(...) renames it"
                raise UnusableInput(f"{error}{unread(recording)}; {how}, silent=({name!r},) is 0")
        for n in sensors:
            if n not in here:
                graph = graph.remove(n)
        return graph

    def with_silence(self, recording: Recording) -> Recording:
        """Return the recording with zeros for the silent inputs it has no channel for."""
        units = {s.name: s.unit or "1" for s in drives(self.graph)}
        units |= dict.fromkeys(external_signals(self.graph), "1")
        units = {n: unit for n, unit in units.items() if n not in recording.channels}
        if not units:
            return recording
        zeros = {n: np.zeros(recording.n) for n in units}
        return replace(
            recording, channels={**recording.channels, **zeros}, units={**recording.units, **units}
        )

    @cached_property
    def judged_splits(self) -> tuple[Split, ...]:
        """Splits of `records`; a validation recording has nothing to train on."""
        empty = slice(0, 0)
        return self.splits + tuple(
            Split(
                empty,
                slice(self.init, r.n),
                f"judged only, after {self.init} samples",
                usual_split(self.graph, r).rest,
            )
            for r in self.validation
        )

    @cached_property
    def first_setting(self) -> SettledSetting:
        """Setting to begin with: floors from the recordings alone."""
        floors = []
        for i, (r, split) in enumerate(zip(self.straight_records, self.judged_splits, strict=True)):
            sensors = tuple(s.name for s in self.graph.of_type(Sensor) if s.name in r.channels)
            found = noise_floor(r, split, sensors)
            if not isinstance(self.noise, str):
                found |= {n: _nth(v, i) for n, v in self.noise.items() if n in found}
            still = {n: max(1e-9 * abs(float(r[n][0])), STILL) for n in sensors if not np.ptp(r[n])}
            floors.append(np.array([max(found[n], still.get(n, 0.0)) for n in sensors]))
        hold = "linear" if self.hold == ESTIMATED else self.hold
        begin = self.n_sub or (2 if hold == "band-limited" else 1)
        many = len(self.records)
        return SettledSetting(
            hold, (begin,) * many, tuple(floors), ((),) * many, (begin,) * many, (None,) * many
        )

    def problem(self, i: int, setting: SettledSetting) -> Problem:
        """Problem of one of `records`."""
        require_time_step(self.records[i])
        graph = self._one(i, self.records[i])
        recording = self.with_silence(self.straight_records[i])
        sensors = [s.name for s in graph.of_type(Sensor)]
        floor = dict(zip(sensors, setting.floors[i], strict=True))
        data = data_for(graph, recording, self.judged_splits[i], floor, setting.hold)
        made = replace(
            self.posed(graph, data),
            window=self.window,
            n_sub=setting.n_sub[i],
            correction=setting.corrections[i],
            window_offsets=True,
            whitening=setting.whitening[i],
        )
        return in_turn(self._with_states(self._scaled(self._built(made), i)), self.turns)

    def posed(self, graph: BondGraph, data: Data) -> Problem:
        """Ask what this study asks of a graph (its own, or one that adds to it) and of data."""
        names = graph.parameters
        priors = {v.name: v.prior for v in self.free if v.prior is not None}
        priors |= {p.name: gain_prior(p) for p in self.gains if not p.fixed}
        return Problem(
            graph,
            data,
            starts={k: v for k, v in self.starts.items() if k in names},
            source_offsets=self.nuisances.commands,
            gains=self.gains,
            fixed=tuple(n for n in names if n not in self.free_names),
            lags=self.nuisances.lags,
            offsets=self.nuisances.offsets,
            clock=self.nuisances.clock,
            priors=priors,
            overrides=self._freedom,
        )

    def whole(self, data: Data) -> Problem:
        """Ask what this study asks of all its recordings behind one another, see `Data.breaks`.

        The values that a parameter starts from are those of the problem's graph.

        Raises
        ------
        UnusableInput
            Parameters with a value in every recording are asked for.
        """
        if len(self.records) > 1 and (own := sorted(v.name for v in self.free if v.own)):
            raise UnusableInput(
                f"{', '.join(own)} would have a value in every recording; all of them are judged "
                "as one here, by one value: make it common, or diagnose the recordings one by one"
            )
        begun = {n: replace(p, value=self.starts[n]) for n, p in self._freedom.items()}
        posed = self.posed(self.straight_graph.with_values(self.starts), data)
        lags = self.nuisances.lags and self.window is None
        made = replace(posed, starts={}, overrides=begun, n_sub=self.n_sub or 1, lags=lags)
        return self._with_states(made)

    def _scaled(self, made: Problem, i: int) -> Problem:
        """Give the problem the scale of its states, simulated once for each way to run it."""
        key = (i, made.data.hold, made.n_sub)
        if key not in self._scales:
            self._scales[key] = made
            return made
        return replace(made, known_scale=self._scales[key].state_scale)

    @cached_property
    def _scales(self) -> dict[tuple[int, str, int], Problem]:
        return {}

    def _built(self, made: Problem) -> Problem:
        """Give the problem its dynamics, derived once for each choice of sensors."""
        if made.source_offsets:
            return made  # offsets are bounded by the commands of each record
        key = made.data.names
        if key not in self._dynamics:
            self._dynamics[key] = made.dynamics
        return replace(made, built=self._dynamics[key])

    @cached_property
    def _dynamics(self) -> dict[tuple[str, ...], Dynamics]:
        return {}

    def _with_states(self, made: Problem) -> Problem:
        states = made.dynamics.state_names
        known = self.initial if isinstance(self.initial, Mapping) else {}
        require_known("state", self.graph.name, states, *known)
        if self.initial == "rest":
            return replace(made, initial="rest")
        if not known:
            return made
        windows = 1 + len(made.data.breaks)
        return replace(
            made,
            initial=tuple(n for n in states if n not in known),
            known_states={n: np.full(windows, real_number(n, v)) for n, v in known.items()},
        )

    def stack(self, setting: SettledSetting | None = None) -> JointProblem:
        """Problems of the fitted recordings under one vector of unknowns."""
        if setting is None:
            return self._first_stack
        problems = [self.problem(i, setting) for i in range(len(self.recordings))]
        return stack_of(problems, self.own, self.record_names)

    @cached_property
    def _first_stack(self) -> JointProblem:
        """The stack to begin with, derived once a study and process."""
        return self.stack(self.first_setting)

    def fixing(self, values: Mapping[str, float]) -> Study:
        """Return the study with some parameters held at given values, SI."""
        free = [v for v in self.free if v.name not in values]
        return self.changed(free=free, fixed={**self.fixed, **values})

    def starting(self, values: Mapping[str, float]) -> Study:
        """Return the study with other start values (SI); clipped to the bounds."""
        free = []
        for v in self.free:
            if v.name in values:
                start = np.clip(values[v.name], *_ends(self._freedom[v.name]))
                v = replace(v, start=float(start))
            free.append(v)
        return self.changed(free=free)

    def changed(self, **changes: object) -> Study:
        """Return the study with other arguments, as `Study` takes them, checked again."""
        return _rebuilt({f.name: getattr(self, f.name) for f in fields(self)} | changes)

    def __reduce__(self) -> tuple[object, ...]:
        """Travel to worker processes by what was declared; compiled functions are rebuilt there."""
        return _rebuilt, ({f.name: getattr(self, f.name) for f in fields(self)},)

    def __repr__(self) -> str:
        """Short text."""
        names, n = ", ".join(self.free_names), len(self.recordings)
        many = "1 recording" if n == 1 else f"{n} recordings"
        return f"Study({self.graph.name!r}, {many}, free: {names})"

    def __str__(self) -> str:
        """Return the short text, and under it where each free parameter starts."""
        known = self.graph.parameters
        starts = (f"  {v.name} starts at {self.starts[v.name]:.6g} {known[v.name].unit}"
                  for v in self.free)  # fmt: skip
        return "\n".join([repr(self), *starts])

    def _repr_html_(self) -> str:
        """Return the free parameters with their starts and what is known of them."""
        known = self.graph.parameters
        rows = (
            (v.name, f"{self.starts[v.name]:.6g}", known[v.name].unit, v.prior or "")
            for v in self.free
        )
        return html_table(repr(self), ("free", "start", "unit", "known"), rows)


def _ends(p: Parameter) -> tuple[float, float]:
    return -np.inf if p.lower is None else p.lower, np.inf if p.upper is None else p.upper


def _rebuilt(declared: Mapping[str, object]) -> Study:
    return Study(**declared)  # type: ignore[arg-type]


def _nth(levels: float | Sequence[float], i: int) -> float:
    found = np.asarray(levels, float)
    return float(found[i] if found.ndim else found)
