"""What simpler rules would have named, asked with what the tool had: one name, one place, one knob.

Each rule reads the content of an answer's file, as `tests.proof.exam.answering` writes it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from hardware.simulators.judging.claims import Claim, exam_answer_of, told_at
from identification.diagnosis.catalogue import UNNAMED
from tests.proof.trial.rates import rate

Content = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Pick:
    """A name given to a recording.

    Attributes
    ----------
    places : frozenset of str
        Where; empty where no place was told.
    knob : tuple of float
        How sure, the more the surer: names below a limit are withheld.
    """

    name: str
    places: frozenset[str]
    knob: tuple[float, ...]


Rule = Callable[[Content], Pick | None]
"""What a rule names; nothing where it has nothing to go by, or says that nothing is missing."""


def tool(content: Content) -> Pick | None:
    """Return the first name that the tool gives; knob: its probability, then the decision's margin.

    Names among which it does not choose are none.
    """
    said = exam_answer_of(content)
    named = [c for c in said.claims if c.answer in ("exact", "approximate")]
    if not said.alarm or not named:
        return None
    first = named[0]
    sure = first.probability if first.probability is not None else 0.0
    places = first.places if first.resolved else frozenset[str]()
    return Pick(first.effect, places, (sure, margin(content, first)))


def margin(content: Content, claim: Claim) -> float:
    """Return the fewest standard errors by which a rival lost against a claim in its decision.

    Rivals are the laws of another name and the model without a law; -inf where no decision looked
    at the claim.
    """
    for e in content.get("evidence") or ():
        laws = e["laws"]
        own = [
            i + 1
            for i, x in enumerate(laws)
            if x["effect"] == claim.effect and _place(content, *_law(x)) in claim.places
        ]
        if own:
            best = min(own, key=lambda i: e["loss"][i])
            others = [
                i + 1 for i, x in enumerate(laws) if x["effect"] not in (claim.effect, UNNAMED.name)
            ]
            return min(_behind(e, i, best) for i in (0, *others))
    return -math.inf


def _behind(e: Content, worse: int, better: int) -> float:
    """Standard errors of a comparison of stored evidence, as `stored.StoredScore` has it."""
    if e["loss"][worse] < e["loss"][better]:
        return -_behind(e, better, worse)
    return float(max(e["apart"][worse][better], e["paired"][worse][better], key=abs))


def held_out(content: Content, gain: bool = False) -> Pick | None:
    """Return the law with the least held-out misfit.

    Knob: the logarithm of the misfit of the best one of another name, over its own; with `gain`
    that of the model as it is.
    """
    rows, plain = _trials(content)
    return _leading([(_log(r["test"]), r) for r in rows], _log(plain.get("test")), plain_only=gain)


def criterion(content: Content, weight: Callable[[int], float]) -> Pick | None:
    """Return the law with the least ``n log(misfit) + weight(n) k``; knob: the lead to the next.

    ``n`` samples of all readings of the training part, ``k`` parameters (Akaike, IEEE TAC 19 (1974)
    716; Schwarz, Ann. Statist. 6 (1978) 461). Answers that do not hold them say nothing.
    """
    rows, plain = _trials(content)
    if "samples" not in plain:
        return None

    def value(row: Content) -> float:
        n = int(row["samples"])
        # per sample: a trial on a thinned record is worth as much as one on all of it
        made = n * _log(row["train"]) + weight(n) * int(row["parameters"])
        return int(plain["samples"]) / n * made

    return _leading([(value(r), r) for r in rows], value(plain))


def _law(row: Content) -> tuple[str, str]:
    return str(row["effect"]), str(row["element"])


def _place(content: Content, effect: str, element: str) -> str:
    first: Content = next(iter(content.get("evidence") or ()), {})
    return told_at(effect, element, first.get("floors") or content.get("nominal_rms") or ())


def _trials(content: Content) -> tuple[Sequence[Content], Content]:
    """Laws that were fitted in the first step and the model as it is, from what an answer keeps."""
    kept = content.get("baselines") or {}
    if "trials" in kept:
        return [_placed(content, x) for x in kept["trials"]], kept["plain"]
    first = next(iter(content.get("evidence") or ()), None)
    if first is None:
        return (), {}
    laws = [_placed(content, x) for x in first["laws"] if x["effect"] != UNNAMED.name]
    return laws, {"train": first["trained"], "test": first["nominal"]}


def _placed(content: Content, row: Content) -> Content:
    """Return a law's row with its place as truths have it."""
    return {**row, "element": _place(content, *_law(row))}


def _log(value: float | None) -> float:
    return math.inf if value is None else math.log(max(value, 1e-300))


def _leading(
    values: Sequence[tuple[float, Content]], plain: float, plain_only: bool = False
) -> Pick | None:
    known = [(v, r) for v, r in values if math.isfinite(v)]
    if not known:
        return None
    best, row = min(known, key=lambda pair: pair[0])
    others = [] if plain_only else [v for v, r in known if r["effect"] != row["effect"]]
    lead = min([plain, *others]) - best
    return Pick(str(row["effect"]), frozenset({str(row["element"])}), (lead,))


def sparse(content: Content, optimiser: str) -> Pick | None:
    """Return the strongest term that a sparse regression kept; knob: what it contributes."""
    terms = ((content.get("baselines") or {}).get("sparse") or {}).get(optimiser)
    if not terms:
        return None
    effect, element, size = terms[0]
    return Pick(effect, frozenset({_place(content, effect, element)}), (float(size),))


RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "best held-out law, by its lead": held_out,
        "best held-out law, by its gain": partial(held_out, gain=True),
        "Akaike's criterion": partial(criterion, weight=lambda n: 2.0),
        "Bayesian criterion": partial(criterion, weight=math.log),
        "sparse regression, STLSQ": partial(sparse, optimiser="STLSQ"),
        "sparse regression, SR3": partial(sparse, optimiser="SR3"),
        "sparse regression, FROLS": partial(sparse, optimiser="FROLS"),
    }
)
"""Rules that need no training."""


def fits_beside(contents: Mapping[str, Content]) -> Iterator[tuple[float, float, float]]:
    """Yield held-out misfits: of the model as it is, after the repair, and with the black box.

    Of every recording that was repaired and has a black box; each is the rms over readings of the
    held-out rms over the noise of the reading.
    """
    for content in contents.values():
        box = (content.get("baselines") or {}).get("black_box")
        plain, repaired = content.get("nominal_rms"), content.get("repaired_rms")
        first: Content = next(iter(content.get("evidence") or ()), {})
        floors = first.get("floors")
        if not (box and plain and repaired and floors) or None in box.values():
            continue
        made = [
            math.sqrt(float(np.mean([(rms[k] / v) ** 2 for k, v in floors.items()])))
            for rms in (plain, repaired, box)
        ]
        yield made[0], made[1], made[2]


def fit_line(contents: Mapping[str, Content]) -> str:
    """Return in a line how the repair's held-out misfit compares with the black box's."""
    found = list(fits_beside(contents))
    if not found:
        return "no recording that was repaired has a black box beside it"
    plain, repaired, box = np.median(found, axis=0)
    lower = rate(r < b for _, r, b in found)
    low, high = lower.exact
    return (
        f"held-out misfit over the noise, median of {len(found)} repaired recordings: the model as "
        f"it is {plain:.3g}, with a black box {box:.3g}, repaired {repaired:.3g}; the repair's is "
        f"the lower one in {lower.hits} ({100 * low:.1f} to {100 * high:.1f} %)"
    )
