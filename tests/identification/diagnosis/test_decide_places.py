"""The decision, from hand-made scores: places."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.localisation.structural_classes import Isolability
from tests.identification.diagnosis.decision_cases import (
    LOUD,
    QUIET,
    Case,
    label,
    lag,
    scored,
    times,
)


def test_where_only_one_place_is_left_the_decision_is_made_there() -> None:
    case = Case(5.0).law("backlash at k", 0.0).law("creep at k_2", lag(1.0))
    case.kind("memory", "k_2", 0.0).kind("restoring", "k", lag(1.0))
    assert case.decided().answer == "look_alikes"
    d = decide(replace(case.evidence(), located=("k", "b")))
    assert (label(d), d.answer, d.places) == ("backlash at k", "exact", ("k",))
    assert {t.label for t in d.trials} == {"backlash at k", "creep at k_2"}
    elsewhere = decide(replace(case.evidence(), located=("m",)))
    assert (elsewhere.kind, elsewhere.answer, elsewhere.places) == (
        "unknown_physics", "unknown", ("m",)
    )  # fmt: skip


def test_a_law_elsewhere_that_explains_nearly_as_much_leaves_kind_and_place_open() -> None:
    """A filter of the command does what creep of the spring does, and more of it by chance."""

    def answer(law: float) -> Decision:
        case = Case(5.0).law("creep at k", law).kind("slow", "k", 2.0)
        return case.kind("command", "V", 0.0).decided()

    near = answer(0.8)  # 97.4 % of it
    assert (near.answer, near.physics) == ("unknown", "")
    assert set(near.places) == {"V", "k"}
    far = answer(1.5)
    assert (far.answer, far.physics, far.places) == ("kind", "command", ("V",))


def test_a_place_stays_known_where_laws_explain_little_or_fail() -> None:
    little = Case(9.0).law("backlash at k", 8.5).kind("restoring", "k", 8.5)
    assert decide(little.evidence()).places == ()
    assert decide(replace(little.evidence(), located=("k", "b"))).places == ("k", "b")
    failing = Case(9.0).law("backlash at k", 0.0, test=80.0).kind("restoring", "k", 0.0)
    d = decide(replace(failing.evidence(), located=("k",)))
    assert (d.answer, d.physics, d.places) == ("unknown", "", ("k",))


def test_a_law_that_leaves_much_where_an_input_at_its_place_leaves_nothing_is_not_named() -> None:
    """One place explains everything: the law there is another one, not the first of several."""

    def answer(misfit: float, located: tuple[str, ...]) -> tuple[str, str]:
        case = Case(30.0, before=Remaining({"x": 30.0}, True, 0.0)).law("creep at k", misfit)
        d = decide(replace(case.kind("slow", "k", misfit).evidence(), located=located))
        return d.kind, label(d) if d.kind == "missing_physics" else ""

    assert answer(8.0, ()) == ("missing_physics", "creep at k")
    assert answer(8.0, ("k", "b")) == ("unknown_physics", "")
    assert answer(4.0, ("k", "b")) == ("missing_physics", "creep at k")


def test_what_comes_nearest_is_listed_where_neither_place_nor_kind_is_told() -> None:
    case = Case(9.0).law("backlash at k", 8.0).law("creep at k_2", 8.95).kind("restoring", "k", 7.5)
    d = case.kind("memory", "k", 8.5).decided()
    assert (d.answer, d.places) == ("unknown", ())
    told = [(n.effect, n.kind, n.element) for n in d.nearest]
    assert told == [("", "restoring", "k"), ("", "memory", "k")]  # creep removes 1 %
    assert d.nearest[0].part == pytest.approx((81.0 - 56.25) / 81.0, rel=0.02)
    placed = decide(replace(case.evidence(), located=("k", "b")))
    assert placed.places == ("k", "b")
    assert placed.nearest == ()


@pytest.mark.parametrize(("left", "places"), [(6.0, ("k",)), (6.8, ())])
def test_a_form_that_removes_most_tells_its_place_before_its_kind(
    left: float, places: tuple[str, ...]
) -> None:
    d = Case(9.0).kind("restoring", "k", left).decided()
    assert (d.kind, d.answer, d.physics, d.places) == ("unknown_physics", "unknown", "", places)
    many = Case(9.0)
    for name in "abcdefgh":
        many.kind("restoring", name, left)
    assert many.decided().places == ()


@pytest.mark.parametrize("before", [QUIET, LOUD])
def test_what_shows_elsewhere_is_not_explained_because_it_cannot_sit_there(
    before: Remaining,
) -> None:
    shows = Case(1.0, before).kind("memory", "k", 0.0).evidence()
    assert decide(shows).kind == "unknown_physics"
    d = decide(replace(shows, located=("m",)))
    assert (d.kind, d.places) == ("unknown_physics", ("m",))


def test_noise_is_what_a_law_leaves_if_that_may_be_noise() -> None:
    """A floor read far too low makes the gain look small beside what is left."""
    unknown = Remaining({"x": 3.4}, False, 0.0)
    case = Case(0.4, unknown).law("hysteresis at k", 0.0).kind("memory", "k", 0.0)
    evidence = case.evidence()
    scale = 3.0
    louder = [replace(s, score=times(s.score, scale), left=unknown) for s in evidence.laws]
    kinds = [replace(k, score=times(k.score, scale)) for k in evidence.kinds]
    read = replace(
        evidence, plain=times(evidence.plain, scale), laws=tuple(louder), kinds=tuple(kinds),
        nominal=scale**2 * evidence.nominal, trained=scale**2 * evidence.trained,
    )  # fmt: skip
    assert label(decide(read)) == "hysteresis at k"
    loud = [replace(s, left=LOUD) for s in louder]  # what it leaves is no noise
    assert label(decide(replace(read, laws=tuple(loud)))) == ""
    # nor is there anything to guess where the noise was measured
    sure = replace(read, before=Remaining({"x": 3.4}, True, 0.0))
    assert label(decide(sure)) == ""
    # or known of this reading alone
    own = replace(unknown, sure=frozenset({"x"}))
    assert label(decide(replace(read, before=own))) == ""
    assert label(decide(replace(read, before=replace(own, sure=frozenset({"v"}))))) != ""
    # a law that explains nothing, and leaves what may be noise, says nothing of another one
    worse = replace(louder[0], score=times(scored(0.5, 7), scale))
    assert label(decide(replace(read, laws=(*loud, worse)))) == ""


def test_many_equals_are_nothing_known() -> None:
    case = Case(5.0).kind("memory", "k", lag(0.5))
    for i, name in enumerate(
        ("hysteresis at k", "nonlinear_stiffness at k", "creep at k", "coulomb_friction at d")
    ):
        case.law(name, lag(0.2 * i)).kind("slow", name[-1], lag(0.4))
    assert case.decided().answer == "unknown"


@pytest.mark.parametrize("plain", [5.0, 50.0, 500.0])
def test_a_law_that_leaves_ten_times_the_noise_is_as_good_as_none(plain: float) -> None:
    """However much both explain: one leaves nothing but noise, the other does not."""
    d = (
        Case(plain).law("nonlinear_stiffness at k", 0.0).law("hysteresis at k", 10.0)
        .kind("restoring", "k", lag(0.5)).decided()
    )  # fmt: skip
    assert (d.kind, label(d)) == ("missing_physics", "nonlinear_stiffness at k")
    assert d.rivals == ()


def test_the_same_effect_elsewhere_is_a_matter_of_place() -> None:
    d = (
        Case(5.0).law("hysteresis at C_nl", 0.0).law("hysteresis at k", lag(1.0))
        .kind("memory", "C_nl", lag(0.5)).kind("memory", "k", lag(1.0)).decided()
    )  # fmt: skip
    assert (d.kind, label(d)) == ("missing_physics", "hysteresis at C_nl")
    assert [t.element for t in d.same_place] == ["k"]
    assert d.places == ("C_nl", "k")
    assert d.rivals == ()


def test_unusual_places_need_a_clear_lead() -> None:
    def chosen(usual: float) -> str:
        case = Case(5.0).law("hysteresis at k", usual).law("hysteresis at F", 0.0, home=False)
        return label(case.kind("memory", "k", 0.0).kind("command", "F", 0.0).decided())

    assert chosen(lag(4.0)) == "hysteresis at k"
    assert chosen(2.0) == "hysteresis at F"


ALIKE = Isolability((("C_a", "R_a", "k", "m_1", "k_1"),))


@pytest.mark.parametrize(("own", "named"), [(lag(9.0), True), (lag(40.0), False)])
def test_a_law_that_the_form_of_its_kind_cannot_follow_there_imitates_another_place(
    own: float, named: bool
) -> None:
    """A sensor that warms up looked like creep, of which no slow form at that spring told."""
    case = Case(5.0, classes=ALIKE).law("creep at k", 0.0)
    d = case.kind("slow", "k", own).kind("slow", "R_a", lag(1.0)).decided()
    assert (label(d) == "creep at k" and d.kind == "missing_physics") is named
    assert "R_a" in d.places or named


def test_a_linear_element_that_leaves_noise_needs_no_form_through_the_model_without_it() -> None:
    """A coupling without its damper rings for ever: no form of a loss answers as it should."""
    case = Case(5.0, classes=ALIKE).law("linear_loss at k", 0.0)
    d = case.kind("dissipative", "k", lag(40.0)).kind("mode", "m_1", lag(1.0)).decided()
    assert (d.kind, label(d)) == ("missing_physics", "linear_loss at k")


def test_a_form_elsewhere_that_does_worse_leaves_the_law_where_it_is() -> None:
    case = Case(5.0, classes=ALIKE).law("creep at k", 0.0)
    d = case.kind("slow", "k", lag(40.0)).kind("slow", "R_a", lag(4.0)).decided()
    assert (d.kind, label(d), d.places) == ("missing_physics", "creep at k", ("k",))


@pytest.mark.parametrize(("most", "lags", "open_"), [(0.5, 1.0, True), (0.5, 9.0, False)])
def test_the_same_law_elsewhere_leaves_the_place_open_though_it_left_what_its_name_says(
    most: float, lags: float, open_: bool
) -> None:
    case = Case(5.0, classes=ALIKE).law("creep at k", 0.0)
    d = case.law("creep at C_a", lag(lags), most=most).kind("slow", "k", 0.0).decided()
    assert (d.answer, label(d)) == ("exact", "creep at k")
    assert ("C_a" in d.places) is open_


@pytest.mark.parametrize(("own", "named"), [(lag(11.0), False), (6.0, True)])
def test_a_form_elsewhere_that_leads_clearly_rules_out_a_law_that_its_own_form_follows(
    own: float, named: bool
) -> None:
    """A gap in a spring was a force along the way of the mass before it."""
    case = Case(30.0, classes=ALIKE).law("position_periodic_force at m_1", lag(10.0))
    d = case.kind("restoring", "k_1", 0.0).kind("restoring", "m_1", own).decided()
    assert (label(d) == "position_periodic_force at m_1") is named


@pytest.mark.parametrize(
    ("z", "together", "open_"), [(4.0, True, True), (4.0, False, False), (8.0, True, False)]
)
def test_a_lag_between_two_fits_of_one_law_that_leave_noise_decides_no_place(
    z: float, together: bool, open_: bool
) -> None:
    """A push at the mass was told at the ceramic: three standard errors, both to the noise."""
    classes = ALIKE if together else Isolability((("k",), ("k_1",)))
    case = Case(30.0, classes=classes).law("creep at k", 0.0).law("creep at k_1", lag(z))
    d = case.kind("slow", "k", 0.0).decided()
    assert label(d) == "creep at k"
    assert ("k_1" in d.places) is open_
