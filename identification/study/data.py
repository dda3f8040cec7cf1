"""A recording seen through a model: commands, readings, noise floor, split."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.binding import external_signals
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import map_argument
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.split import stretches
from bondgraph.signals.units import GRAM, GRAVITY, same_dimension
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.study.channel_names import left_in, renamed, rivals_for, unread
from identification.study.factors import drives
from identification.study.read_after import READ_AFTER, between

SAME_CLOCK = 1e-6
"""Relative difference of sampling rates that is none."""


@dataclass(frozen=True)
class Data:
    """A recording seen through a model: commands, readings, noise floor, split.

    Attributes
    ----------
    commands : dict of str to ndarray, shape (N,), SI
    readings : ndarray, shape (N, n_y), SI
    names : tuple of str
        Sensors, in the order of `readings`.
    floor : ndarray, shape (n_y,), SI
        Standard deviation of the noise of each reading.
    split : Split
        Which samples are scored in training, which are held out.
    hold : str
        Behaviour of the commands, one of `read_after.BEHAVIOURS`.
    breaks : tuple of int
        First samples of further recordings, and `cuts`: from each a state of its own begins.
    cuts : tuple of int
        Those of `breaks` that begin no recording, but a further window of one.
    resolution : dict of str to float
        Unit of a sensor's converter, SI, where it is known: rounding to it is no finding.
    floor_measured : bool
        `floor` was read off the noise itself or is known, of every reading; not estimated from the
        spectrum.
    floor_known : frozenset of str
        Readings of which that holds, where it does not of every one.
    sha256 : str
        Of the recording's file; empty if there is none.
    finer : tuple of (int, dict)
        For each recording the steps a sample in which its commands are known, and these commands,
        shape ((n - 1) steps + 1,); see `joined.between_samples`. Empty: all at the samples alone.
    read_in : dict of str to str
        Unit of each channel's numbers, and of the `time`, before they were SI.
    begin : int
        First sample that is simulated from a free state. Long before the first that is scored one
        could be anything: it would have died away by then.
    """

    name: str
    time: Array
    commands: dict[str, Array]
    readings: Array
    names: tuple[str, ...]
    floor: Array
    split: Split
    hold: str = "linear"
    breaks: tuple[int, ...] = ()
    resolution: Mapping[str, float] = field(default_factory=dict)
    floor_measured: bool = False
    sha256: str = ""
    finer: tuple[tuple[int, Mapping[str, Array]], ...] = ()
    cuts: tuple[int, ...] = ()
    floor_known: frozenset[str] = frozenset()
    begin: int = 0
    read_in: Mapping[str, str] = field(default_factory=dict)

    @property
    def sure(self) -> Array:
        """Whether the noise of each reading is measured or known, shape (n_y,)."""
        return np.array([self.floor_measured or n in self.floor_known for n in self.names], bool)

    @property
    def between(self) -> str:
        """What the commands do between samples, one of `bondgraph.simulation.start.HOLDS`."""
        return between(self.hold)

    @property
    def reads_after(self) -> bool:
        """Whether readings are taken after the steps of held commands."""
        return self.hold == READ_AFTER

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.time.size)

    @cached_property
    def spread(self) -> Array:
        """Standard deviation of each reading over the whole record, SI, shape (n_y,).

        A reading that is not finite is missing, where a filter takes it so.
        """
        missing = np.isnan(self.readings)
        some = missing.any() and not missing.all(axis=0).any()
        return np.asarray((np.nanstd if some else np.std)(self.readings, axis=0))

    @property
    def dt(self) -> float:
        """Time between samples, s; the mean of several recordings."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    def step(self, window: slice) -> float:
        """Time between the samples of the recording that a window lies in, s."""
        if not self.breaks:
            return self.dt
        ends = (0, *self.breaks, self.n)
        k = bisect_right(self.breaks, window.start or 0)
        if ends[k + 1] - ends[k] < 2:
            return self.dt
        own = float((self.time[ends[k + 1] - 1] - self.time[ends[k]]) / (ends[k + 1] - ends[k] - 1))
        # one clock for all, but for the rounding of the stamps
        return self.dt if abs(own - self.dt) < SAME_CLOCK * self.dt else own

    @property
    def starts(self) -> tuple[int, ...]:
        """First samples of further recordings."""
        return tuple(b for b in self.breaks if b not in self.cuts)

    @cached_property
    def parts(self) -> int:
        """Steps of a sample in which the commands of every recording are known."""
        return math.lcm(*(steps for steps, _ in self.finer))

    def commanded(self, window: slice) -> tuple[int, Mapping[str, Array]]:
        """Return the steps a sample in which commands of a window are known, and these commands."""
        starts = self.starts
        k, last = (bisect_right(starts, i) for i in (window.start or 0, window.stop - 1))
        # of several recordings at once none has steps of its own
        steps, known = self.finer[k] if self.finer and k == last else (1, {})
        begin = (0, *starts)[k]
        own = slice((window.start - begin) * steps, (window.stop - 1 - begin) * steps + 1)
        return steps, {n: v[own] for n, v in known.items() if n in self.commands}

    def mask(self, part: str) -> Array:
        """Boolean mask of the samples of ``train``, ``test`` or ``held-out``.

        ``held-out`` is all that took no part in a fit: ``test``, and what choices have looked at.
        """
        m = np.zeros(self.n, bool)
        split = self.split
        chosen = stretches(split.train if part == "train" else split.test)
        for s in (*chosen, *(stretches(split.looked_at) if part == "held-out" else ())):
            m[s] = True
        return m

    def first(self, count: int) -> Data:
        """Return the first `count` samples, all of them scored in training."""
        split = Split(slice(0, count), slice(count, count), "the first samples")
        return replace(self.begun(count), split=split, begin=0)

    def begun(self, count: int) -> Data:
        """Return the first `count` samples; the split is carried over."""

        def part(s: slice | tuple[slice, ...]) -> tuple[slice, ...]:
            ends = ((p.start or 0, self.n if p.stop is None else p.stop) for p in stretches(s))
            kept = (slice(a, min(b, count)) for a, b in ends)
            return tuple(p for p in kept if p.start < p.stop)

        split = replace(
            self.split, train=part(self.split.train), test=part(self.split.test),
            looked_at=part(self.split.looked_at),
        )  # fmt: skip
        return replace(
            self,
            time=self.time[:count],
            commands={k: v[:count] for k, v in self.commands.items()},
            readings=self.readings[:count],
            split=split,
            breaks=tuple(b for b in self.breaks if b < count),
            begin=min(self.begin, count - 1),
        )

    def thinned(self, factor: int) -> Data:
        """Every `factor`-th sample; the split is carried over."""
        if factor == 1:
            return self

        def fewer(s: slice) -> slice:
            return slice(-(-(s.start or 0) // factor), -(-(s.stop or self.n) // factor))

        def part(s: slice | tuple[slice, ...]) -> slice | tuple[slice, ...]:
            return tuple(map(fewer, s)) if isinstance(s, tuple) else fewer(s)

        split = replace(self.split, train=part(self.split.train), test=part(self.split.test))
        return replace(
            self,
            time=self.time[::factor],
            commands={k: v[::factor] for k, v in self.commands.items()},
            readings=self.readings[::factor],
            split=split,
            breaks=tuple(-(-b // factor) for b in self.breaks),
            cuts=tuple(-(-b // factor) for b in self.cuts),
            finer=(),
            begin=self.begin // factor,
        )


def require_channels(graph: BondGraph, recording: Recording) -> None:
    """Refuse a recording that lacks a channel of the graph, or has one in another quantity."""
    inputs = [
        *((s.name, s.unit) for s in drives(graph)),
        *((n, "") for n in external_signals(graph)),
    ]
    readings_of = [(s.name, s.unit) for s in graph.of_type(Sensor)]
    for kind, wanted in (("input", inputs), ("sensor", readings_of)):
        for n, unit in wanted:
            if n not in recording.channels:
                same = rivals_for(unit, graph, recording)
                if len(same) > 1:
                    raise UnusableInput(
                        f"no channel for {kind} {n!r} in {recording.name}: {' and '.join(same)} "
                        f"are in {unit}; choose one with {map_argument(n, same[0])}"
                    )
                error = unknown_name(f"channel for {kind}", n, recording.name, recording.channels)
                if how := renamed(n, graph, recording):
                    raise UnusableInput(f"{error}; {how}")
                less = f", or leave it out of the model: graph.remove({n!r})"
                raise UnusableInput(
                    f"{error}{left_in(unit, graph, recording)}{unread(recording)}; name it with "
                    f"{map_argument(n)} or Recording.select"
                    f"{less if kind == 'sensor' else ''}"
                )
    for s in (*drives(graph), *graph.of_type(Sensor)):
        unit = recording.units[s.name]
        if s.unit and unit and not same_dimension(unit, s.unit):
            how = f"correct the header or choose the column with {map_argument(s.name)}"
            if recording.read_in.get(s.name) == GRAM and same_dimension(s.unit, GRAVITY):
                column = f"COLUMN[{GRAVITY}]"
                how = (
                    f"{GRAM} is the gram: for standard gravity write {s.name}[{GRAVITY}] in the "
                    f"header, or {map_argument(s.name, column)}"
                )
            raise UnusableInput(
                f"channel {s.name} of {recording.name} is in {unit}, the model {graph.name} has "
                f"{s.name} in {s.unit}; {how}"
            )


def data_for(
    graph: BondGraph,
    recording: Recording,
    split: Split,
    floor: Mapping[str, float],
    hold: str = "linear",
) -> Data:
    """Match the channels of `recording` to the inputs and sensors of `graph` by name."""
    require_channels(graph, recording)
    outside = external_signals(graph)
    sources = [*(s.name for s in drives(graph)), *outside]
    sensors = [s.name for s in graph.of_type(Sensor)]
    readings = np.stack([recording[n] for n in sensors], axis=1)
    return Data(
        recording.name,
        np.asarray(recording.time),
        {n: np.asarray(recording[n]) for n in sources},
        readings,
        tuple(sensors),
        np.array([floor[n] for n in sensors]),
        split,
        hold,
        sha256=recording.sha256, read_in=recording.read_in,
    )  # fmt: skip
