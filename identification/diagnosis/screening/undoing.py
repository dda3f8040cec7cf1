"""A mistake in a recording, in words, and the recording or the model with it undone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations, product

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Da, Df, Dq, Sensor
from bondgraph.signals.files.checks import map_argument
from bondgraph.signals.files.time_base import TIME
from bondgraph.signals.recording import Recording
from bondgraph.signals.units import read_unit
from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.region import multiple
from identification.diagnosis.screening.forgotten_unit import plainly
from identification.diagnosis.screening.usual_units import named
from identification.report.numbers import percent, quantity, times_noise
from identification.report.words import listed
from identification.study.data import Data
from identification.study.noise_floor import noise_floor

Commands = Mapping[str, Array]

JUMP = 0.2
"""Step of a command over its range from which it is tried as held first."""
NEAR = 3.0
"""Factor within which a size that is no conversion is fitted."""
FACTORS = (1e2, 1e3, 1e6, 1e9, 180.0 / np.pi, 30.0 / np.pi, 9.80665, 1e3 / 25.4, 1e5, 6e4)
"""What a forgotten conversion multiplies by: percent, milli, micro, nano, degrees, turns a minute,
kilogram-force, inches, bar, litres a minute."""
KNOWN = frozenset(f**s for f in FACTORS for s in (1, -1))


@dataclass(frozen=True)
class Mixup:
    """A mistake in a recording that explains the misfit, or values far from those declared.

    Attributes
    ----------
    kind : {"sign", "exchange", "scale", "quantity", "dead", "clipped"}
    channels : tuple of str
        One channel, or ``time``; two for an exchange; several that share a unit for a scale.
    factor : float
        How many times too large the channel is, for a scale; for an exchange what the second is
        multiplied by in the place of the first, where units were exchanged with the numbers.
    sensor : str
        What reads such a channel (``Da``), for a quantity.
    before, after : float
        Held-out mean square over the floor as recorded, and with the mistake undone.
    beside : float
        How far the factor lies beside the size that declared values give, logarithmic.
    unit, said : str
        Unit that the numbers look like, and in which they were read; empty where none is usual.
    values : str
        Which fitted values return to what is declared, where they tell it, not the misfit.
    share : float
        Part of the samples at an end of the range, of what is clipped.
    ends : tuple of float
        These ends, SI; `said` is the unit.
    """

    kind: str
    channels: tuple[str, ...]
    factor: float = 1.0
    sensor: str = ""
    before: float = float("nan")
    after: float = float("nan")
    beside: float = 0.0
    unit: str = ""
    said: str = ""
    values: str = ""
    share: float = 0.0
    ends: tuple[float, ...] = ()

    def drives_otherwise(self, data: Data) -> bool:
        """Whether another signal drives the model where this is undone."""
        mixed = self.kind == "exchange" and self.channels[0] in data.commands
        return mixed and self.channels[1] in data.names

    def is_rare(self, data: Data) -> bool:
        """Whether hardly anybody does it: it needs more to be believed."""
        other = self.kind == "scale" and (self.channels == (TIME,) or len(self.channels) > 1)
        return other or self.drives_otherwise(data)

    @property
    def is_conversion(self) -> bool:
        """Whether the factor is one between units."""
        return self.factor in KNOWN or bool(self.unit)

    @property
    def claim(self) -> str:
        """The mistake in a few words."""
        first = self.channels[0]
        if self.kind == "exchange":
            return f"{first} and {self.channels[1]} look exchanged"
        if self.kind == "sign":
            return f"{first} looks recorded with the wrong sign"
        if self.kind == "dead":
            return f"{first} does not follow the model at all: a dead or a foreign sensor"
        if self.kind == "clipped":
            ends = " and at ".join(quantity(v, self.said) for v in self.ends)
            return f"{first} is clipped: {percent(self.share)} of its samples sit exactly at {ends}"
        if self.kind == "quantity":
            return f"{first} looks like {QUANTITIES[self.sensor]} (read by {self.sensor})"
        many, size = max(self.factor, 1 / self.factor), "large" if self.factor > 1 else "small"
        # what is no conversion is known as well as the declared values only
        digits, why = (3, "its unit?") if self.is_conversion else (2, "its unit, or counts?")
        look = "looks" if len(self.channels) == 1 else "look"
        like = f", as {self.unit} read as {self.said}" if self.unit else ""
        return (
            f"{listed(self.channels)} {look} about {plainly(many, digits)} times too {size} "
            f"({why}){like}"
        )

    @property
    def sentence(self) -> str:
        """The mistake with its evidence."""
        return f"{self.claim}: {self.undoing}"

    @property
    def undoing(self) -> str:
        """What is gained where it is undone."""
        if self.kind == "clipped":
            return "noise does not stand still: the peaks were cut after it came in"
        if self.values:
            return f"with that undone {self.values}"
        how = "without it" if self.kind == "dead" else "with that undone"
        before, after = times_noise(self.before), times_noise(self.after)
        rest = "; what then remains shows once the file is mended" if after > REMAINS else ""
        return (
            f"{how} the model misses all readings together by {multiple(after)} the noise, not by "
            f"{multiple(before)}, on held-out samples{rest}"
        )

    @property
    def remedy(self) -> str:
        """What to write in the file or the command."""
        first, *others = self.channels
        if self.kind == "exchange":
            other = others[0]
            return (
                f"exchange the headers of {first} and {other} in the file, each with its unit, or, "
                f"where they have none, write map={{{first!r}: 'COLUMN[UNIT]', {other!r}: "
                "'COLUMN[UNIT]'} with the column of the other"
            )
        if self.kind == "sign":
            return f"multiply {first} by -1 in the file"
        if self.kind == "clipped":
            return f"record {first} over a wider range, or give a stretch in which it stays inside"
        if self.kind in ("dead", "quantity"):
            return f"name the right column by {map_argument(first)}"
        unit = self.unit or "UNIT"
        if self.channels == (TIME,):
            return f"write t[{unit}] as the header of the time, or correct fs="
        if not self.unit:
            return f"write the unit it was recorded in as {first}[UNIT] in the header"
        heads = " and ".join(f"{n}[{self.unit}]" for n in self.channels)
        return (
            f"write {heads} in the header, or {map_argument(first, f'COLUMN[{self.unit}]')} where "
            "it has no unit"
        )


REMAINS = 2.0
"""Times the noise beyond which more is wrong than the recording."""
QUANTITIES = {"Dq": "a displacement", "Df": "a velocity or a flow", "Da": "an acceleration"}
SENSORS: dict[str, type[Sensor]] = {"Dq": Dq, "Df": Df, "Da": Da}


def what_to_do(mistakes: Sequence[Mixup]) -> str:
    """Say how a recording is mended that looks wrong."""
    either = " or ".join(m.claim for m in mistakes)
    wrong = "recording, or the model's sensor," if mistakes[0].kind == "quantity" else "recording"
    remedies = "; or ".join(m.remedy for m in mistakes if m.remedy)
    how = f" ({remedies})" if remedies else ""
    otherwise = "; where it is right, declare other values" if mistakes[0].values else ""
    return f"{either}: correct the {wrong}{how} and diagnose again{otherwise}"


def moving_commands(graph: BondGraph, data: Data) -> list[str]:
    """Return what drives the model; a signal from outside that no source makes has no unit."""
    return [n for n, u in data.commands.items() if np.ptp(u) > 0 and n in graph.elements]


def exchanges(graph: BondGraph, data: Data) -> Iterator[Mixup]:
    """Yield all pairs of channels that may be exchanged."""
    driving = moving_commands(graph, data)
    pairs = (*combinations(driving, 2), *combinations(data.names, 2))
    for pair in (*pairs, *driven_and_read(data, driving)):
        yield from exchanges_of(data, pair)


def driven_and_read(data: Data, driving: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield pairs of a command and a reading; none where commands are known between samples."""
    if all(steps == 1 for steps, _ in data.finer):
        yield from product(driving, data.names)


def exchanges_of(data: Data, pair: tuple[str, str]) -> Iterator[Mixup]:
    """Yield exchanged names, and numbers that stand under the other's unit as well."""
    yield Mixup("exchange", pair)
    one, other = (read_unit(data.read_in.get(n, "")) for n in pair)
    if one is not None and other is not None and one.scale != other.scale:
        yield Mixup("exchange", pair, one.scale / other.scale)


def in_unit(data: Data, channels: tuple[str, ...], factor: float) -> Mixup:
    """Return channels that are in another unit than was read, which is named if it is usual."""
    said = data.read_in.get(channels[0], "")
    return Mixup("scale", channels, factor, unit=named(said, factor), said=said)


def with_unit(data: Data, mixup: Mixup) -> Mixup:
    """Return a scale with the unit that the numbers look like, where that is a usual one."""
    if mixup.kind != "scale":
        return mixup
    like = in_unit(data, mixup.channels, mixup.factor)
    return replace(mixup, unit=like.unit, said=like.said)


def undone(data: Data, mixup: Mixup) -> Data:
    """Return the recording with the mistake undone."""
    if mixup.kind == "exchange":
        one, other = mixup.channels
        return _exchanged(data, one, other, mixup.factor)
    if mixup.kind == "quantity":
        return data
    if mixup.kind == "dead":
        c = data.names.index(mixup.channels[0])
        # a floor this high takes the reading out of the fit
        return replace(data, floor=_with(data.floor, c, 1e6 * float(np.ptp(data.readings[:, c]))))
    factor = -1.0 if mixup.kind == "sign" else 1.0 / mixup.factor
    return reduce(lambda d, name: _multiplied(d, name, factor), mixup.channels, data)


def _multiplied(data: Data, name: str, factor: float) -> Data:
    if name == TIME:
        return replace(data, time=factor * data.time)
    if name in data.commands:
        return _commanded(data, lambda u: {**u, name: factor * u[name]} if name in u else u)
    c = data.names.index(name)
    return _read(data, c, factor * data.readings[:, c], abs(factor) * float(data.floor[c]))


def _read(data: Data, place: int, values: Array, floor: float) -> Data:
    """Return the recording with other values of a reading."""
    readings = data.readings.copy()
    readings[:, place] = values
    return replace(data, readings=readings, floor=_with(data.floor, place, floor))


def as_read(graph: BondGraph, mixup: Mixup) -> BondGraph:
    """Return the model with the sensor that reads what a channel seems to hold.

    Of a factor that is no conversion only the size is known: it is fitted.
    """
    if mixup.kind == "scale" and not mixup.is_conversion:
        return _scaled(graph, mixup.channels[0])
    if mixup.kind != "quantity":
        return graph
    (name,) = mixup.channels
    # without its unit: what it reads is another quantity now
    kept = {f: getattr(graph[name], f) for f in Sensor.channel}
    return graph.replace(name, SENSORS[mixup.sensor](name, **kept))


def _scaled(graph: BondGraph, sensor: str) -> BondGraph:
    if getattr(graph[sensor], "gain", None) is not None:
        return graph
    made = graph.with_element(sensor, gain=(name := scale_of(sensor)))
    return made.with_parameters([Parameter(name, 1.0, spread=NEAR)])


def scale_of(sensor: str) -> str:
    """Name of the gain that a size which is no conversion is fitted by."""
    return f"scale_{sensor}"


def _commanded(data: Data, changed: Callable[[Commands], Commands]) -> Data:
    """Return the recording with other commands, at the samples and between them."""
    finer = tuple((steps, changed(u)) for steps, u in data.finer)
    return replace(data, commands=dict(changed(data.commands)), finer=finer)


def _with(values: Array, place: int, value: float) -> Array:
    found = np.array(values, float)
    found[place] = value
    return found


def _exchanged(data: Data, one: str, other: str, factor: float) -> Data:
    """Exchange two channels; numbers in other units change by `factor`."""
    back = 1.0 / factor
    if one in data.commands and other in data.commands:
        return _commanded(
            data,
            lambda u: {**u, one: factor * u[other], other: back * u[one]} if one in u else u,
        )
    if one in data.commands:
        c = data.names.index(other)
        seen, driven = back * data.commands[one], factor * data.readings[:, c]
        alone = Recording(data.name, data.time, {other: seen}, {other: "1"})
        split = replace(data.split, rest=None)
        floor = noise_floor(alone, split, (other,), breaks=data.breaks)[other]
        jumps = np.abs(np.diff(driven)).max(initial=0.0) > JUMP * np.ptp(driven)
        made = _read(data, c, seen, floor)
        hold = "hold" if jumps else data.hold
        return replace(
            made, commands={**data.commands, one: driven}, hold=hold,
            floor_known=data.floor_known - {other},
        )  # fmt: skip
    a, b = data.names.index(one), data.names.index(other)
    first, second = data.readings[:, a], data.readings[:, b]
    made_a = _read(data, a, factor * second, factor * float(data.floor[b]))
    made = _read(made_a, b, back * first, back * float(data.floor[a]))
    other_of = {one: other, other: one}
    return replace(made, floor_known=frozenset(other_of.get(n, n) for n in data.floor_known))
