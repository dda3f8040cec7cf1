"""What to do next where nothing may be named and no experiment could be designed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from bondgraph.analysis.sensor_advice import unmeasured
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Df, Sensor
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.kinds_told import open_kinds
from identification.diagnosis.localisation.places_without_name import places_of
from identification.diagnosis.localisation.recording.variables import variables_beside
from identification.report.numbers import interval

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

PROBES: Mapping[str, str] = MappingProxyType(
    {
        "restoring": "a slow sweep of the whole range, there and back, and once more at twice the "
        "speed: what depends on the displacement alone draws the same curve each time",
        "dissipative": "steady flows from small to large in both directions, each held until "
        "nothing changes: a loss then depends on the flow alone",
        "surface": "the same way at three constant speeds: what depends on displacement and flow "
        "together keeps its places and changes its size",
        "memory": "slow sweeps there and back with falling amplitude, and once more at twice the "
        "speed: a memory draws loops within loops, the same at both speeds",
        "slow": "a step, a long rest, a step back and a long rest: a slow after-effect goes on by "
        "itself in both rests",
        "mode": "a sine swept slowly through the band at two amplitudes: a resonance keeps its "
        "frequency, and its height grows with the amplitude",
        "ratio": "the same small excitation about several positions, with both sides measured: "
        "both gains change by the same share if it is the ratio",
        "command": "the same command at half the amplitude and at half the speed, with what the "
        "drive really puts out recorded beside it",
        "sensing": "known steps of what is measured, or a second sensor beside it: an error of the "
        "reading shows in one of them",
        "time": "the same short input at the beginning, in the middle and at the end of a long "
        "run: a coefficient that changes answers otherwise each time",
        "exogenous": "a record with the command at rest: what still moves comes from outside",
    }
)
"""The experiment that shows each kind of physics by itself."""


def next_step(d: Diagnosis) -> tuple[str, ...]:
    """Return what would show what is missing: an experiment, and a signal that nobody reads."""
    step = d.decision
    if step is None:
        return ()
    tried = next(_told_apart(step), "") or _where_it_fails(d)
    place = next(iter(places_of(step, d.structure)), "")
    return tuple(s for s in (tried, _signal_at(d.graph, place)) if s)


def _told_apart(step: Decision) -> Iterator[str]:
    """Yield the experiments that show what the answer holds possible, the likeliest first."""
    alike = {k.kind: k.element for k in open_kinds(step)}
    if step.answer == "kind" and step.places:
        alike = {step.physics: step.places[0]}
    # a law of another kind than the one that is told would lead astray
    near = step.possible if step.closest is not None else ()
    laws = [t for t in near if not alike or t.insertion.kind in alike]
    for t in laws:
        other = next((r for r in near if r is not t), None)
        if apart := _separated(t.effect, other.effect if other else ""):
            told = f"to see whether it is {t.label}"
            if other is not None:
                told = f"to tell {t.label} from {other.label}"
            yield f"{told}: {apart}"
    for kind, element in alike.items():
        if kind in PROBES:
            yield f"to see what is missing at {element}: {PROBES[kind]}"
    for n in step.nearest:
        if apart := _separated(n.effect) or PROBES.get(n.kind, ""):
            yield f"to see whether {n.effect or 'that'} at {n.element} is part of it: {apart}"


def _separated(effect: str, other: str = "") -> str:
    """Return the experiment that tells an effect from what looks like it; empty if unknown.

    Of two the one that is known for the pair, else that of the one which is known to be confused
    with the other.
    """
    known = {e.name: e for e in CATALOGUE if e.name in (effect, other)}
    if effect not in known:
        return ""
    pair = (e.from_one[n] for e in known.values() for n in known if n in e.from_one)
    if (told := next(pair, "")) != "":
        return told
    aware = (e for n, e in known.items() if {effect, other} - {n} <= set(e.confused_with))
    return next(aware, known[effect]).separated_by


def _where_it_fails(d: Diagnosis) -> str:
    """Word when the misfit sits in a band of frequencies that a drive can dwell in."""
    drives = [s.name for s in d.graph.of_type(Source) if not s.measured]
    band = next((r for r in d.regions if r.kind == "frequency" and r.density > 1.0), None)
    if band is None or not drives or not band.high > 0:
        return ""
    return (
        f"to see whether what is missing is linear: a sine of {drives[0]} swept slowly over "
        f"{interval(band.low, band.high, band.unit)}, where {band.channel or 'the model'} misses "
        "most, at two amplitudes: a misfit that grows in proportion is linear (a resonance, a "
        "lag), one that does not is a law"
    )


def _signal_at(graph: BondGraph, place: str) -> str:
    """Word on the signal of a place's own junction where no sensor reads it, nor its integral."""
    if place not in graph.elements or isinstance(graph[place], Sensor):
        return ""
    read = {n for s in graph.of_type(Sensor) for n in _bonded(graph, s.name)}
    beside = _bonded(graph, place) - read
    for kind, junction in unmeasured(graph):
        if junction.name in beside:
            signal = f"{'f' if kind is Df else 'e'}_{junction.name}"
            return f"measure {junction_signal(graph, signal)} too: it shows {place} by itself"
    return ""


def _bonded(graph: BondGraph, name: str) -> set[str]:
    """Return an element and its neighbours; a reading of what others carry has none."""
    return {n for b in graph.bonds_of(name) for n in (b.tail, b.head)}


def junction_signal(graph: BondGraph, signal: str) -> str:
    """Say what a junction's variable is, in the words of its domain.

    Examples
    --------
    >>> from bondgraph import BondGraph, I, One
    >>> with BondGraph("cart") as cart:
    ...     mass = One("body") >> I("m", 2.0, unit="kg")
    >>> junction_signal(cart, "f_body")
    'the velocity v (the flow at body)'
    """
    what, _, junction = signal.partition("_")
    word, general = variables_beside(graph, junction), "flow" if what == "f" else "effort"
    own = word.flow if what == "f" else word.effort
    if own == general:
        return f"the {general} at {junction}"
    letter = {"current": " i", "velocity": " v"}.get(own, "")
    return f"the {own}{letter} (the {general} at {junction})"
