"""The verdict of a diagnosis in the contract's JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from bondgraph.graph.elements import C, Element, I, R, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.lacking_element import domain_at
from identification.diagnosis.catalogue.places import law_of, modulated_ratio
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.kinds_told import open_kinds
from identification.diagnosis.evidence.nearest import Nearest
from identification.diagnosis.explanation.doubts import suspected
from identification.diagnosis.explanation.law_formula import in_symbols, meaning_of
from identification.diagnosis.explanation.places_judged import JudgedPlace, judged_places
from identification.diagnosis.explanation.rivals import standings
from identification.diagnosis.explanation.undetermined import remark_of
from identification.diagnosis.localisation.element_kind import element_kind
from identification.diagnosis.localisation.places_without_name import places_of
from identification.diagnosis.localisation.recording.variables import (
    GENERIC,
    losing_words,
    restoring_words,
)
from identification.diagnosis.localisation.regions import summary
from identification.diagnosis.screening.flexible_forms import SORTS
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.estimates import Estimate
from identification.estimation.single_record import Fit
from identification.report.numbers import quantity, times_noise
from identification.uncertainty.tied import remark_on

KINDS = (
    "explained", "parameters_only", "missing_physics", "unknown_physics", "insufficient_data"
)  # fmt: skip
SCHEMA = "bondsight.verdict/1"
_PART = {"name": str, "sha256": str, "samples": int}


def sort_at(kind: str, element: Element) -> str:
    """Return a kind of physics in words of the element's domain."""
    if kind == "restoring":
        return restoring_words(element)
    own = losing_words(element, kind == "surface") if kind in ("dissipative", "surface") else ""
    return own or SORTS.get(kind, f"something {kind}")


def verdict(d: Diagnosis) -> dict[str, Any]:
    """Return the verdict as plain data (schema ``bondsight.verdict/1``).

    Examples
    --------
    >>> document = verdict(found)
    >>> document["schema"], document["verdict"]
    ('bondsight.verdict/1', 'missing_physics')
    """
    last = d.repaired or d.nominal
    floor = {} if d.data is None else dict(zip(d.data.names, map(float, d.data.floor), strict=True))
    return {
        "schema": SCHEMA,
        "verdict": d.kind,
        "model": d.model,
        "recording": {
            "name": d.recording.name,
            "sha256": d.recording.sha256,
            "samples": int(d.recording.n),
            "channels": list(d.recording.channels),
            **({"parts": parts} if (parts := parts_of(d.recording)) else {}),
        },
        "findings": _findings(d),
        "fit": {
            "noise_floor": floor,
            "nominal": _errors(d.nominal),
            "repaired": _errors(d.repaired),
        },
        "remaining": _remaining(d),
        "regions": list(summary(d.regions)),
        "steps": [_step(step, d) for step in d.steps],
        # those that were bent to a wrong recording mean nothing
        "parameters": [_estimate(e, d) for e in last.estimates] if last and not d.mistakes else [],
        "nuisances": [_nuisance(e, d) for e in last.nuisances] if last else [],
        "advice": list(d.advice),
        "notes": list(d.notes),
        "seconds": round(d.seconds, 3),
        "seed": d.seed,
    } | _where_any(d)


def _where_any(d: Diagnosis) -> dict[str, Any]:
    """Return what not every verdict has: mistakes of the recording, own limits, places."""
    found, places = suspected(d), judged_places(d)
    return (
        ({"suspects": list(found)} if found else {})
        | ({} if d.limits == Thresholds() else {"limits": asdict(d.limits)})
        | ({"places": [_place(p) for p in places]} if places else {})
        | ({"units": _units(d)} if d.data is not None else {})
        | ({"together": [t.document for t in d.tied]} if d.tied else {})
    )


def _units(d: Diagnosis) -> dict[str, str]:
    """Return the SI unit of every reading."""
    assert d.data is not None
    return {n: d.recording.units.get(n) or "" for n in d.data.names}


def _place(p: JudgedPlace) -> dict[str, Any]:
    """Return a class of elements, what is left with any law there over the noise, and why."""
    left = {"train": _rounded(p.train), "test": _rounded(p.test)}
    return {"elements": list(p.elements), "over_noise": left, "why": p.why}


def parts_of(recording: Recording) -> list[dict[str, Any]]:
    """Return name, hash and samples of every recording where several were joined.

    Empty too if ``meta["parts"]`` is something of the user's own.
    """
    found = recording.meta.get("parts")
    if not isinstance(found, list | tuple) or not all(map(_is_part, found)):
        return []
    return [{k: part[k] for k in _PART} for part in found]


def _is_part(part: Any) -> bool:
    return isinstance(part, Mapping) and all(isinstance(part.get(k), t) for k, t in _PART.items())


def _findings(d: Diagnosis) -> list[dict[str, Any]]:
    if d.kind == "missing_physics":
        return [_named(step, d) for step in d.findings]
    return [_unknown(d)] if d.kind == "unknown_physics" else []


def _named(step: Decision, d: Diagnosis) -> dict[str, Any]:
    chosen = step.chosen
    assert chosen is not None
    repaired = as_repaired(chosen, d)
    same = [t.element for t in step.same_place]
    if step.answer == "approximate":
        same += [p for p in step.places if p != chosen.element]
    return {
        "location": _location(chosen.element, same, d, chosen.effect),
        "answer": step.answer,
        "effect": chosen.effect if step.answer in NAMES else "unknown",
        "family": chosen.insertion.family,
        "kind": step.physics,
        "kind_words": sort_of(chosen, step.physics, d),
        "sentence": chosen.insertion.sentence if step.answer in NAMES else "",
        "law": chosen.insertion.law,
        "formula": in_symbols(repaired),
        "law_fit": _rounded(step.law_fit),
        "confidence": round(step.confidence, 3),
        "probability": round(step.confidence, 3),
        "parameters": [
            _estimate(e, d) | {"meaning": meaning_of(e.name, repaired)}
            for e in effect_parameters(chosen, d)
        ],
        "constants": [
            {
                "name": p.name,
                "value": p.value,
                "unit": p.unit,
                "meaning": meaning_of(p.name, repaired),
            }
            for p in law_constants(chosen, d)
        ],
        "also_possible": [_rival(t) for t in _members(step)],
        "share_of_misfit_explained": round(step.share, 4),
    }


def _step(step: Decision, d: Diagnosis) -> dict[str, Any]:
    """Return what one step of the search tried, the best first, and why it ended as it did."""
    tried = [
        {
            "effect": s.trial.effect,
            "element": s.trial.element,
            "over_noise": _rounded(times_noise(s.trial.test)),
            "behind": None if s.role == "winner" else _rounded(s.z),
            "why": s.why,
        }
        for s in standings(d, step)[:TRIED]
    ]
    return {
        "before": _rounded(times_noise(step.nominal)),
        "reasons": list(step.reasons),
        "tried": tried,
    }


TRIED = 12
"""Effects of a step that a verdict lists."""


def _members(step: Decision) -> tuple[Candidate, ...]:
    """Effects that are not excluded beside the one that is named, or all where none is."""
    own = () if step.answer in NAMES or step.chosen is None else (step.chosen,)
    return (*own, *step.rivals, *step.richer)


NAMES = ("exact", "approximate")
"""Answers that give one effect its name."""


def _unknown(d: Diagnosis) -> dict[str, Any]:
    """Return an honest "unknown": what comes closest is listed, nothing is named."""
    step = d.decision
    return {
        "location": unresolved_place(d),
        "answer": step.answer if step else "unknown",
        "effect": "unknown",
        "family": step.family if step else "outside",
        "kind": step.physics if step and step.answer != "unknown" else "",
        "kind_words": _kind_words(step.physics, next(iter(step.places), ""), d)
        if step and step.answer != "unknown"
        else "",
        "sentence": "",
        "law": "none",
        "formula": "",
        "law_fit": _rounded(step.law_fit) if step else None,
        "confidence": 0.0,
        "probability": round(step.confidence, 3) if step else 0.0,
        "parameters": [],
        "constants": [],
        "also_possible": _possible(step, d) if step else [],
        "share_of_misfit_explained": round(step.share, 4) if step else 0.0,
    } | ({"nearest": near_of(step.nearest, d)} if step and step.nearest else {})


def near_of(found: Iterable[Nearest], d: Diagnosis) -> list[dict[str, Any]]:
    """Return what comes nearest as plain data."""
    return [
        {
            "effect": n.effect or "unknown",
            "element": n.element,
            "kind": n.kind,
            "kind_words": _kind_words(n.kind, n.element, d),
            "share": round(n.part, 4),
        }
        for n in found
    ]


def sort_of(chosen: Candidate, kind: str, d: Diagnosis) -> str:
    """Return the kind of a named law in words: its own where it has some."""
    own = next((e.sort for e in CATALOGUE if e.name == chosen.effect), "")
    if not (own and kind):
        return _kind_words(kind, chosen.element, d)
    held = d.graph.elements.get(chosen.element)
    v = GENERIC if held is None else domain_at(d.graph, held)
    article = "an" if v.effort[0] in "aeiou" else "a"
    return own.replace("an effort", f"{article} {v.effort}").replace("its flow", f"the {v.flow}")


def _kind_words(kind: str, element: str, d: Diagnosis) -> str:
    held = d.graph.elements.get(element)
    return sort_at(kind, held) if kind and held is not None else ""


def _rounded(v: float) -> float | None:
    return round(float(v), 4) if np.isfinite(v) else None


def _remaining(d: Diagnosis) -> dict[str, Any]:
    """Return what the last fit leaves of every reading: size, place, kind, regions."""
    if d.left is None:
        return {}
    last = d.steps[-1] if d.steps else None
    known = last is not None and last.kind == "unknown_physics"
    found = {}
    for name, size in d.left.over_noise.items():
        above = size > d.limits.noise
        found[name] = {
            "over_noise": _number(round(size, 4)),
            "place": list(last.places) if above and known and last is not None else [],
            "kind": last.physics if above and known and last is not None else "",
            "regions": [str(r) for r in d.regions_left if r.channel in ("", name)] if above else [],
        }
    return found


def unresolved_place(d: Diagnosis) -> dict[str, Any]:
    """Place of an unnamed mismatch, with all that are as good; empty where they are too many."""
    step = d.decision
    found = places_of(step, d.structure) if step else ()
    if not found:
        return {"element": "", "kind": "junction", "indistinguishable_from": []}
    effect = step.chosen.effect if step and step.chosen and step.answer != "kind" else ""
    return _location(found[0], list(found[1:]), d, effect)


def _location(element: str, same: list[str], d: Diagnosis, effect: str = "") -> dict[str, Any]:
    if effect == "clock_skew" and isinstance(d.graph[element], Source):
        # the clock that all readings share is no element of the graph
        return {"element": "clock", "kind": "clock", "indistinguishable_from": sorted(set(same))}
    return {
        "element": element,
        "kind": element_kind(d.graph, element),
        "indistinguishable_from": sorted(set(same) - {element}),
    }


def _rival(t: Candidate) -> dict[str, Any]:
    left = f"leaves {times_noise(t.test):.4g} times the noise, all readings together"
    sized = size_words(t)
    return {
        "effect": t.effect,
        "element": t.element,
        "evidence": f"{left}, with {sized}" if sized else left,
    }


def size_words(t: Candidate) -> str:
    """Say how large a law is fitted: its strengths, or what else it brought in.

    Its numbers stand where an experiment, or somebody who knows the machine, can tell look-alikes
    apart.
    """
    units = {e.name: e.unit for e in t.fit.estimates}
    own = [n for n in t.insertion.strengths if n in units]
    return ", ".join(f"{n} = {quantity(t.fit.values[n], units[n])}" for n in own[:SIZES])


SIZES = 3
"""Numbers of a look-alike that are told."""


def _possible(step: Decision, d: Diagnosis) -> list[dict[str, Any]]:
    """Return the laws that come closest, then kinds of physics that the data do not tell apart."""
    kinds = [
        {
            "effect": "unknown",
            "element": k.element,
            "kind": k.kind,
            "kind_words": _kind_words(k.kind, k.element, d),
            "evidence": f"predicts stretches left out to {times_noise(k.score.square):.4g} times "
            "the noise, all readings together",
        }
        for k in open_kinds(step)
    ]
    far = step.closest is None and step.answer in ("kind", "unknown")
    return [*map(_rival, step.rivals if far else step.possible), *kinds]


def effect_parameters(trial: Candidate, d: Diagnosis) -> list[Estimate]:
    """Parameters that the effect brought in, as the last repair has them."""
    known = set(d.nominal.problem.dynamics.parameter_names) if d.nominal else set()
    last = {e.name: e for e in d.repaired.estimates} if d.repaired else {}
    for step in d.findings:
        if step.chosen is not None and step.chosen.insertion.label == trial.insertion.label:
            break
        if step.chosen is not None:
            known |= {e.name for e in step.chosen.fit.estimates} | _of_law(step.chosen, d)
    own = {e.name: e for e in trial.fit.estimates if e.name not in known}
    # a law that was refined in the last repair has numbers that its own fit does not know
    own |= {n: last[n] for n in last if n in _of_law(trial, d) - known}
    return [last.get(n, e) for n, e in own.items()]


def _of_law(trial: Candidate, d: Diagnosis) -> set[str]:
    """Names of what the law at the place of `trial` holds in the last repair."""
    held = d.repaired.problem.graph.elements.get(trial.element) if d.repaired else None
    law = held.law if isinstance(held, C | R | I) else None
    return {p.name for p in law.parameters(trial.element)} if law is not None else set()


def as_repaired(trial: Candidate, d: Diagnosis) -> Candidate:
    """Return an effect with the last repair, which may have refined its law."""
    return replace(trial, fit=d.repaired or trial.fit)


def law_constants(trial: Candidate, d: Diagnosis) -> list[Parameter]:
    """Return the numbers of the law that were chosen, not fitted, as the last repair has them."""
    graph, declared = (d.repaired or trial.fit).problem.graph, d.graph.parameters
    held = graph.elements.get(trial.element)
    law = None if held is None else law_of(held)
    own: Iterable[Parameter] = () if law is None else law.parameters(trial.element)
    if (ratio := modulated_ratio(held)) is not None:
        symbols = sorted(map(str, ratio.free_symbols))
        own = [graph.parameters[n] for n in symbols if n in graph.parameters]
    return [graph.parameters.get(p.name, p) for p in own if p.fixed and p.name not in declared]


def _estimate(e: Estimate, d: Diagnosis) -> dict[str, Any]:
    """Return a number with its interval; without one where it is told only together with others."""
    ends = [None if remark_on(e.name, d.tied) else _number(v) for v in e.ci95]
    made = {"name": e.name, "value": _number(e.value), "unit": e.unit, "ci95": ends}
    return made | ({"remark": remark} if (remark := remark_of(e, d)) else {})


def _nuisance(e: Estimate, d: Diagnosis) -> dict[str, Any]:
    """Return a nuisance; one that the answer leans on with what it does to a reading."""
    made = {
        "name": e.name,
        "value": _number(e.value),
        "unit": e.unit,
        "within_bounds": not e.at_bound,
        "ci95": [_number(v) for v in e.ci95],
    }
    own = (n for n in d.leanings if n.estimate.name == e.name)
    return made | next(({"words": str(n), "over_noise": _rounded(n.over_noise)} for n in own), {})


def _number(v: float) -> float | None:
    return float(v) if np.isfinite(v) else None


def _errors(f: Fit | None) -> dict[str, dict[str, float]]:
    if f is None:
        return {"train_rmse": {}, "test_rmse": {}}
    return {"train_rmse": f.rmse("train"), "test_rmse": f.rmse("test")}


def normalised_error(f: Fit, part: str = "test") -> dict[str, float]:
    """Return rms error over the reading's standard deviation on the whole recording, by sensor.

    The scale does not depend on which stretches were held out: in some of them little moves.
    """
    data = f.problem.data
    spread = np.std(data.readings[data.mask("train") | data.mask("held-out")], axis=0)
    return {
        n: error / max(float(spread[c]), 1e-300)
        for c, (n, error) in enumerate(f.rmse(part).items())
    }


ERROR = "rms error over the standard deviation that the reading has in the whole recording"
"""What a percentage of error is of."""
