"""Exact intervals and bounds, and every gate where it fails."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from scipy.stats import beta

from tests.proof.tests.exam.made_up import (
    BACKLASH,
    MISSING,
    UNKNOWN,
    Pair,
    counted,
    effect,
    finding,
    said,
    truth,
)
from tests.proof.trial.gates import ERRORS, MISNAMED, SHARPNESS, Gate, gates, withheld_gates
from tests.proof.trial.rates import Rate, rate

RIGHT: Pair = (BACKLASH, said(MISSING, finding("exact", "backlash")))
QUIET: Pair = (truth("control"), said("explained"))
OUTSIDE: Pair = (truth("outside", effect("unknown")), said(UNKNOWN, finding("unknown")))
GOOD = (RIGHT, QUIET, OUTSIDE)
"""Recordings that every gate is content with, if there are enough of them."""

BAD: Mapping[str, Pair] = {
    "false alarms, of the controls": (truth("control"), said(UNKNOWN, finding("unknown"))),
    "misfit above 3 times the noise, of those called explained": (
        truth("control"), said("explained", over=3.1),
    ),
    "called explained, of those where an effect shows": (BACKLASH, said("explained", over=0.4)),
    "wrong names, of the names given": (BACKLASH, said(MISSING, finding("exact", "creep"))),
    "wrong places, of the places given": (
        BACKLASH, said(MISSING, finding("exact", "backlash", "k_1")),
    ),
    "outside the catalogue named exactly": (
        truth("outside", effect("unknown")), said(MISSING, finding("exact", "creep")),
    ),
    "sharp where an oracle separates names: right name and place": (
        BACKLASH, said(UNKNOWN, finding("kind", kind="restoring")),
    ),
    "sharp where an oracle separates kinds: right place, and right name or kind": (
        BACKLASH, said(UNKNOWN, finding("unknown")),
    ),
    "truth in the set of names, of those told": (
        BACKLASH, said(UNKNOWN, finding("kind", kind="slow")),
    ),
    "truth in the set of places, of those told": (
        BACKLASH, said(UNKNOWN, finding("unknown", place="k_1")),
    ),
}  # fmt: skip
"""One recording that speaks against each gate."""


def found(*pairs: Pair) -> dict[str, Gate]:
    return {g.name: g for g in gates(counted(*pairs).rates)}


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    r = Rate(3, 150)
    expected = [beta.ppf(0.025, 3, 148), beta.ppf(0.975, 4, 147)]
    assert list(r.exact) == pytest.approx(expected, rel=1e-9)
    assert r.upper == pytest.approx(beta.ppf(0.95, 4, 147), rel=1e-9)
    assert r.lower == pytest.approx(beta.ppf(0.05, 3, 148), rel=1e-9)
    assert Rate(0, 59).upper == pytest.approx(1 - 0.05 ** (1 / 59))
    assert (Rate(0, 0).exact, Rate(0, 0).upper, Rate(0, 0).lower) == ((0.0, 1.0), 1.0, 0.0)
    assert str(Rate(2, 150)) == "2/150  1.3 % (0.2-4.7)"
    assert str(rate([])) == "0/0"


@pytest.mark.parametrize(
    ("limit", "enough"),
    [(0.02, (149, 236, 313)), (0.03, (99, 157, 208)), (0.05, (59, 93, 124))],
)
def test_the_design_is_just_large_enough(limit: float, enough: tuple[int, ...]) -> None:
    for errors, total in enumerate(enough):
        assert Gate("", Rate(errors, total), limit).state == "certified"
        assert Gate("", Rate(errors, total - 1), limit).state == "met, not certified"
        # what certifies a limit is that the bound lies below it
        assert Rate(errors, total).upper < limit < Rate(errors, total - 1).upper


def test_states() -> None:
    assert Gate("", Rate(3, 100), 0.02).state == "missed"
    assert Gate("", Rate(0, 0), 0.02).state == "empty"
    assert not Gate("", Rate(0, 0), 0.02).passed
    assert Gate("", Rate(0, 3), 0.0).state == "none seen"
    assert Gate("", Rate(1, 10**6), 0.0).state == "missed"
    assert Gate("", Rate(79, 100), 0.8, most=False).state == "missed"
    assert Gate("", Rate(80, 100), 0.8, most=False).state == "met, not certified"
    # the design: a rate that keeps the limit is met, whatever its bound; it is not certified
    narrow = Gate("", Rate(2, 100), 0.02)
    assert narrow.state == "met, not certified"
    assert narrow.passed
    assert not narrow.certified
    assert Gate("", Rate(90, 100), 0.8, most=False).state == "certified"
    assert "asked none" in Gate("x", Rate(0, 3), 0.0).words
    assert "upper bound 63.2 %, asked <= 2 %, p 0.94" in Gate("x", Rate(0, 3), 0.02).words


def test_enough_right_answers_meet_every_gate() -> None:
    met = found(*GOOD * 160)
    assert [g.words for g in met.values() if not g.passed] == []
    assert met.keys() == {*ERRORS, *SHARPNESS}


@pytest.mark.parametrize("name", [*ERRORS, *SHARPNESS])
def test_every_gate_fails_where_it_should(name: str) -> None:
    # two bad ones of each sort among so few: no limit bears that
    failed = found(*GOOD * 3, BAD[name], BAD[name])[name]
    assert failed.state == "missed", failed.words
    assert not failed.passed


def test_too_few_answers_certify_nothing() -> None:
    few = found(*GOOD * 3)
    assert few["wrong names, of the names given"].state == "met, not certified"
    assert found(QUIET)["wrong names, of the names given"].state == "empty"


def test_the_withheld_gate() -> None:
    assert withheld_gates({MISNAMED: Rate(0, 59)})[0].passed
    assert withheld_gates({MISNAMED: Rate(1, 59)})[0].passed
    assert not withheld_gates({MISNAMED: Rate(1, 59)})[0].certified
    assert withheld_gates({MISNAMED: Rate(4, 59)})[0].state == "missed"
