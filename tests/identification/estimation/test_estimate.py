"""Fits find the truth within their intervals: many records, nuisances, noise, holds, sub-steps."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording, Split
from identification.estimation import (
    NO_NUISANCES,
    Estimation,
    FitStatus,
    Nuisances,
    Study,
    Vary,
    estimate,
    holds,
)
from identification.estimation.estimates import estimates_of
from identification.estimation.settling import carried_setting
from tests.identification.estimation.plants import (
    FREE,
    NOISE,
    TRUTH,
    force,
    misses,
    moved,
    record,
    spring,
    study,
)
from tests.settled import simulate

FAR = 3.3
"""Standard errors that one of some dozen estimates may miss the truth by."""


@pytest.fixture(scope="module")
def plain() -> Estimation:
    return estimate(study(record(offset=3e-3, lag=0.1)))


def test_one_record_gives_the_truth_within_its_intervals(plain: Estimation) -> None:
    assert plain.status is FitStatus.CONVERGED
    assert max(misses(plain, TRUTH).values()) < FAR
    assert abs(plain.values["k"] - 200.0) < 1.0
    assert plain.cost == pytest.approx(1.0, abs=0.02)
    assert plain.rmse("test")["x"] == pytest.approx(NOISE, rel=0.08)
    nuisances = {"offset x": 3e-3, "delay x": 0.1 * 0.01}
    assert max(misses(plain, nuisances).values()) < FAR
    assert plain.estimate_of("offset x").unit == "m"
    assert plain.setting.floors[0] == pytest.approx(NOISE, rel=0.08)


def test_a_print_says_where_held_out_errors_are_far_above_the_noise(plain: Estimation) -> None:
    y, held = plain.simulated[0].copy(), plain.problem().data.mask("test")
    y[held] += 400.0 * plain.floors[0]
    far = replace(plain, simulated=(y,))
    (said,) = (line for line in str(far).splitlines() if "far above the noise" in line)
    assert "the error of x of run is 400 times" in said
    assert "far above the noise" not in str(plain)


def test_a_drawing_measures_what_is_left_by_the_noise_that_is_stated() -> None:
    """Its own rms would make the residual of a model that fails look like noise."""
    made = record(400, graph=spring(k=260.0))
    wrong = {"free": ("m",), "fixed": {"k": 200.0, "d": 2.0}}
    told = Recording("run", made.time, made.channels, made.units, meta={"noise": {"x": NOISE}})
    for given, recording, word in (
        ({}, made, "the noise fitted (its rms)"),
        ({}, told, "the noise declared"),
        ({"noise": {"x": NOISE}}, made, "the noise given"),
    ):
        found = estimate(Study(spring(m=0.7), recording, **wrong, **given))  # type: ignore[arg-type]
        ((_, right),) = found.plot()
        assert right.get_ylabel() == f"left over,\ntimes {word}"
        size = np.sqrt(np.mean(np.square(right.lines[0].get_ydata())))
        assert bool(size > 10.0) == (word != "the noise fitted (its rms)"), size


@pytest.mark.parametrize("given", [{}, {"held": True}, {"offsets": False}, {"start": 0.0}])
def test_an_offset_that_is_the_initial_position_is_told(given: dict[str, Any]) -> None:
    """Nothing holds a free mass, so that its position at the start is the offset of its reading."""

    def mass() -> BondGraph:
        with BondGraph("mass") as g:
            body = One("body")
            Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
            body >> R("d", 2.0, unit="N*s/m")
            if "held" in given:
                body >> C("k", stiffness=200.0, unit="N/m")
            body >> Dq("x", unit="m")
        return g

    rng, t = np.random.default_rng(0), 0.01 * np.arange(300)
    u = np.repeat(rng.standard_normal(30), 10)
    x = np.asarray(simulate(mass(), t, {"F": u}, hold="hold")["x"])
    x = x + 1e-4 * rng.standard_normal(t.size)
    made = Recording.from_arrays("run", {"F[N]": u, "x[m]": x}, fs=100.0)
    nuisances = Nuisances(offsets=given.get("offsets", True))
    initial: Any = {"q_x": given["start"]} if "start" in given else "free"
    found = estimate(Study(mass(), made, hold="hold", nuisances=nuisances, initial=initial))
    told = [n for n in found.notes if n.startswith("the offset of x and the initial q_x shift x")]
    assert len(told) == (not given)


def test_interval_is_as_wide_as_the_estimates_scatter() -> None:
    scores = []
    for seed in range(20):
        found = estimate(study(record(400, seed=seed)))
        scores += [
            (found.values[n] - t) / np.diff(found.estimate_of(n).ci95)[0] * 2 * 1.96
            for n, t in TRUTH.items()
        ]
    assert 0.75 < np.std(scores) < 1.35
    assert np.mean(np.abs(scores) < 1.96) > 0.86


def test_records_of_other_lengths_rates_and_channels_join() -> None:
    slow, fast = record(900, 80.0, 1, name="slow"), record(2000, 250.0, 2, name="fast")
    t, u = np.asarray(fast.time), np.asarray(fast["F"])
    w = np.asarray(simulate(spring(speed=True), t, {"F": u})["w"])
    w = w + 1e-3 * np.random.default_rng(1).standard_normal(w.size)
    both = Recording.from_arrays("fast", {"F[N]": u, "x[m]": fast["x"], "w[m/s]": w}, fs=250.0)
    made = Study(spring(m=0.7, speed=True), [slow, both], free=FREE)
    found = estimate(made)
    alone = [estimate(Study(spring(m=0.7, speed=True), r, free=FREE)) for r in (slow, both)]
    assert max(misses(found, TRUTH).values()) < FAR
    assert found.sensors(0) == ("x",)
    assert found.sensors(1) == ("x", "w")
    assert [y.shape for y in found.simulated] == [(900, 1), (2000, 2)]
    assert found.setting.floors[1] == pytest.approx([NOISE, 1e-3], rel=0.1)
    for n in TRUTH:
        width = np.diff(found.estimate_of(n).ci95)[0]
        assert width < min(np.diff(a.estimate_of(n).ci95)[0] for a in alone)
    labels = {e.name for e in found.nuisances}
    assert {"offset x @slow", "offset x @fast", "delay w @fast"} <= labels


def test_a_parameter_of_its_own_takes_a_value_in_each_record() -> None:
    two = [record(seed=1, name="a"), record(seed=2, name="b", graph=spring(k=260.0))]
    found = estimate(study(*two, free=("m", "d", Vary("k", own=True))))
    assert max(misses(found, {"k @a": 200.0, "k @b": 260.0, "m": 0.5, "d": 2.0}).values()) < FAR
    assert found.values_of(1)["k"] == pytest.approx(260.0, rel=5e-3)
    assert found.values["k"] == pytest.approx(200.0, rel=5e-3)
    wrong = estimate(study(*two))
    # each record has a noise of its own, so one of them is fitted and the other given up
    assert max(wrong.rmse(record=r)["x"] for r in (0, 1)) > 10 * NOISE
    assert max(found.rmse(record=r)["x"] for r in (0, 1)) < 1.1 * NOISE


def test_silent_source_is_zero() -> None:
    """A record that only rings down, beside a driven one."""
    t = np.arange(600) * 0.01
    x = np.asarray(simulate(spring(), t, {"F": np.zeros(600)}, x0={"q_k": 0.05, "p_m": 0.0})["x"])
    x = x + NOISE * np.random.default_rng(2).standard_normal(600)
    ring = Recording.from_arrays("ring", {"x[m]": x}, fs=100.0)
    found = estimate(study(record(600), ring, silent=("F",)))
    assert max(misses(found, TRUTH).values()) < FAR
    # a mass is not seen without a force: alone it only gives ratios, and the intervals say so
    alone = estimate(study(ring, silent=("F",)))
    low, high = alone.estimate_of("k").ci95
    assert high > 20 * low
    ratio = alone.values["k"] / alone.values["m"]
    assert ratio == pytest.approx(400.0, rel=2e-3)


# -- initial states ---------------------------------------------------------------------------
def test_initial_state_rest_known_or_free() -> None:
    t, u = np.arange(700) * 0.01, force(700, 100.0, 4)
    start = {"q_k": 0.03, "p_m": 0.2}
    x = np.asarray(simulate(spring(), t, {"F": u}, x0=start)["x"])
    x = x + NOISE * np.random.default_rng(9).standard_normal(700)
    thrown = Recording.from_arrays("thrown", {"F[N]": u, "x[m]": x}, fs=100.0)
    quiet = Nuisances(offsets=False)
    for initial in ("free", start, {"q_k": 0.03}):
        found = estimate(study(thrown, initial=initial, nuisances=quiet))
        assert max(misses(found, TRUTH).values()) < FAR, initial
        assert found.cost == pytest.approx(1.0, abs=0.05)
    wrong = estimate(study(thrown, initial="rest", nuisances=quiet))
    assert wrong.rmse()["x"] > 5 * NOISE
    at_rest = estimate(study(record(700), initial="rest"))
    assert max(misses(at_rest, TRUTH).values()) < FAR


def test_known_state_makes_the_interval_narrower() -> None:
    made = record(120)
    rest = simulate(spring(), np.asarray(made.time), {"F": np.asarray(made["F"])})
    known = {"q_k": float(np.asarray(made["F"])[0] / 200.0), "p_m": 0.0}
    assert float(np.asarray(rest["x"])[0]) == pytest.approx(known["q_k"])
    said = {"noise": {"x": NOISE}, "nuisances": Nuisances(offsets=False)}
    free = estimate(study(made, **said)).estimate_of("k").ci95
    held = estimate(study(made, initial=known, **said)).estimate_of("k").ci95
    assert np.diff(held)[0] < np.diff(free)[0]


# -- nuisances --------------------------------------------------------------------------------
def test_command_offset_is_found_where_sensors_have_none() -> None:
    u = force(1200, 100.0, 6)
    x = moved(u + 0.7, 100.0) + NOISE * np.random.default_rng(1).standard_normal(1200)
    pushed = Recording.from_arrays("pushed", {"F[N]": u, "x[m]": x}, fs=100.0)
    found = estimate(study(pushed, nuisances=Nuisances(offsets=False, commands=True)))
    assert max(misses(found, {**TRUTH, "offset_F": 0.7}).values()) < FAR
    assert "offset_F" in {e.name for e in found.nuisances}
    assert "offset_F" not in found.values


def test_command_offsets_of_records_with_other_commands() -> None:
    """One command rests; the other record still has an offset, within its own bounds."""
    t, u = np.arange(900) * 0.01, force(900, 100.0, 6)
    ring = np.asarray(
        simulate(spring(), t, {"F": np.zeros(900)}, x0={"q_k": 0.05, "p_m": 0.0})["x"]
    )
    rng = np.random.default_rng(1)
    still = {"F[N]": np.zeros(900), "x[m]": ring + NOISE * rng.standard_normal(900)}
    pushed = {"F[N]": u, "x[m]": moved(u + 0.7, 100.0) + NOISE * rng.standard_normal(900)}
    two = [Recording.from_arrays(n, c, fs=100.0) for n, c in (("a", still), ("b", pushed))]
    found = estimate(study(*two, nuisances=Nuisances(offsets=False, commands=True)))
    assert found.values["k"] == pytest.approx(200.0, rel=5e-3)
    (e,) = [e for e in found.nuisances if e.name.startswith("offset_F")]
    assert e.value == pytest.approx(0.7, abs=0.02)


def test_clock_that_runs_fifty_millionths_fast_is_found() -> None:
    n, fs, fast = 30_000, 100.0, 50e-6
    u = force(n + 20, fs, 3)
    dense = CubicSpline(np.arange(n + 20), moved(u, fs))
    x = dense(np.arange(n) * (1 + fast)) + NOISE * np.random.default_rng(1).standard_normal(n)
    made = Recording.from_arrays("long", {"F[N]": u[:n], "x[m]": x}, fs=fs)
    found = estimate(study(made, nuisances=Nuisances(clock=2e-4)))
    clock = found.estimate_of("clock x")
    assert misses(found, {"clock x": fast})["clock x"] < FAR
    assert np.diff(clock.ci95)[0] < 4e-6
    assert max(misses(found, TRUTH).values()) < FAR
    deaf = estimate(study(made))
    assert deaf.rmse("test")["x"] > 1.2 * found.rmse("test")["x"]


def test_nuisances_that_are_off_are_known() -> None:
    """They widen no interval, and are not in the table."""
    made = record(800)
    on, off = estimate(study(made)), estimate(study(made, nuisances=NO_NUISANCES))
    assert off.nuisances == ()
    for n in TRUTH:
        assert np.diff(off.estimate_of(n).ci95)[0] < np.diff(on.estimate_of(n).ci95)[0] * 1.001
    at = [i for i, n in enumerate(off.stack.names) if n in ("offset x", "delay x")]
    assert not off.covariance[at].any()


@pytest.mark.parametrize("hold", ["linear", "hold", "band-limited"])
def test_behaviour_between_samples_is_found(hold: str) -> None:
    quick = spring(k=900.0)  # seven samples a period
    u = np.random.default_rng(4).standard_normal(800)
    x = moved(u, 30.0, quick, hold) + 1e-5 * np.random.default_rng(5).standard_normal(800)
    made = Recording.from_arrays("coarse", {"F[N]": u, "x[m]": x}, fs=30.0)
    asked = Study(quick, made, hold="estimate", nuisances=NO_NUISANCES)
    found = estimate(asked)
    assert found.setting.hold == hold
    assert any("between samples" in n for n in found.notes)
    truth = {**TRUTH, "k": 900.0}
    assert max(misses(found, truth).values()) < FAR


def test_another_behaviour_is_tried_where_a_fit_ran_out_of_iterations() -> None:
    """A wrong one may be why it did not converge."""
    quick = spring(k=900.0)
    u = np.random.default_rng(4).standard_normal(800)
    x = moved(u, 30.0, quick, "hold") + 1e-5 * np.random.default_rng(5).standard_normal(800)
    made = Recording.from_arrays("coarse", {"F[N]": u, "x[m]": x}, fs=30.0)
    asked = Study(quick, made, hold="estimate", nuisances=NO_NUISANCES)
    assert estimate(asked.changed(hold="linear"), max_iterations=3).status is FitStatus.ITERATIONS
    assert estimate(asked, max_iterations=3).setting.hold == "hold"


@pytest.mark.parametrize("seed", [6, 7, 8, 9])
@pytest.mark.parametrize("hold", ["linear", "hold"])
def test_of_holds_that_fit_equally_well_that_without_a_delay_is_taken(hold: str, seed: int) -> None:
    """A held command looks half a sample late to one that is linear; a lag may be a quarter."""
    found = estimate(study(record(600, hold=hold, noise=3e-3, seed=seed)))
    assert found.setting.hold == hold
    if (hold, seed) == ("hold", 6):
        assert any("as linear ones they fit no better, and need" in n for n in found.notes)
    assert not found.estimate_of("delay x").at_bound


def test_steps_of_a_converter_are_held_where_nothing_else_tells() -> None:
    """Without lags no delay is asked for, and both behaviours fit."""
    u = np.repeat(np.random.default_rng(3).uniform(-4, 4, 20), 30)
    x = moved(u, 100.0, hold="hold") + 0.02 * np.random.default_rng(4).standard_normal(u.size)
    made = Recording.from_arrays("steps", {"F[N]": u, "x[m]": x}, fs=100.0)
    found = estimate(study(made, nuisances=NO_NUISANCES))
    assert found.setting.hold == "hold"
    linear = estimate(study(made, nuisances=NO_NUISANCES, hold="linear"))
    assert linear.cost < 1.02 * found.cost


def test_what_another_behaviour_that_fits_as_well_would_change_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(holds, "CLEARLY", 0.7)
    u = np.repeat(np.random.default_rng(3).uniform(-4, 4, 400), 10)
    x = moved(u, 100.0) + 5e-3 * np.random.default_rng(4).standard_normal(u.size)
    made = Recording.from_arrays("steps", {"F[N]": u, "x[m]": x}, fs=100.0)
    found = estimate(study(made, nuisances=NO_NUISANCES))
    (said,) = (n for n in found.notes if "between samples" in n)
    assert said.startswith("the commands are taken as held constant between samples; as linear one")
    assert said.endswith(", beyond the 95 % interval")


# -- windows, validation, sub-steps -----------------------------------------------------------
def test_windows_with_states_of_their_own() -> None:
    made = record(1200)
    found = estimate(study(made, window=100))
    for n, t in TRUTH.items():
        assert found.values[n] == pytest.approx(t, rel=0.02)
    assert found.cost == pytest.approx(1.0, abs=0.1)
    assert np.isfinite(found.residuals("test")).all()


def test_validation_records_are_judged_and_never_fitted() -> None:
    fresh = record(600, 200.0, 8, name="fresh")
    with_it = estimate(study(record(), validation=fresh))
    without = estimate(study(record()))
    assert with_it.values == without.values
    assert with_it.rmse("test", 1)["x"] == pytest.approx(NOISE, rel=0.15)
    assert np.isnan(with_it.rmse("train", 1)["x"])
    assert with_it.record_names == ("run", "fresh")
    assert np.allclose(with_it.predict(fresh), with_it.simulated[1], atol=1e-2 * NOISE)


def test_first_samples_of_a_validation_record_give_its_state() -> None:
    t, u = np.arange(600) * 0.01, force(600, 100.0, 11)
    x = np.asarray(simulate(spring(), t, {"F": u}, x0={"q_k": 0.06, "p_m": -0.3})["x"])
    thrown = Recording.from_arrays("thrown", {"F[N]": u, "x[m]": x}, fs=100.0)
    cold = estimate(study(record(), validation=thrown))
    warm = estimate(study(record(), validation=thrown, init=60))
    assert warm.residuals("test", 1).shape == (540, 1)
    assert warm.rmse("test", 1)["x"] < 1e-4 < 1e-3 < cold.rmse("test", 1)["x"]


def hardening() -> BondGraph:
    return spring(law=Polynomial(orders=(3,)), name="hardening")


def test_correction_of_few_substeps_ends_where_many_would() -> None:
    cubic = next(n for n in hardening().parameters if n not in ("m", "d", "k"))
    truth = {**TRUTH, cubic: 4e4}
    graph = hardening().with_values({cubic: 4e4})
    t, u = np.arange(900) * 0.03, force(900, 1 / 0.03, 2) * 2
    exact = simulate(graph, t, {"F": u}, accuracy=1e-9)
    x = np.asarray(exact["x"]) + 3e-5 * np.random.default_rng(3).standard_normal(900)
    made = Recording.from_arrays("coarse", {"F[N]": u, "x[m]": x}, fs=1 / 0.03)
    many = estimate(Study(graph, made, n_sub=64))
    few = estimate(Study(graph, made))
    blunt = estimate(Study(graph, made, n_sub=1))
    assert max(misses(many, truth).values()) < FAR
    for n in truth:
        width = np.diff(many.estimate_of(n).ci95)[0] / (2 * 1.96)
        assert abs(few.values[n] - many.values[n]) < 0.3 * width, n
    assert max(misses(blunt, truth).values()) > 2 * FAR
    assert few.setting.n_sub[0] < 64


# -- Ctrl-C, travel, words --------------------------------------------------------------------
@pytest.mark.parametrize("method", ["single_shooting", "multiple_shooting"])
@pytest.mark.parametrize("at", [1, 3])
def test_interrupt_keeps_the_best_so_far(method: str, at: int) -> None:
    seen: list[str] = []

    def stop(text: str, fraction: float) -> None:
        seen.append(text)
        if len(seen) == at:
            raise KeyboardInterrupt

    made = study(record(600))
    found = estimate(made, method, progress=stop)
    assert found.status is FitStatus.CANCELLED
    assert "cancelled" in str(found)
    assert found.trace[-1] < found.trace[0] or at == 1
    off = abs(np.log(found.values["k"] / 200.0))
    assert off < abs(np.log(300.0 / 200.0))


def test_progress_rises_to_the_end() -> None:
    heard: list[tuple[str, float]] = []
    estimate(study(record(300)), progress=lambda text, share: heard.append((text, share)))
    assert heard[-1] == ("done", 1.0)
    assert all(0.0 <= s <= 1.0 for _, s in heard)
    assert all("cost" in text for text, _ in heard[:-1])


def test_fit_goes_on_where_another_ended(plain: Estimation) -> None:
    again = estimate(plain.study, start=plain)
    assert len(again.trace) < len(plain.trace)
    for n, v in plain.values.items():
        assert again.values[n] == pytest.approx(v, rel=1e-6)


def test_what_another_study_says_holds_where_the_fit_goes_on(plain: Estimation) -> None:
    made = plain.study.changed(hold="hold", noise={"x": 0.05}, n_sub=2)
    begun = carried_setting(made, plain.setting, plain.study)
    assert (begun.hold, begun.n_sub, begun.n_fine) == ("hold", (2,), (2,))
    assert begun.floors[0] == pytest.approx([0.05])
    again = estimate(made, start=plain, max_iterations=0)
    assert again.setting.hold == "hold"
    assert again.setting.floors[0] == pytest.approx([0.05])
    # what is to be estimated begins where it ended, but for corrections of other readings
    change = np.ones(plain.simulated[0].shape)
    corrected = replace(plain.setting, corrections=(change,), corrected_at=plain.point.theta)
    same = carried_setting(plain.study, corrected, plain.study)
    assert same.corrections[0] is not None
    assert same.floors[0] == pytest.approx(plain.setting.floors[0])
    other = plain.study.changed(recordings=(record(seed=8),))
    there = carried_setting(other, corrected, plain.study)
    assert (there.corrections, there.corrected_at) == ((None,), None)
    assert there.floors[0] == pytest.approx(plain.setting.floors[0])


def test_estimation_and_study_travel(plain: Estimation) -> None:
    other = pickle.loads(pickle.dumps(plain))
    assert other.values == plain.values
    assert np.array_equal(other.residuals("test"), plain.residuals("test"))
    assert other.status is plain.status
    made = pickle.loads(pickle.dumps(plain.study))
    assert repr(made) == repr(plain.study)
    assert estimate(made).values == pytest.approx(plain.values, rel=1e-9)


def test_words_and_tables(plain: Estimation) -> None:
    text = str(plain)
    assert repr(plain) in text
    for piece in ("single_shooting", "converged", "offset x", "train of run", "test of run"):
        assert piece in text
    table = plain.to_pandas()
    assert list(table.index) == ["m", "d", "k", "delay x", "offset x"]
    assert table.loc["k", "value"] == plain.values["k"]
    assert table.loc["k", "lower95"] < table.loc["k", "value"] < table.loc["k", "upper95"]
    assert set(table["kind"]) == {"parameter", "nuisance"}
    html = replace(plain, notes=("a <note> & more",))._repr_html_()
    assert "a &lt;note&gt; &amp; more" in html
    assert html.count("<tr>") == 6
    with pytest.raises(Exception, match="Did you mean 'offset x'"):
        plain.estimate_of("offset_x")


def test_fitted_graph_carries_the_values(plain: Estimation) -> None:
    assert plain.graph().parameters["k"].value == plain.values["k"]


def test_the_interval_of_a_linear_number_far_from_its_start_holds_it() -> None:
    off = Parameter("off", 0.0, "m", positive=False, scale=1e-6)
    graph = spring().with_parameters([off]).with_element("x", offset="off")
    stack = Study(graph, record(60), ("off",)).stack()
    at, start = stack.names.index("off"), stack.start()
    theta, covariance = start.theta.copy(), np.zeros((stack.n, stack.n))
    theta[at], covariance[at, at] = 1e4, 25.0
    (found,), _ = estimates_of(stack, replace(start, theta=theta), covariance)
    assert found.value == pytest.approx(1e-2)
    assert found.ci95 == pytest.approx((1e-2 - 9.8e-6, 1e-2 + 9.8e-6), rel=1e-9)


def test_a_dead_time_of_each_recording_is_an_estimate_as_a_shared_one_is() -> None:
    tau = Parameter("tau", 0.01, "s", lower=0.0)
    graph = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
    for own, names in ((True, ["tau @a", "tau @b"]), (False, ["tau"])):
        study = Study(graph, [record(60, name="a"), record(60, name="b")], (Vary("tau", own=own),))
        stack = study.stack()
        found, others = estimates_of(stack, stack.start(), np.eye(stack.n))
        assert [e.name for e in found] == names
        assert not any(e.name.startswith("tau") for e in others)


def test_record_in_training_only_has_no_test_error() -> None:
    whole = Split(slice(0, 400), slice(400, 400), "all of it")
    found = estimate(study(record(400), splits=whole))
    assert np.isnan(found.rmse("test")["x"])
    assert np.isnan(found.chi2("test"))
