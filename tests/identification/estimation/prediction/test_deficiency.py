"""Which equation is deficient: the noise is put where the physics is missing."""

from __future__ import annotations

import doctest
from importlib import import_module

import numpy as np
import pytest

from bondgraph.laws import Polynomial
from bondgraph.simulation.simulate import simulate
from identification.estimation import estimate
from identification.estimation.prediction import deficient_equations
from identification.estimation.prediction.deficiency import boundary_p_value
from tests.identification.estimation.prediction.plants import (
    euler_maruyama,
    random_force,
    recording_of,
    spring,
    study_of,
)

DT, N = 0.02, 600


def test_random_momentum_points_at_the_momentum() -> None:
    rng = np.random.default_rng(2)
    u = random_force(N, rng)[:, None]
    x = euler_maruyama(u, DT, 0.3, rng) + 5e-4 * rng.standard_normal((N, 1))
    report = deficient_equations(study_of(spring(), recording_of(x, DT, u[:, 0])))
    assert report.places[0].place == "p_m"
    assert report.places[0].p_value < 1e-10
    assert report.places[0].sigma == pytest.approx(0.3, rel=0.15)
    assert "the equation of p_m is deficient" in str(report)
    # from a fit: the same, from where that one ended
    fitted = estimate(study_of(spring(), recording_of(x, DT, u[:, 0])))
    again = deficient_equations(fitted, ("q_k", "p_m")).places[0]
    assert again.place == "p_m"
    assert again.sigma == pytest.approx(report.places[0].sigma, rel=1e-3)


def test_missing_cubic_spring_points_at_the_momentum() -> None:
    rng = np.random.default_rng(2)
    u = random_force(N, rng)
    law = Polynomial(half=0.05, size=5.0, orders=(3,), unit="N")
    g = spring().with_element("k", law=law).with_values({"a_3_k": 4.0})
    x = simulate(g, DT * np.arange(N), {"F": u})["x"] + 5e-4 * rng.standard_normal(N)
    report = deficient_equations(study_of(spring(), recording_of(x, DT, u)))
    # the force of the spring stands in the balance of forces, not in that of speeds
    assert report.places[0].place == "p_m"
    assert report.places[0].ratio > report.places[1].ratio + 10
    assert "p_m is deficient" in str(report)


def test_a_right_model_needs_no_noise() -> None:
    rng = np.random.default_rng(4)
    u = random_force(N, rng)
    x = simulate(spring(), DT * np.arange(N), {"F": u})["x"] + 5e-4 * rng.standard_normal(N)
    report = deficient_equations(study_of(spring(), recording_of(x, DT, u)))
    assert not report.significant
    assert "the equations suffice" in str(report)
    assert {d.place for d in report.places} == {"p_m", "q_k"}


@pytest.mark.long
def test_the_boundary_halves_the_p_value() -> None:
    """Without process noise half of the records want some, fewer if they are short: 5 % stay 5 %.

    The chi-squared law without its other half would call about 2.5 % significant in place of 5 %.
    """
    rng = np.random.default_rng(6)
    runs, n = 40, 400
    u = random_force(n, rng)
    x = np.asarray(simulate(spring(), DT * np.arange(n), {"F": u})["x"])
    p = []
    for _ in range(runs):
        record = recording_of(x + 5e-4 * rng.standard_normal(n), DT, u)
        (only,) = deficient_equations(study_of(spring(), record), ["p_m"]).places
        p.append(only.p_value)
    assert 18 <= sum(v > 0.49 for v in p) <= 36
    assert sum(v < 0.05 for v in p) <= 6
    assert boundary_p_value(0.0) == 1.0
    assert boundary_p_value(2.705543) == pytest.approx(0.05, rel=1e-5)


@pytest.mark.parametrize(
    "module",
    [
        "estimation.prediction.deficiency",
        "estimation.prediction.diffusion",
        "statistics.whiteness",
        "study.process_noise",
    ],
)
def test_examples_in_the_docstrings(module: str) -> None:
    result = doctest.testmod(import_module(f"identification.{module}"))
    assert result.attempted > 0
    assert result.failed == 0
