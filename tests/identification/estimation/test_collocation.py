"""Direct collocation: agrees with single shooting, takes unstable and integrating plants."""

from __future__ import annotations

import numpy as np
import pytest

from actuators import stack_bond_graph
from bondgraph import BondGraph, CField, Dq, I, One, R, Se
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program
from bondgraph.laws import Coulomb, Polynomial, StopSum
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation import Study, Vary, estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods import interior_point
from identification.estimation.methods.collocation import Collocation
from identification.estimation.methods.method import FitOptions, FitTask
from identification.estimation.methods.radau import stage_inputs, tableau
from identification.estimation.result import Estimation
from identification.study.specification import NO_NUISANCES, Nuisances
from tests.identification.estimation.plants import (
    TRUTH,
    caught,
    falling,
    misses,
    record,
    spring,
    study,
)
from tests.settled import simulate


def moved_by(a: Estimation, b: Estimation) -> Array:
    """Return the distances of the unknowns in standard errors of b."""
    error = np.sqrt(np.diag(b.covariance))
    free = error > 0
    return np.asarray(np.abs(a.point.theta - b.point.theta)[free] / error[free])


def both(s: Study) -> tuple[Estimation, Estimation]:
    return estimate(s, "collocation", optimiser="ipopt"), estimate(s)


@pytest.mark.parametrize("stages", [2, 3, 4])
def test_tableau_is_exact_for_polynomials_of_its_order(stages: int) -> None:
    c, a = tableau(stages)
    for power in range(stages):
        assert a @ c**power == pytest.approx(c ** (power + 1) / (power + 1), abs=1e-13)
    for power in range(2 * stages - 1):
        assert a[-1] @ c**power == pytest.approx(1 / (power + 1), abs=1e-13)


def test_stage_inputs_follow_the_declared_behaviour() -> None:
    made: Program = program(spring())
    c = tableau(3)[0]
    u = np.array([[0.0], [2.0], [1.0]])
    held, nodes = stage_inputs(made, u, 0.1, 2, "hold")
    assert held.shape == (3, 4)
    assert held[:, 1].tolist() == [0.0, 0.0, 0.0]
    assert nodes[0].tolist() == [0.0, 0.0, 0.0, 2.0, 2.0]
    linear, nodes = stage_inputs(made, u, 0.1, 2, "linear")
    assert linear[:, 1] == pytest.approx(1.0 + c)
    assert nodes[0] == pytest.approx([0.0, 1.0, 2.0, 1.5, 1.0])
    t = np.arange(200) / 100
    wave = np.sin(2 * np.pi * 20.0 * t)[:, None]
    smooth, _ = stage_inputs(made, wave, 0.01, 1, "band-limited")
    at = t[80:120] + c[1] * 0.01
    assert smooth[1, 80:120] == pytest.approx(np.sin(2 * np.pi * 20.0 * at), abs=5e-3)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"initial": "rest"},
        {"initial": {"q_k": 0.0}, "noise": "coloured"},
        {"hold": "hold", "nuisances": NO_NUISANCES},
    ],
    ids=["free", "rest", "known and coloured", "hold"],
)
def test_agrees_with_single_shooting(options: dict[str, object]) -> None:
    here, there = both(study(record(200), **options))
    assert here.status is FitStatus.CONVERGED
    assert moved_by(here, there).max() < 1e-3
    assert here.rmse()["x"] == pytest.approx(there.rmse()["x"], rel=1e-3)


@pytest.mark.long
def test_records_of_different_rates_share_the_parameters() -> None:
    here, there = both(study(record(250), record(200, fs=70.0, seed=8)))
    assert moved_by(here, there).max() < 1e-3
    assert max(misses(here, TRUTH).values()) < 4


def test_a_hardening_spring() -> None:
    g = spring(d=1.0, k=100.0, law=Polynomial(orders=(3,), size=30.0, unit="N"))
    t = np.arange(250) / 100
    force = 40 * np.sin(2 * np.pi * (1 + t) * t)
    truth = {"m": 0.6, "d": 1.3, "k": 120.0, "a_3_k": 200.0}
    x = np.asarray(simulate(g, t, {"F": force}, truth)["x"])
    noise = 1e-3 * float(x.std())
    x = x + noise * np.random.default_rng(0).standard_normal(t.size)
    r = Recording.from_arrays("r", {"F[N]": force, "x[m]": x}, fs=100.0)
    s = Study(g, r, nuisances=Nuisances(lags=False), initial="rest", noise={"x": noise})
    # the sub-steps that single shooting chooses may move an unknown by a fifth of its error
    here, there = estimate(s, "collocation", optimiser="ipopt"), estimate(s.changed(n_sub=256))
    assert moved_by(here, there).max() < 1e-3
    assert max(misses(here, truth).values()) < 4


def test_the_law_of_a_field_is_smooth() -> None:
    with BondGraph("spring") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> CField("k", matrix=((TRUTH["k"],),), ports=1)
        body >> Dq("x", unit="m")
    made = estimate(Study(g, record(300), (Vary("d", start=1.0),)), "collocation")
    assert misses(made, {"d": TRUTH["d"]})["d"] < 4


@pytest.mark.long
def test_an_integrating_plant() -> None:
    with BondGraph("cart") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> R("d", 3.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    force = np.repeat(np.random.default_rng(0).uniform(-5, 5, 30), 20)
    truth = {"m": 0.7, "d": 2.0}
    x = np.asarray(simulate(g, np.arange(600) / 100, {"F": force}, truth, hold="hold")["x"])
    x = x + 1e-3 * np.random.default_rng(1).standard_normal(600)
    r = Recording.from_arrays("cart", {"F[N]": force, "x[m]": x}, fs=100.0)
    here, there = both(Study(g, r, hold="hold"))
    assert moved_by(here, there).max() < 1e-3
    assert max(misses(here, truth).values()) < 4


def test_an_unstable_plant_keeps_readings_and_intervals_of_the_trajectory() -> None:
    truth = {"m": 0.5, "d": 1.0, "t_0_k": 20.0, "t_2_k": -20.0}
    s = Study(
        falling(-15.0), caught(250), tuple(truth), {"t_1_k": 0.0}, hold="hold",
        nuisances=NO_NUISANCES,
    )  # fmt: skip
    made = estimate(s, "collocation", optimiser="ipopt")
    assert made.status is FitStatus.CONVERGED
    assert max(misses(made, truth).values()) < 4
    assert made.rmse()["x"] == pytest.approx(2e-4, rel=0.15)


def test_scales_of_the_piezo_stack() -> None:
    """Its states are 1e-6 C, 1e-6 m and 1e-3 N s; its readings amperes and micrometres."""
    n, fs = 250, 2e5
    t = np.arange(n) / fs
    g = stack_bond_graph(sensors=("x", "i"))
    rng = np.random.default_rng(0)
    drive = 20 * (1 - np.cos(2 * np.pi * 4000 * t)) + 5 * np.convolve(
        rng.standard_normal(n), np.ones(6) / 2, "same"
    )
    drive -= drive[0]
    truth = {"T": 1.1 * g.parameters["T"].value, "m": 0.9 * g.parameters["m"].value}
    made = simulate(g, t, {"V_in": drive}, truth)
    r = Recording.from_arrays(
        "stack",
        {
            "V_in[V]": drive,
            "x[m]": made["x"] + 1e-8 * rng.standard_normal(n),
            "i[A]": made["i"] + 1e-2 * rng.standard_normal(n),
        },
        fs=fs,
    )
    here, there = both(Study(g, r, free=tuple(truth), nuisances=NO_NUISANCES, initial="rest"))
    assert here.status is FitStatus.CONVERGED
    assert moved_by(here, there).max() < 5e-3
    assert max(misses(here, truth).values()) < 4


def test_interrupt_keeps_the_best_values() -> None:
    s = study(record(400))
    calls: list[float] = []

    def report(iteration: int, cost: float) -> None:
        calls.append(cost)
        if len(calls) == 4:
            raise KeyboardInterrupt

    stack = s.stack()
    made = Collocation().solve(
        FitTask(s, s.first_setting, stack, stack.start(), FitOptions("ipopt", report=report))
    )
    assert made.status is FitStatus.CANCELLED
    assert np.isfinite(made.point.theta).all()
    assert len(calls) == 4


def test_wall_time_ends_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interior_point, "LONGEST", 1e-3)
    s = study(record(400))
    stack = s.stack()
    made = Collocation().solve(
        FitTask(s, s.first_setting, stack, stack.start(), FitOptions("ipopt"))
    )
    assert made.status is FitStatus.ITERATIONS


def test_refusals_name_another_method() -> None:
    memory = stack_bond_graph(StopSum((1e-6,), height=1e8, scale=1e8))
    with BondGraph("dry") as dry:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> R("d", 1.0, unit="N*s/m", law=Coulomb(1.0))
        body >> Dq("x", unit="m")
    t = np.arange(50.0)
    piezo = Recording.from_arrays("p", {"V_in[V]": t, "x[m]": t, "i[A]": t}, fs=1.0)
    cart = Recording.from_arrays("c", {"F[N]": t, "x[m]": t}, fs=1.0)
    for s, words in (
        (Study(memory, piezo), "memory"),
        (Study(dry, cart), "jumps"),
        (study(nuisances=Nuisances(clock=1e-4)), "clocks"),
        (study(window=100), "windows"),
    ):
        with pytest.raises(UnusableInput, match=words) as caught_error:
            Collocation().check(s)
        assert words == "windows" or "single_shooting" in str(caught_error.value)


@pytest.mark.long
def test_starts_far_away() -> None:
    far = study(record(200), free=("m", Vary("d", start=0.3), Vary("k", start=900.0)))
    made = estimate(far, "collocation", optimiser="ipopt")
    assert max(misses(made, TRUTH).values()) < 4
