"""One take from the first check to the stored recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air
from hardware.recorder.assembling import OUTPUT, SENSOR, assemble, recording_of
from hardware.recorder.keeping import end_of, ended
from hardware.recorder.plan import TakePlan
from hardware.recorder.station import Station
from hardware.recorder.taking import Watch, check, take
from hardware.storage import (
    ClockAlignment,
    Journal,
    JournalFile,
    Scale,
    StreamOrigin,
    finish,
    journal_header,
    new_files,
    open_journal,
    recovery,
)
from hardware.synchrony import ClockWiring


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A finished take.

    Attributes
    ----------
    recording : Recording
        On one time base, in SI, with provenance.
    path, journal : Path
        Where it is stored, and its raw data.

    Examples
    --------
    >>> with virtual_bench() as bench:
    ...     plan = TakePlan(np.linspace(0.0, 10.0, 200), 5e3, "slow")
    ...     taken = record(bench.station(plan), plan, folder / "slow")
    >>> sorted(taken.recording.channels)
    ['V', 'V_mon', 'x']
    """

    recording: Recording
    path: Path
    journal: Path
    sentences: tuple[str, ...] = field(default=())


def record(
    station: Station,
    plan: TakePlan,
    target: Path,
    *,
    wiring: ClockWiring | None = None,
    watch: Watch | None = None,
) -> Taken:
    """Drive, acquire, align and store.

    Parameters
    ----------
    station : Station
        The bench.
    plan : TakePlan
        What to do.
    target : Path
        NAME or NAME.npz; the raw data go to NAME.journal beside it, as they arrive.
    wiring : ClockWiring, optional
        What is known of clocks and trigger; read from the plan if not given.
    watch : callable, optional
        Told of the progress.

    Raises
    ------
    LimitViolation
        The waveform leaves the envelope; nothing was sent and nothing is stored.
    HardwareError
        A device failed; what had arrived is in the journal.
    UnusableInput
        The files cannot be written, or what arrived cannot be put together.

    Examples
    --------
    >>> with virtual_bench() as bench:
    ...     plan = TakePlan(np.linspace(0.0, 10.0, 200), 5e3, "ramp")
    ...     taken = record(bench.station(plan), plan, folder / "ramp")
    >>> taken.recording.n, taken.path.name
    (200, 'ramp.npz')
    """
    check(station, plan)
    path, archive = new_files(target)
    origins = origins_of(station, plan)
    about = station.output.provenance()
    header = journal_header(
        plan.name, origins, envelope=about, watchdog=bool(about.get("has_watchdog", False)),
        alignment=_stated(plan), command=_command(plan), noise=station.noise,
    )  # fmt: skip
    with Journal.create(path, header) as journal:
        with ended(journal, path, station.output):
            take(station, plan, journal, watch)
        raw = open_journal(path)
        air = air_of(raw)
        try:
            made = assemble(
                raw, plan, origins, wiring or wiring_of(plan, station, _rate_of(origins)),
                index=1.0 if air is None else air.index, ellipse=station.ellipse,
            )  # fmt: skip
        except UnusableInput as error:
            raise UnusableInput(f"{error}; what arrived is in {path}: {recovery(path)}") from error
        made = replace(made, sentences=(*station.remarks, *made.sentences))
        recording, provenance = recording_of(
            made, plan.name, raw, station.noise, output_end=end_of(station.output),
            envelope=dict(about), scales=scales_of(station.gains), air=air,
        )  # fmt: skip
        stored = finish(journal, archive, recording, provenance)
    return Taken(stored, archive, path, provenance.warnings)


def wiring_of(plan: TakePlan, station: Station, rate: float) -> ClockWiring:
    """Return what plan and station say of clocks and trigger, for a sensor of that rate (Hz)."""
    lag: dict[str, Any] = {"lag": station.lag, "lag_error": station.lag_error}
    if plan.synchronisation == "clock":
        return ClockWiring(shared_clock=True, delay_error=1e-6)
    if plan.synchronisation == "start":
        # the edge may be taken one sample early or late: evenly within a period on either side
        return ClockWiring(delay_error=1.0 / (rate * math.sqrt(3.0)), **lag)
    return ClockWiring(most_delay=plan.seconds / 4.0, **lag)


def origins_of(station: Station, plan: TakePlan) -> tuple[StreamOrigin, ...]:
    """Return devices and nominal rates of all streams."""
    output = StreamOrigin(OUTPUT, station.output.identity, plan.rate)
    return (output, *(StreamOrigin(s.stream, s.identity, s.rate) for s in station.sensors))


def _rate_of(origins: tuple[StreamOrigin, ...]) -> float:
    """Return the nominal rate (Hz) of the sensor that is aligned."""
    return next((o.nominal_rate for o in origins if o.stream == SENSOR), origins[-1].nominal_rate)


def _stated(plan: TakePlan) -> ClockAlignment | None:
    if plan.synchronisation != "clock":
        return None
    return ClockAlignment("shared clock", 1.0, 0.0, 0.0, 0.0)


def _command(plan: TakePlan) -> dict[str, Any]:
    return {
        "samples": int(plan.volts.size), "rate": plan.rate, "lowest": float(plan.volts.min()),
        "highest": float(plan.volts.max()), "synchronisation": plan.synchronisation,
        "asked": dict(plan.asked),
    }  # fmt: skip


def scales_of(gains: Mapping[str, Any]) -> tuple[Scale, ...]:
    """Return calibrations as they are stored."""
    return tuple(
        Scale(channel, **{k: v for k, v in values.items() if k in Scale.__dataclass_fields__})
        for channel, values in gains.items()
        if isinstance(values, Mapping)
    )


def air_of(raw: JournalFile) -> Air | None:
    """Return the air at the start, if anything told it."""
    names = tuple(Air.__dataclass_fields__)
    for note in raw.notes:
        content = note.content
        if content.get("event") == "air" and all(n in content for n in names):
            return Air(**{n: content[n] for n in names})
    return None
