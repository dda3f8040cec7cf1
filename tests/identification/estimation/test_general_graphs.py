"""Guesses, lines and descents on graphs that only the general dynamics runs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.estimation import FitStatus, Study, Vary, estimate
from identification.estimation.guess import explained_guess
from identification.estimation.guessing.measured import measured_response
from identification.estimation.starts import many_starts
from tests.identification.estimation.test_frequency_domain import assert_exact_jacobian
from tests.identification.study.general_plants import (
    driven,
    filled,
    motor,
    pendulum,
    recorded,
    swung,
    tank,
)

FREE = ("Ra", "La", "kt", "spring", "d", "e")
"""Of the motor, whose load and shaft cannot be told apart."""


@cache
def case(name: str) -> tuple[BondGraph, Recording, tuple[str, ...]]:
    if name == "motor":
        return motor(), driven(), FREE
    if name == "tank":
        return tank(), filled(), ("area", "k", "pipe")
    return pendulum(), swung(3.0 if name == "far swung pendulum" else 1.0), ("mgl", "J", "b")


def wrong(name: str, seed: int, reach: float) -> Study:
    """Every start wrong by a factor of its own, up to ``10**reach`` either way."""
    graph, record, free = case(name)
    rng = np.random.default_rng(seed)
    starts = [graph.parameters[n].value * 10 ** rng.uniform(-reach, reach) for n in free]
    return Study(graph, record, [Vary(n, start=s) for n, s in zip(free, starts, strict=True)])


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("name", ["pendulum", "far swung pendulum", "motor", "tank"])
def test_guess_lands_near_the_truth(name: str) -> None:
    """Factors 1e-2 to 1e2 in every parameter, then a fit whose intervals hold the truth."""
    graph = case(name)[0]
    for seed in (1, 4):
        found = explained_guess(wrong(name, seed, 2.0), seed=seed)
        for n, value in found.values.items():
            assert value == pytest.approx(graph.parameters[n].value, rel=0.05), (n, seed)
        made = estimate(found.study)
        assert made.status is FitStatus.CONVERGED
        for e in made.estimates:
            assert abs(e.value - graph.parameters[e.name].value) < 4 / 3.92 * np.ptp(e.ci95)


@pytest.mark.long
def test_what_no_small_motion_shows_is_tried_on_the_run() -> None:
    """The ripple of the gear is not seen about the middle, and no response is matched by it."""
    found = explained_guess(wrong("motor", 0, 2.0))
    assert any("matched by 5 parameters" in w for w in found.words)
    assert found.values["e"] == pytest.approx(0.3, rel=0.1)


def test_measured_response_is_that_of_small_motions() -> None:
    graph, record, _ = case("pendulum")
    (p,) = Study(graph, record).stack().problems
    m = measured_response(p)
    assert m is not None
    made = p.dynamics.small_signal(p.start_vector, p.mean_inputs)
    s = np.asarray(1j * m.omega, complex)
    exact = made.response(s, p.dynamics.drive(["T"], s))[:, 0, 0]
    exact = exact * np.sinc(m.omega * p.data.dt / (2 * np.pi)) ** 2
    error = np.abs(np.exp(m.logarithm[:, 0, 0]) / exact - 1.0) * m.weight[:, 0, 0]
    assert np.median(error) < 1.5


@pytest.mark.parametrize("name", ["pendulum", "motor", "tank"])
@pytest.mark.sampled(every=3)
def test_lines_give_what_the_free_run_gives(name: str) -> None:
    """Values and widths of both; the truth lies inside."""
    graph, record, free = case(name)
    whole = Split(slice(0, record.n), slice(0, 0), "all of it")
    off = [Vary(n, start=1.25 * graph.parameters[n].value) for n in free]
    study = Study(graph, record, off, splits=whole)
    lines, run = estimate(study, "frequency_domain"), estimate(study)
    for e in lines.estimates:
        other = run.estimate_of(e.name)
        widths = [float(np.ptp(v.ci95)) for v in (e, other)]
        assert abs(e.value - other.value) < 0.5 * max(widths), e.name
        assert 0.5 < widths[0] / widths[1] < 1.6, e.name
        assert abs(e.value - graph.parameters[e.name].value) < 4 / 3.92 * widths[0]
    for n in lines.rmse():
        assert lines.rmse()[n] == pytest.approx(run.rmse()[n], rel=1e-2)


def test_jacobian_of_the_lines_is_exact() -> None:
    """Distortion and all: against differences, with a lag."""
    graph, record, _ = case("tank")
    study = Study(graph, record, splits=Split(slice(0, record.n), slice(0, 0), "all of it"))
    assert_exact_jacobian(study, 1e-5)


def test_lines_want_settled_periods() -> None:
    """Two periods leave no run-in to wait for: refused in one line."""
    short = recorded(pendulum(), "T", 50.0, 500, (0.1, 4.0), periods=2)
    whole = Split(slice(0, short.n), slice(0, 0), "all of it")
    with pytest.raises(UnusableInput, match=r"not linear needs two settled.*single_shooting"):
        estimate(Study(pendulum(), short, splits=whole), "frequency_domain")


def test_a_start_that_moves_is_found() -> None:
    """The record begins in full swing, the fit at rest: a joint step alone overshoots."""
    graph, record, free = case("far swung pendulum")
    near = [Vary(n, start=1.02 * graph.parameters[n].value) for n in free]
    made = estimate(Study(graph, record, near))
    assert made.status is FitStatus.CONVERGED
    assert made.cost < 1.1
    for e in made.estimates:
        assert abs(e.value - graph.parameters[e.name].value) < 4 / 3.92 * np.ptp(e.ci95)


def test_windows_of_a_field_are_fitted() -> None:
    """The law of a field counts no time."""
    graph, record, _ = case("pendulum")
    made = estimate(Study(graph, record, window=100))
    assert made.values["mgl"] == pytest.approx(3.0, rel=1e-2)


def test_many_starts_agree() -> None:
    found = many_starts(wrong("tank", 0, 0.3), 3)
    assert found.best.values["area"] == pytest.approx(0.02, rel=5e-3)
