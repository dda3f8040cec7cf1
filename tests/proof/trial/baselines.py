"""Baselines on the same recordings: what simpler rules would have answered."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.proof.trial.answers import Answer
from tests.proof.trial.gates import INSIDE, asked_for
from tests.proof.trial.matching import Outcome
from tests.proof.trial.oracles import OracleAnswer
from tests.proof.trial.rates import Rate, rate

Choice = tuple[str, str]
"""Effect and element; both empty for "nothing is missing"."""
NOTHING: Choice = ("", "")


@dataclass(frozen=True, slots=True)
class Baseline:
    """A rule's score on the trial.

    Attributes
    ----------
    answered : int
        Recordings on which the rule could be applied.
    alarms : Rate
        Controls on which something was named.
    outside : Rate
        Recordings with physics outside the catalogue on which an effect of it was named.
    wrong : Rate
        Wrong names of the names given on effects of the catalogue.
    misplaced : Rate
        Places that exclude the true one, of those given on recordings with an effect.
    right : Rate
        Right name at the right element, among the distinguishable effects.
    """

    name: str
    answered: int
    alarms: Rate
    outside: Rate
    wrong: Rate
    misplaced: Rate
    right: Rate


def best_candidate(answer: Answer) -> Choice | None:
    """Return what fits the held-out part best, whatever it is; None without any trial.

    A recording that the diagnosis found at the floor has no trials: there it can only say nothing.
    """
    named = [t for t in answer.trials if t["effect"] != "unknown" and t["test"] is not None]
    if not named:
        return NOTHING if math.isfinite(answer.nominal_test) else None
    best = min(named, key=lambda t: float(t["test"]))
    return str(best["effect"]), str(best["element"])


def information_criterion(answer: Answer) -> Choice | None:
    """Return the candidate, or the model as it is, with the least Bayesian information criterion.

    ``n log(mean square) + k log n`` on the training part, with ``n`` samples (all sensors) and
    ``k`` parameters (Schwarz, Ann. Statist. 6 (1978) 461).
    """
    if not math.isfinite(answer.nominal_train) or answer.samples < 2:
        return None

    def criterion(train: float, parameters: int, samples: int) -> float:
        # per sample, so that trials on a thinned record can be compared with the full one
        return math.log(max(train, 1e-300)) + parameters * math.log(samples) / samples

    choices: dict[Choice, float] = {
        NOTHING: criterion(answer.nominal_train, answer.nominal_parameters, answer.samples)
    }
    for t in answer.trials:
        if t["effect"] != "unknown" and t["train"] is not None and int(t["samples"]) > 1:
            value = criterion(float(t["train"]), int(t["parameters"]), int(t["samples"]))
            choices[str(t["effect"]), str(t["element"])] = value
    return min(choices, key=lambda c: choices[c])


def sparse_regression(answer: Answer) -> Choice | None:
    """Return the strongest term that a sparse regression kept, as an effect at an element."""
    found: Mapping[str, Any] | None = answer.sparse
    if not found:
        return None
    return str(found["effect"]), str(found["element"])


RULES: Mapping[str, Callable[[Answer], Choice | None]] = {
    "best candidate, never abstaining": best_candidate,
    "Bayesian information criterion": information_criterion,
    "sparse regression with all states": sparse_regression,
}


def baselines(
    outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer]
) -> tuple[Baseline, ...]:
    """Score every rule on the recordings of the trial."""
    clear = {o.truth.id for o in asked_for(outcomes, oracles, separable=True)}
    return tuple(_scored(name, rule, outcomes, clear) for name, rule in RULES.items())


def _scored(
    name: str,
    rule: Callable[[Answer], Choice | None],
    outcomes: Sequence[Outcome],
    clear: set[str],
) -> Baseline:
    said = [(o, c) for o in outcomes if (c := rule(o.answer)) is not None]
    named = [(o, c) for o, c in said if c != NOTHING and o.truth.effects]

    def true_name(o: Outcome, c: Choice) -> bool:
        return any(e.effect == c[0] for e in o.truth.effects)

    def true_place(o: Outcome, c: Choice) -> bool:
        return any(e.element == c[1] for e in o.truth.effects)

    return Baseline(
        name,
        len(said),
        rate(c != NOTHING for o, c in said if o.truth.empty),
        rate(c != NOTHING for o, c in said if o.truth.cell == "outside"),
        rate(not true_name(o, c) for o, c in named if o.truth.cell in INSIDE),
        rate(not true_place(o, c) for o, c in named),
        rate(true_name(o, c) and true_place(o, c) for o, c in said if o.truth.id in clear),
    )
