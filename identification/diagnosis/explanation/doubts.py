"""What makes an answer doubtful: a recording, or values, that look wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bondgraph.graph.bond_graph import BondGraph
from identification.diagnosis.explanation.notes import taken_over
from identification.diagnosis.screening.carried import far_off
from identification.diagnosis.screening.forgotten_unit import suspects
from identification.diagnosis.screening.mixups import (
    FIRST,
    TOGETHER,
    forgotten,
    gross,
    in_doubt,
    of_units,
)
from identification.diagnosis.screening.undoing import Mixup, what_to_do, with_unit
from identification.diagnosis.screening.values_back import in_usual_unit
from identification.estimation.single_record import Fit
from identification.report.words import listed

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

BEYOND = 1e3
"""Ratio of a fitted to a declared value that no missing physics bends it by (to nearly nothing it
does)."""
KNOWN_WITHIN = 10.0
"""Upper over lower end of an interval beyond which a value is not known, wherever it is."""


def at_once(
    graph: BondGraph, nominal: Fit, dead: Sequence[Mixup], doubted: Sequence[Mixup]
) -> tuple[str, ...]:
    """Return what looks wrong with channels and values before anything is searched."""
    doubts_on_values = in_doubt(nominal, graph.parameters)
    return (*(m.sentence for m in dead), *doubts_on_values, *(m.sentence for m in doubted))


SETTLED = "suspected before the search, and settled by what was found"
"""How the note begins on what was said on the way and no longer holds."""


def settled(d: Diagnosis, said: Sequence[str]) -> Diagnosis:
    """Return the diagnosis with a note on what was `said` on the way and the repair has settled."""
    if d.kind != "missing_physics" or d.repaired is None:
        return d
    now = {_about(s) for s in (*d.notes, *doubts(d), *(m.sentence for m in d.doubted))}
    left = [s for s in dict.fromkeys(said) if _about(s) not in now]
    return replace(d, notes=(*d.notes, f"{SETTLED}: {'; '.join(left)}")) if left else d


def _about(sentence: str) -> str:
    """Return what a doubt is about: units, or a declared value, whatever it is fitted as."""
    if sentence.startswith((FIRST, TOGETHER)):
        return FIRST
    return sentence.partition(" and fitted as ")[0]


def suspected(d: Diagnosis) -> tuple[str, ...]:
    """Return in a few words each what looks wrong with the recording or with declared values."""
    if d.mistakes or d.doubted:
        return tuple(m.claim for m in d.mistakes or d.doubted)
    found, last = absurd(d), d.repaired or d.nominal
    likely = _likely(d, last) if found and last is not None else ()
    return tuple(m.claim for m in likely) or found


def doubts(d: Diagnosis) -> tuple[str, ...]:
    """Return what the sentence of an answer is followed by, beginning with ``but``."""
    last = d.repaired or d.nominal
    if d.mistakes or last is None:
        return ()
    found = in_doubt(last, d.graph.parameters, _not_known(d))
    units = of_units(found)
    told = found if d.kind == "parameters_only" else units or absurd(d)
    so = d.written(" or ".join(f"{m.claim} ({m.remedy})" for m in d.doubted))
    return ("; so ".join((*told[-1:], so)),) if so else told


AFTER = "the values told here are those of the file as it was read: use them only after that"
"""How what is to be mended ends where a model was found beside it."""


def file_first(d: Diagnosis) -> tuple[str, ...]:
    """Return what to mend in the file before any value is used; empty where nothing is in doubt."""
    return tuple(map(d.written, _to_mend(d)))


def _to_mend(d: Diagnosis) -> tuple[str, ...]:
    last = d.repaired or d.nominal
    if d.mistakes or last is None:
        return (what_to_do(d.mistakes),) if d.mistakes else ()
    if d.doubted:
        return (f"{what_to_do(d.doubted)}; {AFTER}",)
    if gains := tuple(forgotten_units(d)):
        return gains
    if not doubts(d):
        return ()
    if likely := _likely(d, last):
        told = "; or ".join(f"{m.claim}: {m.remedy}" for m in likely)
        return (f"{told}; where the file is right, declare other values; {AFTER}",)
    data = last.problem.data
    channels = listed((*data.commands, *data.names))
    return (
        f"look at the header of the file, whether each unit of {channels} is that of its numbers "
        f"(x[mm], not x[m], for millimetres), and at the declared values; {AFTER}",
    )


def _likely(d: Diagnosis, last: Fit) -> tuple[Mixup, ...]:
    """Return the channels whose unit the values make up for, with the usual unit next to it."""
    if gross(last):
        return ()
    loose = _not_known(d)
    declared = {n: p for n, p in d.graph.parameters.items() if n not in loose}
    data = last.problem.data
    return tuple(
        in_usual_unit(data, s) or Mixup("scale", s.channels, s.factor)
        for s in suspects(last, declared)
    )


def forgotten_units(d: Diagnosis) -> Iterator[str]:
    """Yield what a wrong factor of a reading looks like: a sign or a unit."""
    for chosen in (s.chosen for s in d.findings):
        if chosen is not None and chosen.effect == "sensor_gain":
            names = (f"a_1_{chosen.element}", f"error_{chosen.element}")  # of no gain, of a gain
            factor = 1.0 + sum(chosen.fit.values.get(n, 0.0) for n in names)
            if (mistake := forgotten(chosen.element, factor)) is not None:
                known = with_unit(chosen.fit.problem.data, mistake)
                yield f"{known.claim}: correct the recording ({known.remedy}) and diagnose again"


def absurd(d: Diagnosis) -> tuple[str, ...]:
    """Return one sentence on well known values that no data sheet is wrong by.

    Physics that is missing bends values as well: beside more than noise they must be beyond all
    reason, and beside a gross misfit they tell nothing.
    """
    last = d.repaired or d.nominal
    if last is None or gross(last):
        return ()
    noise = d.kind == "parameters_only" or (d.left is not None and d.left.is_noise(d.limits.noise))
    taken = _taken_over(d)
    declared = {n: p for n, p in d.graph.parameters.items() if n not in taken}
    ends = {e.name: e.ci95 for e in last.estimates}
    far = {
        n: ratio
        for n, ratio in far_off(last, declared).items()
        if _known(*ends[n]) and (noise or ratio > BEYOND)
    }
    if not far:
        return ()
    many, of, these = listed(map(_many, far.values())), "its", "of this value"
    if len(far) > 1:
        of, these = "their", "of these values"
    ends_at = "ends" if len(far) == 1 else "end"
    value = "value" if len(far) == 1 else "values"
    return (
        f"{listed(far)} {ends_at} {many} times {of} declared {value}: a unit, of a channel or "
        f"{these}?",
    )


def _known(low: float, high: float) -> bool:
    return low * high > 0.0 and max(low / high, high / low) < KNOWN_WITHIN


def _many(ratio: float) -> str:
    rounded = float(f"{ratio:.2g}")
    return f"{rounded:,.0f}" if rounded >= 100.0 else f"{rounded:g}"


def _not_known(d: Diagnosis) -> frozenset[str]:
    """Return the parameters whose own values tell nothing of a unit."""
    return _taken_over(d) | {n for t in d.tied for n in t.names}


def _taken_over(d: Diagnosis) -> frozenset[str]:
    last = d.repaired or d.nominal
    named = [s.chosen for s in d.findings if s.chosen is not None]
    return taken_over(last, named) if last is not None else frozenset()
