"""Identifiability, speeds, checks, profiles and coverage of graphs of the general dynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.laws import Coulomb
from bondgraph.simulation.dynamics import dynamics_of
from identification.estimation import Study, Vary, estimate
from identification.estimation.guess import explained_guess
from identification.uncertainty.cases import case_of
from identification.uncertainty.coverage import coverage
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.joint_sensitivities import speeds_of
from identification.uncertainty.linear_speeds import speeds
from identification.uncertainty.postflight import postflight, practical_of
from identification.uncertainty.preflight import preflight
from identification.uncertainty.profiles import profiles
from identification.uncertainty.structural import identifiability
from identification.validation import judge
from identification.validation.compare import compare
from tests.identification.study.general_plants import (
    coupled,
    general,
    motor,
    pendulum,
    recorded,
    swung,
    tank,
)


def test_speeds_are_those_of_the_twin() -> None:
    record = recorded(coupled(), "F", 80.0, 400, (0.2, 8.0), peak=5.0)
    (exact,) = Study(coupled(), record).stack().problems
    found = [speeds(p) for p in (exact, replace(exact, built=general(coupled())))]
    for a, b in zip(*(sorted(f, key=lambda s: (abs(s.rate), s.rate.imag)) for f in found),
                    strict=True):  # fmt: skip
        assert b.rate == pytest.approx(a.rate, rel=1e-9)
        assert set(b.names) == set(a.names)
    both = [speeds_of(e, e.vector({})) for e in (dynamics_of(coupled()), general(coupled()))]
    assert both[1] == pytest.approx(both[0], rel=1e-9)


def test_speeds_of_a_tilted_pendulum() -> None:
    """About the mean torque: ``sqrt(mgl cos(phi0) / J)``, decided by what stands in it."""
    record = recorded(pendulum(), "T", 50.0, 500, (0.1, 4.0), peak=0.1, bias=1.5)
    (p,) = Study(pendulum(), record).stack().problems
    wanted = np.sqrt(3.0 * np.cos(np.arcsin(0.5)) / 0.05)
    assert [abs(s.rate) for s in speeds(p)] == pytest.approx([wanted, wanted], rel=1e-3)
    assert all({"mgl", "J"} <= set(s.names) for s in speeds(p))


def test_preflight_knows_the_speeds() -> None:
    """Good data raise nothing; samples too slow for the motion are told."""
    assert preflight(Study(pendulum(), swung())) == ()
    light = pendulum().with_values({"J": 2e-6})
    found = {f.kind: f for f in preflight(Study(light, swung()))}
    assert "J" in found["slow samples"].where


def test_identifiability_of_every_kind() -> None:
    assert identifiability(pendulum()).missing == 0
    assert identifiability(tank()).missing == 0
    tied = identifiability(motor())
    assert tied.missing == 1
    assert set(tied.groups[0].names) == {"n", "kt", "J", "b"}


@pytest.mark.long
def test_a_law_that_jumps_is_held_beside_products_of_signals() -> None:
    """Swings without dry friction: every verb takes a model with some, and finds next to none."""
    graph = pendulum().with_element("b", law=Coulomb(0.1, unit="N*m"))
    assert identifiability(graph).missing == 0
    assert preflight(Study(graph, swung())) == ()
    guess = explained_guess(Study(graph, swung()))
    assert guess.cost_after < 0.01 * guess.cost_before
    for found in (
        estimate(Study(graph, swung())),
        estimate(Study(graph, swung()), "frequency_domain"),
    ):
        for name in ("mgl", "J", "b"):
            low, high = found.estimate_of(name).ci95
            wide = high - low
            assert low - wide < graph.parameters[name].value < high + wide
        assert abs(found.estimate_of("F_c_b").value) < 0.002


def test_profiles_and_judgement_hold_the_truth() -> None:
    graph = pendulum()
    starts = [Vary(n, start=1.2 * graph.parameters[n].value) for n in ("mgl", "J", "b")]
    made = estimate(Study(graph, swung(2.0), starts))
    fit = from_estimation(made)
    for p in profiles(fit, ["mgl", "b"]):
        low, high = p.interval
        assert low < graph.parameters[p.name].value < high
        assert high - low == pytest.approx(np.ptp(made.estimate_of(p.name).ci95), rel=0.4)
    assert practical_of(fit).of("dead") == ()
    assert {f.kind for f in postflight(made)} <= {"trade-off pair"}
    assert "nothing to object to" in str(judge(made))
    fewer = estimate(Study(graph, swung(2.0), starts[:2]))
    assert "not worse than the best" in str(compare({"all": made, "two": fewer}))


@pytest.mark.long
def test_intervals_cover_the_truth() -> None:
    """A case is made from the speeds about the rest; too few trials for more than a bound."""
    case = case_of(pendulum(), samples=300, amplitude=2.0)
    assert case.time[1] == pytest.approx(np.pi / 8.0 / np.sqrt(60.0), rel=1e-3)
    found = coverage(case, 20, kinds=("fisher",))
    assert found.overall("fisher") > 0.8
