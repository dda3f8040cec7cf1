"""The fit on spectral lines: exact against the simulator, equal to the free run, honest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuators.models.catalogue import stack_with_payload
from actuators.models.textbook import mass_with_viscous_friction, resonator, thermal_lag
from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Polynomial
from bondgraph.laws.stop_sum import StopSum
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation import (
    NO_NUISANCES,
    Estimation,
    Normal,
    Nuisances,
    Study,
    Vary,
    estimate,
)
from identification.estimation.methods.line_response import line_evaluation
from identification.estimation.methods.periodic_lines import Lines, lines_of
from identification.estimation.methods.steady_response import settled_course, steady_evaluation
from identification.experiments.design import multisine
from identification.study.residual import Point, slots
from tests.settled import simulate
from tests.spring import spring


def recorded(
    graph: BondGraph,
    rate: float,
    period: int,
    periods: int,
    band: tuple[float, float],
    *,
    lead: int = 2,
    noise: float = 0.01,
    peak: float = 1.0,
    hold: str = "linear",
    seed: int = 0,
) -> Recording:
    """Multisine answers; `lead` periods are run before the record begins."""
    source = "V_in" if "V_in" in graph.elements else ("F" if "F" in graph.elements else "u")
    signal = multisine(rate, period, periods=lead + periods, peak=peak, band=band, seed=seed)
    time = np.arange((lead + periods) * period) / rate
    made = simulate(graph, time, {source: signal.values}, hold=hold, accuracy=1e-8).outputs
    rng = np.random.default_rng(1000 + seed)
    channels = {source: np.asarray(signal.values)} | {
        n: v + noise * v.std() * rng.standard_normal(v.size) for n, v in made.items()
    }
    kept = slice(lead * period, None)
    return Recording(
        f"record {seed}", time[: periods * period], {n: v[kept] for n, v in channels.items()},
        {n: getattr(graph[n], "unit", "") or "1" for n in channels},
    )  # fmt: skip


def whole(record: Recording) -> Split:
    return Split(slice(0, record.n), slice(0, 0), "all of it")


def study_of(graph: BondGraph, record: Recording, **options: object) -> Study:
    return Study(graph, record, splits=whole(record), **options)  # type: ignore[arg-type]


def agree(a: Estimation, b: Estimation) -> None:
    """Fail unless the parameters lie within one another's intervals of like width."""
    for one in a.estimates:
        other = b.estimate_of(one.name)
        widths = [e.ci95[1] - e.ci95[0] for e in (one, other)]
        assert abs(one.value - other.value) < 0.5 * max(widths), one.name
        assert 0.6 < widths[0] / widths[1] < 1.6, one.name


def misfit(graph: BondGraph, record: Recording, hold: str) -> tuple[Lines, Array]:
    study = study_of(graph, record, hold=hold, nuisances=NO_NUISANCES)
    problem = study.problem(0, study.first_setting)
    lines = lines_of(problem)
    flat = replace(
        lines, variance=np.abs(lines.y[0]) ** 2 + 1e-2 * np.abs(lines.y[0]).max(axis=0) ** 2
    )
    theta = np.zeros(slots(problem).size)
    found = line_evaluation(problem, flat, Point(theta, problem.rest_state[None]))
    return lines, found.residual


@pytest.mark.parametrize(
    ("hold", "close"), [("linear", 1e-6), ("hold", 1e-6), ("band-limited", 1e-3)]
)
def test_response_is_that_of_the_simulator(hold: str, close: float) -> None:
    """At the truth nothing is left, direct feedthrough and the mean included."""
    for graph, rate, band, peak in (
        (resonator(damping=2e-3), 1000.0, (2.0, 200.0), 1.0),
        (stack_with_payload(), 80000.0, (80.0, 12000.0), 100.0),
    ):
        record = recorded(graph, rate, 500, 4, band, lead=4, noise=0.0, hold=hold, peak=peak)
        lines, residual = misfit(graph, record, hold)
        assert lines.omega[0] == 0.0
        assert not lines.transient
        assert np.abs(residual).max() < close


@pytest.mark.parametrize("hold", ["linear", "hold", "band-limited"])
@pytest.mark.parametrize("periods", [2, 4])
def test_jacobian_is_exact(hold: str, periods: int) -> None:
    """Against differences, by parameters, lag, dead time, offset and initial state."""
    with BondGraph("late") as g:
        body = One("body")
        Se("u", unit="V") >> body >> I("m", 4e-6, unit="V*s2/V")
        body >> R("d", 1e-3, unit="V*s/V")
        body >> C("k", stiffness=0.8, unit="V/V")
        body >> Dq("y", unit="V", delay="T_y")
    g = g.with_parameters([Parameter("T_y", 1e-3, "s", positive=True, lower=0.0)])
    record = recorded(g, 1000.0, 250, periods, (4.0, 200.0), lead=0, noise=0.02)
    study = study_of(g, record, hold=hold, nuisances=Nuisances(offsets=False))
    problem = study.problem(0, study.first_setting)
    lines = lines_of(problem)
    if not lines.transient:
        problem = replace(problem, initial=())
    assert lines.transient == (periods == 2)
    rng = np.random.default_rng(0)
    theta = rng.uniform(-0.1, 0.1, slots(problem).size)
    state = problem.rest_state[None] + problem.state_scale * np.array([[0.7, -0.4]])
    found = line_evaluation(problem, lines, Point(theta, state))
    steps = 1e-6
    for j in range(theta.size):
        ends = [
            line_evaluation(
                problem, lines, Point(theta + s * steps * np.eye(theta.size)[j], state),
                derivatives=False,
            ).residual
            for s in (1, -1)
        ]  # fmt: skip
        slope = -(ends[0] - ends[1]) / (2 * steps)
        assert np.allclose(found.jacobian[:, j], slope, atol=1e-6 * (1 + np.abs(slope).max())), j
    local = found.local[0][1]
    for k in range(local.shape[1]):
        h = 1e-4 * problem.state_scale[k]
        ends = [
            line_evaluation(
                problem, lines, Point(theta, state + s * h * np.eye(2)[k]), derivatives=False
            ).residual
            for s in (1, -1)
        ]
        slope = -(ends[0] - ends[1]) / (2 * h)
        assert np.allclose(local[:, k], slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("hold", ["linear", "hold", "band-limited"])
@pytest.mark.sampled(every=3)
def test_agrees_with_single_shooting(hold: str) -> None:
    """Same values and intervals from other start values, lag and offset included."""
    record = recorded(resonator(), 1000.0, 300, 6, (4.0, 200.0), hold=hold)
    late = replace(record, channels={**record.channels, "y": record["y"] + 0.05})
    far = resonator(mass=3e-6, damping=4e-4, stiffness=1.0)
    study = study_of(far, late, hold=hold)
    lines, free = estimate(study, "frequency_domain"), estimate(study)
    agree(lines, free)
    assert lines.rmse()["y"] == pytest.approx(free.rmse()["y"], rel=2e-3)
    offset, other = lines.estimate_of("offset y"), free.estimate_of("offset y")
    assert offset.value == pytest.approx(other.value, abs=1e-4)
    assert np.ptp(offset.ci95) == pytest.approx(np.ptp(other.ci95), rel=0.3)
    assert lines.cost == pytest.approx(1.0, abs=0.3)


def test_several_readings_records_and_rates() -> None:
    """A current that answers at once and a displacement, 1e11 apart; two rates, integrals too."""
    graph = stack_with_payload()
    records = [
        recorded(graph, 40000.0, 1000, 4, (40.0, 12000.0), peak=100.0),
        recorded(graph, 80000.0, 1500, 5, (60.0, 12000.0), peak=50.0, seed=1),
    ]
    splits = [whole(r) for r in records]
    free = ("T", "R_e", Vary("C_nl", start=8e-10), "k", "m", "R_nl")
    study = Study(graph, records, free, splits=splits)
    lines = estimate(study, "frequency_domain")
    agree(lines, estimate(study))
    for e in lines.estimates:
        assert abs(e.value - graph.parameters[e.name].value) < 4 / 3.92 * np.ptp(e.ci95)
    moving = mass_with_viscous_friction()
    record = recorded(moving, 100.0, 500, 4, (0.2, 20.0), peak=300.0)
    study = study_of(moving.with_values({"M": 30.0, "F_v": 500.0}), record)
    found = estimate(study, "frequency_domain")
    agree(found, estimate(study))


def test_transient_of_two_periods_from_rest() -> None:
    """A ringing resonator that starts at rest: nothing has settled, and nothing is biased."""
    graph = resonator(damping=2e-5)
    record = recorded(graph, 1000.0, 500, 2, (2.0, 200.0), lead=0)
    study = study_of(graph.with_values({"m": 3e-6, "d": 4e-5}), record)
    lines = estimate(study, "frequency_domain")
    assert any("transient" in n for n in lines.notes)
    agree(lines, estimate(study))


def test_prior_bounds_and_dead_time() -> None:
    """Priors pull, bounds hold, a declared dead time is found."""
    with BondGraph("late") as g:
        body = One("body")
        Se("u", unit="V") >> body >> I("m", 4e-6, unit="V*s2/V")
        body >> R("d", 1e-3, unit="V*s/V")
        body >> C("k", stiffness=0.8, unit="V/V")
        body >> Dq("y", unit="V", delay="T_y")
    g = g.with_parameters([Parameter("T_y", 2.7e-3, "s", positive=True, lower=0.0)])
    record = recorded(g, 1000.0, 500, 4, (2.0, 100.0))
    study = study_of(g, record, free=("m", "d", "k", Vary("T_y", start=2e-3)))
    found = estimate(study, "frequency_domain")
    late = found.estimate_of("T_y")
    assert late.ci95[0] - 2e-5 < 2.7e-3 < late.ci95[1] + 2e-5
    tight = (Vary("m", start=6e-6, lower=5.5e-6), Vary("k", prior=Normal(1.0, 1e-6)), "d")
    held = estimate(study_of(g, record, free=tight), "frequency_domain")
    assert held.estimate_of("m").at_bound
    assert held.values["k"] == pytest.approx(1.0, rel=1e-4)


@pytest.mark.long
def test_intervals_cover_the_truth() -> None:
    """Fifty records with noise of their own: about 95 in 100 intervals hold the truth."""
    graph = resonator(damping=1e-3)
    clean = recorded(graph, 1000.0, 250, 5, (4.0, 250.0), noise=0.0)
    inside = total = 0
    for seed in range(50):
        rng = np.random.default_rng(seed)
        noise = 0.05 * clean["y"].std() * rng.standard_normal(clean.n)
        # coloured: the method must find how much noise each line has
        coloured = np.convolve(noise, [1.0, 0.8], mode="same")
        record = replace(clean, channels={"u": clean["u"], "y": clean["y"] + coloured})
        study = study_of(graph, record, nuisances=Nuisances(lags=False))
        for e in estimate(study, "frequency_domain").estimates:
            total += 1
            inside += e.ci95[0] <= graph.parameters[e.name].value <= e.ci95[1]
    assert total == 150
    assert 0.88 <= inside / total <= 0.99


def test_refusals_name_another_way() -> None:
    """One line each: laws, clocks, records that do not repeat."""
    record = recorded(resonator(), 1000.0, 250, 4, (4.0, 200.0))
    short = recorded(worn(), 1000.0, 250, 2, (4.0, 200.0))
    with pytest.raises(UnusableInput, match=r"not linear needs two settled.*single_shooting"):
        estimate(study_of(worn(), short), "frequency_domain")
    five = recorded(resonator(damping=0.1), 1000.0, 250, 5, (4.0, 200.0), lead=0)
    with pytest.raises(UnusableInput, match=r"3 periods train .* still decay.* more, or .*splits"):
        estimate(Study(worn(), five), "frequency_domain")  # a third of them is held out
    clocks = study_of(resonator(), record, nuisances=Nuisances(clock=1e-4))
    with pytest.raises(UnusableInput, match="clock"):
        estimate(clocks, "frequency_domain")
    rng = np.random.default_rng(0)
    wild = replace(record, channels={**record.channels, "u": rng.standard_normal(record.n)})
    with pytest.raises(UnusableInput, match=r"frequency_domain.*single_shooting"):
        estimate(study_of(resonator(), wild), "frequency_domain")
    still = replace(record, channels={**record.channels, "u": np.zeros(record.n)})
    with pytest.raises(UnusableInput, match=r"no command .* moves"):
        estimate(study_of(resonator(), still), "frequency_domain")


def test_two_periods_after_a_run_in_that_is_over_are_enough() -> None:
    """Three of five train: the first runs in, the others repeat but for their noise."""
    law = Polynomial(orders=(3,), size=1.0)
    graph = spring(law=law).with_values({"a_3_k": 1e4})
    record = recorded(graph, 200.0, 400, 5, (0.5, 15.0), lead=0)
    study = Study(graph, record, nuisances=Nuisances(lags=False))
    made = estimate(study, "frequency_domain")
    assert any("2 periods of 400 samples, 1 left out as run-in" in n for n in made.notes)
    agree(made, estimate(study))


def worn() -> BondGraph:
    """Resonator whose spring has memory."""
    with BondGraph("worn") as g:
        body = One("body")
        Se("u", unit="V") >> body >> I("m", 4e-6, unit="V*s2/V")
        body >> R("d", 1e-3, unit="V*s/V")
        law = StopSum((0.05, 0.2), height=0.4, scale=0.4, unit="V/V")
        body >> C("k", stiffness=0.8, unit="V/V", law=law)
        body >> Dq("y", unit="V")
    return g


def test_memory_runs_to_its_closed_course() -> None:
    """A hysteretic spring: values and intervals of the free run, from the settled period alone."""
    record = recorded(worn(), 1000.0, 300, 6, (4.0, 150.0))
    far = worn().with_values({"m": 5e-6, "k": 1.0, "h_1_k": 0.7, "h_2_k": 0.1})
    study = study_of(far, record)
    lines = estimate(study, "frequency_domain")
    truth = worn().parameters
    for e in lines.estimates:
        assert abs(e.value - truth[e.name].value) < 4 / 3.92 * np.ptp(e.ci95), e.name
    free = estimate(study)
    for e in lines.estimates:
        # the free run begins with a memory it does not know, which widens its intervals
        other = free.estimate_of(e.name)
        assert np.ptp(e.ci95) < 1.2 * np.ptp(other.ci95), e.name


def assert_exact_jacobian(study: Study, h: float) -> None:
    """The derivative of the settled course of one recording, against differences of step `h`."""
    problem = replace(study.problem(0, study.first_setting), initial=())
    lines = lines_of(problem)
    theta = np.random.default_rng(0).uniform(-0.1, 0.1, slots(problem).size)
    start = Point(theta, problem.rest_state[None])
    course = settled_course(problem, lines, start)
    found = steady_evaluation(problem, lines, course, start)
    for j in range(theta.size):
        ends = [
            steady_evaluation(
                problem, lines, course, replace(start, theta=theta + s * np.eye(theta.size)[j]),
                derivatives=False,
            ).residual
            for s in (h, -h)
        ]  # fmt: skip
        slope = -(ends[0] - ends[1]) / (2 * h)
        assert np.allclose(found.jacobian[:, j], slope, atol=1e-4 * (1 + np.abs(slope).max())), j


def test_jacobian_of_the_closed_course_is_exact() -> None:
    """Against differences, memory and lag included."""
    assert_exact_jacobian(study_of(worn(), recorded(worn(), 1000.0, 300, 4, (4.0, 150.0))), 1e-6)


def test_says_when_the_model_lacks_something() -> None:
    """A lag of first order on a resonator: intervals are widened, and a note says so."""
    record = recorded(resonator(damping=1e-3), 1000.0, 500, 4, (2.0, 200.0))
    lag = thermal_lag()
    found = estimate(study_of(lag, record), "frequency_domain")
    assert any("times the noise between periods" in n for n in found.notes)
    assert found.cost > 10.0
