"""Piecewise simulation of a switched graph: one mode after the other, states carried over.

Switch times are inputs: nothing here detects an event (a diode that would open, a stop that would
be hit). A piece is simulated by `bondgraph.simulate`, so every mode must be linear up to scalar
laws. What the storages hold is continuous at a switch. A mode in which a storage depends on others
(or on a source) takes over only values that fit; where they do not, the switch would need an
impulse and is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.simulation.modes.resolve import mode_of
from bondgraph.simulation.modes.states import Mode, taken_over
from bondgraph.simulation.simulate import rested, simulate
from bondgraph.simulation.start import own_input, usual_hold
from bondgraph.simulation.timing import is_timed, read, sent, without_timing
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import GraphError, UnusableInput, unknown_name

Schedule = Sequence[tuple[float, Mapping[str, bool]]]
"""Times of switching (s, rising) and what each changes."""

Signals = Mapping[str, Array]
_SHORT = 1e-9


def simulate_modes(
    graph: BondGraph,
    time: Array,
    schedule: Schedule,
    commands: Signals | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    start: Mapping[str, float] | None = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
    tolerance: float = 1e-6,
) -> Trajectory:
    """Simulate `graph` through given switch times.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid. Switch times need not lie on it.
    schedule : sequence of (float, mapping of str to bool)
        At each time, which switched junctions go on or off; before, they are as declared.
    commands : dict of str to ndarray, shape (N,), SI
        Command of each source.
    parameters : dict of str to float
        Values that differ from the declared ones.
    start : dict of str to float
        States at the first sample by name (``q_C_1``, ``p_L``); the others are those of rest with
        all inputs at zero.
    hold : {"hold", "linear"}, optional
        What the inputs do between samples. When not given, they are held, as by a converter; linear
        where one is recorded by its rate or its integral.
    accuracy : float
        As in `bondgraph.simulate`.
    tolerance : float
        A store may differ by so much of its largest value so far from what a new mode dictates.

    Returns
    -------
    Trajectory
        Outputs at `time`; a sample at a switch belongs to the new mode. `laws` is empty, `state`
        is that of the last mode.

    Raises
    ------
    GraphError
        A switch would need an impulse (the line names the store), or a mode has no equations.
    UnusableInput
        Times that do not rise or lie outside of `time`.
    """
    if is_timed(graph):
        between, before = hold or usual_hold(graph, ()), None if start else 0.0
        arrived = sent(graph, time, commands, parameters, before, between)
        made = simulate_modes(
            without_timing(graph), time, schedule, arrived, parameters,
            start=start, hold=hold, accuracy=accuracy, tolerance=tolerance,
        )  # fmt: skip
        return replace(made, outputs=read(graph, made.time, made.outputs, parameters))
    grid = _checked_grid(graph, time)
    given = {k: np.asarray(v, float) for k, v in (commands or {}).items()}
    hold = hold or usual_hold(graph, ())
    if hold not in ("linear", "hold"):
        raise unknown_name("inter-sample behaviour", hold, "simulate_modes", ("linear", "hold"))
    if hold == "hold" and (by := [s.name for s in graph.of_type(Source) if s.given == "integral"]):
        raise UnusableInput(
            f"{graph.name}: the equations need the rate of what is recorded of {by[0]}, but an "
            "input that is held jumps between samples; leave hold out, or use hold='linear'"
        )
    for name, values in given.items():
        if values.shape != grid.shape:
            raise UnusableInput(
                f"{graph.name}: input {name} has shape {values.shape}, time has {grid.shape}"
            )
    pieces = _pieces(graph, grid, schedule)
    run = _Run(grid, given, dict(parameters or {}), hold, accuracy, tolerance)
    for begin, end, mode in pieces:
        run.piece(Mode(graph, mode), begin, end, start if begin == grid[0] else None)
    return run.trajectory(graph.name)


def _checked_grid(graph: BondGraph, time: Array) -> Array:
    grid = np.asarray(time, float)
    steps = np.diff(grid)
    even = grid.ndim == 1 and grid.size >= 2 and steps.min() > 0
    if not even or not np.allclose(steps, steps.mean(), rtol=1e-3, atol=0):
        raise UnusableInput(f"{graph.name}: time needs at least two samples that rise evenly")
    return grid


def _pieces(
    graph: BondGraph, grid: Array, schedule: Schedule
) -> list[tuple[float, float, dict[str, bool]]]:
    """Begin, end and mode of each piece."""
    mode = mode_of(graph)
    if not mode:
        raise GraphError(f"{graph.name} has no switched junction; simulate(graph, ...) serves it")
    found = []
    begin = float(grid[0])
    slack = _SHORT * (grid[1] - grid[0])
    for t, changes in schedule:
        if not begin <= t <= grid[-1]:
            raise UnusableInput(
                f"{graph.name}: switch at {t:g} s: times must rise from {grid[0]:g} s to "
                f"{grid[-1]:g} s"
            )
        if t - begin > slack:
            found.append((begin, float(t), dict(mode)))
            begin = float(t)
        for name, on in changes.items():
            if name not in mode:
                raise unknown_name("switched junction", name, graph.name, mode)
            mode[name] = on
    if grid[-1] - begin > slack:
        found.append((begin, float(grid[-1]), dict(mode)))
    return found


@dataclass
class _Run:
    """The pieces so far."""

    grid: Array
    commands: Signals
    parameters: Mapping[str, float]
    hold: str
    accuracy: float
    tolerance: float
    outputs: dict[str, list[Array]] = field(default_factory=dict)
    held: dict[str, float] = field(default_factory=dict)
    largest: dict[str, float] = field(default_factory=dict)
    shift: dict[str, float] = field(default_factory=dict)
    memory: dict[str, tuple[float, ...]] = field(default_factory=dict)
    state: Array = field(default_factory=lambda: np.zeros(0))
    finest: int = 1

    def piece(
        self, mode: Mode, begin: float, end: float, start: Mapping[str, float] | None
    ) -> None:
        """Simulate one mode from `begin` to `end` and keep its samples."""
        first = not self.held
        x = self._start(mode, begin, start) if first else self._taken_over(mode, begin)
        readings = {n: self.held.get(f"y {n}") for n in mode.taps}
        times = self._times(begin, end)
        chunks = even_runs(times)
        for i, chunk in enumerate(chunks):
            done = self._simulate(mode, chunk, x)
            x = done.state
            self.memory |= done.memory
            if i == 0 and not first:
                for n, before in readings.items():
                    if before is not None:
                        self.shift[n] = before - float(done[n][0])
            self._keep(mode, done, last=i == len(chunks) - 1 and end >= self.grid[-1])
        self.state = x

    def _times(self, begin: float, end: float) -> Array:
        slack = _SHORT * (self.grid[1] - self.grid[0])
        inside = self.grid[(self.grid > begin + slack) & (self.grid < end - slack)]
        return np.concatenate([[begin], inside, [end]])

    def _at(self, mode: Mode, times: Array) -> dict[str, Array]:
        # a sensor drifts along the whole record, not once a piece
        own = {n: own_input(n, self.grid.size) for n in mode.compiled.inputs if n != "one"}
        signals = {**{n: v for n, v in own.items() if v is not None}, **self.commands}
        if self.hold == "hold":
            slack = _SHORT * (self.grid[1] - self.grid[0])
            index = np.searchsorted(self.grid, times + slack, side="right") - 1
            index[-1] = max(index[0], np.searchsorted(self.grid, times[-1] - slack) - 1)
            return {n: v[np.clip(index, 0, None)] for n, v in signals.items()}
        return {n: np.interp(times, self.grid, v) for n, v in signals.items()}

    def _simulate(self, mode: Mode, times: Array, x: Array | None) -> Trajectory:
        done = simulate(
            mode.compiled,
            times,
            self._at(mode, times),
            self.parameters,
            x0=x,
            hold=self.hold,
            accuracy=self.accuracy,
            memory={n: m for n, m in self.memory.items() if n in _remembering(mode)},
        )
        self.finest = max(self.finest, done.steps_per_sample)
        return done

    def _keep(self, mode: Mode, done: Trajectory, *, last: bool) -> None:
        slack = _SHORT * (self.grid[1] - self.grid[0])
        near = np.searchsorted(self.grid, done.time - slack)
        on_grid = np.abs(self.grid[np.clip(near, 0, self.grid.size - 1)] - done.time) <= slack
        if not last:
            on_grid[-1] = False  # the next piece gives it
        for n in mode.compiled.model.output_names:
            values = done[n] + self.shift.get(n, 0.0)
            self.outputs.setdefault(n, []).append(values[on_grid])
            self.held[f"y {n}"] = float(values[-1])
        for n in mode.carried:
            self.held[n] = float(done[n][-1])
            self.largest[n] = max(self.largest.get(n, 0.0), float(np.abs(done[n]).max()))

    # -- taking over ------------------------------------------------------------------------
    def _start(self, mode: Mode, begin: float, start: Mapping[str, float] | None) -> Array:
        from bondgraph.simulation.start import inputs_of

        now = {n: v[:1] for n, v in self.commands.items()}
        model, p = mode.compiled, mode.compiled.vector(self.parameters)
        first = inputs_of(mode.compiled, now, np.zeros(1))
        x, memory = rested(model, p, first, self.grid[1] - self.grid[0], None, None)
        if not start:  # where states are given, laws are relaxed at these
            self.memory |= {n: tuple(m) for n, m in (memory or {}).items()}
        for name, value in (start or {}).items():
            if name not in mode.states:
                raise unknown_name("state", name, f"mode {mode.text}", mode.states)
            x[mode.states.index(name)] = value
        return x

    def _taken_over(self, mode: Mode, begin: float) -> Array:
        """Return the state of a new mode in which every storage holds what it held."""
        probe = np.array([begin, begin + (self.grid[1] - self.grid[0])])

        def holds(x: Array) -> Mapping[str, float]:
            done = self._simulate(mode, probe, x)
            return {n: float(done[n][0]) for n in mode.carried}

        return taken_over(mode, self.held, self.largest, holds, begin, self.tolerance)

    def trajectory(self, name: str) -> Trajectory:
        """Return all pieces as one record."""
        outputs = {n: np.concatenate(parts) for n, parts in self.outputs.items()}
        return Trajectory(name, self.grid, outputs, {}, self.finest, self.state, dict(self.memory))


def _remembering(mode: Mode) -> set[str]:
    return {port.element for port in mode.compiled.laws if port.law.n_memory}


def even_runs(times: Array) -> list[Array]:
    """Cut rising times, of which only the first and the last step may differ, into even runs."""
    if times.size <= 2:
        return [times]
    steps = np.diff(times)
    middle: Any = np.median(steps[1:-1]) if steps.size > 2 else steps.max()
    first = 0 if np.isclose(steps[0], middle, rtol=1e-6, atol=0) else 1
    last = times.size - (0 if np.isclose(steps[-1], middle, rtol=1e-6, atol=0) else 1)
    cuts = [times[: first + 1]] if first else []
    if last - first >= 2:
        cuts.append(times[first:last])
    if last < times.size:
        cuts.append(times[last - 1 :])
    return cuts
