"""What became of every place: where something was named, and why it was nowhere else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.rivals import Standing, standings
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.places_without_name import LEFT, located
from identification.report.numbers import percent, times_noise
from identification.report.words import listed, spaced

NEAR = 1.02
"""Times what the named law leaves, up to which another one leaves as much."""
HALF = 0.5
"""Share of the misfit from which an effect that was not fitted came near."""


@dataclass(frozen=True)
class JudgedPlace:
    """One class of elements in the order in which the readings speak for it.

    Attributes
    ----------
    elements : tuple of str
    train, test : float
        What is left with any law there, times the noise; NaN where no reading could tell.
    why : str
        What follows for the place; where something was named, why it is or is not there.
    likely : bool
        Whether something was named there, or may sit there where nothing was.
    """

    elements: tuple[str, ...]
    train: float
    test: float
    why: str
    likely: bool


def judged_places(d: Diagnosis) -> tuple[JudgedPlace, ...]:
    """Return what became of every class of elements; empty where no relation was looked at."""
    named = {s.chosen.element for s in d.findings if s.chosen and d.kind == "missing_physics"}
    readings = d.nominal.problem.data.names if d.nominal is not None else ()
    place = () if named else located(d.relations, readings)
    tried = standings(d) if named else ()
    found = []
    for r in d.relations:
        here = bool(named & set(r.ports)) if named else r.compatible or r.ports[0] in place
        why = _beside_a_name(d, r, tried) if named else _without_name(r, place)
        found.append(JudgedPlace(r.ports, times_noise(r.train), times_noise(r.test), why, here))
    return tuple(found)


def _without_name(r: BlindRelation, place: tuple[str, ...]) -> str:
    if not r.decided:
        return "not excluded: nothing is left that could tell"
    if r.compatible:
        return "the mismatch may sit here alone"
    if r.ports[0] in place:
        return f"here: all but {percent(r.left)} of the mismatch"
    return f"not here alone: {_whatever(r)}"


def _whatever(r: BlindRelation) -> str:
    return f"whatever the law there, {times_noise(r.train):.3g} times the noise is left"


def _beside_a_name(d: Diagnosis, r: BlindRelation, tried: tuple[Standing, ...]) -> str:
    """Say where it was named, else why it was not: by the readings alone, or by the laws there."""
    named = {s.chosen.element for s in d.findings if s.chosen}
    # where the readings leave hardly anything of the misfit, laws decide
    if r.decided and not r.compatible and r.left >= LEFT and not named & set(r.ports):
        return f"{'ruled out' if len(named) == 1 else 'not here alone'}: {_whatever(r)}"
    said: dict[str, list[str]] = {}
    for n in r.ports:
        said.setdefault(_of_element(d, n, tried), []).append(n)
    if len(said) == 1:
        return next(iter(said))
    told = sorted(said.items(), key=lambda told: not named & set(told[1]))
    return "; ".join(f"at {listed(names)} {why}" for why, names in told)


def _of_element(d: Diagnosis, name: str, tried: tuple[Standing, ...]) -> str:
    """Say what the laws at an element came to."""
    for step in d.findings:
        assert step.chosen is not None
        if step.chosen.element == name:
            return f"found here, {spaced(step.chosen.effect)}"
        others = (*(t.element for t in step.same_place), *step.places * (step.answer != "exact"))
        if name in others:
            return f"these sensors cannot tell it from {step.chosen.element}"
    laws = [s for s in tried if s.trial.element == name and s.trial.effect != "unknown"]
    if not laws:
        return _not_fitted(d, name)
    best, first = laws[0], next((s for s in tried if s.role == "winner"), laws[0])
    left, least = times_noise(best.trial.test), times_noise(first.trial.test)
    law = f"the best law there, {spaced(best.trial.effect)}"
    if not np.isfinite(left):
        return f"{law}, could not be judged"
    if left <= NEAR * least:
        return f"{law}, leaves no more, but {best.why}"
    return (
        f"ruled out by held-out samples: {law}, leaves {left:.3g} times the noise, "
        f"{spaced(first.trial.effect)} at {first.trial.element} {least:.3g}"
    )


def _not_fitted(d: Diagnosis, name: str) -> str:
    shares = [s.share for s in d.ranking if s.element.name == name and np.isfinite(s.share)]
    if not shares:
        return "no effect of the catalogue sits there"
    if max(shares) > HALF:
        return "not fitted, others were ahead in the screening"
    return f"no effect there comes near, the best would remove {percent(max(shares))} of the misfit"
