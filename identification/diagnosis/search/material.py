"""What a diagnosis works on: the recording as data, with its noise floor, or why there is none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split, default_split
from bondgraph.signals.split import interleaved, stretches
from bondgraph.signals.wrapping import wrap_period
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.diagnosis.screening.mixups import stuck
from identification.diagnosis.search.asked import Asked
from identification.study.data import Data, data_for
from identification.study.factors import drives
from identification.study.joined import joined, split_of
from identification.study.noise_floor import declared_noise, read_noise
from identification.study.turns import in_turn


@dataclass(frozen=True, eq=False)
class Material:
    """Recordings of one question as data.

    Attributes
    ----------
    recording : Recording
        All of them behind one another.
    read, given : dict of str to float
        Noise of the readings as the recording shows it, and as it is known; SI.
    usual : bool
        The division is the usual one of a single recording: a finer one may take its place.
    reason : str
        Why nothing can be said; empty where something can.
    """

    recording: Recording
    data: Data
    read: Mapping[str, float] = field(default_factory=dict)
    given: Mapping[str, float] = field(default_factory=dict)
    usual: bool = False
    reason: str = ""


def material_of(asked: Asked) -> Material:
    """Match the recordings to the model, divide them, and read their noise.

    Raises
    ------
    UnusableInput
        Channels, units or given noises that do not fit.
    """
    graph = asked.graph
    recording, breaks = joined(asked.recordings)
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    commands = tuple(s.name for s in drives(graph))
    usual = (
        split_of(asked.recordings)
        if breaks
        else _split(recording, commands, sensors, _latest(graph))
    )
    split = asked.split or usual
    data = data_for(graph, recording, split, dict.fromkeys(sensors, 1.0))
    coarse = recording.meta.get("resolution") or {}
    steps = _declared_steps(graph) | (dict(coarse) if isinstance(coarse, Mapping) else {})
    data = replace(data, breaks=breaks, resolution=steps, finer=asked.finer if breaks else ())
    if reason := _insufficient(asked.n_free, data) or "; ".join((*stuck(data), *_turns(data))):
        return Material(recording, data, reason=reason)
    if asked.study.turns:
        data = in_turn(asked.problem(data), asked.study.turns).data
    given = declared_noise(recording, sensors) | dict(asked.noise)
    noise = read_noise(recording, split, sensors, commands, breaks)
    read = {n: level for n, (level, _) in noise.items()}
    floor = read | given_noise(given, sensors, graph.name)
    known = frozenset(n for n in sensors if n in given or noise[n][1])
    level = np.array([floor[n] for n in sensors])
    inner = tuple(c for c in asked.cuts if c not in breaks)
    begins = asked.cuts or breaks
    late = round(_latest(graph) / data.dt)
    data = replace(
        data, floor=level, floor_measured=len(known) == len(sensors), floor_known=known,
        breaks=begins, cuts=inner, begin=0 if begins else _begin(split, late),
    )  # fmt: skip
    ours = asked.split is None and not breaks and recording.n >= LEAST_TO_INTERLEAVE
    return Material(recording, data, read, given, ours, _nothing_moves(data))


def _begin(split: Split, late: int) -> int:
    """Return where a state begins to be simulated: shortly before a leading rest ends.

    Commands that come `late`, in samples, rest as long before.
    """
    if split.rest is None:
        return 0
    scored: int = min(p.start or 0 for p in (*stretches(split.train), *stretches(split.test)))
    return max(min(int(split.rest.stop), scored) - STILL - late, 0)


STILL = 24
"""Samples of a rest that are simulated: what rubs comes to a stand in them before it is scored, and
little of a state has died away."""


def _declared_steps(graph: BondGraph) -> dict[str, float]:
    """Return the resolutions that sensors of the model have, SI."""
    named = {e.name: graph.channel_value(e, "resolution") for e in graph.of_type(Sensor)}
    known = graph.parameters
    return {n: known[str(v)].value for n, v in named.items() if v is not None}


def _latest(graph: BondGraph) -> float:
    """Return the longest dead time (s) that is declared of a command."""
    declared = [d.delay for e in drives(graph) if (d := e.drive) is not None and d.delay]
    return max((graph.parameters[name].value for name in declared), default=0.0)


def _split(
    recording: Recording, commands: Sequence[str], sensors: Sequence[str], late: float
) -> Split:
    """Leading rest aside, every third of thirty stretches is held out.

    Levels, bands and slow changes then show in both parts, whatever the excitation. What a command
    that comes `late` (s) was before a record without a rest is not known: so long nothing is
    judged.
    """
    moving = [c for c in commands if c in recording.channels and np.ptp(recording[c]) > 0]
    watched = [c for c in (*commands, *sensors) if c in recording.channels]
    plain = default_split(recording, drive=moving[0] if moving else None, watched=watched)
    begin = plain.rest.stop if plain.rest is not None else _unknown(recording, late)
    if recording.n - begin < LEAST_TO_INTERLEAVE:
        return plain
    split = interleaved(begin, recording.n)
    if plain.rest is not None:
        return replace(split, rest=plain.rest, rule=f"{split.rule}; {_resting(moving[0], begin)}")
    return split


def _resting(command: str, samples: int) -> str:
    return f"the first {samples} samples, in which {command} does not move, are not scored"


def _unknown(recording: Recording, late: float) -> int:
    """Return the samples that a late command of before the record reaches."""
    return int(np.ceil(LATER * late / recording.dt)) if late else 0


LATER = 1.5
"""Times a declared dead time that it may be in truth."""
LEAST_TO_INTERLEAVE = 600
"""Samples from which stretches of a thirtieth say something."""


def _insufficient(n_free: int, data: Data) -> str:
    needed = max(30, 5 * n_free)
    train = int(data.mask("train").sum())
    if train >= needed and data.mask("test").sum() < 8:
        return "nothing is held out: give at least 8 samples to judge by"
    if train < needed:
        count = "1 sample is" if data.n == 1 else f"{data.n} samples are"
        return f"{count} too few for {n_free} parameters: record at least {2 * needed} samples"
    still = [n for c, n in enumerate(data.names) if np.ptp(data.readings[:, c]) == 0]
    if len(still) == len(data.names):
        return f"the output {', '.join(still)} is constant: excite the system and check the sensor"
    return ""


def _turns(data: Data) -> tuple[str, ...]:
    """Return a sentence for every reading that begins anew after each turn."""
    periods = {n: wrap_period(data.readings[:, c]) for c, n in enumerate(data.names)}
    return tuple(
        f"the reading {n} jumps by about {p:.4g} whenever it has passed a turn: an encoder that "
        "wraps; declare it by encoder(..., wraps=True), or give "
        f"recording.unwrap({n!r}, period) with the exact period; if it is no encoder, its column "
        "is another channel"
        for n, p in periods.items()
        if p is not None
    )


def _nothing_moves(data: Data) -> str:
    if any(np.ptp(u) > 0 for u in data.commands.values()):
        return ""
    if (data.readings.std(axis=0) > 1.5 * data.floor).any():
        return ""
    return "the commands are constant and the readings only noise: excite the system"


def given_noise(noise: Mapping[str, float], sensors: Sequence[str], model: str) -> dict[str, float]:
    """Return the noise that a user gives, checked.

    Raises
    ------
    UnusableInput
        A name is no sensor of the model, or a value is no positive number.
    """
    for name, value in noise.items():
        if name not in sensors:
            raise UnusableInput(str(unknown_name("sensor", name, model, sensors)))
        if not (np.isfinite(value) and value > 0):
            raise UnusableInput(
                f"noise of {name}: {value:g} is no standard deviation; give a positive number in "
                "the unit of the sensor (SI)"
            )
    return {n: float(v) for n, v in noise.items()}
