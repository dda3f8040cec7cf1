"""The decision, from hand-made trials."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Split
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Insertion
from identification.diagnosis.evidence.decision import Decision, Thresholds, decide
from identification.diagnosis.evidence.residual_pattern import ResidualPattern
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search.candidates import Candidate
from identification.statistics.blocks import paired_z
from identification.study.problem import Data


def blocks(test: float, seed: int = 1, spread: float = 0.05) -> np.ndarray:
    shape = np.exp(spread * np.random.default_rng(seed).standard_normal(40))
    return np.asarray(test * shape / shape.mean())


@cache
def noisy() -> Any:
    """Return what a decision reads of a fit: motion that swells and noise that does not."""
    t = np.linspace(0.0, 1.0, 2000)
    moved = ((1 + t) * np.sin(50 * t))[:, None]
    noise = np.random.default_rng(0).standard_normal(moved.shape)
    split = Split(slice(0, 1300), slice(1300, 2000), "first part")
    data = Data("run", t, {}, moved + noise, ("x",), np.ones(1), split)
    return SimpleNamespace(problem=SimpleNamespace(data=data), simulated=moved)


def trial(effect: str, element: str, test: float, *, home: bool = True, seed: int = 2) -> Candidate:
    e = by_name(effect)
    graph: Any = None  # the decision looks at scores, and whether the floor was measured
    insertion = Insertion(
        effect, e.family, e.law, element, graph, ({},), ("s",), e.simpler, e.confused_with,
        e.sentence,
    )  # fmt: skip
    return Candidate(insertion, home, noisy(), test, test, blocks(test, seed))


def kind(nominal: float, *trials: Candidate, **more: Any) -> str:
    return decide(nominal, blocks(nominal), trials, **more).kind


def test_at_the_floor_nothing_is_missing() -> None:
    assert kind(1.04, trial("hysteresis", "k", 1.0)) == "explained"
    assert kind(50.0) == "explained"


def test_a_clear_winner_is_named() -> None:
    d = decide(
        50.0, blocks(50.0),
        [trial("hysteresis", "k", 1.1), trial("creep", "k", 20.0), trial("unknown", "d", 5.0)],
    )  # fmt: skip
    assert d.kind == "missing_physics"
    assert d.chosen is not None
    assert d.chosen.label == "hysteresis at k"
    assert d.share > 0.99
    assert 0.9 < d.confidence <= 0.99
    assert d.reasons
    assert d.rivals == ()


def test_two_that_are_as_good_are_look_alikes() -> None:
    d = decide(
        50.0, blocks(50.0), [trial("hysteresis", "k", 1.1), trial("creep", "k", 1.12, seed=3)]
    )
    assert d.kind == "unknown_physics"
    assert [r.effect for r in d.rivals] == ["creep"]
    assert d.confidence == 0.0


def test_the_same_effect_elsewhere_is_a_matter_of_place() -> None:
    trials = [trial("hysteresis", "C_nl", 1.1), trial("hysteresis", "k", 1.12, seed=3)]
    d = decide(50.0, blocks(50.0), trials)
    assert d.kind == "missing_physics"
    assert [t.element for t in d.same_place] == ["k"]


def test_class_counts_as_one_place_unless_the_law_speaks() -> None:
    classes = Isolability((("C_nl", "k"), ("x",)))
    trials = [
        trial("hysteresis", "C_nl", 1.1), trial("hysteresis", "k", 1.9),
        trial("hysteresis", "x", 1.9),
    ]  # fmt: skip
    d = decide(50.0, blocks(50.0), trials, classes=classes)
    assert [t.element for t in d.same_place] == ["k"]
    assert len(decide(50.0, blocks(50.0), trials).same_place) == 0


@pytest.mark.parametrize("nominal", [1.02, 1.6, 50.0])
def test_no_effect_that_helps_and_no_pattern_is_noise(nominal: float) -> None:
    nothing = trial("hysteresis", "k", 0.995 * nominal)
    assert kind(nominal, nothing) == "explained"
    assert kind(nominal, nothing, before=ResidualPattern(0.5, 1.0, "creep at k")) == "explained"


@pytest.mark.parametrize(("nominal", "answer"), [(1.02, "explained"), (50.0, "unknown_physics")])
def test_a_clear_pattern_that_no_effect_explains_is_unknown(nominal: float, answer: str) -> None:
    pattern = ResidualPattern(0.5, 9.0, "a curve at k")
    d = decide(
        nominal, blocks(nominal), [trial("hysteresis", "k", 0.995 * nominal)], before=pattern
    )
    assert d.kind == answer
    if answer == "unknown_physics":
        assert d.left is pattern
        assert any("a curve at k" in r for r in d.reasons)


def test_far_above_a_measured_floor_is_no_noise() -> None:
    nothing = trial("hysteresis", "k", 49.8)
    assert kind(50.0, nothing, certain=40.0) == "unknown_physics"
    assert kind(50.0, nothing, certain=1.1) == "explained"


def test_part_of_the_misfit_is_no_name() -> None:
    d = decide(50.0, blocks(50.0), [trial("hysteresis", "k", 25.5)])
    assert d.kind == "unknown_physics"
    assert d.chosen is not None
    assert any("50 %" in r for r in d.reasons)


def test_what_a_second_screening_finds_forbids_a_name() -> None:
    best = trial("hysteresis", "k", 8.0)  # over a floor that coloured noise exceeds

    def after(left: ResidualPattern) -> Decision:
        return decide(50.0, blocks(50.0), [best], remaining=lambda _: left)

    rest, none = (
        after(ResidualPattern(0.8, 9.0, "creep at k")),
        after(ResidualPattern(0.0, 0.2, "nothing")),
    )
    assert rest.kind == "unknown_physics"
    assert any("creep at k" in r for r in rest.reasons)
    assert none.share > rest.share
    assert none.kind == "missing_physics"


def test_declared_parameters_beat_a_repair() -> None:
    trials = [trial("hysteresis", "k", 1.1)]
    assert kind(50.0, *trials, declared=1.0) == "explained"
    assert kind(50.0, *trials, declared=60.0) == "missing_physics"


def test_the_simpler_law_wins_unless_the_richer_adds_much() -> None:
    simple, rich = trial("coulomb_friction", "d", 1.10), trial("stribeck_friction", "d", 1.09)
    d = decide(50.0, blocks(50.0), [simple, rich])
    assert d.kind == "missing_physics"
    assert d.chosen is simple
    assert d.richer == (rich,)
    assert d.confidence <= 0.7
    d = decide(50.0, blocks(50.0), [trial("coulomb_friction", "d", 6.0), rich])
    assert d.chosen is rich


def test_unusual_places_need_a_clear_lead() -> None:
    usual = trial("hysteresis", "k", 1.1)
    assert (
        decide(50.0, blocks(50.0), [usual, trial("hysteresis", "F", 1.09, home=False)]).chosen
        is usual
    )
    away = trial("hysteresis", "F", 1.1, home=False)
    assert decide(50.0, blocks(50.0), [trial("hysteresis", "k", 9.0), away]).chosen is away


def test_thresholds_can_be_moved() -> None:
    t = trial("hysteresis", "k", 1.1)
    assert kind(3.0, t, limits=Thresholds(mismatch=4.0)) == "explained"


def test_paired_z() -> None:
    a = blocks(2.0, 1)
    assert paired_z(a, a) == 0.0
    assert paired_z(2 * a, a) > 1e3
    assert paired_z(a, 2 * a) < -1e3
    assert paired_z(a, blocks(1.0, 5)) > 10
    assert paired_z(a[:1], a[:1]) == 0.0
