"""One answer beside one truth, each case decided by hand."""

from __future__ import annotations

import pytest

from tests.proof.tests.trial.made_up import answer, content, finding, truth
from tests.proof.trial.answers import answer_of
from tests.proof.trial.matching import Outcome, judge

COULOMB = truth("r", "single", ("coulomb_friction", "b_1"))


def outcome(*findings: dict[str, object], **more: object) -> Outcome:
    return judge(COULOMB, answer("r", *findings, **more))


@pytest.mark.parametrize(
    ("said", "name", "place"),
    [
        (finding("coulomb_friction", "b_1"), "right", "right"),
        (finding("coulomb_friction", "k_1", "b_1"), "right", "right"),
        (finding("coulomb_friction", "b_2"), "right", "wrong"),
        (finding("hysteresis", "k_1"), "wrong", "wrong"),
        (finding("hysteresis", "k_1", "b_1"), "wrong", "right"),
        (finding("unknown", "b_1", family="friction"), "family", "right"),
        (finding("unknown", "b_1", family="memory"), "wrong", "right"),
        (finding("unknown", "b_1", family="outside"), "unknown", "right"),
        (finding("unknown", "", family="outside"), "unknown", "unresolved"),
        (
            finding("unknown", "b_1", also=("coulomb_friction", "hysteresis"), family="outside"),
            "look_alikes",
            "right",
        ),
        (
            finding("unknown", "b_1", also=("creep", "hysteresis"), family="memory"),
            "wrong",
            "right",
        ),
        # two candidates that explain little are no set either
        (
            finding("unknown", "b_1", also=("creep", "hysteresis"), family="outside", share=0.4),
            "unknown",
            "right",
        ),
        # one candidate that comes closest is no set
        (finding("unknown", "b_1", also=("hysteresis",), family="outside"), "unknown", "right"),
        # more than half of the seven ports is no place
        (finding("coulomb_friction", "k_1", "k_2", "b_1", "b_2"), "right", "unresolved"),
    ],
)
def test_one_effect(said: dict[str, object], name: str, place: str) -> None:
    found = outcome(said)
    assert (found.name, found.place) == (name, place)
    assert found.right == (name == place == "right")


def test_a_kind_of_answer_that_the_finding_states_counts() -> None:
    said = finding(
        "unknown", "b_1", answer="unknown", family="memory", also=("creep", "hysteresis")
    )
    assert outcome(said).name == "unknown"
    said = finding("unknown", "b_1", answer="family", family="friction", also=("creep", "delay"))
    assert outcome(said).name == "family"


def test_a_family_as_the_effect_is_a_family_answer() -> None:
    assert outcome(finding("friction", "b_1", family="friction")).name == "family"
    assert outcome(finding("memory", "b_1", family="memory")).name == "wrong"


def test_silence_alarm_without_finding_and_crash() -> None:
    assert (outcome().name, outcome().place) == ("missed", "none")
    assert outcome(verdict="parameters_only").name == "missed"
    assert outcome(verdict="unknown_physics").name == "unknown"
    assert outcome(error="it broke").name == "crashed"


def test_a_second_wrong_finding_spoils_a_right_one() -> None:
    found = outcome(finding("coulomb_friction", "b_1"), finding("saturation", "F"))
    assert (found.name, found.place) == ("wrong", "wrong")
    assert not found.right


def test_controls() -> None:
    control = truth("r", "control")
    assert judge(control, answer("r")).name == "quiet"
    assert judge(control, answer("r")).right
    assert judge(control, answer("r", verdict="insufficient_data")).name == "quiet"
    assert judge(control, answer("r", verdict="unknown_physics")).name == "false_alarm"
    assert judge(control, answer("r", finding("creep", "k_1"))).name == "false_alarm"
    assert judge(control, answer("r", error="it broke")).name == "crashed"
    # a look-alike that is only a wrong parameter is a control as well
    assert judge(truth("r", "look_alike"), answer("r")).right


def test_another_form_asks_for_the_family() -> None:
    form = truth("r", "form", ("coulomb_friction", "b_1"))
    for said, name in (
        (finding("coulomb_friction", "b_1"), "right"),
        (finding("stribeck_friction", "b_1"), "right"),
        (finding("unknown", "b_1", family="friction"), "right"),
        (finding("hysteresis", "b_1"), "wrong"),
        (finding("unknown", "b_1", family="memory"), "wrong"),
        (finding("unknown", "b_1", family="outside"), "unknown"),
    ):
        assert judge(form, answer("r", said)).name == name, said


def test_physics_outside_may_not_be_named() -> None:
    outside = truth("r", "outside", ("unknown", "b_1"))
    for said, name in (
        (finding("coulomb_friction", "b_1"), "wrong"),
        (finding("unknown", "b_1", also=("creep", "hysteresis"), family="memory"), "wrong"),
        (finding("unknown", "b_1", family="friction"), "family"),
        (finding("unknown", "b_1", family="outside"), "unknown"),
    ):
        found = judge(outside, answer("r", said))
        assert (found.name, found.place) == (name, "right"), said


def test_two_effects() -> None:
    two = truth("r", "double", ("coulomb_friction", "b_1"), ("saturation", "F"))
    first, second = finding("coulomb_friction", "b_1"), finding("saturation", "F")
    assert judge(two, answer("r", first, second)).found == 2
    assert judge(two, answer("r", first)).found == 1
    # twice the same is one of the two
    assert judge(two, answer("r", first, first)).found == 1
    found = judge(two, answer("r", finding("saturation", "b_1")))
    assert (found.found, found.place) == (0, "wrong")
    wrong = judge(two, answer("r", first, finding("creep", "k_2")))
    assert [j.name for j in wrong.judged] == ["right", "wrong"]
    # an unnamed remainder may sit at either place
    assert judge(two, answer("r", finding("unknown", "F", family="outside"))).place == "right"


def test_what_is_not_excluded_counts_only_where_nobody_can_tell() -> None:
    said = finding("stribeck_friction", "b_1", also=("coulomb_friction",))
    given = answer("r", said)
    assert judge(COULOMB, given, separable=False).name == "look_alikes"
    assert judge(COULOMB, given, separable=True).name == "wrong"
    assert judge(COULOMB, given).name == "wrong"


@pytest.mark.parametrize(
    ("share", "name"), [(0.5, "look_alikes"), (0.85, "family"), (None, "family")]
)
def test_look_alikes_are_read_by_the_limits_of_the_verdict(share: float | None, name: str) -> None:
    said = finding(
        "unknown", "b_1", family="friction", also=("coulomb_friction", "stribeck_friction"),
        share=0.6,
    )  # fmt: skip
    made = content("r", said)
    if share is not None:
        made["verdict"]["limits"] = {"share": share}
    assert [s.answer for s in answer_of(made).statements] == [name]
