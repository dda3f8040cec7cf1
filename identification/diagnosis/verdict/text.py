"""A diagnosis becomes words: a sentence, and what the terminal shows."""

from __future__ import annotations

from collections.abc import Collection
from itertools import dropwhile

import numpy as np

from bondgraph.graph.elements import Source
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.words import briefly, called, spoken
from identification.diagnosis.diagnose import STOPPED_AT_ONCE, Diagnosis
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.conclusion import QUIET
from identification.diagnosis.evidence.kinds_told import EXACT, open_kinds
from identification.diagnosis.explanation.colour import COLOURED
from identification.diagnosis.explanation.common_lag import lag_of_all
from identification.diagnosis.explanation.doubts import doubts, forgotten_units
from identification.diagnosis.explanation.law_formula import gain_of
from identification.diagnosis.localisation.element_kind import element_words
from identification.diagnosis.localisation.regions import summary
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.verdict.document import (
    as_repaired,
    near_of,
    normalised_error,
    sort_at,
    sort_of,
    unresolved_place,
)
from identification.diagnosis.verdict.lines import (
    alike_lines,
    certainty_lines,
    colour,
    error_lines,
    nuisance_lines,
    parameter_lines,
    reason_lines,
    recording_lines,
    together_lines,
    value_lines,
)
from identification.diagnosis.verdict.said_again import (
    ANY_TWO,
    MOST,
    NO_LAW,
    UNPROVED,
    coming_near,
    much,
)
from identification.report.words import ended, gathered, listed, shortened, spaced, stopped
from identification.study.driven import STANDS
from identification.study.factors import drives


def sentence(d: Diagnosis) -> str:
    """Return the answer with what makes it doubtful: the headline, and the sentences behind it."""
    return " ".join(answered(d))


def headline(d: Diagnosis) -> str:
    """Return the answer in one short sentence; what it rests on follows in others."""
    return answered(d)[0]


def answered(d: Diagnosis) -> tuple[str, ...]:
    """Return the sentences of the answer: headline, what is known of it, what makes it doubtful."""
    said = tuple(map(stopped, _answered(d)))
    if d.mistakes or d.nominal is None:
        return said
    instead = [w.claim for w in (d.load, lag_of_all(d)) if w is not None]
    doubted = doubts(d)
    if d.kind == "missing_physics" and any(forgotten_units(d)):
        # a header that is to be mended comes before the name that stands in for it
        first, doubted = f"First check a unit: {'; or '.join(doubted)}.", ()
        said = (first, *_as_it_is(said))
    elif d.doubted and d.kind in QUIET:
        # values that only a mistake in the file explains are no answer yet
        first = f"First check the recording: {' or '.join(m.claim for m in d.doubted)}."
        said = (first, *_as_it_is(said))
    still = [n for n in d.notes if n.endswith(STANDS)]
    if d.kind == "unknown_physics" and still and len(still) == len(drives(d.graph)):
        said = (f"First check the recording: {'; '.join(still)}.", *_as_it_is(said))
    return (*said, *(ended(f"But {s}") for s in (*doubted, *instead)))


def _as_it_is(said: tuple[str, ...]) -> tuple[str, ...]:
    first, *more = said
    return (f"Taken as it is: {first[0].lower()}{first[1:]}", *more)


SLOW = 1.5
"""Times the noise read off the spectrum from which a rest that is called noise needs a word."""


def _slow_rest(d: Diagnosis) -> tuple[str, ...]:
    """Return what is said of a rest above the noise that no law and no form foretells."""
    if d.left is None or d.left.most < SLOW:
        return ()
    return (
        f"But {d.left.most:.3g} times the noise of the quickest samples is left: slow noise, or "
        "what no law of the catalogue and no form follows",
    )


def _answered(d: Diagnosis) -> tuple[str, ...]:
    """Return the headline and what is known beside it."""
    name = shortened(d.recording.name)
    if d.mistakes:
        return _mistaken(d)
    if d.kind == "insufficient_data":
        return (f"There is too little to go on: {d.notes[0] if d.notes else 'no excitation'}",)
    if d.kind == "explained":
        return (
            f"The model {d.model} explains {name} as far as its noise allows; nothing missing "
            "shows",
            *_slow_rest(d),
        )
    if d.kind == "parameters_only":
        return (
            f"With other parameter values the model {d.model} explains {name} as far as its noise "
            "allows; nothing missing shows",
            *_slow_rest(d),
        )
    if d.kind == "missing_physics" and d.nominal is not None and d.repaired is not None:
        return _named(d)
    if d.stopped == STOPPED_AT_ONCE and d.left is not None:
        near = d.steps[0].nearest[:1] if d.steps else ()
        hint = (f"What comes nearest is {coming_near(near_of(near, d))}",) if near else ()
        return (
            f"The search was stopped before its first step had ended: {d.model}, fitted as it is, "
            f"leaves {d.left.most:.3g} times the noise, and why is not known yet",
            *hint,
        )
    said = _without_name(d)
    return (f"{SOONER}: {said[0][0].lower()}{said[0][1:]}", *said[1:]) if d.stopped else said


def _named(d: Diagnosis) -> tuple[str, ...]:
    """Say which effects are missing and where, then of each what it does, then what they gain."""
    names, more = list[str](), list[str]()
    for step in d.findings:
        t = step.chosen
        assert t is not None
        also, others = _also({r.element for r in step.same_place} - {t.element})
        alike = [spaced(n) for n in dict.fromkeys(t.effect for t in step.possible)]
        several = step.answer == "family" and len(alike) > 1
        own = called(t.effect, d.graph, t.element) + _by_law(t)
        effect = f"one of {listed(alike)}" if several else own
        where = f"the {element_words(d.graph, t.element)} {t.element}{also}"
        sure = "" if step.confidence > 0 else "perhaps "
        is_missing = f"is missing at {where}" if not names else f"at {where}"
        names.append(f"{'so is ' if names and not sure else ''}{sure}{effect} {is_missing}")
        whose = f"{own} at {t.element}: " if len(d.findings) > 1 else ""
        says = f"{whose}{t.insertion.sentence}{_gain(t, d)} ({_fits(step, d)})"
        more += [f"the best of them, {own}: {_fits(step, d)}" if several else says, *others]
    before, after = normalised_error(d.nominal), normalised_error(d.repaired)  # type: ignore[arg-type]
    n = max(before, key=lambda k: before[k] / max(after[k], 1e-300))
    gain = (
        f"With {'it' if len(names) == 1 else 'them'} the held-out error of {n} falls from "
        f"{100 * before[n]:.3g} % to {100 * after[n]:.3g} % of its standard deviation"
    )
    return ("; ".join(names), *more, gain)


FEW = 3
"""Places beside the likeliest that a headline lists."""


def _also(same: Collection[str]) -> tuple[str, tuple[str, ...]]:
    """Return in brackets which places the sensors cannot tell apart, and a sentence if many."""
    if not same:
        return "", ()
    told = ", ".join(sorted(same))
    if len(same) <= FEW:
        return f" (or {told}: these sensors cannot tell)", ()
    return f" (or one of {len(same)} others)", (f"These sensors cannot tell it from {told}",)


SOONER = "The search was stopped before all was tried"


def _gain(t: Candidate, d: Diagnosis) -> str:
    """Tell the number of a gain that is off."""
    gain = gain_of(as_repaired(t, d))
    return "" if gain is None else f", its gain is {gain:.4g}"


def _mistaken(d: Diagnosis) -> tuple[str, ...]:
    """Say what looks wrong with the recording, and that no physics is told."""
    first, name = d.mistakes[0], shortened(d.recording.name)
    claims = " or ".join(m.claim for m in d.mistakes)
    return (
        f"The recording {name} rather than the model {d.model} looks wrong: {claims}",
        first.undoing,
        "No physics is told before that is mended",
    )


def _without_name(d: Diagnosis) -> tuple[str, ...]:
    """Say what is known where no name is given: a kind and a place, look-alikes, or less."""
    step = d.decision
    place = unresolved_place(d)
    kind = element_words(d.graph, place["element"]) if place["kind"] == ANY_TWO else place["kind"]
    where = f"the {kind} {place['element']}" if place["element"] else ""
    also, others = _also(place["indistinguishable_from"] if where else ())
    if step is not None and step.answer == "kind" and where:
        sort = sort_at(step.physics, d.graph[step.places[0]])
        if step.physics == "sensing" and isinstance(d.graph[step.places[0]], Source):
            sort = "an error of the measured input"
        law: tuple[str, ...] = ()
        if step.closest is not None and np.isfinite(step.law_fit):
            law = (_no_law(_title(step.closest, d), step.law_fit),)
        return (f"{sort} is missing at {where}{also}", *law, *others)
    if step is not None and step.answer == "look_alikes":
        names = briefly(", ".join(t.label for t in step.possible))
        return (f"Something is missing in {d.model}; these explain it alike: {names}",)
    hint = f"Closest is {_title(step.closest, d)}" if step and step.closest else ""
    if step is not None and step.nearest and not hint:
        hint = f"What comes nearest is {coming_near(near_of(step.nearest[:1], d))}"
    at = f", at {where}{also}," if where else ""
    kinds = open_kinds(step) if step is not None else ()
    either = ""
    if kinds:
        each = " or ".join(f"{sort_at(k.kind, d.graph[k.element])} at {k.element}" for k in kinds)
        at, either = "", f"It is {each}, which look alike here"
        others = ()
    unnamed = "that the catalogue cannot name with confidence"
    if d.stopped:
        unnamed = "that has no name yet"
    first = f"Something is missing in {d.model}{at} {unnamed}"
    return (first, *filter(None, (either, hint)), *others)


def _no_law(law: str, fit: float) -> str:
    """Say why no law is named where a kind of physics is told."""
    much = f"{law} explains {100 * fit:.0f} % of what can be explained so"
    return f"{much}{UNPROVED}" if fit >= EXACT else f"{NO_LAW} ({much})"


def _by_law(t: Candidate) -> str:
    """Name the law, in brackets, where an effect has another at an element of this sort."""
    made = t.insertion
    try:
        own = by_name(t.effect)
    except BondsightError:
        return ""
    return f" ({spaced(made.law)})" if made.law not in (own.law, *own.richer) else ""


def _title(t: Candidate, d: Diagnosis) -> str:
    return f"{called(t.effect, d.graph, t.element)} at {t.element}"


def _fits(step: Decision, d: Diagnosis) -> str:
    """How much a named effect explains and how well its law fits."""
    last = step is d.findings[-1] and d.left is not None and d.left.is_noise(d.limits.noise)
    said = f"explains {much(step.share, 0, step.answer == 'exact' or last)} of the misfit"
    if step.physics:
        assert step.chosen is not None
        said = f"{sort_of(step.chosen, step.physics, d)}, {said}"
    if np.isfinite(step.law_fit) and step.answer != "exact":
        assert step.chosen is not None
        caused = step.chosen.insertion.kind != "time"
        if step.answer == "approximate" and caused and step.law_fit >= EXACT:
            best = "" if _outdone_later(step, d) else "no freer form does better there, but "
            return f"{said}; {best}more than noise is left"
        near = ": near, not exact" if step.answer == "approximate" else ""
        said += f"; the law fits to {min(100 * step.law_fit, 99.9):.3g} %{near}"
    return said


def _outdone_later(step: Decision, d: Diagnosis) -> bool:
    """Whether a later step has found that a freer form does better at the place of a name."""
    later = dropwhile(lambda s: s is not step, d.steps)
    return step.chosen is not None and any(
        k.element == step.chosen.element for s in later if s is not step for k in s.kinds
    )


def what_remains(d: Diagnosis) -> str:
    """Return one sentence on what the last fit leaves; empty where that is noise."""
    if d.kind != "missing_physics" or d.left is None or d.left.is_noise(d.limits.noise):
        return ""
    said = f"What remains, {d.left.most:.3g} times the noise"
    last = d.steps[-1] if d.steps else None
    if last is None or last.kind != "unknown_physics":
        return f"{said}, {'was not looked into' if d.stopped else 'has no place and no kind'}."
    where = f", sits at {listed(last.places)}" if 0 < len(last.places) <= MOST else ""
    looks = ""
    if last.physics and where:
        looks = f" and looks like {sort_at(last.physics, d.graph[last.places[0]])}"
    return f"{said}{where or ', has no place'}{looks}."


def in_words(d: Diagnosis) -> str:
    """Answer, numbers, place in the recording, every step, rivals, advice."""
    first, *more = answered(d)
    answer = " ".join((first, *more))
    said = (first, " ".join(more), what_remains(d), *map(stopped, colour(d)))
    lines = [s for s in said if s] + [""]
    notes = (s for s in d.notes if s not in answer and not s.startswith(COLOURED))
    lines += [f"note: {s}" for s in gathered(notes)]
    lines += [*error_lines(d), *recording_lines(d)]
    lines += [*parameter_lines(d), *alike_lines(d)]
    lines += [*value_lines(d), *nuisance_lines(d), *together_lines(d)]
    lines += certainty_lines(d)
    if d.kind in ("missing_physics", "unknown_physics"):
        seen = [f"seen: {s}" for s in summary(d.regions)[:3]]
        lines += [*seen, *([SEEN] if seen else [])]
    lines += reason_lines(d)
    lines += [f"nearest: {said}" for said in hints(d)]
    lines += [f"next: {spoken(a)}" for a in d.advice if a not in answer]
    lines.append(f"diagnosed in {d.seconds:.1f} s")
    return "\n".join(lines)


SEEN = "  (seen: of the model as it is, fitted, on all scored samples, in that band or part alone)"
"""What the numbers are of that say where the model fails."""


def hints(d: Diagnosis) -> list[str]:
    """Say what comes nearest where neither place nor kind is told."""
    near = [n for step in d.findings for n in near_of(step.nearest, d)]
    return [coming_near(near)] if near else []
