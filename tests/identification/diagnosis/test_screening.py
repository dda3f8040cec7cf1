"""The linear screening on a chain of three masses whose data come from another integrator."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import ode

from actuators.models.plants import plant_model
from bondgraph import C
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, _best, projection, screen
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate

Array = Any
N, DT, NOISE = 800, 2e-3, 3e-6
MASS, STIFFNESS, DAMPING = 1.0, 1e4, 8.0
AMPLITUDES = np.array([14.0, 11.0, 9.0, 9.0, 8.0, 6.0])
TONES = np.array([1.3, 3.7, 7.1, 11.9, 19.3, 27.7])


def push(t: Array) -> Array:
    return AMPLITUDES @ np.sin(2 * np.pi * np.outer(TONES, t) + np.arange(6)[:, None])


def moved(extra: Callable[[Array, Array], Array]) -> Array:
    """Return the displacements (N, 2); `extra` adds to the three efforts of the links."""

    t = DT * np.arange(N)
    u = push(t)

    def rates(t_now: float, state: Array) -> Array:
        x, v = state[:3], state[3:]
        stretch, speed = np.diff(x, prepend=0.0), np.diff(v, prepend=0.0)
        link = STIFFNESS * stretch + DAMPING * speed + extra(stretch, speed)
        force = -link + np.append(link[1:], 0.0)
        force[0] += np.interp(t_now, t, u)
        return np.concatenate([v, force / MASS])

    solver = ode(rates).set_initial_value(np.zeros(6))
    solver.set_integrator("dopri5", rtol=1e-7, atol=1e-10, max_step=DT)
    states = np.stack([np.zeros(6), *(solver.integrate(s) for s in t[1:])])
    return states[:, [0, 2]]


def nothing(stretch: Array, speed: Array) -> Array:
    return np.zeros(3)


def cubic(stretch: Array, speed: Array) -> Array:
    return np.array([0.0, 3e7, 0.0]) * stretch**3


def drag(stretch: Array, speed: Array) -> Array:
    return np.array([0.0, 0.0, 10.0]) * speed * np.abs(speed)


@cache
def screened(extra: Callable[[Array, Array], Array]) -> tuple[Fit, list[Screened]]:
    y = moved(extra)
    y = y + NOISE * np.random.default_rng(3).standard_normal(y.shape)
    t = np.asarray(DT * np.arange(N), np.float64)
    names = ("x_1", "x_3")
    data = Data("chain", t, {"F": push(t)}, y, names, np.full(2, NOISE), interleaved(0, N))
    made = fit(Problem(plant_model("chain", names), data), max_iterations=12)
    return made, screen(scene(made), probes(made), (*CATALOGUE, UNNAMED))


@pytest.mark.parametrize(
    ("extra", "label"), [(cubic, "nonlinear_stiffness at k_2"), (drag, "quadratic_drag at b_3")]
)
def test_the_true_effect_comes_first(extra: Callable[[Array, Array], Array], label: str) -> None:
    made, ranked = screened(extra)
    assert made.chi2("test") > 3.0
    named = [s for s in ranked if s.effect is not UNNAMED]
    assert named[0].label == label
    assert named[0].share > 0.9
    assert named[0].z > 8.0


def test_noise_alone_has_no_pattern() -> None:
    made, ranked = screened(nothing)
    assert made.cost == pytest.approx(1.0, abs=0.1)
    assert all(s.z < 4.0 for s in ranked)
    # two weights and a free frequency fit 1 % of some thousand readings of noise
    assert all(s.share < 0.02 for s in ranked)


@pytest.mark.parametrize("size", [1e120, 1e200, np.inf, np.nan])
def test_a_response_that_runs_away_is_left_out(size: float) -> None:
    """Its square is no number, and eigenvalues of that are none."""
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((480, 2))
    onto: Any = SimpleNamespace(
        residual=columns[:, 0], total=float(columns[:, 0] @ columns[:, 0]),
        blocks=np.arange(480) // 20, rows=lambda response: response,
    )  # fmt: skip
    wild: Any = SimpleNamespace(respond=lambda name, given, flow: size * given)
    calm: Any = SimpleNamespace(respond=lambda name, given, flow: given)
    element, signature = C("k"), Signature(columns)
    assert _best(onto, wild, element, [signature]) == []
    ((gain, *_),) = _best(onto, calm, element, [signature])
    assert gain == pytest.approx(onto.total)


def test_what_the_fit_can_do_is_projected_out() -> None:
    made, ranked = screened(nothing)
    onto = projection(scene(made))
    by_parameters = evaluate(made.problem, made.point).jacobian
    assert np.linalg.norm(onto.clean(by_parameters)) < 1e-6 * np.linalg.norm(by_parameters)
    again = onto.clean(onto.residual[:, None])[:, 0]
    np.testing.assert_allclose(again, onto.residual, atol=1e-9)
    assert onto.total <= float(np.sum(evaluate(made.problem, made.point).residual ** 2))
    assert set(onto.blocks) == set(range(24))
    assert {s.element.name for s in ranked} >= {"F", "x_1", "x_3", "k_1", "b_2", "m_3"}
