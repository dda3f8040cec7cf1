"""From recordings to an identified stack: chapters 5 and 6 of the thesis in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from actuators.stack.conversions import Lumped
from actuators.stack.identified import IdentifiedStack
from actuators.stack.inner_curves import CapacitorFit, best_capacitor, fit_capacitor
from actuators.stack.loading_curve import Interval
from actuators.stack.ramps import (
    USUAL_CREEP,
    FromRest,
    RampFit,
    fit_ramp,
    from_rest,
    require_different,
    require_stack,
)
from actuators.stack.step_response import Ringing
from bondgraph.hysteresis.fitting.creep_behind import WithoutCreep, without_creep
from bondgraph.hysteresis.fitting.held_out import COUNTS as COUNTS
from bondgraph.hysteresis.fitting.held_out import OperatorChoice, choose_operator
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput

NANO = 1e9
TABLE_6_3 = {"al_janaideh": 33.88, "ang": 28.63}
"""Printed rms of the operators on the sine they were fitted to, nm."""
TABLE_6_5 = 87.36
"""Printed rms of the lumped model with Maxwell elements on a sine, nm."""
TIMES = 5.0
"""Of the rms of the fit: more held out is told."""
BENT = 0.01
"""Rise of the slope in the last tenth that is told."""


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """An identified stack and what led to it.

    Attributes
    ----------
    stack : IdentifiedStack
    ramp : RampFit
    choice : OperatorChoice
    capacitors : tuple of CapacitorFit
        Empty without a capacitance.
    """

    stack: IdentifiedStack
    ramp: RampFit
    choice: OperatorChoice
    capacitors: tuple[CapacitorFit, ...]

    def __str__(self) -> str:
        """Return the tables, the thesis' numbers beside."""
        s = self.stack
        span = NANO * s.stroke()
        lines = [
            f"{ramp_table([self.ramp])}",
            f"operator by held-out error, {', '.join(s.sources)} (nm; thesis, table 6.3)",
        ]
        for kind, printed in TABLE_6_3.items():
            if any(t.kind == kind for t in self.choice.tried):
                t = self.choice.best(kind)
                size = f"J {t.plays}" + (f", m {t.zones}" if kind == "ang" else "")
                lines.append(
                    f"  {kind:12s} {size:10s} rms {NANO * t.rms:7.2f}, held out "
                    f"{NANO * t.held_out:7.2f}   ({printed:g})"
                )
        lines.append(
            f"chosen: {s.operator.kind}, rms {NANO * s.rms:.2f} nm, held out "
            f"{NANO * s.held_out:.2f} nm = {100 * NANO * s.held_out / span:.3f} % of "
            f"{1e-3 * span:.3f} um; noise {NANO * s.noise:.2f} nm; x {1e6 * s.lag:.0f} us late"
        )
        # the rms of the stack is over all samples, also those that are held out
        fitted = self.choice.best(s.operator.kind).rms
        if s.held_out > TIMES * fitted:
            judge = s.sources[-1] if len(s.sources) > 1 else f"the last third of {s.sources[-1]}"
            lines.append(
                f"  note: {judge}, which is held out, is missed by {s.held_out / fitted:.0f} times "
                "the rms of the fit; are the recordings in the order in which they were taken, of "
                "one stack, and do those that are fitted go as far?"
            )
        for f in self.capacitors:
            lines.append(
                f"  Maxwell capacitor, {f.way:14s} {len(f.capacitor.stiffnesses):2d} elements, rms "
                f"{NANO * f.rms:7.2f}, held out {NANO * f.held_out:7.2f}   ({TABLE_6_5:g})"
            )
        if s.creep is not None:
            units = zip(s.creep.weights, s.creep.times, strict=True)
            said = ", ".join(f"{100 * c:.2f} % in {t:.3g} s" for c, t in units)
            lines.append(f"creep behind the operator: {said}")
        if s.damping is not None:
            lines.append(f"damping {said_of(s.damping)} N s/m")
        lines.append(number_table(s))
        return "\n".join(lines)


def identify_stack(
    recordings: Sequence[Recording],
    stiffness: Interval,
    *,
    capacitance: float | None = None,
    mass: float | None = None,
    step: Ringing | None = None,
    carried: bool = True,
    counts: Sequence[int] = COUNTS,
    name: str = "stack",
) -> Identification:
    """Identify a stack from ramps and loops, each from rest at 0 V.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order in which they were taken; the first one rises from virgin rest. The last one,
        or the last third of a single one, is held out.
    stiffness : Interval
        k, N/m.
    capacitance : float, optional
        Clamped, F; without it there are no Maxwell elements.
    mass : float, optional
        Moved, kg; with `step` it gives the damping.
    step : Ringing, optional
    carried : bool
        A recording begins with what the one before left; else all were demagnetised.
    counts : sequence of int
        Numbers of plays that are tried.
    name : str

    Raises
    ------
    UnusableInput
        If there is no recording, one cannot be used, or they differ in rate; the line says which
        and why.
    """
    if not recordings:
        raise UnusableInput("identify: give at least one recording of a ramp or a loop")
    from_rests = checked_records(recordings)
    first = from_rests[0]
    for r in from_rests[1:]:
        if not _one_rate(r, first):  # delay and creep are fitted by samples
            raise UnusableInput(
                f"{r.name}: is sampled at {r.rate:g} Hz, {first.name} at {first.rate:g} Hz; delay "
                "and creep are fitted over all recordings together, so record at one rate, or "
                "read them at one (Recording.read(..., resample=))"
            )
    raw = fit_ramp(first, stiffness)  # refused before minutes are spent
    clean = _without_creep(from_rests, carried)
    ramp = fit_ramp(replace(first, x=clean.records.outputs[0]), stiffness)
    if len(from_rests) == 1 or clean.creep is None:
        more = max(raw.transducer.value / ramp.transducer.value - 1.0, 0.0) if clean.creep else 0.0
        ramp = replace(ramp, unsure=(ramp.usual_creep, more))
    choice = choose_operator(clean.records, counts=counts)
    capacitors: tuple[CapacitorFit, ...] = ()
    if capacitance is not None:
        constants = Lumped(capacitance, ramp.transducer.value, stiffness.value)
        capacitors = fit_capacitor(clean.records, constants)
    best = best_capacitor(capacitors) if capacitors else None
    stack = IdentifiedStack(
        name, tuple(r.name for r in from_rests), ramp.constant, stiffness,
        choice.fit.operator, choice.fit.numbers,
        min(float(r.volt.min()) for r in from_rests), max(float(r.volt.max()) for r in from_rests),
        first.noise, choice.fit.rms, choice.fit.held_out, lag=clean.delay / first.rate,
        remanence=ramp.remanence, capacitance=capacitance, mass=mass,
        damping=step.damping(mass) if step and mass else None, creep=clean.creep,
        capacitor=best.capacitor if best else None,
        capacitor_held_out=best.held_out if best else None,
    )  # fmt: skip
    return Identification(stack, ramp, choice, capacitors)


def checked_records(recordings: Sequence[Recording]) -> list[FromRest]:
    """Return records from rest; refuse one that is given twice, or that no stack gives."""
    records = [from_rest(r) for r in recordings]
    require_different(records)
    for r in records:
        require_stack(r)
    return records


def fit_ramps(
    records: Sequence[FromRest], stiffness: Interval, *, carried: bool = True
) -> list[RampFit]:
    """Return what ramps tell, creep taken out where several records tell it from hysteresis.

    Parameters
    ----------
    records : sequence of FromRest
        In the order in which they were taken.
    stiffness : Interval
        k, N/m.
    carried : bool
        A record begins with what the one before left; else all were demagnetised.

    Raises
    ------
    UnusableInput
        If a rise has too few samples, or the records cannot be put together.
    """
    raw = [fit_ramp(r, stiffness) for r in records]
    # creep is fitted by samples
    if len(records) > 1 and all(_one_rate(r, records[0]) for r in records):
        clean = _without_creep(records, carried)
        if clean.creep is not None:
            outputs = clean.records.outputs
            pairs = zip(records, outputs, strict=True)
            return [fit_ramp(replace(r, x=x), stiffness) for r, x in pairs]
    return [replace(r, unsure=(r.usual_creep, 0.0)) for r in raw]


def _one_rate(r: FromRest, first: FromRest) -> bool:
    return abs(r.rate / first.rate - 1.0) < 1e-3


def _without_creep(records: Sequence[FromRest], carried: bool) -> WithoutCreep:
    pairs = [(r.volt - r.volt[0], r.x) for r in records]
    return without_creep(LoopRecords.of(pairs, carried=carried), 1.0 / records[0].rate)


def said_of(number: Interval, scale: float = 1.0) -> str:
    """Return a number with its interval."""
    low, high = number.ci95
    return f"{scale * number.value:.5g} [{scale * low:.5g}, {scale * high:.5g}]"


def ramp_table(ramps: Sequence[RampFit]) -> str:
    """Return slopes, T and remanence of ramps (thesis: 54.15 nm/V, 3.52 N/V)."""
    lines = ["ramp: slope of the first and the last of 50 parts (nm/V; thesis 54.15 at the end)"]
    for r in ramps:
        s = r.slopes
        left = "not seen" if r.remanence is None else f"{said_of(r.remanence, NANO)} nm"
        lines.append(
            f"  {r.name}: {NANO * s.first.value:.3f} .. {NANO * s.last.value:.3f} "
            f"[{NANO * s.last.ci95[0]:.3f}, {NANO * s.last.ci95[1]:.3f}]; "
            f"T = k slope = {said_of(r.constant)} N/V (thesis 3.52), the slope rises by "
            f"{100 * r.bend:.1f} % in the last tenth; remanence {left}; noise "
            f"{NANO * r.noise:.2f} nm"
        )
        if s.last.ci95[0] <= 0.0:
            lines.append(
                f"  note: {r.name}: the slope at the end is not told from zero by its noise, so T "
                "means nothing; drive further, or record longer"
            )
        elif not r.steady:
            lines.append(
                f"  note: {r.name}: the voltage slows down where the slope is read, so delay and "
                "creep are in T; a ramp tells it better"
            )
        elif r.bend > BENT:
            lines.append(f"  note: {r.name}: the slope still rises at the end: T is more than this")
    down, up = (max(shares) for shares in zip(*(r.unsure for r in ramps), strict=True))
    if up > 0.0:
        lines.append(
            "  note: one record hardly tells creep from hysteresis; the interval of T reaches to "
            "the slope with all creep in it; give a loop taken after it as another recording"
        )
    elif down > 0.0:
        lines.append(
            "  note: creep is not told from hysteresis here; it raises the slope, so T is less by "
            f"what there is of it: {100 * down:.1f} % where {100 * USUAL_CREEP[0]:g} % creep in a "
            "decade, which the interval holds; give the ramp and a loop taken after it"
        )
    return "\n".join(lines)


def number_table(stack: IdentifiedStack) -> str:
    """Return every number of the operator and of its inverse."""
    lines = [f"{stack.operator.kind}, number and 95 % interval, SI (c = 1, w_s0 = 1 are the gauge)"]
    for n in stack.numbers:
        said = (
            f"{n.value:.5g} [not determined: {n.reason}]"
            if n.ci95 is None
            else said_of(Interval(n.value, n.ci95))
        )
        lines.append(f"  {n.name:8s} {said}")
    inverse: Any = stack.operator.inverse()
    stages = [("r'", "w'", inverse)] if hasattr(inverse, "weights") else [
        ("d'", "ws'", inverse.dead_zone), ("r'", "wf'", inverse.play)
    ]  # fmt: skip
    for widths, weights, stage in stages:
        lines.append(f"  inverse {widths:3s} " + " ".join(f"{v:.4g}" for v in stage.thresholds))
        lines.append(f"  inverse {weights:3s} " + " ".join(f"{v:.4g}" for v in stage.weights))
    return "\n".join(lines)
