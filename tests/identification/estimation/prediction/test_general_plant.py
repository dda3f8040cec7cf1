"""The filter on the general step: against the exact one, differences, free runs, and truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, C, Dq, I, One, R, Recording, Se
from bondgraph.equations.codegen import program
from bondgraph.graph.elements import MTF
from bondgraph.graph.modulation import displacement
from bondgraph.laws import Coulomb, Polynomial
from bondgraph.simulation.dynamics import GeneralDynamics
from bondgraph.support.errors import BondsightError
from identification.estimation import FitStatus, Vary, estimate
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.likelihood import evaluate, pass_over
from identification.study.free_parameters import idle
from identification.study.joint import stack_of
from tests.bondgraph.simulation.test_general_kernel import MODELS
from tests.identification.estimation.prediction.plants import (
    euler_maruyama,
    filter_of,
    random_force,
    recording_of,
    spring,
    study_of,
)
from tests.identification.estimation.prediction.test_likelihood import (
    assert_gradient,
    assert_the_same_without_a_compiler,
)

DT = 0.02
SLOWER = ("Bouc-Wen", "creep", "LuGre", "time and modulation", "duffing")


def general(kalman: KalmanFilter) -> KalmanFilter:
    """Return the same filter on the general dynamics, also where the exact one is to be had."""
    (p,) = kalman.problems
    dynamics = GeneralDynamics(program(p.with_chain), p.with_chain.parameters)
    return replace(kalman, stack=stack_of([replace(p, built=dynamics)]))


def driven(name: str, n: int = 60, **more: Any) -> KalmanFilter:
    """One of the kernel's models under a swept force; what it reads does not matter much here."""
    graph = MODELS[name]()
    t = DT * np.arange(n)
    u = 1.2 * np.sin(2.1 * t) + 0.7 * np.sin(5.3 * t)
    rng = np.random.default_rng(1)
    sensors = [e.name for e in graph.elements.values() if e.name in "wyxviv"]
    channels = {"F[1]": u, **{f"{s}[1]": 0.3 * u + 0.1 * rng.standard_normal(n) for s in sensors}}
    idle_names = idle(graph) | {
        n for n, p in graph.parameters.items() if p.positive and not p.value
    }
    used = {n: p for n, p in graph.parameters.items() if n not in idle_names}
    free = [Vary(n, start=None if p.value else 0.3) for n, p in used.items()]
    record = Recording.from_arrays("run", channels, fs=1 / DT)
    return general(filter_of(graph, record, free=free, **more))


def test_it_tends_to_the_exact_filter_of_a_linear_model() -> None:
    rng = np.random.default_rng(1)
    u = random_force(100, rng)
    u -= u[0]
    x = euler_maruyama(u[:, None], DT, 0.3, rng) + 2e-3 * rng.standard_normal((100, 1))
    given = spring(), recording_of(x, DT, u), {"m": 0.3, "k": 0.01, "F": 0.2}
    off = []
    for n_sub in (4, 8):
        exact = filter_of(*given, n_sub=n_sub, noise={"x": 2e-3})
        other = general(exact)
        values = [evaluate(k, k.start(), False).log_likelihood for k in (exact, other)]
        off.append(abs(values[0] - values[1]))
    assert off[1] < 1e-3
    # noise and mean are both of third order
    assert off[0] / off[1] == pytest.approx(8.0, rel=0.2)


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize(
    "name",
    # the tangents of every model are held against differences where the kernel is tested
    [pytest.param(n, marks=pytest.mark.long) if n in SLOWER else n for n in MODELS],
)
def test_gradient_equals_differences(name: str) -> None:
    made = driven(name, process_noise=None)
    assert_gradient(made, 1e-5, 0.02)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("name", ["implicit loop", "silverbox", "plays", "rate of an input"])
def test_without_process_noise_it_predicts_the_free_run(name: str) -> None:
    made = driven(name, process_noise=(), n_sub=2)
    theta = made.start()
    p = made.first
    ready = p.dynamics.prepare(p.start_vector, DT, 2, [], False)
    run = p.dynamics.run(ready, p.inputs, made.initial(theta, 0), p.fine_inputs(slice(0, 60), 2))
    passed, _ = pass_over(made, theta, 0, np.ones_like(p.data.readings))
    assert np.allclose(passed.reading * made.reading_scale(0), run.y, rtol=1e-8, atol=1e-9)


def test_without_a_compiler_all_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("silverbox", "LuGre"):
        made = driven(name, 20, process_noise=None, n_sub=2)
        assert_the_same_without_a_compiler(made, monkeypatch, 1e-7)


# -- a pendulum in noise ---------------------------------------------------------------------

TRUTH = {"L": 0.3, "J": 0.02, "d": 0.02}
WEIGHT, TORSION, SIGMA, NOISE = 3.0, 0.1, 0.01, 2e-3


def pendulum() -> BondGraph:
    """Return a pendulum that swings through more than a right angle; the arm lifts a weight."""
    with BondGraph("pendulum") as g:
        arm = g.parameter("L", 0.25, "m")
        turn, lift = One("turn"), One("lift")
        Se("T", unit="N*m") >> turn >> I("J", 0.03, unit="kg*m2")
        turn >> R("d", 0.04, unit="N*m*s/rad")
        turn >> C("c", stiffness=TORSION, unit="N*m/rad", fixed=True)
        turn >> MTF("lever", ratio=arm * sp.sin(displacement("c"))) >> lift
        Se("W", unit="N") >> lift
        turn >> Dq("phi", unit="rad")
    return g


@pytest.fixture(scope="module")
def swings() -> list[Recording]:
    """By Euler and Maruyama, all runs at once."""
    rng, n, runs, sub = np.random.default_rng(3), 600, 8, 40
    torque = np.stack([random_force(n, rng, size=0.25) for _ in range(runs)], axis=1)
    q, p, angle, h = np.zeros(runs), np.zeros(runs), np.zeros((n, runs)), DT / sub
    for i in range(n - 1):
        for j in range(sub):
            force = torque[i] + (torque[i + 1] - torque[i]) * j / sub - TORSION * q
            force = force - TRUTH["L"] * WEIGHT * np.sin(q) - TRUTH["d"] * p / TRUTH["J"]
            p = p + h * force + SIGMA * np.sqrt(h) * rng.standard_normal(runs)
            q = q + h * p / TRUTH["J"]
        angle[i + 1] = q
    assert np.abs(angle).max() > 1.2  # the sine is then no line
    seen = angle + NOISE * rng.standard_normal(angle.shape)
    return [
        Recording.from_arrays(
            f"swing {i}",
            {"T[N*m]": torque[:, i], "W[N]": np.full(n, -WEIGHT), "phi[rad]": seen[:, i]},
            fs=1 / DT,
        )
        for i in range(runs)
    ]


@pytest.mark.long
def test_a_pendulum_with_process_noise(swings: list[Recording]) -> None:
    inside, levels = [], []
    for record in swings:
        study = study_of(pendulum(), record, ("J",), n_sub=None)
        found = estimate(study, method="prediction_error")
        assert found.status is FitStatus.CONVERGED
        assert found.filtered is not None
        assert np.std(found.filtered.innovation[0]) == pytest.approx(1.0, abs=0.05)
        assert not any("not white" in n for n in found.notes)
        for name, true in {**TRUTH, "sigma J": SIGMA, "noise phi": NOISE}.items():
            low, high = found.estimate_of(name).ci95
            inside.append(low <= true <= high)
            assert high - low < 0.4 * true
        levels.append(found.estimate_of("sigma J").value)
    # 40 intervals: 38 expected at 95 %, below 34 with a probability of one in a hundred
    assert sum(inside) >= 34
    assert np.mean(levels) == pytest.approx(SIGMA, rel=0.05)


def test_all_swings_at_once(swings: list[Recording]) -> None:
    study = study_of(pendulum(), swings[:2], ("T",), n_sub=None)
    found = estimate(study, method="prediction_error")
    for name, true in TRUTH.items():
        e = found.estimate_of(name)
        assert abs(e.value - true) < 1.6 * 0.5 * (e.ci95[1] - e.ci95[0])
    # a random torque is what moves the momentum
    assert found.estimate_of("sigma T").value == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        (lambda g: g.with_element("d", law=Coulomb(0.01)), "J", "d has a law that jumps"),
        (lambda g: g, "L", "no place for process noise 'L' in pendulum. Known: p_J, q_c, J, c, T"),
    ],
)
def test_only_physics_refuses(
    swings: list[Recording], change: Callable[[BondGraph], BondGraph], place: str, words: str
) -> None:
    with pytest.raises(BondsightError, match=words):
        estimate(study_of(change(pendulum()), swings[0], (place,)), method="prediction_error")


def test_noise_where_the_rate_of_a_source_acts_is_refused() -> None:
    with pytest.raises(BondsightError, match="needs the rate of F, and white noise has none"):
        driven("rate of an input", process_noise=("F",))


def test_a_law_beside_a_modulation_is_named(swings: list[Recording]) -> None:
    g = pendulum().with_element("d", law=Polynomial(half=5.0, size=0.01, orders=(3,), unit="N*m"))
    found = estimate(study_of(g, swings[0], ("J",)), method="prediction_error", max_iterations=5)
    assert any(n.startswith("d is nonlinear: the filter linearises") for n in found.notes)
