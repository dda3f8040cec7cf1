"""From the raw streams of a journal to one recording on one time base.

The time base is the instants at which the output changes, because a held command is exact only
there: sample k of the recording has the voltage that holds from its instant on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.signals.units import parse_unit
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import INSTANT, Flag
from hardware.optics import Ellipse
from hardware.recorder.beside import beside
from hardware.recorder.correcting import HeldCommand, corrected
from hardware.recorder.marking import of_flags, of_losses, slip, with_jitter_judged
from hardware.recorder.plan import TakePlan
from hardware.storage import ClockAlignment, JournalFile, Provenance, StreamData, StreamOrigin
from hardware.synchrony import Alignment, Budget, ClockWiring, Stream, align, merged

Words = NDArray[np.uint16]
OUTPUT = "output"
SENSOR = "interferometer"
"""What is aligned with it."""
TAKEN = "clock"
"""Channel of the sensor: when it took its sample, by its own clock (s)."""
NOT_STORED = (INSTANT, "sample", TAKEN)
"""Channels that belong to the raw data only."""


@dataclass(frozen=True, slots=True, eq=False)
class Assembled:
    """Streams on one time base.

    Attributes
    ----------
    time : ndarray
        (N,), s by the output's clock.
    channels, units : mapping
        (N,) each, and their units as recorded.
    flags : mapping of str to ndarray
        (N,) uint16 for every stream.
    clocks : ClockAlignment
        How the clocks were brought together.
    sentences : tuple of str
        What a reader must know.
    """

    time: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    flags: Mapping[str, Words]
    clocks: ClockAlignment
    sentences: tuple[str, ...] = ()
    origins: tuple[StreamOrigin, ...] = field(default=())


def assemble(
    journal: JournalFile,
    plan: TakePlan,
    origins: Sequence[StreamOrigin],
    wiring: ClockWiring,
    *,
    index: float = 1.0,
    ellipse: Ellipse | None = None,
) -> Assembled:
    """Put output and sensor of a take on the instants of the output.

    Parameters
    ----------
    journal : JournalFile
        Raw streams.
    plan : TakePlan
        What was asked for.
    origins : sequence of StreamOrigin
        Devices and nominal rates.
    wiring : ClockWiring
        What is known of clocks and trigger beforehand.
    index : float
        Refraction index of the air.
    ellipse : Ellipse, optional
        Of a calibration, for records that cover too little of a fringe.

    Raises
    ------
    UnusableInput
        A stream is missing, or they have no time in common.
    """
    for stream in (OUTPUT, SENSOR):
        if stream not in journal.streams:
            raise UnusableInput(
                f"{journal.path.name}: nothing of stream {stream!r} arrived; there is "
                f"{', '.join(journal.streams) or 'none'}"
            )
    drive = journal.read(OUTPUT)
    known = {o.stream: o for o in origins}
    heard = journal.read(SENSOR)
    command = _held(drive, heard, plan, known[SENSOR].nominal_rate)
    improved = corrected(heard, index, ellipse, command)
    measured = improved.stream
    if plan.synchronisation == "clock":
        made = _same_clock(drive, measured, plan)
    else:
        made = _two_clocks(drive, measured, plan, known[SENSOR].nominal_rate, wiring)
    slow = [journal.read(n) for n in journal.streams if n not in (OUTPUT, SENSOR)]
    made = _with_slow(made, drive, [s for s in slow if INSTANT in s.channels], plan.rate)
    lost = (*of_losses(drive), *of_losses(measured))
    made = without_gaps(replace(made, sentences=(*improved.sentences, *lost, *made.sentences)))
    made = replace(made, sentences=(*made.sentences, *of_flags(made.flags)))
    return replace(made, origins=_counted(known, {OUTPUT: drive, SENSOR: measured}, made.clocks))


def _held(drive: StreamData, heard: StreamData, plan: TakePlan, rate: float) -> HeldCommand | None:
    """Return the command at the samples of a sensor, before their clocks are compared."""
    if "V" not in drive.channels or not drive.n:
        return None
    if plan.synchronisation == "clock":
        ratio, late = 1.0, 0.0
    else:
        ratio = plan.rate / rate
        # an amplifier's lag, two clocks side by side, and a sensor that was there before the wave
        late = 2e-4 + 2e-4 * plan.seconds + (0.02 if plan.synchronisation == "none" else 0.0)
    at = np.searchsorted(drive.numbers, np.floor(heard.numbers * ratio), side="right") - 1
    return HeldCommand(drive.channels["V"][at.clip(0, drive.n - 1)], math.ceil(late * rate))


def recording_of(
    made: Assembled,
    name: str,
    journal: JournalFile,
    noise: Mapping[str, float] | None = None,
    **others: object,
) -> tuple[Recording, Provenance]:
    """Return the recording in SI, and its provenance; `others` are fields of `Provenance`."""
    units = {k: parse_unit(u, f"{name}, channel {k!r}") for k, u in made.units.items()}
    channels = {k: units[k].to_si(v) for k, v in made.channels.items()}
    kept = {k: v for k, v in channels.items() if np.all(np.isfinite(v))}
    strange = [n for n in noise or {} if n not in kept]
    notes = (
        made.clocks.remark, *made.sentences,
        *(f"the noise of {n} is stated, but there are {', '.join(kept)}" for n in strange),
    )  # fmt: skip
    known = {n: v for n, v in (noise or {}).items() if n in kept}
    recording = Recording(
        name, made.time - made.time[0], kept, {k: units[k].si for k in kept},
        journal.path.name,
        meta={"notes": tuple(n for n in notes if n), **({"noise": known} if known else {})},
    )  # fmt: skip
    provenance = Provenance.for_recording(
        recording, made.origins, made.flags, alignment=made.clocks, warnings=made.sentences,
        started=journal.utc, **others,
    )  # fmt: skip
    return recording, provenance


def _same_clock(drive: StreamData, measured: StreamData, plan: TakePlan) -> Assembled:
    """Every sample of the output clocked one of the sensor: numbers are instants."""
    common, a, b = np.intersect1d(drive.numbers, measured.numbers, return_indices=True)
    if common.size < 2:
        raise UnusableInput(
            f"{plan.name}: output and sensor share {common.size} samples; is the sample clock "
            "connected to the sensor?"
        )
    channels = {k: v[a] for k, v in _stored(drive).items()}
    channels.update({k: v[b] for k, v in _stored(measured).items()})
    missing = drive.n - common.size
    alone = (f"{missing} samples of the output have none of the sensor",) if missing else ()
    clocks = ClockAlignment(
        "shared clock", 1.0, 0.0, 0.0, 0.0, "every sample of the output clocks one of the sensor"
    )
    marks = measured.flags[b]
    said: tuple[str, ...] = ()
    if INSTANT in drive.channels and TAKEN in measured.channels:
        marks, said = _in_step(drive.channels[INSTANT][a], measured.channels[TAKEN][b], marks, plan)
    return Assembled(
        common / plan.rate, channels, _units(drive, measured),
        {drive.layout.name: drive.flags[a], measured.layout.name: marks}, clocks,
        (*alone, *said),
    )  # fmt: skip


def _with_slow(
    made: Assembled, drive: StreamData, slow: Sequence[StreamData], rate: float
) -> Assembled:
    """Add sensors that are read now and then, by the program's instants of the output."""
    if slow and INSTANT not in drive.channels:
        names = ", ".join(s.layout.name for s in slow)
        said = f"{names}: in the journal only, as the output does not tell when it wrote"
        return replace(made, sentences=(*made.sentences, said))
    for stream in slow:
        at = np.searchsorted(drive.numbers, np.rint(made.time * rate)).clip(0, drive.n - 1)
        found, said = beside(stream, drive.channels[INSTANT][at])
        made = replace(
            made, channels={**made.channels, **found},
            units={**made.units, **{k: stream.layout.units[k] for k in found}},
            sentences=(*made.sentences, said),
        )  # fmt: skip
    return made


def _in_step(
    written: Array, taken: Array, flags: Words, plan: TakePlan
) -> tuple[Words, tuple[str, ...]]:
    """Flag what follows an edge of the sample clock that was too many or was missed."""
    found = slip(written, taken, plan.rate)
    if found is None:
        return flags, ()
    first, periods = found
    marked = flags.copy()
    marked[first:] |= np.uint16(Flag.UNSYNCHRONISED)
    return marked, (
        f"sample clock: by the sensor's own clock its samples are {abs(periods):.2g} periods too "
        f"{'early' if periods < 0.0 else 'late'} from sample {first} on, so edges were "
        f"{'too many' if periods < 0.0 else 'missed'}; these samples are flagged, see to the line",
    )


def _two_clocks(
    drive: StreamData,
    measured: StreamData,
    plan: TakePlan,
    rate: float,
    wiring: ClockWiring,
) -> Assembled:
    """Estimate how the clocks run, then read the sensor at the instants of the output."""
    output = Stream(plan.rate, _stored(drive), drive.numbers, drive.flags)
    sensor = Stream(rate, _stored(measured), measured.numbers, measured.flags)
    budget = Budget(seconds=plan.skew_budget, excess="mark")
    found = align(output, sensor, wiring, budget=budget)
    found = with_jitter_judged(found, plan.skew_budget)
    both = merged(output, sensor, found, base="drive", rate=2.0 * plan.rate)
    # of the points at halves and wholes of a step, the wholes: where the output changes
    phase = np.rint(both.time * 2.0 * plan.rate).astype(np.int64)
    whole = phase % 2 == 0
    numbers = phase[whole] // 2
    at = np.searchsorted(drive.numbers, numbers).clip(0, drive.n - 1)
    there = drive.numbers[at] == numbers
    channels = {k: v[whole][there] for k, v in both.channels.items()}
    channels.update({k: v[at][there] for k, v in _stored(drive).items()})
    flags = {
        drive.layout.name: drive.flags[at][there],
        measured.layout.name: both.flags[whole][there] & ~np.uint16(Flag.LATE),
    }
    return Assembled(
        both.time[whole][there], channels, _units(drive, measured), flags, _clocks(found, rate),
        (both.sentence, *found.notes),
    )  # fmt: skip


def _clocks(found: Alignment, rate: float) -> ClockAlignment:
    """Return what the alignment found, as it is stored."""
    known = found.delay_known and np.isfinite(found.covariance[0, 0])
    return ClockAlignment(
        found.how, 1.0 / found.ratio, float(np.sqrt(found.covariance[1, 1])),
        float(found.map.delay) if known else None,
        float(np.sqrt(found.covariance[0, 0])) if known else None,
        found.sentence,
    )  # fmt: skip


def _stored(stream: StreamData) -> dict[str, Array]:
    return {k: v for k, v in stream.channels.items() if k not in NOT_STORED}


def _units(*streams: StreamData) -> dict[str, str]:
    return {k: u for s in streams for k, u in s.layout.units.items() if k not in NOT_STORED}


def without_gaps(made: Assembled) -> Assembled:
    """Return the longest stretch in which no sample is missing; nothing is filled in."""
    n = made.time.size
    step = float(np.median(np.diff(made.time)))
    whole = np.ones(n, bool)
    for values in made.channels.values():
        whole &= np.isfinite(values)
    if not whole.any():
        raise UnusableInput("no sample of all channels is finite; nothing can be assembled")
    breaks = (np.diff(made.time) > 1.5 * step) | ~whole[1:] | ~whole[:-1]
    starts = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    ends = np.concatenate([starts[1:], [n]])
    sizes = np.where(whole[starts], ends - starts, 0)
    best = int(np.argmax(sizes))
    part = slice(int(starts[best]), int(ends[best]))
    if part.stop - part.start == n:
        return made
    sentence = (
        f"samples are missing: the longest stretch without a gap was kept, {part.stop - part.start}"
        f" of {n} samples from {made.time[part.start]:.6g} s on; all are in the journal"
    )
    return replace(
        made, time=made.time[part],
        channels={k: v[part] for k, v in made.channels.items()},
        flags={k: v[part] for k, v in made.flags.items()},
        sentences=(*made.sentences, sentence),
    )  # fmt: skip


def _counted(
    known: Mapping[str, StreamOrigin], data: Mapping[str, StreamData], clocks: ClockAlignment
) -> tuple[StreamOrigin, ...]:
    """Return who measured what, with what arrived and the rate found."""
    counted = []
    for name, stream in data.items():
        origin = replace(known[name], samples=stream.n, lost=stream.lost)
        if name != OUTPUT and clocks.ratio is not None:
            nominal = origin.nominal_rate
            origin = replace(
                origin, measured_rate=nominal * clocks.ratio,
                rate_uncertainty=nominal * (clocks.ratio_uncertainty or 0.0),
            )  # fmt: skip
        counted.append(origin)
    return tuple(counted)
