"""A sensor with a clock of its own: simulation, exact derivatives, windows, estimates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.equations.codegen import program
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.elements import C, I, One, R, Se
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Df, Dq
from bondgraph.signals.fractional_delay import delayed_within
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.varying_delay import warped_within
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.catalogue.time.clock_skew import ClockSkewEffect
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.screening.port_history import FittedModel
from identification.estimation import Nuisances, Study, estimate
from identification.estimation.methods import METHODS
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.joint import stack_of
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, slots, start_point, windows
from identification.uncertainty.fitted import unknowns
from identification.uncertainty.structural import identifiability
from tests.settled import simulate

N, DT = 2000, 1e-3
CLOCK = Parameter("clock_x", 0.0, positive=False, lower=-0.01, upper=0.01)


def plant(clock: str | None = "clock_x") -> BondGraph:
    with BondGraph("oscillator") as g:
        node = One("v")
        Se("F", unit="N") >> node
        node >> I("m", 0.5, unit="kg")
        node >> C("k", stiffness=800.0, unit="N/m")
        node >> R("b", 3.0, unit="N*s/m")
        node >> Dq("x", unit="m", clock=clock)
        node >> Df("rate", unit="m/s")
    return g.with_parameters([CLOCK])


def force(t: np.ndarray) -> np.ndarray:
    return np.asarray(3.0 * np.sin(2 * np.pi * 3 * t) + 2.0 * np.sin(2 * np.pi * 7.7 * t))


def recorded(ratio: float, noise: float = 0.0) -> Data:
    """Both readings from ten times as many samples, `x` interpolated at its clock's times."""
    fine = DT / 10 * np.arange(10 * N + 400)
    run = simulate(plant(None), fine, {"F": force(fine)})
    t = DT * np.arange(N)
    x, rate = np.interp((1 + ratio) * t, fine, run["x"]), run["rate"][: 10 * N : 10]
    y = np.stack([x, rate], axis=1)
    floor = np.maximum(noise, 1e-3) * y.std(axis=0)
    y = y + noise * y.std(axis=0) * np.random.default_rng(0).standard_normal(y.shape)
    return Data(
        "run",
        t,
        {"F": force(t)},
        y,
        ("x", "rate"),
        floor,
        Split(slice(0, 1400), slice(1400, N), "-"),
    )


def test_simulation_takes_the_reading_at_the_clock_s_times() -> None:
    ratio, t = 0.004, DT * np.arange(N)
    run = simulate(plant(), t, {"F": force(t)}, {"clock_x": ratio})
    truth = recorded(ratio).readings
    inner = slice(0, N - 20)
    np.testing.assert_allclose(run["x"][inner], truth[inner, 0], atol=1e-4 * np.ptp(truth[:, 0]))
    quiet = simulate(plant(None), t, {"F": force(t)})
    np.testing.assert_allclose(run["rate"], quiet["rate"])
    same = simulate(plant(), t, {"F": force(t)}, {"clock_x": 0.0})
    np.testing.assert_allclose(same["x"], quiet["x"])


@pytest.mark.parametrize("window", [None, 500])
def test_derivative_against_differences(window: int | None) -> None:
    problem = Problem(plant(), recorded(0.002), window=window, starts={"clock_x": 0.0013})
    at = slots(problem)
    assert list(problem.delays) == list(problem.skews) == ["clock_x"]
    point = start_point(problem)
    column = evaluate(problem, point).jacobian[:, at.delays.start]
    h = 1e-4
    ends = []
    for d in (h, -h):
        theta = point.theta.copy()
        theta[at.delays] += d
        ends.append(-evaluate(problem, Point(theta, point.states), derivatives=False).residual)
    np.testing.assert_allclose(
        column, (ends[0] - ends[1]) / (2 * h), atol=2e-4 * np.abs(column).max()
    )
    assert np.abs(column).max() > 1


def test_a_window_counts_time_from_the_start_of_the_record() -> None:
    ratio = 0.003
    data = recorded(ratio)
    whole = evaluate(p := Problem(plant(), data, starts={"clock_x": ratio}), start_point(p)).y
    cut = fit(Problem(plant(), data, window=500, starts={"clock_x": ratio}, fixed=("m", "b", "k")))
    assert cut.values["clock_x"] == pytest.approx(ratio, rel=0.02)
    assert np.abs(whole[:-20, 0] - data.readings[:-20, 0]).max() < 1e-3 * np.ptp(whole[:, 0])


def test_a_nuisance_clock_counts_from_the_start_of_the_record_in_windows_too() -> None:
    data = recorded(0.003)
    problem = Problem(plant(None), data, window=500, clock=0.01)
    at, point = slots(problem), start_point(problem)
    theta = point.theta.copy()
    theta[at.clocks] = 0.3, 0.0
    y = evaluate(problem, Point(theta, point.states)).y
    declared = Problem(plant(), data, window=500, starts={"clock_x": 0.003})
    wanted = evaluate(declared, start_point(declared)).y
    begins = np.array([w.start for w in windows(problem)])
    inner = np.abs(np.arange(N)[:, None] - np.append(begins, N)).min(axis=1) > 20
    np.testing.assert_allclose(y[inner], wanted[inner], atol=1e-4 * np.ptp(wanted))
    column = evaluate(problem, Point(theta, point.states)).jacobian[:, at.clocks.start]
    h, ends = 1e-3, []
    for d in (h, -h):
        moved = theta.copy()
        moved[at.clocks.start] += d
        ends.append(-evaluate(problem, Point(moved, point.states), derivatives=False).residual)
    wanted = (ends[0] - ends[1]) / (2 * h)
    np.testing.assert_allclose(column, wanted, atol=2e-3 * np.abs(column).max())


def test_recordings_in_a_row_start_their_clocks_anew() -> None:
    ratio, data = 0.003, recorded(0.003)
    cut = 1100
    columns = {k: np.concatenate([v[:cut], v[:cut]]) for k, v in data.commands.items()}
    two = replace(
        data,
        time=DT * np.arange(2 * cut),
        commands=columns,
        readings=np.concatenate([data.readings[:cut]] * 2),
        split=Split(slice(0, 1500), slice(1500, 2 * cut), "-"),
        breaks=(cut,),
    )
    problem = Problem(plant(), two, starts={"clock_x": ratio})
    y = evaluate(problem, start_point(problem), derivatives=False).y
    np.testing.assert_allclose(y[cut:], y[:cut], rtol=1e-9, atol=1e-12)
    assert fit(problem).values["clock_x"] == pytest.approx(ratio, rel=0.01)


@pytest.mark.parametrize("ratio", [-4e-4, 2.5e-3])
def test_fit_gives_ratio_and_parameters_back(ratio: float) -> None:
    found = fit(Problem(plant(), recorded(ratio, 0.01)))
    (estimate,) = [e for e in found.estimates if e.name == "clock_x"]
    assert estimate.unit == "1"
    low, high = estimate.ci95
    half = 0.5 * (high - low)
    assert low - half < ratio < high + half
    assert half < 1e-4
    assert found.values["k"] == pytest.approx(800.0, rel=0.01)
    assert found.chi2("test") < 1.2
    assert any(e.name == "delay x" for e in found.nuisances)  # a constant lateness is beside it
    blind = fit(Problem(plant(None), recorded(ratio, 0.01)))
    assert blind.chi2("test") > 1.8 * found.chi2("test")


def test_bounds_and_fixed_clocks() -> None:
    tight = plant().with_parameters([replace(CLOCK, lower=-1e-3, upper=1e-3)])
    assert fit(Problem(tight, recorded(2.5e-3))).values["clock_x"] == pytest.approx(1e-3)
    held = fit(Problem(plant(), recorded(2.5e-3), fixed=("clock_x",), starts={"clock_x": -1e-3}))
    assert held.values["clock_x"] == pytest.approx(-1e-3)


def test_a_clock_without_bounds_may_run_slow_and_is_judged_as_a_ratio() -> None:
    loose = plant().with_parameters([Parameter("clock_x", 0.0, positive=False)])
    stack = stack_of((Problem(loose, recorded(-4e-3)),))
    (clock,) = [u for u in unknowns(stack) if u.name == "clock_x"]
    assert clock.lower == pytest.approx(-0.1)
    assert clock.upper == pytest.approx(0.1)
    assert clock.free.parameter.unit == "1"
    bounded = stack_of((Problem(plant(), recorded(-4e-3)),))
    (clock,) = [u for u in unknowns(bounded) if u.name == "clock_x"]
    assert (clock.lower, clock.upper) == pytest.approx((-0.01, 0.01))


def test_a_clock_that_is_held_is_no_unknown() -> None:
    held = stack_of((Problem(plant(), recorded(-4e-3), fixed=("clock_x",)),))
    assert "clock_x" not in {u.name for u in unknowns(held)}


def test_variable_delay_is_the_fixed_one_where_it_stands_still() -> None:
    y = np.sin(0.07 * np.arange(4 * 60 + 1)) + 0.2
    for late in (0.0, 0.4, 3.7, 5.0):
        value, slope = warped_within(y, np.full(61, late), 4)
        wanted = delayed_within(y, late, 4)
        np.testing.assert_allclose(value, wanted[0], atol=1e-13)
        np.testing.assert_allclose(slope[:-1], wanted[1][:-1], atol=1e-12)


def test_files_keep_a_clock_and_exports_refuse_it() -> None:
    again = from_json(to_json(plant()))
    assert again["x"] == plant()["x"]
    with pytest.raises(UnusableInput, match="x has a clock of its own"):
        program(plant())
    lost = plant(None).with_element("x", clock="nowhere")
    assert any("nowhere" in line for line in lost.check())


def test_clocks_reach_over_the_edges_of_windows_and_are_refused_on_them() -> None:
    """Beyond its end a window knows nothing; what it would read there was scored."""
    t = DT * np.arange(600)
    columns = {"F[N]": force(t), "x[m]": np.sin(20 * t), "rate[m/s]": np.cos(20 * t)}
    record = Recording.from_arrays("r", columns, fs=1 / DT)
    declared = Study(plant(), record, window=200)
    beside = Study(plant(None), record, window=200, nuisances=Nuisances(clock=2e-4))
    for study, words in ((declared, "clock_x"), (beside, "a clock of each sensor")):
        with pytest.raises(
            UnusableInput, match=rf"^window = 200: {words}.* reaches over the edges"
        ):
            estimate(study)
        with pytest.raises(
            UnusableInput, match=rf"^window = 200: {words}.* reaches over the edges"
        ):
            diagnose(study)


def test_a_diagnosis_of_windows_tries_no_clock() -> None:
    data = recorded(0.0)
    for cuts, found in (((), ["F", "x", "rate"]), ((700,), [])):
        cut = replace(data, breaks=cuts, cuts=cuts)
        scene = FittedModel(plant(None), cut, cast(Any, None), np.zeros((N, 2)), {})
        assert [e.name for e in ClockSkewEffect().places_in(scene)] == found


@pytest.mark.parametrize("method", sorted(METHODS.keys() - {"single_shooting"}))
def test_methods_without_a_free_run_refuse_a_clock_of_its_own(method: str) -> None:
    t = DT * np.arange(200)
    columns = {"F[N]": force(t), "x[m]": np.sin(20 * t), "rate[m/s]": np.cos(20 * t)}
    study = Study(plant(), Recording.from_arrays("r", columns, fs=1 / DT))
    with pytest.raises(UnusableInput, match=r"x is read by a clock of its own.*single_shooting"):
        estimate(study, method)


def test_a_clock_is_determined_by_a_reading_that_an_input_moves() -> None:
    found = identifiability(plant())
    assert found.exact
    assert found.dead == ()
    assert set(found.determined) == {"m", "k", "b", "clock_x"}
