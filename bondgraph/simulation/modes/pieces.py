"""The pieces of a switched simulation, one after the other, and where guards end them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.modes.crossing import GuardMargins, Located
from bondgraph.simulation.modes.guards import SwitchEvent
from bondgraph.simulation.modes.inputs import Inputs
from bondgraph.simulation.modes.mode_run import ModeRun, ModeState, Passage
from bondgraph.simulation.modes.resolve import mode_of
from bondgraph.simulation.modes.states import Mode, taken_over
from bondgraph.simulation.modes.watching import Watch
from bondgraph.simulation.trajectory import Trajectory, units_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, GraphError

MOST_EVENTS = 100
"""Within one sample interval; more is a chattering."""
MOST_TRIED = 256
"""Modes that are tried at one switch."""
ROUNDED = 1e-15
"""Share of a time by which it may be off a sample and still be that of the sample."""
_PARTS = 4
_LEAST, _FIRST = 16, 64


@dataclass
class Entry:
    """A mode where it begins."""

    run: ModeRun
    state: ModeState
    shift: dict[str, float]
    margins: GuardMargins | None


class Pieces:
    """The pieces so far: what is held at their end, the samples, and the events."""

    def __init__(
        self,
        graph: BondGraph,
        watch: Watch,
        inputs: Inputs,
        parameters: Mapping[str, float],
        accuracy: float,
        tolerance: float,
    ) -> None:
        self.graph, self.watch, self.inputs, self.parameters = graph, watch, inputs, parameters
        self.accuracy, self.tolerance = accuracy, tolerance
        self.mode = mode_of(graph)
        self.outputs: dict[str, Array] = {}
        self.held: dict[str, float] = {}
        self.largest: dict[str, float] = {}
        self.seen: dict[tuple[str, str], float] = {}
        self.shift: dict[str, float] = {}
        self.memory: dict[str, Sequence[float]] = {}
        self.state = np.zeros(0)
        self.finest = 1
        self.events: list[SwitchEvent] = []
        self._runs: dict[tuple[bool, ...], ModeRun] = {}
        self._windows: dict[tuple[bool, ...], int] = {}
        self._interval, self._busy = -1, Counter[str]()
        self._begun: tuple[ModeRun, ModeState] | None = None

    # -- from one switch to the next --------------------------------------------------------
    def stretch(
        self,
        changes: Mapping[str, bool],
        begin: float,
        end: float,
        start: Mapping[str, float] | None = None,
    ) -> None:
        """Simulate from `begin`, where the schedule makes `changes`, to `end`; guards act."""
        if not self.held:
            self._begin({**self.mode, **changes}, begin, start)
        asked, now = {**self.mode, **changes}, begin
        while True:
            entry = self._entered(asked, now)
            found = self._piece(entry, now, end)
            if found is None:
                return
            now, acting = found
            self._count(now, acting)
            asked = {**self.mode, **{n: not self.mode[n] for n in acting}}

    def _begin(
        self, mode: Mapping[str, bool], begin: float, start: Mapping[str, float] | None
    ) -> None:
        """Take the start of the record for what is held."""
        run = self._run(mode)
        state = run.begun(start or {})
        self.memory |= state.memory
        first = run.now(begin, state)
        self._hold(run, first.y)
        self.mode, self._begun = dict(mode), (run, first.state)

    def _piece(
        self, entry: Entry, begin: float, end: float
    ) -> tuple[float, tuple[str, ...]] | None:
        """Run one mode until a guard acts, and return when and of which junctions; or to `end`."""
        run, state, now, new = entry.run, entry.state, begin, True
        key = tuple(self.mode.values())
        window = self._windows.get(key, _FIRST)
        while end - now > self.inputs.slack:
            times = self._chunk(now, end, window if entry.margins else self.inputs.grid.size)
            made = run.settled(times, state)
            self.finest = max(self.finest, made.n_sub)
            found = None
            if entry.margins is not None:
                found = entry.margins.first_crossing(made, state)
            rows = made.times.size if found is None else found.sample + 1
            self._keep(run, made.times[:rows], made.y[:rows], skip=0 if new else 1)
            self._measure(run, made.y[: rows + 1])  # a guard acts up to a sample later
            new = False
            if found is not None:
                return self._stopped(entry, made.times, found, key, begin)
            if entry.margins is not None:
                self._notice(entry.margins, made.y)
            state, now, window = made.end, float(made.times[-1]), 2 * window
            self._remember(run, made)
        self.state = state.x
        return None

    def _stopped(
        self, entry: Entry, times: Array, found: Located, key: tuple[bool, ...], begin: float
    ) -> tuple[float, tuple[str, ...]]:
        time = float(times[found.sample] + found.after)
        self._windows[key] = max(_LEAST, int((time - begin) / self.inputs.step) + 2)
        assert entry.margins is not None
        self._notice(entry.margins, found.run.y)
        self._remember(entry.run, found.run)
        self.state = found.run.end.x
        return time, found.acting

    def _chunk(self, now: float, end: float, window: int) -> Array:
        """Return even times from `now` on: to the next sample, along samples, or to `end`."""
        grid = self.inputs.grid
        exact = ROUNDED * (self.inputs.step + abs(now))
        near = min(int(np.searchsorted(grid, now - 0.5 * self.inputs.step)), grid.size - 1)
        if abs(grid[near] - now) <= exact:
            last = int(np.searchsorted(grid, end + self.inputs.slack)) - 1
            if last > near:
                return grid[near : min(last, near + window) + 1]
        ahead = int(np.searchsorted(grid, now + exact))
        to = min(end, float(grid[ahead])) if ahead < grid.size else end
        return np.linspace(now, to, (_PARTS if self.watch else 1) + 1)

    def _count(self, now: float, acting: tuple[str, ...]) -> None:
        """Refuse more events in one sample interval than make sense."""
        grid = self.inputs.grid
        interval = int((now - grid[0]) / self.inputs.step)
        if interval != self._interval:
            self._interval, self._busy = interval, Counter()
        self._busy.update(acting)
        name, count = self._busy.most_common(1)[0]
        if count > MOST_EVENTS:
            raise GraphError(
                f"{self.graph.name}: {name} switches more than {MOST_EVENTS} times between two "
                f"samples, up to {now:.9g} s: it chatters; set its off level apart from its on "
                "level, put a resistance or a store where its signal jumps, or sample finer"
            )

    # -- modes ------------------------------------------------------------------------------
    def _run(self, mode: Mapping[str, bool]) -> ModeRun:
        """Return a mode ready to run; compiled once."""
        key = tuple(mode[n] for n in self.mode)
        if key not in self._runs:
            from bondgraph.simulation.modes.opening import opened

            made = Mode(self.graph, mode, self.watch)
            self._runs[key] = opened(made, self.inputs, self.parameters, self.accuracy)
        return self._runs[key]

    def _entered(self, asked: Mapping[str, bool], now: float) -> Entry:
        """Enter the mode that is asked for, or the one that guards make of it."""
        mode, entry = self._consistent(asked, now)
        switched = (n for n in self.watch.guards if mode[n] != self.mode[n])
        self.events += [SwitchEvent(float(now), n, mode[n]) for n in switched]
        self.mode, self.shift = mode, entry.shift
        return entry

    def _consistent(self, asked: Mapping[str, bool], now: float) -> tuple[dict[str, bool], Entry]:
        """Return the mode that guards make of the one asked for, or else the nearest that fits.

        What a switch asks for may have no state: a coil whose last path has opened, until a diode
        takes its current.
        """
        tried: dict[tuple[bool, ...], tuple[str, ...]] = {}
        refusals: list[BondsightError] = []
        mode = dict(asked)

        def fitting(mode: dict[str, bool]) -> Entry | None:
            try:
                entry = self._entry(mode, now)
            except BondsightError as error:
                if not self.watch:
                    raise
                refusals.append(error)
                return None
            wanting = entry.margins.wanting if entry.margins else ()
            tried[tuple(mode.values())] = wanting
            return None if wanting else entry

        while tuple(mode.values()) not in tried:
            if (entry := fitting(mode)) is not None:
                return mode, entry
            if refusals:
                break
            mode = {**mode, **{n: not mode[n] for n in tried[tuple(mode.values())]}}
        for other in islice(self._near(asked), MOST_TRIED):
            if tuple(other.values()) not in tried and (entry := fitting(other)) is not None:
                return other, entry
        if refusals:
            why = f"{refusals[0]}; no other state of its guarded junctions fits"
            raise GraphError(why) from refusals[0]
        names = ", ".join(dict.fromkeys(n for wanting in tried.values() for n in wanting))
        raise GraphError(
            f"{self.graph.name}: at {now:.9g} s the guards contradict each other: in every mode "
            f"one of {names} wants to switch; set levels apart, or let a signal that jumps at a "
            "switch be one that a store holds"
        )

    def _near(self, mode: Mapping[str, bool]) -> Iterator[dict[str, bool]]:
        """Yield modes with guarded junctions switched, few of them first."""
        names = tuple(self.watch.guards)
        for count in range(len(names) + 1):
            for chosen in combinations(names, count):
                yield {**mode, **{n: not mode[n] for n in chosen}}

    def _entry(self, mode: Mapping[str, bool], now: float) -> Entry:
        run = self._run(mode)
        first = run.now(now, self._taken_over(run, now))
        shift = dict(self.shift)
        for n in run.mode.taps:
            if (before := self.held.get(f"y {n}")) is not None:
                shift[n] = before - float(first.y[run.columns[n]])
        margins = GuardMargins(run, first, shift, self.seen) if self.watch else None
        return Entry(run, first.state, shift, margins)

    # -- taking over ------------------------------------------------------------------------
    def _taken_over(self, run: ModeRun, now: float) -> ModeState:
        """Return the state of a mode in which every storage holds what it held."""
        mode = run.mode
        if self._begun is not None and self._begun[0] is run and now == self.inputs.grid[0]:
            return self._begun[1]
        memory = {n: m for n, m in self.memory.items() if n in mode.remembering}

        def holds(x: Array) -> Mapping[str, float]:
            y = run.now(now, ModeState(x, memory)).y
            return {n: float(y[run.columns[n]]) for n in mode.carried}

        x = taken_over(mode, self.held, self.largest, holds, now, self.tolerance)
        return ModeState(x, memory)

    # -- what is kept -----------------------------------------------------------------------
    def _keep(self, run: ModeRun, times: Array, y: Array, skip: int) -> None:
        """Keep the rows that lie on the grid, but the first where it was kept already."""
        grid, slack = self.inputs.grid, self.inputs.slack
        near = np.clip(np.searchsorted(grid, times - slack), 0, grid.size - 1)
        on_grid = np.abs(grid[near] - times) <= slack
        on_grid[:skip] = False
        for n in run.mode.shown:
            values = y[:, run.columns[n]] + self.shift.get(n, 0.0)
            self.outputs.setdefault(n, np.zeros(grid.size))[near[on_grid]] = values[on_grid]

    def _measure(self, run: ModeRun, y: Array) -> None:
        """Take note of how large the contents become."""
        for n in run.mode.carried:
            size = float(np.abs(y[:, run.columns[n]]).max())
            self.largest[n] = max(self.largest.get(n, 0.0), size)

    def _remember(self, run: ModeRun, made: Passage) -> None:
        self.memory |= made.end.memory
        self._hold(run, made.y[-1])

    def _hold(self, run: ModeRun, y: Array) -> None:
        for n in run.mode.shown:
            self.held[f"y {n}"] = float(y[run.columns[n]]) + self.shift.get(n, 0.0)
        for n in run.mode.carried:
            self.held[n] = float(y[run.columns[n]])
        self._measure(run, y[None])

    def _notice(self, margins: GuardMargins, y: Array) -> None:
        signals = margins.signals(y)
        margins.left(margins.of(y))
        for k, c in enumerate(margins.conditions):
            key = c.junction, c.reading
            self.seen[key] = max(self.seen.get(key, 0.0), float(np.abs(signals[:, k]).max()))

    def trajectory(self) -> Trajectory:
        """Return all pieces as one record."""
        return Trajectory(
            self.graph.name, self.inputs.grid, self.outputs, {}, self.finest, self.state,
            {n: tuple(m) for n, m in self.memory.items()}, units=units_of(self.graph),
            events=tuple(self.events),
        )  # fmt: skip
