"""What a diagnosis is asked: a graph with its recordings, or a study of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import require_map
from bondgraph.signals.files.columns import OTHERS
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.datasets.opening import match_by_unit, open_recording
from identification.estimation.cautions import miscalibrated
from identification.estimation.methods import METHODS
from identification.estimation.single_record import Fit
from identification.study.admission import distinct_names
from identification.study.data import Data, require_channels
from identification.study.factors import drives
from identification.study.free_parameters import idle
from identification.study.joined import between_samples, picked
from identification.study.problem import Problem
from identification.study.residual import windows
from identification.study.scaled import Free
from identification.study.specification import Vary
from identification.study.study import ESTIMATED, Study
from identification.study.turns import turning_graph
from identification.study.usual_split import usual_splits

Given = Any
"""A recording, the path of one (or its name in the catalogue), or a data frame."""


@dataclass(frozen=True, eq=False)
class Asked:
    """One statement, however it was made.

    Attributes
    ----------
    study : Study
        What is free and known, as it was given, or as the graph says.
    graph : BondGraph
        Its graph at the start values, without jumps of readings that begin anew after each turn.
    recordings : tuple of Recording
        At one rate, without such jumps, too; those that are only judged come last.
    split : Split or None
        Of all recordings behind one another; None for the usual one.
    hold : str or None
        Behaviour of the commands between samples; None chooses it.
    noise : dict of str to float
        Known standard deviations of readings, SI.
    cuts : tuple of int
        First samples of windows with an initial state of their own, if the study asks for them.
    given : tuple of Recording
        The recordings as they were given, at their own rates.
    """

    study: Study
    graph: BondGraph
    recordings: tuple[Recording, ...]
    split: Split | None = None
    hold: str | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    cuts: tuple[int, ...] = ()
    given: tuple[Recording, ...] = ()

    @cached_property
    def finer(self) -> tuple[tuple[int, dict[str, Array]], ...]:
        """What the channels do between the samples of `recordings`."""
        return between_samples(self.given)

    def problem(self, data: Data) -> Problem:
        """All of it as one problem: each recording from a state of its own."""
        return self.study.whole(data)

    def notes_of(self, last: Fit) -> tuple[str, ...]:
        """Return what is taken otherwise than in a fit of the study, and what that would say."""
        found = (*last.estimates, *last.nuisances)
        coloured = (
            "coloured noise: fits weigh all samples of a reading alike; comparisons are freed of a "
            "pole of its noise, intervals are those of blocks; estimate(found.study) fits it"
        )
        constants = (
            "an offset of each command is one for all recordings, where a fit takes one each"
        )
        apart = self.study.nuisances.commands and len(self.study.records) > 1
        cut = (
            f"windows of {self.study.window} samples begin from states of their own, held-out ones "
            "from states fitted to their samples; sensors have neither lags nor clocks of their "
            "own in them"
        )
        said = {coloured: self.study.noise == "coloured", constants: apart, cut: bool(self.cuts)}
        taken = tuple(text for text, holds in said.items() if holds)
        return (*taken, *miscalibrated(self.graph, self.study.nuisances.gains, found))

    @property
    def disturbed(self) -> bool:
        """Whether the rates move at random, as a study says."""
        return bool(self.study.process_noise)

    @property
    def n_free(self) -> int:
        """How many parameters are fitted."""
        return len(self.study.free)

    def about(self, last: Fit) -> Study:
        """Return the study of another model of the same recordings, to begin where a fit ended."""
        values = _inside(last)
        graph = turning_graph(last.problem.graph.with_values(values), self.study.graph)
        hold = last.problem.data.hold
        old = self.study.graph.parameters
        new = [Vary(n) for n, p in graph.parameters.items() if n not in old and not p.fixed]
        begun, steps = self.study.starting(values), self.study.n_sub and last.problem.n_sub
        kept = [v for v in begun.free if v.name in graph.parameters and v.name not in idle(graph)]
        moving = replace(begun.nuisances, commands=last.problem.source_offsets)
        return begun.changed(
            graph=graph, hold=hold, n_sub=steps, free=(*kept, *new), nuisances=moving
        )

    def again(self, last: Fit) -> Study:
        """Return the study that a fit of the search answers, to begin and to end where that did.

        Noise and sub-steps are those of the fit, and bounds stay where they were: a spread around
        a declared value does not move with the value. A filter settles its noise by itself.
        """
        study, fitted, split = self.about(last), last.problem, self.split
        bounded = {f.parameter.name: f for f in fitted.free if f.parameter.spread is not None}
        free = [_between(v, bounded[v.name], last) if v.name in bounded else v for v in study.free]
        more: dict[str, Any] = {"free": free}
        if not study.process_noise and study.noise != "coloured":
            floors = map(float, fitted.data.floor)
            more["noise"] = dict(zip(fitted.data.names, floors, strict=True))
        if not study.process_noise and not fitted.exact:
            more["n_sub"] = fitted.n_sub
        if len(self.given) == 1 and split is not None and _plain(split):
            more["splits"] = split
        return study.changed(**more)


def _inside(last: Fit) -> dict[str, float]:
    """Return the values of a fit by the names of its graph; rounding leaves none beyond a bound."""
    known, found = last.problem.graph.parameters, dict(last.values)
    for n in (*(f.parameter.name for f in last.problem.free), *last.problem.delays):
        if (p := known.get(n)) is not None:
            low, high = (-np.inf if p.lower is None else p.lower), p.upper
            found[n] = float(np.clip(found[n], low, np.inf if high is None else high))
    return {n: v for n, v in found.items() if n in known}


def _between(v: Vary, fitted: Free, last: Fit) -> Vary:
    low, high = map(fitted.value, fitted.bounds())
    return replace(v, lower=low, upper=high, start=min(max(last.values[v.name], low), high))


def _plain(split: Split) -> bool:
    return isinstance(split.train, slice) and isinstance(split.test, slice)


def asked_of(
    asked: BondGraph | Study,
    recordings: Given | Sequence[Given] | None,
    split: Split | None,
    hold: str | None,
    noise: Mapping[str, float],
    map: Mapping[str, str] | None = None,
) -> Asked:
    """Bring a graph with recordings, or a study, to one statement.

    Raises
    ------
    UnusableInput
        Recordings beside a study, none beside a graph, or what no diagnosis can take of a study.
    """
    if not isinstance(asked, Study):
        if not isinstance(asked, BondGraph):
            raise UnusableInput(
                f"diagnose takes a BondGraph or a Study, not {type(asked).__name__}"
            )
        if recordings is None:
            raise UnusableInput(f"{asked.name}: there is no recording to diagnose; give one")
        given, divided = _opened(asked, recordings, map or {})
        alike = _of_one_kind(asked, given)
        for r in alike:
            require_channels(asked, r)
        study = Study(asked, alike, hold=hold or ESTIMATED)
        return asked_of(study, None, split or divided, hold, noise)
    if recordings is not None:
        raise UnusableInput(
            "diagnose takes a graph with recordings or a study, which has its own; leave the "
            "recordings out, or use study.changed(recordings=...)"
        )
    if map:
        raise UnusableInput(
            f"map = {dict(map)!r} beside a study, whose recordings are read: name the columns in "
            "Recording.read(path, map=...)"
        )
    straight = [asked.with_silence(r) for r in asked.straight_records]
    own = _of_one_kind(asked.graph, straight)
    found = picked(own)
    same = [r.n for r in found] == [r.n for r in own]
    known = None if asked.hold == ESTIMATED else asked.hold
    return Asked(
        asked, asked.straight_graph.with_values(asked.starts), found, split or _split(asked, same),
        hold or known, {**_levels(asked), **noise}, _cuts(asked, same), own,
    )  # fmt: skip


def _opened(
    graph: BondGraph, given: Given | Sequence[Given], map: Mapping[str, str]
) -> tuple[list[Recording], Split | None]:
    """Return recordings, read where they are files or tables; the split that one of them states."""
    several = isinstance(given, Sequence) and not isinstance(given, str)
    made = [_recording(graph, g, map) for g in (given if several else [given])]
    return [r for r, _ in made], made[0][1] if len(made) == 1 else None


def _recording(
    graph: BondGraph, given: Any, map: Mapping[str, str]
) -> tuple[Recording, Split | None]:
    if isinstance(given, Recording):
        require_map(map)
        return given.select({OTHERS: OTHERS, **map}) if map else given, None
    if isinstance(given, str | Path):
        recording, split, _ = open_recording(str(given), graph, map)
        return recording, split
    if hasattr(given, "columns") and hasattr(given, "to_numpy"):
        return match_by_unit(Recording.from_pandas(given, map=map or None), graph)[0], None
    raise UnusableInput(
        f"{graph.name}: what is to be diagnosed is no recording but {type(given).__name__}; give a "
        "Recording, the path of a file or a DataFrame"
    )


OF_ONE_RATE = (
    "splits or windows of recordings of different rates: bring these to one rate, or leave splits "
    "and window out"
)


def _cuts(study: Study, same: bool) -> tuple[int, ...]:
    """Return where windows begin, all recordings behind one another; none without windows."""
    if study.window is None:
        return ()
    if not same:
        raise UnusableInput(OF_ONE_RATE)
    METHODS["prediction_error" if study.process_noise else "single_shooting"].check(study)
    first, found = 0, set[int]()
    for i, r in enumerate(study.records):
        found |= {first, *(first + w.start for w in windows(study.problem(i, study.first_setting)))}
        first += r.n
    return tuple(sorted(found - {0}))


def _of_one_kind(graph: BondGraph, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return recordings with the channels that all have; those of the model must be among them."""
    if not recordings:
        return ()
    everywhere = [c for c in recordings[0].channels if all(c in r.channels for r in recordings)]
    names = distinct_names([r.name for r in recordings])
    for e in (*drives(graph), *graph.of_type(Sensor)):
        has = {n: e.name in r.channels for n, r in zip(names, recordings, strict=True)}
        if any(has.values()) and not all(has.values()):
            lacking = next(n for n, there in has.items() if not there)
            what, cure = "source", f"a study with silent=({e.name!r},) takes it as zero"
            if isinstance(e, Sensor):
                what, cure = "sensor", f"take graph.remove({e.name!r}); estimate takes both"
            raise UnusableInput(
                f"{lacking} has no channel {e.name} for the {what} of {graph.name}, other "
                f"recordings have; leave {lacking} out, or {cure}"
            )
    if all(list(r.channels) == everywhere for r in recordings):
        return tuple(recordings)
    return tuple(r.select({c: c for c in everywhere}) for r in recordings)


def _levels(study: Study) -> dict[str, float]:
    found = {}
    for name, level in study.noise.items() if isinstance(study.noise, Mapping) else ():
        levels = {float(v) for v in np.ravel(level)}
        if len(levels) > 1:
            raise UnusableInput(
                f"noise of {name}: a deviation for every recording; a diagnosis takes one for all"
            )
        found[name] = levels.pop()
    return found


def _split(study: Study, same: bool) -> Split | None:
    """Return the samples that a study holds out; None where it leaves that to the usual rule."""
    usual = study.splits == usual_splits(study.graph, study.recordings)
    usual = usual and study.window is None  # windows end where the study's parts do
    if usual and not study.validation:
        return None
    if usual:
        edge = begin = sum(r.n for r in study.recordings)
        judged: list[slice] = []
        for r in study.validation:
            judged.append(slice(begin + study.init, begin + r.n))
            begin += r.n
        if same:
            return Split(slice(0, edge), tuple(judged), "the recordings to judge held out")
        raise UnusableInput(
            "recordings to judge of another rate: bring all to one rate, see Recording.decimate"
        )
    if not same:
        raise UnusableInput(OF_ONE_RATE)
    train: list[slice] = []
    test: list[slice] = []
    begin = 0
    for r, s in zip(study.records, study.judged_splits, strict=True):
        for part, into in ((s.train, train), (s.test, test)):
            assert isinstance(part, slice)
            if part.stop > part.start:
                into.append(slice(begin + part.start, begin + part.stop))
        begin += r.n
    return Split(tuple(train), tuple(test), "; ".join(dict.fromkeys(s.rule for s in study.splits)))
