"""Sections of the report: what was checked, what the port looks like, and what is not said."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.words import spoken
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.conclusion import QUIET
from identification.diagnosis.explanation.places_judged import judged_places
from identification.diagnosis.localisation.recording import axes_of
from identification.diagnosis.report.found import NAMED, found_of, places_of
from identification.diagnosis.report.views import level_unit_of
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.verdict.text import hints
from identification.report import html
from identification.report.numbers import interval, percent, short
from identification.report.words import gathered, stopped

SCREENED = 15


def checked(d: Diagnosis) -> str:
    """Structure, relations blind to each class, the screening, and what is left."""
    if d.nominal is None:
        return ""
    return html.section(
        "What was checked",
        html.paragraph(_structure(d)),
        *_relations(d),
        _screening(d),
        html.bullets(_left(d)),
    )


def _structure(d: Diagnosis) -> str:
    if d.structure is None:
        return ""
    same = ["{" + ", ".join(c) + "}" for c in d.structure.classes if len(c) > 1]
    if not same:
        return "By structure these sensors can tell all elements apart."
    return (
        f"By structure alone these sensors cannot separate {'; '.join(same)}: a residual that "
        "one of them causes, another could cause as well. Within such a class only the shape of "
        "the law speaks."
    )


def _relations(d: Diagnosis) -> list[str]:
    if not d.relations or d.kind in QUIET:
        return []  # nothing is left to be placed
    words = (
        "Before any law is tried: in each row the elements on the left may do whatever they like, "
        "and the rest of the model is fitted anew. If what is missing sits there and nowhere else, "
        "no more than the noise (1) is left. Where more is left, no law at that place alone "
        "explains the recording; between places that leave as little, the laws decide. One law at "
        "one of these elements, as among the rivals, leaves more than all that they might do."
    )
    found = judged_places(d)
    rows = [[", ".join(p.elements), _number(p.train), _number(p.test), p.why] for p in found]
    kinds = ["named" if p.likely else "" for p in found]
    heads = ("place", "left with any law there, times the noise, train", "held out", "so")
    return [
        html.heading("which places can explain it"),
        html.paragraph(words),
        html.table(heads, rows, (1, 2), kinds),
    ]


def _number(left: float) -> str:
    return short(left) if np.isfinite(left) else ""


def _screening(d: Diagnosis) -> str:
    rows = [
        [_screened(s), percent(s.share), short(s.z, 3)]
        for s in d.ranking[:SCREENED]
        if s.hint is not None
    ]
    words = (
        f"{len(d.ranking)} pairs of effect and place were screened by one linear step; the best "
        "were then fitted. Share of the training misfit that the step would remove, and how many "
        "standard errors that is from nothing:"
    )
    heads = ("effect and place", "share", "standard errors")
    return html.folded(words, html.table(heads, rows, (1, 2)))


def _screened(s: Screened) -> str:
    name = "a curve without a name" if s.effect.name == "unknown" else spoken(s.effect.name)
    return f"{name} at {s.element.name}"


def _left(d: Diagnosis) -> list[str]:
    """Say what the last fit leaves."""
    if d.left is None:
        return []
    noise = d.left.is_noise(d.limits.noise)
    if not d.steps or d.steps[-1].kind == "explained" or noise:
        return [f"No law and no kind of physics improves the last fit; {d.left.words}."]
    near = [f"What comes nearest: {said}." for said in hints(d)]
    return [f"Something is left after the last step; {d.left.words}.", *near]


def limits(d: Diagnosis) -> str:
    """Say what these data cannot tell, and how the answer came about."""
    if d.nominal is None:
        return ""
    lines = _range(d) if d.mistakes else [*_range(d), *_undetermined(d), *_unsaid(d)]
    return html.section(
        "What this does not say",
        html.bullets(lines),
        html.heading("notes"),
        html.bullets(gathered(d.notes)),
    )


def _range(d: Diagnosis) -> list[str]:
    """Range that the recording visited: beyond it the law is a guess."""
    if d.data is None:
        return []
    spans = [
        f"{n} {interval(float(u.min()), float(u.max()), level_unit_of(d, n))}"
        for n, u in d.data.commands.items()
        if np.ptp(u) > 0
    ]
    pasts = d.scene.past if d.scene is not None else {}
    for element in (n for n in places_of(d)[0] if n in pasts):
        for a in axes_of(d.graph, element, pasts[element], d.recording.read_in)[:2]:
            if a.name.removeprefix("command ") not in d.data.commands:
                low, high = float(np.nanmin(a.values)), float(np.nanmax(a.values))
                spans.append(f"{a.name} {interval(low, high, a.unit)}")
    if not spans:
        return []
    return [f"It holds where the recording went: {'; '.join(dict.fromkeys(spans))}."]


def _undetermined(d: Diagnosis) -> list[str]:
    f = d.repaired or d.nominal
    assert f is not None
    tied = [n for t in d.tied for n in t.names]
    weak = [e.name for e in f.estimates if _weak(*e.ci95, e.value) and e.name not in tied]
    bound = [e.name for e in f.estimates if e.at_bound]
    return [
        *(stopped(f"the recording tells {t.words}") for t in d.tied),
        *([f"Hardly determined by these data: {', '.join(weak)}."] if weak else []),
        *([f"At the end of what they may be: {', '.join(bound)}."] if bound else []),
    ]


def _weak(low: float, high: float, value: float) -> bool:
    return not np.isfinite([low, high]).all() or high - low > abs(value)


def _unsaid(d: Diagnosis) -> list[str]:
    lines = []
    if d.kind in QUIET:
        lines.append(
            "What the recording does not excite it cannot show: nothing is missing here, which "
            "is not to say that nothing is missing elsewhere."
        )
    if d.kind in NAMED:
        lines.append(
            f"Only the {len(CATALOGUE)} effects of the catalogue can be named; another physics "
            "with the same trace over this range would be given the same name."
        )
    if any(s.same_place for s in d.steps) and found_of(d):
        lines.append("The place is a class, not one element: see the dashed rings.")
    if d.data is not None:
        lines.append(
            "The held-out samples come from the same recording: another level or another day is "
            "a harder test."
        )
    return lines
