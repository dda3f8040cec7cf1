"""An oracle leaves the noise: what it cannot tell from a rival's fit nobody can."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from tests.proof.exam.separable import kind_separable, name_separable

STRETCHES = 40
FLOORS = {"x": 2e-6, "v": 1e-3}
TRUTH = ExamTruth(
    "e0", "single", "chain",
    (ConcealedEffect(
        "end_stop", frozenset({"end_stop"}), "restoring", frozenset({"restoring"}),
        frozenset({"k"}), "linear_stop", 12.0,
    ),),
    {"x": 1e-6, "v": 2e-3}, {"x": 12.0, "v": 2.0},
)  # fmt: skip


def stretches(misfit: float, seed: int, only: int | None = None) -> list[list[float]]:
    """Mean squares over the floors, of 100 samples each, of the noise and a misfit over it."""
    rng = np.random.default_rng(seed)
    over = np.full(STRETCHES, misfit**2)
    if only is not None:
        over = np.where(np.arange(STRETCHES) == only, STRETCHES * over, 0.0)
    found = []
    for extra in over:
        noise = np.array([TRUTH.noise[n] / f for n, f in FLOORS.items()])
        square = np.mean(rng.standard_normal((100, 2)) ** 2, axis=0) + extra
        found.append([float(v) for v in noise**2 * square])
    return found


def evidence(plain: float, *laws: tuple[str, str, float], only: int | None = None) -> Any:
    kinds = {"creep": "slow", "unknown": "surface"}
    simpler = {"richer": ["end_stop"]}
    return {
        "floors": FLOORS,
        "laws": [
            {
                "effect": e, "element": p, "kind": kinds.get(e, "restoring"),
                "simpler": simpler.get(e, []),
            }
            for e, p, _ in laws
        ],
        "stretches": [
            stretches(plain, 0, only),
            *(stretches(m, 1 + i, only) for i, (*_, m) in enumerate(laws)),
        ],
    }  # fmt: skip


def test_rivals_that_leave_more_than_the_noise_can_be_told() -> None:
    kept = evidence(
        3.0, ("end_stop", "k", 0.0), ("creep", "k", 1.0), ("bilinear_stiffness", "k", 1.0)
    )
    assert name_separable(TRUTH, kept)
    assert kind_separable(TRUTH, kept)


def test_the_clock_of_all_readings_is_where_models_have_it() -> None:
    """A skew of the shared clock is a law of the source; one of a sensor's own is another."""
    (old,) = TRUTH.effects
    skew = replace(
        old, effect="clock_skew", names=frozenset({"clock_skew"}), places=frozenset({"clock"}),
        kinds=frozenset({"sensing"}),
    )  # fmt: skip
    truth = replace(TRUTH, effects=(skew,))
    for element, held in (("F", True), ("x", False)):
        kept = evidence(3.0, ("clock_skew", element, 0.0), ("creep", "k", 1.0))
        assert name_separable(truth, kept) is held
        assert kind_separable(truth, kept) is held


def test_the_declared_model_is_a_rival() -> None:
    kept = evidence(0.0, ("end_stop", "k", 0.0))
    assert not name_separable(TRUTH, kept)
    assert not kind_separable(TRUTH, kept)


def test_another_name_of_the_same_kind_hides_the_name_alone() -> None:
    kept = evidence(3.0, ("end_stop", "k", 0.0), ("bilinear_stiffness", "k", 0.0))
    assert not name_separable(TRUTH, kept)
    assert kind_separable(TRUTH, kept)


@pytest.mark.parametrize("rival", [("creep", "k"), ("end_stop", "m")])
def test_another_kind_or_place_hides_both(rival: tuple[str, str]) -> None:
    kept = evidence(3.0, ("end_stop", "k", 0.0), (*rival, 0.0))
    assert not name_separable(TRUTH, kept)
    assert not kind_separable(TRUTH, kept)


@pytest.mark.parametrize(("law", "hides"), [("unknown", False), ("richer", False), ("creep", True)])
def test_what_contains_the_truth_is_no_rival_where_it_sits(law: str, hides: bool) -> None:
    kept = evidence(3.0, ("end_stop", "k", 0.0), (law, "k", 0.0))
    assert name_separable(TRUTH, kept) is not hides
    elsewhere = evidence(3.0, ("end_stop", "k", 0.0), (law, "m", 0.0))
    assert not name_separable(TRUTH, elsewhere)


def test_a_misfit_in_one_stretch_can_be_told() -> None:
    assert name_separable(TRUTH, evidence(3.0, ("creep", "k", 1.0), only=17))


def test_how_well_the_right_law_was_fitted_does_not_matter() -> None:
    assert name_separable(TRUTH, evidence(3.0, ("end_stop", "k", 2.9), ("creep", "k", 2.8)))


def test_without_evidence_no_answer_is_excused() -> None:
    assert name_separable(TRUTH, {})
    assert kind_separable(TRUTH, {"laws": []})
