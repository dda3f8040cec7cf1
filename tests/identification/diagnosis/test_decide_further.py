"""The decision, from hand-made scores: further effects beside what was named."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.decision import _spoils, decide
from identification.diagnosis.evidence.hypotheses import Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search import forward_selection
from identification.diagnosis.search.forward_selection import (
    _all_needed,
    _held_to_noise,
    _together,
)
from tests.identification.diagnosis.decision_cases import (
    QUIET,
    Case,
    label,
    lag,
    named,
    scored,
    trial,
)


def test_what_a_named_law_leaves_at_its_own_place_is_no_second_effect() -> None:
    def answer(named: tuple[str, ...]) -> Decision:
        case = Case(1.0, named=named).law("coulomb_friction at d", 0.0)
        return case.kind("memory", "k", lag(0.5)).kind("dissipative", "d", 0.0).decided()

    first = answer(())
    assert (first.kind, label(first)) == ("missing_physics", "coulomb_friction at d")
    assert answer(("m",)).kind == "missing_physics"
    second = answer(("k",))
    assert (second.kind, second.answer) == ("unknown_physics", "kind")
    assert (second.physics, second.places, second.chosen) == ("memory", ("k",), None)
    assert any("not quite the true one" in r for r in second.reasons)


def test_a_second_effect_may_be_named_where_one_sensor_tells_no_places_apart() -> None:
    """Whatever sits at the named place leaves most of it; the class alone takes no name away."""
    classes = Isolability((("d", "k", "x"),))
    d = (
        Case(3.0, named=("d",), classes=classes).law("nonlinear_stiffness at k", 0.0)
        .kind("restoring", "k", lag(0.5)).kind("sensing", "x", lag(0.7)).kind("memory", "d", 2.5)
        .decided()
    )  # fmt: skip
    assert (d.kind, label(d)) == ("missing_physics", "nonlinear_stiffness at k")


def test_a_second_law_at_a_named_place_may_be_named() -> None:
    case = Case(1.0, named=("k",)).law("creep at k", 0.0).kind("slow", "k", lag(0.5))
    assert case.decided().kind == "missing_physics"


def test_a_second_effect_elsewhere_is_named() -> None:
    case = Case(1.0, named=("k",)).law("coulomb_friction at d", 0.0)
    d = case.kind("dissipative", "d", lag(0.5)).kind("memory", "k", 0.9).decided()
    assert (d.kind, label(d)) == ("missing_physics", "coulomb_friction at d")


@pytest.mark.parametrize(("z", "named"), [(8.0, False), (10.0, True)])
def test_a_further_law_elsewhere_has_to_lead_clearly(z: float, named: bool) -> None:
    """What a named law leaves may look like another effect."""

    def answer(*known: str) -> str:
        case = Case(lag(z), named=known).law("coulomb_friction at d", 0.0)
        return case.kind("dissipative", "d", 0.0).decided(replace(Thresholds(), gain=0.0)).kind

    assert answer() == answer("d") == "missing_physics"
    assert (answer("k") == "missing_physics") is named


@pytest.mark.parametrize("measured", [True, False])
def test_what_shows_within_a_measured_noise_is_no_further_name(measured: bool) -> None:
    """A law that is not quite the true one leaves as much, and other laws follow it."""
    before = Remaining({"x": 1.2}, measured, 0.0)
    case = Case(0.6, before, named=("b",)).law("hysteresis at k", 0.0).kind("memory", "k", 0.0)
    d = case.decided()
    assert (d.kind == "unknown_physics") == measured
    assert named(d) == ([] if measured else ["hysteresis"])
    first = Case(0.6, before).law("hysteresis at k", 0.0).kind("memory", "k", 0.0).decided()
    assert named(first) == ["hysteresis"]


def test_a_further_law_takes_half_of_what_is_left() -> None:
    def answer(misfit: float, *places: str) -> str:
        case = Case(3.0, named=places).law("hysteresis at k", misfit).kind("memory", "k", misfit)
        return case.decided().kind

    assert answer(2.4) == answer(1.9, "b") == "missing_physics"
    assert answer(2.4, "b") == "unknown_physics"


@pytest.mark.parametrize(("trained", "kind"), [(2.0, "explained"), (3.0, "unknown_physics")])
def test_a_push_in_training_beside_noise_on_either_part_is_nothing(
    trained: float, kind: str
) -> None:
    case = Case(1.0, QUIET).law("external_disturbance at m", 0.0, test=2.0)
    e = case.kind("exogenous", "m", 0.0).evidence()
    assert decide(replace(e, trained=trained)).kind == kind


def test_an_exact_law_that_leaves_something_yields_to_a_freer_one_elsewhere() -> None:
    def answer(misfit: float) -> Decision:
        case = Case(5.0).law("nonlinear_stiffness at k", misfit).kind("restoring", "k", misfit)
        freer = trial("position_periodic_force at m", 0.3 * misfit, 1.0, most=0.5)  # left its range
        case.laws.append(Scored(freer, scored(0.3 * misfit, 9), QUIET))
        return case.decided()

    assert answer(0.2).answer == "exact"
    d = answer(0.9)
    assert (d.answer, d.physics, d.places) == ("kind", "restoring", ("k", "m"))


def test_an_approximate_law_sits_wherever_its_kind_looks_the_same() -> None:
    classes = Isolability((("k", "m"), ("c", "b")))
    case = Case(9.0, classes=classes).law("nonlinear_stiffness at k", 2.0)
    case.kind("restoring", "k", 1.0).kind("restoring", "m", 2.1).kind("restoring", "c", 2.0)
    d = case.kind("surface", "k", 0.5).decided()
    assert (d.answer, d.places) == ("approximate", ("k", "m"))


@pytest.mark.parametrize(
    ("after", "rest", "answer"),
    [
        ("explained", 1.4, "exact"),
        ("explained", 1.6, "approximate"),
        ("unknown_physics", 1.1, "exact"),
        ("unknown_physics", 1.4, "approximate"),
    ],
)
def test_beside_a_rest_that_something_improves_no_name_is_exact(
    after: str, rest: float, answer: str
) -> None:
    exact = Case(3.0).law("hysteresis at k", 0.0).kind("memory", "k", 0.0).decided()
    assert exact.answer == "exact"
    more = replace(exact, kind=after, chosen=None, remaining=Remaining({"x": rest}, True, 0.0))
    assert _held_to_noise((exact, more), Thresholds())[0].answer == answer


@pytest.mark.parametrize(("left", "answer"), [(0.8, "approximate"), (1.05, "kind")])
def test_effects_together_have_to_explain_as_much_of_a_form_as_one_law_alone(
    left: float, answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One form of both variables leads surely: it stands for two effects at places alike."""
    one = Case(4.0).law("nonlinear_stiffness at k", 2.0).kind("surface", "k", 0.1)
    first = one.decided()
    assert (first.answer, first.physics) == ("kind", "surface")
    second = Case(2.0).law("quadratic_drag at b", left).kind("dissipative", "b", left).decided()
    assert first.chosen is not None
    assert second.chosen is not None
    nominal: Any = SimpleNamespace()
    scores = {id(nominal): scored(4.0, 1), id(second.chosen.fit): scored(left, 2)}
    monkeypatch.setattr(forward_selection, "_weighed_as", lambda fit, other: fit)
    monkeypatch.setattr(forward_selection, "score", lambda fit: scores[id(fit)])
    told = _together(nominal, [first, second], Thresholds())
    assert told[0].answer == answer
    assert len(told) == (2 if answer == "approximate" else 1)


@pytest.mark.parametrize(("form", "named"), [(0.1, 1), (0.4, 3)])
def test_what_followed_a_choice_that_was_not_sure_may_be_the_rest_of_that_law(
    form: float, named: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its own kind in another form does as well as law and disturbance: that one is not needed."""
    one = Case(4.0).law("coulomb_friction at b", 0.3).law("external_disturbance at m", 0.31)
    first = one.kind("dissipative", "b", 0.1).kind("slow", "m", 0.2).kind("exogenous", "m", 0.1)
    begun = first.decided()
    assert (begun.answer, set(begun.places)) == ("look_alikes", {"b", "m"})
    push = Case(0.3).law("external_disturbance at m", 0.1).kind("slow", "m", 0.1).decided()
    law = Case(0.3).law("coulomb_friction at b", 0.1).kind("dissipative", "b", 0.1).decided()
    quiet = Case(0.0, QUIET).decided()
    kinds = [KindScore("b", "dissipative", scored(form, 5), np.zeros(3))]
    task: Any = SimpleNamespace(
        limits=Thresholds(), done=SimpleNamespace(kinds=lambda base, along, places: kinds)
    )
    monkeypatch.setattr(forward_selection, "_weighed_as", lambda fit, other: fit)
    monkeypatch.setattr(forward_selection, "score", lambda fit: scored(0.1, 2))
    nominal: Any = SimpleNamespace()
    told = _all_needed(begun, [push, law, quiet], nominal, task)
    assert len(told) == named
    if named == 1:
        assert told[0].kind == "unknown_physics"
        assert told[0].reasons[-1].startswith("external_disturbance at m beside coulomb_friction")


@pytest.mark.parametrize(("with_it", "spoils"), [(20.0, True), (6.0, False), (7.0, False)])
def test_a_law_that_spoils_a_reading_far_above_the_noise_is_no_name(
    with_it: float, spoils: bool
) -> None:
    """Twice as bad near the noise may be another effect, or a noise that grows."""
    before = Remaining({"x": 50.0, "p": 10.0 if spoils else 3.0}, True, 0.0)
    law: Any = SimpleNamespace(left=Remaining({"x": 1.0, "p": with_it}, True, 0.0))
    seen: Any = SimpleNamespace(before=before)
    assert _spoils(law, seen) is spoils
