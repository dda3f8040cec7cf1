"""One run of a loop from the first check to the stored recording."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bondgraph.signals.recording import Recording
from hardware.contracts import INSTANT, Flag
from hardware.recorder.assembling import Assembled, recording_of, without_gaps
from hardware.recorder.keeping import end_of, ended
from hardware.recorder.marking import of_flags, of_losses
from hardware.recorder.recording import air_of, scales_of
from hardware.recorder.taking import Watch
from hardware.regulation.controller import Controller
from hardware.regulation.plan import LoopPlan
from hardware.regulation.running import LOOP, check_rate, regulate
from hardware.regulation.station import LoopStation
from hardware.regulation.timing import LoopTiming
from hardware.storage import (
    ClockAlignment,
    Journal,
    JournalFile,
    StreamOrigin,
    finish,
    journal_header,
    new_files,
    open_journal,
)


@dataclass(frozen=True, slots=True, eq=False)
class Regulated:
    """A finished loop.

    Attributes
    ----------
    recording : Recording
        One row a tick: ``V``, ``V_asked``, reading and reference.
    path, journal : Path
        Where it is stored, and its raw data.
    timing : LoopTiming
        Rate, jitter and limits.
    sentences : tuple of str
        What a reader must know.
    """

    recording: Recording
    path: Path
    journal: Path
    timing: LoopTiming
    sentences: tuple[str, ...] = field(default=())


def record_loop(
    bench: LoopStation,
    plan: LoopPlan,
    controller: Controller,
    target: Path,
    watch: Watch | None = None,
) -> Regulated:
    """Run a loop and store it; `target` is NAME or NAME.npz, the raw data go beside it.

    Raises
    ------
    UnusableInput, LimitViolation, HardwareError
        As `regulate`; what had arrived is in the journal.

    Examples
    --------
    >>> from hardware.regulation import OpenLoop
    >>> with virtual_bench() as bench:
    ...     plan = LoopPlan(np.linspace(0.0, 10.0, 50), 500.0, "x", voltage=True)
    ...     done = record_loop(bench.loop(plan), plan, OpenLoop(), folder / "loop")
    >>> done.recording.n
    50
    """
    check_rate(bench, plan)
    path, archive = new_files(target)
    origins = (
        StreamOrigin(LOOP, bench.output.identity, plan.rate),
        StreamOrigin(bench.sensor.stream, bench.sensor.identity, bench.sensor.rate),
    )
    about = bench.output.provenance()
    command = {
        "samples": int(plan.reference.size), "rate": plan.rate, "reading": plan.reading,
        "asked": dict(plan.asked),
    }  # fmt: skip
    header = journal_header(
        plan.name, origins, envelope=about, watchdog=bool(about.get("has_watchdog", False)),
        alignment=_clocks(bench.sensor.rate), command=command, noise=bench.noise,
    )  # fmt: skip
    with Journal.create(path, header) as journal:
        with ended(journal, path, bench.output):
            timing = regulate(bench, plan, controller, journal, watch)
        raw = open_journal(path)
        made = _assembled(raw, plan, origins, timing)
        recording, provenance = recording_of(
            made, plan.name, raw, bench.noise, output_end=end_of(bench.output),
            envelope=dict(about), scales=scales_of(bench.gains), air=air_of(raw),
        )  # fmt: skip
        stored = finish(journal, archive, recording, provenance)
    return Regulated(stored, archive, path, timing, made.sentences)


def _clocks(rate: float) -> ClockAlignment:
    """Return how old readings of a sensor of this rate (Hz) are: evenly up to its period."""
    return ClockAlignment(
        "loop", 1.0, 0.0, -0.5 / rate, 1.0 / (rate * math.sqrt(12.0)),
        "every row has the newest reading before the write of its tick",
    )  # fmt: skip


def _assembled(
    raw: JournalFile, plan: LoopPlan, origins: tuple[StreamOrigin, ...], timing: LoopTiming
) -> Assembled:
    """Return the ticks on their even grid."""
    data = raw.read(LOOP)
    flags = {LOOP: data.flags}
    told = {LOOP: data.flags & ~np.uint16(Flag.CLAMPED | Flag.LATE)}
    made = Assembled(
        data.numbers / plan.rate,
        {k: v for k, v in data.channels.items() if k != INSTANT},
        {k: u for k, u in data.layout.units.items() if k != INSTANT}, flags,
        _clocks(origins[1].nominal_rate),
        (*timing.sentences, *of_losses(data), *of_flags(told)), origins,
    )  # fmt: skip
    return without_gaps(made)
