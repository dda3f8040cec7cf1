"""The decision, from hand-made scores: nothing, one law, several laws, and what always holds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from identification.diagnosis.evidence.answer import RIGHT, Decision
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.decision import NEAR, decide
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import EXACT, open_kinds
from identification.diagnosis.evidence.leave_out import LeftOut
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.evidence.shares import UNUSUAL
from identification.diagnosis.search.one_step import in_doubt
from tests.identification.diagnosis.decision_cases import (
    BASIS,
    BLOCKS,
    LOUD,
    NOISE,
    ONCE,
    QUIET,
    ROWS,
    Case,
    N,
    label,
    lag,
    named,
    scored,
)


def test_the_ruler() -> None:
    for z in (1.0, 2.5, 10.0):
        assert scored(lag(z), 3).behind(scored(0.0, 4)) == pytest.approx(z, rel=0.25)


# -- nothing helps ---------------------------------------------------------------------------------
@pytest.mark.parametrize("size", [1.01 * Thresholds().noise, 2.0, 5.0, 100.0, 1e5])
@pytest.mark.parametrize("tried", ["nothing", "a law", "a law and a kind"])
def test_nothing_is_missing_only_where_what_is_left_is_noise(size: float, tried: str) -> None:
    def answer(before: Remaining) -> Decision:
        case = Case(0.0, before)
        if tried != "nothing":
            case.law("hysteresis at k", lag(1.0))
        if tried == "a law and a kind":
            case.kind("memory", "k", lag(0.5))
        return case.decided()

    quiet = answer(QUIET)
    assert quiet.kind == "explained"
    assert quiet.chosen is None
    loud = answer(Remaining({"x": 1.0, "v": size}, True, 0.0))
    assert loud.kind == "unknown_physics"
    assert loud.chosen is None
    assert any(f"{size:.3g} times the noise" in r for r in loud.reasons)


def test_a_lead_within_the_noise_names_nothing() -> None:
    case = Case(lag(2.5), QUIET).law("hysteresis at k", 0.0).kind("memory", "k", 0.0)
    assert case.decided().kind == "explained"
    assert case.decided(Thresholds(z=1.5, gain=1e-4)).kind == "missing_physics"


def test_what_one_stretch_alone_shows_beside_noise_alarms_nobody() -> None:
    """Two outliers beside each other do that; what is left of all samples is noise."""

    def answer(where: np.ndarray | float, before: Remaining = QUIET) -> Decision:
        case = Case(1.2, before, where)
        left = KindScore("x", "sensing", scored(0.72, 2), np.zeros(3))
        return decide(replace(case.evidence(), kinds=(left,)))

    d = answer(ONCE)
    assert d.kind == "explained"
    assert "in one stretch alone" in d.reasons[0]
    assert answer(1.0).kind == "unknown_physics"
    assert answer(ONCE, LOUD).kind == "unknown_physics"


def test_a_sure_but_tiny_gain_names_nothing() -> None:
    case = Case(0.4, QUIET).law("hysteresis at k", 0.0).kind("memory", "k", 0.0)
    assert case.decided().kind == "missing_physics"
    d = case.decided(Thresholds(gain=0.3))
    assert d.kind == "explained"
    # what improves it is not denied
    assert "at k improves it by 16 % of the noise only" in d.reasons[0]
    assert "no law and no kind" in Case(0.0, QUIET).law("creep at k", lag(1)).decided().reasons[0]


# -- one law ---------------------------------------------------------------------------------------
def test_a_clear_winner_is_named() -> None:
    d = (
        Case(5.0)
        .law("hysteresis at k", 0.0).law("creep at k", 2.0).law("coulomb_friction at d", 3.0)
        .kind("memory", "k", lag(0.5)).kind("slow", "k", 1.8).kind("dissipative", "d", 2.5)
        .decided()
    )  # fmt: skip
    assert (d.kind, d.answer, label(d)) == ("missing_physics", "exact", "hysteresis at k")
    assert (d.physics, d.places, d.family) == ("memory", ("k",), "memory")
    assert d.rivals == d.same_place == d.richer == ()
    assert d.law_fit > 0.99
    assert d.share > 0.99
    assert 0.9 < d.confidence <= 0.99
    assert any("hysteresis at k" in r for r in d.reasons)


def test_a_rare_effect_is_named_too() -> None:
    """It shows in two stretches of forty."""
    seen = np.where((ROWS.block == 11) | (ROWS.block == 30), 20.0 * BASIS[:, 1], 0.0)
    case = Case(0.0).law("end_stop at k", 0.0).kind("restoring", "k", lag(0.5))
    residual = NOISE + seen
    plain = BlockScore(LeftOut(ROWS, residual, residual, np.zeros(BLOCKS)))
    square = float(np.mean(residual**2))
    d = decide(Evidence(plain, tuple(case.laws), tuple(case.kinds), LOUD, square, square))
    assert (d.kind, label(d)) == ("missing_physics", "end_stop at k")


def test_a_law_near_its_kind_is_approximate() -> None:
    d = Case(5.0).law("hysteresis at k", 1.5).kind("memory", "k", 0.0).decided()
    assert (d.kind, d.answer, label(d)) == ("missing_physics", "approximate", "hysteresis at k")
    assert d.law_fit == pytest.approx(1 - 1.5**2 / 5.0**2)
    exact = Case(5.0).law("hysteresis at k", 0.0).kind("memory", "k", lag(0.5)).decided()
    assert d.confidence < exact.confidence


def test_what_changes_in_time_is_named_but_not_why() -> None:
    """Heat, work and age all look like a course in time in one recording."""
    case = Case(5.0).law("time_varying_parameter at d", 0.0).kind("time", "d", 0.0)
    d = case.decided()
    assert (d.kind, d.answer, label(d)) == (
        "missing_physics", "approximate", "time_varying_parameter at d",
    )  # fmt: skip
    assert d.confidence == RIGHT["approximate"]
    assert any("not what changes it" in r for r in d.reasons)
    pushed = Case(5.0).law("external_disturbance at m", 0.0).kind("exogenous", "m", 0.0)
    assert pushed.decided().answer == "exact"


def test_a_course_in_time_is_not_named_where_the_motion_itself_explains_more() -> None:
    """Heat that left the range of its name still says that the clock changes nothing."""

    def answer(heat: float) -> Decision:
        case = Case(5.0).law("time_varying_parameter at d", lag(1.0)).kind("time", "d", lag(1.0))
        return case.law("self_heating at d", heat, most=0.5).kind("slow", "d", lag(2.0)).decided()

    assert label(answer(lag(2.0))) == "time_varying_parameter at d"
    d = answer(0.0)
    assert (d.kind, d.answer, d.physics, d.places) == ("unknown_physics", "kind", "slow", ("d",))


def test_a_law_that_is_not_quite_right_must_be_ahead_of_laws_elsewhere() -> None:
    """It explains 92 % of what the best form does, and leaves noise."""
    misfit = float(np.sqrt(0.08))

    def answer(elsewhere: float, form: float = 0.0) -> Decision:
        case = Case(1.0).law("coulomb_friction at d", misfit).kind("dissipative", "d", form)
        return case.law("position_periodic_force at m", elsewhere, most=0.5).decided()

    assert label(answer(misfit + 0.05)) == "coulomb_friction at d"
    d = answer(misfit - 0.05)
    assert (d.kind, d.answer, d.places) == ("unknown_physics", "unknown", ("d", "m"))
    # one that explains all that any form does needs no lead
    assert answer(misfit - 0.05, misfit).answer == "exact"


def test_a_law_without_a_form_beside_it_is_not_called_exact() -> None:
    d = Case(5.0).law("hysteresis at k", 0.0).decided()
    assert (d.answer, np.isnan(d.law_fit)) == ("approximate", True)


def test_the_gain_must_show_on_the_held_out_part() -> None:
    case = Case(3.0).law("hysteresis at k", 0.0, test=8.0).kind("memory", "k", 0.0)
    d = case.decided()
    assert (d.kind, d.answer) == ("unknown_physics", "unknown")
    assert any("held-out" in r for r in d.reasons)
    assert d.confidence == 0.0
    again = Case(3.0).law("hysteresis at k", 0.0, test=1.3).kind("memory", "k", 0.0)
    assert again.decided().kind == "missing_physics"


@pytest.mark.parametrize(("named", "least"), [((), 0.25), (("d",), 0.5)])
def test_a_further_effect_must_show_there_more_clearly(
    named: tuple[str, ...], least: float
) -> None:
    def answer(gained: float) -> str:
        case = Case(3.0, named=named)
        case.law("hysteresis at k", 0.0, test=10.0 - gained * 9.0).kind("memory", "k", 0.0)
        return case.decided().kind

    assert answer(least - 0.02) == "unknown_physics"
    assert answer(least + 0.02) == "missing_physics"


def test_a_law_that_left_what_its_name_says_is_not_named() -> None:
    """A spring twenty times stiffer beyond its knee is a stop."""

    def answer(most: float) -> Decision:
        case = Case(5.0).law("bilinear_stiffness at k", 0.0, most=most)
        return case.law("end_stop at k", lag(0.5)).kind("restoring", "k", 0.0).decided()

    assert answer(2.0).answer == "family"
    d = answer(0.5)
    assert (d.kind, d.answer, label(d)) == ("missing_physics", "exact", "end_stop at k")


@pytest.mark.parametrize(("ahead", "answer"), [(1.0, "exact"), (2.5, "family")])
def test_a_richer_law_beyond_its_name_that_does_better_leaves_the_family_open(
    ahead: float, answer: str
) -> None:
    """What friction that remembers explains better is not plain friction for certain."""
    d = (
        Case(5.0).law("coulomb_friction at d", lag(ahead)).kind("memory", "d", 0.0)
        .law("presliding_friction at d", 0.0, most=0.5).decided()
    )  # fmt: skip
    assert (d.kind, d.answer, label(d)) == ("missing_physics", answer, "coulomb_friction at d")
    assert [r.effect for r in d.rivals] == ["presliding_friction"] * (answer == "family")


# -- several laws ----------------------------------------------------------------------------------
def test_a_simpler_law_that_could_not_be_simulated_leaves_a_family() -> None:
    def answer(*untried: tuple[str, str]) -> Decision:
        case = Case(5.0, untried=untried).law("presliding_friction at d", 0.0)
        return case.kind("memory", "d", 0.0).decided()

    assert answer().answer == answer(("coulomb_friction", "m")).answer == "exact"
    d = answer(("coulomb_friction", "d"))
    assert (d.kind, d.answer, d.family) == ("missing_physics", "family", "friction")
    assert any("coulomb_friction" in r and "not excluded" in r for r in d.reasons)


def test_rubbing_with_and_without_memory_is_dissipative() -> None:
    d = (
        Case(5.0).law("presliding_friction at d", lag(0.5)).law("stribeck_friction at d", 0.0)
        .kind("dissipative", "d", 0.0).decided()
    )  # fmt: skip
    assert (d.answer, d.family, d.physics) == ("family", "friction", "dissipative")


@pytest.mark.parametrize("z", [0.3, 1.0])
def test_the_simpler_law_is_named_where_the_richer_adds_nothing(z: float) -> None:
    d = (
        Case(5.0).law("coulomb_friction at d", lag(z)).law("stribeck_friction at d", 0.0)
        .kind("dissipative", "d", lag(0.5)).decided()
    )  # fmt: skip
    assert (d.kind, d.answer, label(d)) == ("missing_physics", "exact", "coulomb_friction at d")
    assert [t.effect for t in d.richer] == ["stribeck_friction"]
    assert d.rivals == ()


@pytest.mark.parametrize("z", [2.0, 2.5])
def test_a_richer_law_that_leads_a_little_leaves_a_family(z: float) -> None:
    d = (
        Case(5.0).law("coulomb_friction at d", lag(z)).law("stribeck_friction at d", 0.0)
        .kind("dissipative", "d", lag(0.5)).decided()
    )  # fmt: skip
    assert (d.kind, d.answer, d.family) == ("missing_physics", "family", "friction")
    assert set(named(d)) == {"coulomb_friction", "stribeck_friction"}
    assert d.places == ("d",)


def test_a_richer_law_that_leads_clearly_is_named() -> None:
    d = (
        Case(5.0).law("coulomb_friction at d", 1.0).law("stribeck_friction at d", 0.0)
        .kind("dissipative", "d", lag(0.5)).decided()
    )  # fmt: skip
    assert (d.answer, label(d), d.rivals) == ("exact", "stribeck_friction at d", ())


@pytest.mark.parametrize(("z", "told"), [(4.5, "coulomb_friction"), (8.0, "stribeck_friction")])
def test_what_leads_by_far_is_not_idle_whatever_its_interval(z: float, told: str) -> None:
    case = Case(5.0).law("coulomb_friction at d", lag(z)).law("stribeck_friction at d", 0.0)
    case.laws[1] = replace(case.laws[1], idle=True)
    assert label(case.decided()) == f"{told} at d"


@pytest.mark.parametrize("form", [False, True])
def test_a_memory_with_a_past_is_told_though_no_free_form_follows_it(form: bool) -> None:
    case = (
        Case(9.0).law("hysteresis at k", 0.0)
        .kind("memory", "k", lag(60.0)).kind("dissipative", "d", 0.0)
    )  # fmt: skip
    (law,) = case.laws
    made = replace(law.trial, insertion=replace(law.trial.insertion, form=form))
    case.laws = [replace(law, trial=made)]
    assert (case.decided().kind == "missing_physics") is form


def test_equals_of_different_families_are_look_alikes() -> None:
    d = (
        Case(5.0).law("hysteresis at k", 0.0).law("nonlinear_stiffness at k", lag(1.0))
        .kind("memory", "k", lag(0.5)).kind("restoring", "k", lag(1.0)).decided()
    )  # fmt: skip
    assert (d.kind, d.answer) == ("unknown_physics", "look_alikes")
    assert set(named(d)) == {"hysteresis", "nonlinear_stiffness"}
    assert d.family == "outside"
    assert d.places == ("k",)
    assert d.confidence == 0.0


@pytest.mark.parametrize("law", [0.5, 0.53])
@pytest.mark.parametrize(("course", "alone"), [(0.5, True), (0.02, False)])
def test_a_disturbance_near_a_law_that_is_not_quite_right_has_to_do_what_its_form_does(
    law: float, course: float, alone: bool
) -> None:
    """What the law leaves goes with another form of it; a disturbance may take any course too."""
    case = Case(4.0).law("coulomb_friction at b", law).law("external_disturbance at m", 0.51)
    case.kind("dissipative", "b", 0.0).kind("slow", "m", 0.02).kind("exogenous", "m", course)
    d = case.decided()
    if alone:
        assert named(d) == ["coulomb_friction"]
    else:
        assert set(named(d)) == {"coulomb_friction", "external_disturbance"}
    assert d.kind == ("missing_physics" if alone else "unknown_physics")
    assert any("explains more than any course" in r for r in d.reasons) is alone


def test_a_law_that_does_nothing_excludes_no_disturbance() -> None:
    case = Case(0.55).law("coulomb_friction at b", 0.53).law("external_disturbance at m", 0.51)
    case.kind("dissipative", "b", 0.0).kind("slow", "m", 0.02)
    assert not any("explains more than any course" in r for r in case.decided().reasons)


def test_an_equal_that_fails_on_the_held_out_part_leaves_nothing_known() -> None:
    """Beside a rest the samples that fitted both cannot be what tells them apart."""

    def answer(test: float) -> Decision:
        case = Case(9.0).law("creep at C_1", 2.0).law("sensor_drift at p_1", 2.0, test=test)
        return case.kind("slow", "C_1", 2.0).decided()

    assert answer(5.01).answer == "look_alikes"
    failing = answer(80.0)
    assert (failing.answer, failing.places) == ("unknown", ())
    assert "held-out" in failing.reasons[-1]


@pytest.mark.parametrize(
    ("breaks", "where", "places"),
    [
        ((N // 2,), 1.0, ("k", "d")),  # two recordings agree
        ((), 1.0, ()),  # one alone may mislead all of its stretches
        ((N // 2,), np.where(ROWS.sample < N // 2, 1.0, 0.0), ()),  # nothing to see in the second
    ],
)
def test_what_several_recordings_agree_on_stays_in_question_though_another_refutes_the_laws(
    breaks: tuple[int, ...], where: Any, places: tuple[str, ...]
) -> None:
    several = Case(9.0, where=where, several=bool(breaks))
    case = several.law("hysteresis at k", 2.0, test=99.0)
    case.law("coulomb_friction at d", 2.0, test=99.0).kind("memory", "k", 2.0)
    case.kind("dissipative", "d", 4.0)
    for s in case.laws:
        problem: Any = s.trial.fit.problem
        problem.data = replace(problem.data, breaks=breaks)
    d = case.decided()
    assert (d.kind, d.answer, d.physics) == ("unknown_physics", "unknown", "")
    assert set(d.places) == set(places)
    assert any("held-out" in r for r in d.reasons)
    # the kinds stay in question, none of them is told
    kinds = {("memory", "k"), ("dissipative", "d")} if places else set()
    assert {(k.kind, k.element) for k in open_kinds(d)} == kinds


def test_what_training_leaves_open_is_told_as_a_kind_if_held_out_samples_bear_it_out() -> None:
    """A stop that was touched once: how stiff it is, is open; held out it is touched again."""

    def answer(
        added: float, left: float = 0.0, plain: float = 9.0, law: str = "end_stop at k"
    ) -> Decision:
        case = Case(plain).law(law, left, test=90.0, added=added)
        return case.kind(case.laws[0].trial.insertion.kind, "k", left).decided()

    told = answer(0.98)
    assert (told.kind, told.answer) == ("unknown_physics", "kind")
    assert (told.physics, told.places) == ("restoring", ("k",))
    assert "do not contradict" in told.reasons[-1]
    for refused in (
        answer(1.2),  # no noise: not true of both parts
        answer(np.nan),
        answer(0.98, left=2.0),  # beside a rest nothing is known of the law
        answer(0.98, plain=1.0),  # held-out samples show nothing that it could explain
        answer(0.98, law="external_disturbance at k"),  # follows anything
    ):
        assert (refused.answer, refused.physics) == ("unknown", "")
        assert "does not show" in refused.reasons[-1]


def test_what_predicts_unseen_samples_to_the_noise_refutes_an_equal_that_does_not() -> None:
    def answer(test: float, misfit: float = 0.0) -> Decision:
        case = Case(9.0).law("overflow at C_1", misfit)
        case.law("saturation at Q", misfit + lag(1.0), test=test)
        return case.kind("restoring", "C_1", misfit).decided()

    assert answer(1.01).answer == "look_alikes"
    alone = answer(80.0)
    assert (label(alone), alone.answer) == ("overflow at C_1", "exact")
    assert "refute saturation at Q" in " ".join(alone.reasons)
    assert answer(80.0, 2.0).answer == "unknown"  # a rest is left, so nothing is refuted
    assert answer(100.0, 2.0).answer == "exact"  # a small one, and worse than without it
    assert answer(100.0, 3.5).answer == "unknown"


# -- in general ------------------------------------------------------------------------------------
LAWS = (
    "hysteresis at k", "creep at k", "coulomb_friction at d", "stribeck_friction at d",
    "nonlinear_stiffness at k", "sensor_lag at x",
)  # fmt: skip
FORMS = (("memory", "k"), ("slow", "k"), ("dissipative", "d"), ("restoring", "k"), ("sensing", "x"))


def drawn(seed: int) -> Case:
    """A few laws and forms, some as good as the best, some near it, some far."""
    rng = np.random.default_rng(seed)
    plain = float(rng.choice([0.0, 0.1, 0.5, 3.0, 30.0]))
    case = Case(plain, LOUD if rng.random() < 0.7 else QUIET)
    near = [0.0, lag(1), lag(2), 0.5, 2.0, 0.28 * plain, 0.5 * plain, 1.2 * plain]
    for i in rng.permutation(len(LAWS))[: rng.integers(0, 4)]:
        case.law(LAWS[i], float(rng.choice(near)))
    for i in rng.permutation(len(FORMS))[: rng.integers(0, 4)]:
        case.kind(*FORMS[i], float(rng.choice([0.0, lag(1), 0.5, 2.0, 0.5 * plain, 1.1 * plain])))
    if not case.laws and rng.random() < 0.5:
        case.law("coulomb_friction at d", lag(float(rng.uniform(0.5, 4.0))))
        case.law("stribeck_friction at d", 0.0)
    return case


@cache
def answered(seed: int) -> Decision:
    return drawn(seed).decided()


def test_the_draws_reach_every_answer() -> None:
    found = {answered(seed).answer for seed in SEEDS}
    assert found == {"exact", "approximate", "family", "look_alikes", "kind", "unknown"}


SEEDS = range(150)


@pytest.mark.parametrize("seed", SEEDS)
def test_whatever_the_scores_the_answer_hangs_together(seed: int) -> None:
    case, d = drawn(seed), answered(seed)
    assert d.kind in ("explained", "missing_physics", "unknown_physics")
    assert d.reasons
    assert 0.0 <= d.share <= 1.0
    assert 0.0 <= d.confidence <= 0.99
    assert d.confidence == RIGHT.get(d.answer, 0.0)
    if d.kind == "explained":
        assert d.chosen is None
        assert case.before is QUIET  # five times a measured noise is never explained
    if d.kind == "missing_physics":
        assert d.chosen is not None
        assert d.answer in ("exact", "approximate", "family")
        assert d.physics or d.rivals
        assert d.places[0] == d.chosen.element
        # of the best form at its place: unusual ones count less
        assert np.isnan(d.law_fit) or d.law_fit >= 0.8
        assert np.isnan(d.law_fit) or d.law_fit >= min(NEAR, UNUSUAL * Thresholds().law)
        assert d.answer != "exact" or d.law_fit >= EXACT
        if d.answer != "family":
            assert d.rivals == ()
    if d.answer == "kind":
        assert d.physics
        assert d.places


def test_of_kinds_in_question_stays_what_every_good_pair_holds() -> None:
    case = Case(20.0).kind("slow", "C", 4.0).kind("memory", "R", 4.1).kind("slow", "R", 4.2)
    evidence = case.evidence()
    assert (decide(evidence).answer, decide(evidence).physics) == ("unknown", "")
    d = decide(replace(evidence, paired=(("R", "memory"),)))
    assert (d.kind, d.answer, d.physics, d.places) == ("unknown_physics", "kind", "memory", ("R",))
    assert "more than one effect is missing" in d.reasons[0]
    # of two effects that every pair holds the one is told that explains most by itself
    both = decide(replace(evidence, paired=(("R", "memory"), ("C", "slow"))))
    assert (both.answer, both.physics, both.places) == ("kind", "slow", ("C",))
    # what is not in question any more is not told
    gone = decide(replace(evidence, paired=(("m", "surface"),)))
    assert (gone.answer, gone.physics, gone.reasons) == ("unknown", "", decide(evidence).reasons)


def test_pairs_are_asked_for_where_a_few_loud_kinds_are_in_question() -> None:
    def asked(left: float, places: str, *kinds: str) -> bool:
        case = Case(20.0)
        for i, (kind, place) in enumerate(product(kinds, places)):
            case.kind(kind, place, left * (1.0 + 0.01 * i))
        return in_doubt(case.decided(), Thresholds())

    assert asked(4.0, "CR", "slow", "memory")
    assert not asked(4.0, "C", "memory")  # it is told
    assert not asked(0.1, "CR", "slow", "memory")  # each leaves noise
    assert not asked(4.0, "CRS", "slow", "memory", "ratio")  # too many
