"""The baselines that compute: a black box on a residual, a sparse regression of the states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bondgraph.support.arrays import FloatArray as Array
from tests.proof.trial.black_box import black_box
from tests.proof.trial.models import MODELS
from tests.proof.trial.sparse import sparse_regression
from tests.proof.trial.state_equations import EQUATIONS


def test_black_box_learns_a_bent_filter_and_nothing_from_noise() -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal((3000, 1))
    noise = 0.01 * rng.standard_normal((3000, 2))
    late = np.roll(u[:, 0], 2)
    bent = np.column_stack([0.3 * late + 0.1 * u[:, 0] ** 3, 0.0 * late]) + noise
    train = np.arange(3000) < 2000
    floor = np.array([0.01, 0.01])
    before = float(np.mean((bent[~train] / floor) ** 2))
    learned, held = black_box(u, bent, floor, train, ~train)
    assert before > 500
    assert held == pytest.approx(1.0, abs=0.15)
    assert learned < held * 1.1
    _, held = black_box(u, noise, floor, train, ~train)
    assert held == pytest.approx(1.0, abs=0.1)


def probe(force: Array, dt: float, cubic: float, coulomb: float) -> dict[str, Array]:
    """Simulate the probe with general-purpose code; the command is linear between samples."""
    t = np.arange(force.size) * dt

    def rate(now: float, s: Array) -> list[float]:
        x, v, e = s
        i = (20.0 * v - e) / 200.0
        spring = 8000.0 * x + cubic * x**3
        f = np.interp(now, t, force) - spring - 2.0 * v - coulomb * np.tanh(v / 2e-4) - 20.0 * i
        return [v, f / 0.2, i / 1e-5]

    s = solve_ivp(rate, (0, t[-1]), [0.0, 0.0, 0.0], t_eval=t, max_step=dt, rtol=1e-6).y
    return {"x": s[0], "v_f": s[2]}


@pytest.mark.parametrize(
    ("cubic", "coulomb", "expected"),
    [
        (0.0, 0.0, ("", "")),
        (4e9, 0.0, ("nonlinear_stiffness", "k")),
        (0.0, 1.0, ("coulomb_friction", "b")),
    ],
)
def test_sparse_regression_finds_a_strong_term_in_clean_states(
    cubic: float, coulomb: float, expected: tuple[str, str]
) -> None:
    dt, rng = 1 / 2000, np.random.default_rng(4)
    force = np.convolve(rng.standard_normal(1500), np.hanning(60), "same")
    readings = probe(force, dt, cubic, coulomb)
    train = np.arange(force.size) < 1000
    assert sparse_regression("probe", force, readings, dt, train) == expected


@pytest.mark.parametrize("plant", sorted(MODELS))
def test_every_plant_has_equations_and_asks_for_all_sensors(plant: str) -> None:
    rng = np.random.default_rng(1)
    sensors = [
        e.name for e in MODELS[plant](None).elements.values() if e.kind in ("De", "Df", "Dq")
    ]
    readings = {n: rng.standard_normal(200) for n in sensors}
    train = np.ones(200, bool)
    elements = MODELS[plant](None).elements
    for equation in EQUATIONS[plant](readings[sensors[0]], readings, 0.01):
        assert all(p.element in elements for p in equation.ports)
    found = sparse_regression(plant, rng.standard_normal(200), readings, 0.01, train)
    assert found is not None
    del readings[sensors[0]]
    assert sparse_regression(plant, rng.standard_normal(200), readings, 0.01, train) is None
