"""Drive a waveform and write down everything that arrives while it lasts.

One loop without threads: the output plays in slices of about 20 ms, between them every sensor is
drained into the journal. Whatever ends the loop, the output goes to its safe value, and what had
arrived or is still held by a sensor is in the journal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Tried, WaveProgress
from hardware.errors import TimedOut
from hardware.recorder.keeping import Notebook, heard, keep, note_air, rescue, write
from hardware.recorder.plan import TakePlan
from hardware.recorder.station import Station

POLL = 0.01
"""Pause between polls when the wave is over and a sensor is not (s)."""


@dataclass(frozen=True, slots=True)
class TakeProgress:
    """State of a running take, for those who watch.

    Parameters
    ----------
    phase : str
        ``"prepare"``, ``"erase"``, ``"arm"``, ``"play"``, ``"drain"`` or ``"end"``.
    seconds : float
        Since the start of the wave, by the program's clock.
    written, total : int
        Samples of the output.
    late : int
        Samples of the output that came late.
    chunks : sequence of Chunk
        What arrived since the last report.
    """

    phase: str
    seconds: float
    written: int
    total: int
    late: int = 0
    chunks: Sequence[Chunk] = ()


Watch = Callable[[TakeProgress], None]


def take(station: Station, plan: TakePlan, journal: Notebook, watch: Watch | None = None) -> None:
    """Record one take.

    Parameters
    ----------
    station : Station
        The bench.
    plan : TakePlan
        What to do; its waveform is checked against the envelope before anything is sent.
    journal : Notebook
        Receives every chunk as it arrives, and events: air, zero, trigger, errors.
    watch : callable, optional
        Told of the progress.

    Raises
    ------
    LimitViolation
        The waveform leaves the envelope; nothing was sent.
    HardwareError
        Something failed on the way; what had arrived is in the journal, the output was ramped to
        its safe value or is declared unknown.
    """
    say = watch or _silent
    check(station, plan)
    try:
        with station.safety:
            try:
                _prepare(station, plan, journal, say)
                _run(station, plan, journal, say)
            except BaseException as error:
                keep(journal, error)
                raise
    except BaseException:
        rescue(station.sensors, journal)
        raise
    finally:
        for sensor in station.sensors:
            sensor.abort()
    journal.note({"event": "output", **station.output.provenance()})
    say(TakeProgress("end", plan.seconds, plan.volts.size, plan.volts.size))


def check(station: Station, plan: TakePlan) -> None:
    """Hold both waves of a plan against the envelope, and its clocks against the sensors.

    Raises
    ------
    LimitViolation
        What, where, by how much; nothing was sent.
    UnusableInput
        A sensor does not take its clock; nothing was driven.
    """
    for wave in (plan.erase, plan.volts):
        if wave is not None:
            station.wave.prepare(wave, plan.rate)
    for sensor in station.sensors:
        if isinstance(sensor, Tried):
            sensor.try_settings()


def _erase(station: Station, wave: NDArray[np.float64], rate: float, say: Watch) -> None:
    """Play the decay that takes the actuator's history away; nothing of it is recorded."""
    station.output.ramp(float(wave[0]))
    station.wave.prepare(wave, rate)
    for state in station.wave.play():
        say(TakeProgress("erase", 0.0, state.samples, state.total, state.late))
        station.output.tend()


def _prepare(station: Station, plan: TakePlan, journal: Notebook, say: Watch) -> None:
    """Power up, go to the first voltage, zero, read the air."""
    say(TakeProgress("prepare", 0.0, 0, plan.volts.size))
    if station.output.present is None:
        station.output.power_up()
    if plan.erase is not None:
        _erase(station, plan.erase, plan.rate, say)
        station.wave.prepare(plan.volts, plan.rate)
    station.output.ramp(float(plan.volts[0]))
    station.clock.sleep(plan.settle)
    station.preparation.zero()
    journal.note({"event": "zero", "instant": station.clock.now()})
    note_air(station.preparation, journal, "start")


def _run(station: Station, plan: TakePlan, journal: Notebook, say: Watch) -> None:
    say(TakeProgress("arm", 0.0, 0, plan.volts.size))
    begin = station.clock.now()
    last = {s.stream: begin for s in station.sensors}
    for sensor in station.sensors:
        sensor.kickoff()
    journal.note({"event": "start", "instant": begin})
    state = WaveProgress(0, plan.volts.size)
    amiss = 0
    for state in station.wave.play():
        driven = write(journal, state.chunks)
        chunks = [*driven, *_poll(station, journal, last)]
        say(TakeProgress("play", station.clock.now() - begin, state.samples, state.total,
                     state.late, chunks))  # fmt: skip
        for chunk in driven:
            if {"V", "V_mon"} <= set(chunk.channels):
                amiss = station.output.compare(chunk.channels["V"], chunk.channels["V_mon"], amiss)
        _check_silence(station, plan, last, waiting=False)
        station.output.tend()
    # a block says nothing before its end: from the end of the wave on its silence counts
    last = dict.fromkeys(last, station.clock.now())
    while not all(s.done for s in station.sensors):
        chunks = _poll(station, journal, last)
        say(TakeProgress("drain", station.clock.now() - begin, state.samples, state.total,
                     state.late, chunks))  # fmt: skip
        if plan.synchronisation != "start" and not chunks:
            break
        _check_silence(station, plan, last, waiting=True)
        station.output.tend()
        station.clock.sleep(POLL)
    for sensor in station.sensors:
        say(TakeProgress("drain", plan.seconds, state.samples, state.total, state.late,
                     heard(journal, sensor, sensor.finish)))  # fmt: skip
    note_air(station.preparation, journal, "end")


def _poll(station: Station, journal: Notebook, last: dict[str, float]) -> list[Chunk]:
    """Drain every sensor; remember when each of them last spoke."""
    arrived = []
    for sensor in station.sensors:
        chunks = heard(journal, sensor, sensor.poll)
        if chunks or sensor.done:
            last[sensor.stream] = station.clock.now()
        arrived += chunks
    return arrived


def _check_silence(
    station: Station, plan: TakePlan, last: Mapping[str, float], waiting: bool
) -> None:
    """Give up on a sensor that has been silent for too long.

    A block arrives at once at its end, so during the wave only streams that have spoken count.
    """
    now = station.clock.now()
    for sensor in station.sensors:
        silence = now - last[sensor.stream]
        # a device that can say more about its silence speaks first
        allowed = 2.0 * plan.patience + (0.0 if waiting else plan.seconds)
        if not sensor.done and silence > allowed:
            raise TimedOut(
                f"{sensor.stream}: nothing came for {silence:.3g} s; check the trigger line and "
                "the beam, or give more patience (--patience)"
            )


def _silent(progress: TakeProgress) -> None:
    """Watch nothing."""
