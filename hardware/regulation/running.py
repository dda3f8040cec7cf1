"""The loop itself: read, decide, write, once a tick; everything is written down.

One thread, no other pace than the program's clock. Nothing but the guard limits the controller,
and whatever ends the loop, the output goes to its safe value.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import final

import numpy as np

from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag, Tried
from hardware.errors import BeamLost, TimedOut
from hardware.recorder.keeping import Notebook, heard, keep, note_air, rescue
from hardware.recorder.taking import TakeProgress, Watch
from hardware.regulation.controller import Controller
from hardware.regulation.plan import LoopPlan
from hardware.regulation.station import LoopStation
from hardware.regulation.timing import CycleCost, LoopTiming, cost_of

LOOP = "loop"
"""Stream of what the loop did."""
SLICE = 0.02
"""Time between looks at the monitor and reports to those who watch (s)."""
REHEARSED = 40
"""Cycles that are tried at rest."""


def check_rate(bench: LoopStation, plan: LoopPlan) -> None:
    """Refuse a rate that the envelope or the sensor cannot take; nothing is driven.

    Raises
    ------
    UnusableInput
        What is asked for, what is possible, and why.
    """
    if plan.rate > bench.fastest * (1.0 + 1e-9):
        raise UnusableInput(
            f"{plan.name}: a loop of {engineering(plan.rate, 'Hz')} was asked for, but "
            f"{bench.bound} allows {engineering(bench.fastest, 'Hz')}; lower the rate"
        )
    if isinstance(bench.sensor, Tried):
        bench.sensor.try_settings()


def regulate(
    bench: LoopStation,
    plan: LoopPlan,
    controller: Controller,
    journal: Notebook,
    watch: Watch | None = None,
) -> LoopTiming:
    """Run a loop over its reference.

    Parameters
    ----------
    bench : LoopStation
    plan : LoopPlan
    controller : Controller
        What decides; its numbers may be anything, the guard goes there as far as it may.
    journal : Notebook
        Receives every chunk of the sensor as it arrives, and stream ``"loop"``: reading,
        reference, voltage asked for and applied, instant of the write.
    watch : callable, optional
        Told of the progress.

    Raises
    ------
    UnusableInput
        The rate is beyond what envelope, sensor, transport or host can do; the output has not
        left where it rests at the start.
    LimitViolation
        The controller gave no finite number, or a dwell was exceeded; the output was parked.
    HardwareError
        A device failed, was silent or the program stood still for longer than `patience`; the
        output was parked or is declared unknown.
    """
    check_rate(bench, plan)
    try:
        with bench.safety:
            try:
                timing = _Run(bench, plan, controller, journal, watch).whole()
            except BaseException as error:
                keep(journal, error)
                raise
    except BaseException:
        rescue((bench.sensor,), journal)
        raise
    finally:
        bench.sensor.abort()
    journal.note({"event": "output", **bench.output.provenance()})
    journal.note({"event": "timing", **timing.as_dict()})
    return timing


@final
class _Run:
    """State of one run."""

    def __init__(
        self,
        bench: LoopStation,
        plan: LoopPlan,
        controller: Controller,
        journal: Notebook,
        watch: Watch | None,
    ) -> None:
        self.bench, self.plan, self.controller, self.journal = bench, plan, controller, journal
        self.watch = watch
        self.period = 1.0 / plan.rate
        self.wanted = f"{'V' if plan.voltage else plan.reading}_ref"
        self.reading = math.nan
        self.unit = ""
        self.heard_at = 0.0
        self.rows: list[tuple[int, tuple[float, ...], int]] = []
        self.fresh: list[Chunk] = []
        self.lateness: list[float] = []
        self.missed = self.stale = self.cut = self.amiss = 0

    def whole(self) -> LoopTiming:
        """Go to where it rests, zero, rehearse, run, finish."""
        bench, plan = self.bench, self.plan
        self._say("prepare", 0)
        if bench.output.present is None:
            bench.output.power_up()
        bench.output.ramp(plan.start)
        bench.clock.sleep(plan.settle)
        bench.preparation.zero()
        note_air(bench.preparation, self.journal, "start")
        bench.sensor.kickoff()
        cost = self._rehearse()
        self.controller.begin(self.reading, plan.start)
        try:
            reached = self._ticks()
        finally:
            self._flush()
        self._note(heard(self.journal, bench.sensor, bench.sensor.finish))
        note_air(bench.preparation, self.journal, "end")
        self._say("end", plan.reference.size)
        late = np.array(self.lateness)
        return LoopTiming(
            plan.rate, reached, float(late.std()), float(late.max()), late.size, self.missed,
            self.stale, self.cut, cost,
        )  # fmt: skip

    def _rehearse(self) -> CycleCost:
        """Try cycles at rest, and refuse a rate that they do not keep.

        The first reading of a slow sensor may take a while.
        """
        bench, plan = self.bench, self.plan
        pause = max(self.period, 1.0 / bench.fastest)
        self.heard_at = bench.clock.now()
        while not self._listen():
            self._patient("the first reading", bench.clock.now(), plan.patience + 1.0)
            bench.clock.sleep(pause)
        spent, busy, passed = np.zeros(REHEARSED), 0.0, 0.0
        self.controller.begin(self.reading, plan.start)
        for k in range(REHEARSED):
            host = time.perf_counter()
            bench.clock.sleep(pause)
            late = max(time.perf_counter() - host - pause, 0.0)
            before, host = bench.clock.now(), time.perf_counter()
            self._listen()
            self.controller.decide(self.reading, plan.start if plan.voltage else self.reading)
            self.controller.applied(bench.output.approach(plan.start))
            took = time.perf_counter() - host
            spent[k] = late + took
            busy += took
            passed += bench.clock.now() - before
        cost = cost_of(spent, passed > 0.5 * busy)
        if cost.real and plan.rate > cost.fastest:
            raise UnusableInput(
                f"{plan.name}: a loop of {engineering(plan.rate, 'Hz')} was asked for, but a cycle "
                f"takes this host and transport {engineering(cost.most, 's')}; ask for at most "
                f"{engineering(cost.fastest, 'Hz')}"
            )
        return cost

    def _ticks(self) -> float:
        """Run over the reference; return the rate reached (Hz)."""
        bench, plan, clock = self.bench, self.plan, self.bench.clock
        n, k = plan.reference.size, 0
        every = max(round(SLICE * plan.rate), 1)
        looked = 0
        begin = self.heard_at = clock.now()
        self.journal.note({"event": "start", "instant": begin})
        first = written = begin
        while k < n:
            due = begin + k * self.period
            now = clock.now()
            if now < due:
                clock.sleep(due - now)
            elif (behind := int((now - due) / self.period)) > 0:
                self._patient("the program stood still", now, plan.patience, due)
                skipped = min(behind, n - 1 - k)
                self.missed += skipped
                k += skipped
                due = begin + k * self.period
            new = self._listen()
            asked = self.controller.decide(self.reading, float(plan.reference[k]))
            volts = bench.output.approach(asked)
            self.controller.applied(volts)
            written = clock.now()
            if not self.lateness:
                first = written
            self._row(k, asked, volts, written, new, due)
            if not new:
                self._patient(f"{bench.sensor.stream}: no new reading", written, plan.patience)
            k += 1
            if k - looked >= every or k == n:
                self._look(volts, k)
                looked = k
        done = len(self.lateness) - 1
        return done / (written - first) if written > first else plan.rate

    def _row(
        self, k: int, asked: float, volts: float, written: float, new: bool, due: float
    ) -> None:
        cut = volts != asked
        late = written - due
        self.lateness.append(late)
        self.cut += cut
        self.stale += not new
        flags = Flag.CLAMPED if cut else Flag.GOOD
        flags |= Flag.LATE if late > 0.5 * self.period else Flag.GOOD
        values = (volts, asked, self.reading, float(self.plan.reference[k]), written)
        self.rows.append((k, values, int(flags)))

    def _listen(self) -> bool:
        """Drain the sensor; whether there is a new reading."""
        chunks = heard(self.journal, self.bench.sensor, self.bench.sensor.poll)
        self._note(chunks)
        new = [c for c in chunks if self.plan.reading in c.channels and c.n]
        if not new:
            return False
        value = float(new[-1].channels[self.plan.reading][-1])
        if not math.isfinite(value) or int(new[-1].flags[-1]) & Flag.BEAM_LOST:
            raise BeamLost(
                f"{new[-1].stream}: {self.plan.reading} = {value:g} is no reading to act on; the "
                "sensor is lost"
            )
        self.reading, self.unit = value, new[-1].units[self.plan.reading]
        self.heard_at = self.bench.clock.now()
        return True

    def _patient(self, what: str, now: float, allowed: float, since: float | None = None) -> None:
        """Give up on what has lasted for too long."""
        lasted = now - (self.heard_at if since is None else since)
        if lasted > allowed:
            raise TimedOut(
                f"{self.plan.name}: {what} for {engineering(lasted, 's')}, allowed are "
                f"{engineering(allowed, 's')}; look at sensor and host, or give more patience"
            )

    def _look(self, volts: float, k: int) -> None:
        """Hold the monitor against the command, feed a watchdog, report."""
        output = self.bench.output
        told = output.read()
        if told is not None:
            self.amiss = output.compare([volts], [told], self.amiss)
        output.tend()
        self._flush()
        self._say("play", k)

    def _flush(self) -> None:
        """Write the rows since the last time, in runs without a gap."""
        rows, self.rows = self.rows, []
        if not rows:
            return
        starts = [j for j, r in enumerate(rows) if not j or r[0] != rows[j - 1][0] + 1]
        for a, b in zip(starts, [*starts[1:], len(rows)], strict=True):
            part = rows[a:b]
            names = ("V", "V_asked", self.plan.reading, self.wanted, "instant")
            unit = "V" if self.plan.voltage else self.unit
            units = dict(zip(names, ("V", "V", self.unit, unit, "s"), strict=True))
            columns = np.array([values for _, values, _ in part]).T
            chunk = Chunk(
                LOOP, part[0][0], dict(zip(names, columns, strict=True)), units,
                np.array([flags for *_, flags in part], np.uint16),
            )  # fmt: skip
            self.journal.append(chunk)
            self._note([chunk])

    def _note(self, chunks: Sequence[Chunk]) -> None:
        if self.watch is not None:
            self.fresh.extend(chunks)

    def _say(self, phase: str, done: int) -> None:
        if self.watch is not None:
            fresh, self.fresh = self.fresh, []
            n = self.plan.reference.size
            self.watch(TakeProgress(phase, done * self.period, done, n, 0, fresh))
