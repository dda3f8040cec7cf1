"""Effects of drives, sensors and time on a mass, a spring and a damper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.graph.elements import C, I, One, R, Se, Source
from bondgraph.graph.sensors import Df, Dq
from bondgraph.signals.recording import Split
from bondgraph.simulation.lure import exact_form
from identification.diagnosis.catalogue.drive.dead_zone import DeadZoneEffect
from identification.diagnosis.catalogue.drive.low_pass import LowPass
from identification.diagnosis.catalogue.drive.saturation import SaturationEffect
from identification.diagnosis.catalogue.drive.slew_limit import SlewLimitEffect
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.measurement.grid_step import (
    quantisation_step,
)
from identification.diagnosis.catalogue.measurement.periodic_error import (
    PeriodicError,
    promising_cycles,
)
from identification.diagnosis.catalogue.measurement.quantisation import Quantisation
from identification.diagnosis.catalogue.measurement.sensor_drift import SensorDrift
from identification.diagnosis.catalogue.measurement.sensor_gain import SensorGainEffect
from identification.diagnosis.catalogue.measurement.sensor_lag import SensorLag
from identification.diagnosis.catalogue.measurement.sensor_nonlinearity import SensorNonlinearity
from identification.diagnosis.catalogue.measurement.sensor_offset import SensorOffset
from identification.diagnosis.catalogue.measurement.sensor_rectification import SensorRectification
from identification.diagnosis.catalogue.time.clock_skew import ClockSkewEffect
from identification.diagnosis.catalogue.time.delay import Delay
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point
from tests.settled import simulate

N, DT = 600, 1e-3
STEP = 2e-5
EFFECTS: tuple[Effect, ...] = (
    SaturationEffect(), SlewLimitEffect(), LowPass(), DeadZoneEffect(),
    SensorLag(), SensorOffset(), SensorGainEffect(), SensorDrift(), SensorNonlinearity(),
    SensorRectification(), PeriodicError(), Quantisation(), Delay(), ClockSkewEffect(),
)  # fmt: skip
EXACT = {
    "low_pass": 2e-2, "slew_limit": 5e-3, "saturation": 5e-3, "dead_zone": 3e-2,
    "sensor_lag": 2e-2, "delay": 2e-2, "clock_skew": 5e-2, "quantisation": 1e-3,
}  # fmt: skip


def plant() -> BondGraph:
    with BondGraph("oscillator") as g:
        node = One("v")
        Se("F", unit="N") >> node
        node >> I("m", 0.5, unit="kg")
        node >> C("k", stiffness=800.0, unit="N/m")
        node >> R("b", 6.0, unit="N*s/m")
        node >> Dq("x", unit="m")
        node >> Df("rate", unit="m/s")
    return g


def drive() -> np.ndarray:
    t = DT * np.arange(N)
    swept = 3.0 * np.sin(2 * np.pi * 4 * t + 0.3) + 2.0 * np.sin(2 * np.pi * 11 * t)
    return np.asarray(swept * np.minimum(1.0, t / 0.05))


def recorded(graph: BondGraph, values: Mapping[str, float] | None = None) -> Data:
    t = DT * np.arange(N)
    run = simulate(graph, t, {"F": drive()}, values)
    y = np.stack([run["x"], run["rate"]], axis=1)
    y[:, 0] = STEP * np.round(y[:, 0] / STEP)
    y[:, 1] += 1e-3 * y[:, 1].std() * np.random.default_rng(0).standard_normal(N)
    split = Split(slice(0, 400), slice(400, N), "first two thirds")
    return Data("run", t, {"F": drive()}, y, ("x", "rate"), 1e-3 * y.std(axis=0), split)


def scene_of(nominal: Fit) -> FittedModel:
    """Scene of sources and sensors alone: their pasts need no simulation of the ports."""
    data = nominal.problem.data
    past = {n: PortHistory(u, u, data.dt) for n, u in data.commands.items()}
    past |= {
        n: PortHistory(nominal.simulated[:, i], nominal.simulated[:, i], data.dt)
        for i, n in enumerate(data.names)
    }
    left = data.readings - nominal.simulated
    return FittedModel(nominal.problem.graph, data, nominal, left, past)


@pytest.fixture(scope="module")
def scene() -> FittedModel:
    graph = plant()
    given = ("m", "k", "b")
    problem = Problem(
        graph, recorded(graph), fixed=given, lags=False, offsets=False, initial="rest"
    )
    return scene_of(fit(problem, max_iterations=1))


def readings(graph: BondGraph, scene: FittedModel, values: Mapping[str, float]) -> np.ndarray:
    """Readings of a model from the initial state of the nominal one."""
    nominal = Problem(scene.graph, scene.data, lags=False, offsets=False)
    begun = dict(zip(nominal.dynamics.state_names, start_point(nominal).states.T, strict=True))
    problem = Problem(
        graph, scene.data, starts=values, known_states=begun, lags=False, offsets=False
    )
    return evaluate(problem, start_point(problem), derivatives=False).y


def driven(scene: FittedModel, command: np.ndarray) -> np.ndarray:
    """Readings of the nominal model under another command, from the same initial state."""
    nominal = Problem(scene.graph, scene.data, lags=False, offsets=False)
    other = Problem(
        scene.graph, replace(scene.data, commands={"F": command}), lags=False, offsets=False
    )
    return evaluate(other, start_point(nominal), derivatives=False).y


def absent(effect: Effect, i: Insertion, scene: FittedModel) -> dict[str, float]:
    """Values at which the effect does nothing: zero, but limits far away and tiny lags."""
    if effect.name == "saturation":
        far = 1e4 * float(np.ptp(drive()))
        return dict(zip(i.strengths, (-far, far), strict=True))
    return dict.fromkeys(i.strengths, 1e-9 if effect.name in ("low_pass", "sensor_lag") else 0.0)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_words(effect: Effect) -> None:
    for text in (
        effect.family, effect.law, effect.sentence, effect.looks, effect.separated_by, effect.source
    ):  # fmt: skip
        assert text
        assert not text.endswith(".")
    assert effect.confused_with
    assert effect.name not in (*effect.confused_with, *effect.simpler)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_zero_strength_is_the_nominal_model(effect: Effect, scene: FittedModel) -> None:
    quiet = readings(scene.graph, scene, {})
    for place in effect.places(scene.graph):
        i = effect.insert(scene, place)
        assert i.graph.check() == ()
        assert exact_form(i.graph) is not None
        assert i.strengths
        y = readings(i.graph, scene, {**i.starts[0], **absent(effect, i, scene)})
        off = np.linalg.norm(y - quiet, axis=0) / np.linalg.norm(quiet, axis=0)
        assert off.max() < 1e-5, i.label
        again = effect.insert(scene, place)
        assert again.starts == i.starts


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_signatures_are_what_the_inserted_effect_does(effect: Effect, scene: FittedModel) -> None:
    """A hint of a signature and some weights gives back what the columns promise."""
    quiet = readings(scene.graph, scene, {})
    for place in effect.places(scene.graph):
        signatures = effect.signatures(scene, place)
        assert signatures
        for s in signatures:
            assert s.columns.shape[0] == N
            assert np.isfinite(s.columns).all()
        shown = [s for s in signatures if np.abs(s.columns).max() > 0]
        assert shown or (effect.name == "quantisation" and place.name == "rate")
        for s in shown:
            weights = np.ones(s.columns.shape[1])
            if effect.name in (
                "sensor_drift",
                "sensor_offset",
                "sensor_nonlinearity",
                "periodic_error",
            ):
                weights *= 0.02 * scene.of(place).half
            if effect.name == "sensor_gain":
                weights *= 0.02
            i = effect.insert(scene, place, Hint(s.shape or {}, weights))
            known = {*exact_form(i.graph).parameter_names, *Problem(i.graph, scene.data).delays}  # type: ignore[union-attr]
            assert 1 <= len(i.starts) <= 3
            assert all(set(start) <= known for start in i.starts)
            y = readings(i.graph, scene, i.starts[0])
            added = s.columns @ weights
            if isinstance(place, Source):
                promised = driven(scene, drive() + added) - quiet
            else:
                promised = np.zeros_like(quiet)
                promised[:, scene.data.names.index(place.name)] = added
            error = np.linalg.norm(y - quiet - promised) / np.linalg.norm(promised)
            allowed = EXACT.get(effect.name, 1e-6)
            if effect.name == "clock_skew" and isinstance(place, Source):
                allowed = 0.25  # a command at another rate leaves out that the plant keeps its own
            assert error < allowed, (i.label, dict(s.shape or {}), error)


def refitted(made: BondGraph, values: Mapping[str, float], effect: Effect, place: str) -> Fit:
    """Recording of `made`; the effect inserted with the best of its signatures, and fitted."""
    graph = plant()
    data = recorded(made, values)
    nominal = fit(Problem(graph, data, fixed=("m", "k", "b")), max_iterations=8)
    scene = scene_of(nominal)
    element = graph[place]
    best, hint = np.inf, None
    for s in effect.signatures(scene, element):
        if isinstance(element, Source):
            u = simulate(graph, data.time, {"F": data.commands["F"] + 1e-3 * s.columns[:, 0]})
            column = (1e3 * (u["x"] - nominal.simulated[:, 0]))[:, None]
            column -= (
                1e3
                * (simulate(graph, data.time, data.commands)["x"] - nominal.simulated[:, 0])[
                    :, None
                ]
            )
            at = 0
        else:
            column, at = s.columns, data.names.index(place)
        column = np.column_stack([column, np.ones(N)])[:400]
        w, *_ = np.linalg.lstsq(column, scene.residual[:400, at], rcond=None)
        left = float(np.sum((scene.residual[:400, at] - column @ w) ** 2))
        if left < best:
            best, hint = left, Hint(s.shape or {}, w[:-1])
    i = effect.insert(scene, element, hint)
    fits = [fit(Problem(i.graph, data, starts=dict(s), fixed=("m", "k", "b"))) for s in i.starts]
    return min(fits, key=lambda f: f.cost)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(
    ("effect", "place", "values"),
    [
        (SlewLimitEffect(), "F", {"slowness_F": 0.009, "falling_F": 0.009}),
        (SlewLimitEffect(), "F", {"slowness_F": 0.009, "falling_F": 0.007}),
        (SlewLimitEffect(), "F", {"slowness_F": 0.007, "falling_F": 0.009}),
        (DeadZoneEffect(), "F", {"width_F": 0.35, "centre_F": 0.0}),
        (LowPass(), "F", {"tau_F": 5e-3}),
        (SensorLag(), "x", {"tau_x": 3e-3}),
        (SensorOffset(), "x", {"h_x": 1.5e-3, "t_0_x": 0.171}),
        (SensorRectification(), "rate", {"amount_rate": 0.8}),
        (PeriodicError(), "x", {"a_x": 2e-4, "b_x": -1e-4, "period_x": 1.13e-3}),
        (Delay(), "F", {"delay_F": 3.3e-3}),
        (ClockSkewEffect(), "x", {"clock_x": 0.004}),
    ],
    ids=lambda v: v.name if isinstance(v, Effect) else "",
)
def test_hints_lead_to_the_truth(
    effect: Effect, place: str, values: dict[str, float], scene: FittedModel
) -> None:
    made = effect.insert(scene, scene.graph[place]).graph
    found = refitted(made, values, effect, place)
    assert found.chi2("train") < 3.0
    for n, v in values.items():
        if v:
            assert found.values[n] == pytest.approx(v, rel=0.05), n


@pytest.mark.parametrize("n", [300, 5000])
@pytest.mark.parametrize("step", [0.5, 0.0244, 1e-3])
def test_step_of_a_grid(n: int, step: float) -> None:
    noise = np.random.default_rng(n)
    y = 2 * np.sin(0.0371 * np.arange(n)) + 0.3 * noise.standard_normal(n)
    rounded = np.round(y / step) * step + 0.0123
    for seen in (rounded, rounded.astype(np.float32), np.round(rounded, 5), rounded + 100.0):
        assert quantisation_step(seen) == pytest.approx(step, rel=1e-3)
    assert quantisation_step(1e-7 * rounded) == pytest.approx(1e-7 * step, rel=1e-3)
    assert quantisation_step(y) is None
    assert quantisation_step(y.astype(np.float32)) is None
    assert quantisation_step(np.round(40 * y, 3)) == pytest.approx(1e-3)


def test_a_slew_limit_shows_in_steps(scene: FittedModel) -> None:
    """A command that rests between jumps: ramps of some samples are tried."""
    steps = np.where((np.arange(N) // 90) % 2, 1.0, -0.5)
    past = {**scene.past, "F": PortHistory(steps, steps, DT)}
    effect, place = SlewLimitEffect(), scene.graph["F"]
    found = effect.signatures(replace(scene, past=past), place)
    taken = sorted(float(np.ceil(1.5 * (s.shape or {})["slowness"] / DT)) for s in found)
    assert taken[0] == 3.0
    assert taken[-1] > 15
    for s in found:
        assert 0 < np.abs(s.columns).max() < 1.5
    still = {**scene.past, "F": PortHistory(np.ones(N), np.ones(N), DT)}
    (nothing,) = effect.signatures(replace(scene, past=still), place)
    assert not nothing.columns.any()


def test_commands_that_move_are_late_together(scene: FittedModel) -> None:
    graph = scene.graph.with_branch("v", [Se("G", unit="N")])
    past = {**scene.past, "G": PortHistory(drive(), drive(), DT)}
    commands = {"F": drive(), "G": 0.5 * drive()}
    both = replace(scene, graph=graph, data=replace(scene.data, commands=commands), past=past)
    i = Delay().insert(both, graph["F"])
    assert i.graph["G"].drive.delay == i.graph["F"].drive.delay == "delay_F"  # type: ignore[attr-defined]
    assert Problem(i.graph, both.data).delays == {"delay_F": (0, 1)}
    held = replace(both, data=replace(both.data, commands={**commands, "G": np.zeros(N)}))
    assert Delay().insert(held, graph["F"]).graph["G"].drive is None  # type: ignore[attr-defined]


def test_readings_without_a_grid() -> None:
    assert quantisation_step(np.ones(50)) is None
    assert quantisation_step(np.arange(3.0)) is None
    assert quantisation_step(np.full(50, np.nan)) is None
    few = np.array([0.0, 0.25, 0.5, 0.25] * 40)
    assert quantisation_step(few) == pytest.approx(0.25)


def test_rounding_is_found_where_the_model_predicts_it() -> None:
    graph = plant()
    data = recorded(graph)
    coarse = np.ptp(data.readings[:, 0]) / 12
    data.readings[:, 0] = coarse * np.round(data.readings[:, 0] / coarse)
    nominal = fit(Problem(graph, data, fixed=("m", "k", "b"), offsets=False), max_iterations=4)
    scene = scene_of(nominal)
    effect = Quantisation()
    (s,) = effect.signatures(scene, graph["x"])
    assert s.shape is not None
    assert s.shape["step"] == pytest.approx(coarse)
    w, *_ = np.linalg.lstsq(s.columns, scene.residual[:, 0], rcond=None)
    assert w[0] == pytest.approx(1.0, abs=0.05)
    i = effect.insert(scene, graph["x"], Hint(s.shape or {}, w))
    repaired = fit(Problem(i.graph, data, starts=dict(i.starts[0]), fixed=("m", "k", "b")))
    assert repaired.rmse("test")["x"] < 0.1 * nominal.rmse("test")["x"]
    # the other reading lies on no grid, and no step explains its residual
    left = scene.residual[:, 1]
    for other in effect.signatures(scene, graph["rate"]):
        rest = left - other.columns @ np.linalg.lstsq(other.columns, left, rcond=None)[0]
        assert np.std(rest) > 0.9 * np.std(left)


@pytest.mark.parametrize("fine", [0.0, 0.02])
def test_rounding_before_the_noise_is_found_without_a_grid(fine: float) -> None:
    """And before a converter of `fine` steps that is known."""
    rng = np.random.default_rng(4)
    graph = plant()
    data = recorded(graph)
    coarse = np.ptp(data.readings[:, 0]) / 40
    rounded = coarse * np.round(data.readings[:, 0] / coarse)
    data.readings[:, 0] = rounded + 0.1 * coarse * rng.standard_normal(rounded.size)
    if fine:
        unit = fine * coarse
        data.readings[:, 0] = unit * np.round(data.readings[:, 0] / unit)
        data = replace(data, resolution={"x": unit})
    nominal = fit(Problem(graph, data, fixed=("m", "k", "b"), offsets=False), max_iterations=4)
    scene = scene_of(nominal)
    steps = [s.shape["step"] for s in Quantisation().signatures(scene, graph["x"]) if s.shape]
    assert min(abs(step / coarse - 1) for step in steps) < 0.01


def test_periods_are_read_off_the_residual() -> None:
    rng = np.random.default_rng(1)
    y = 0.7 * np.sin(0.013 * np.arange(4000)) + 0.2 * np.sin(0.31 * np.arange(4000))
    for cycles in (2.5, 31.0, 260.0):
        r = np.sin(2 * np.pi * cycles * y / np.ptp(y)) + rng.standard_normal(y.size) + y**3
        assert promising_cycles(y, r, 3)[0] == pytest.approx(cycles, abs=0.3)
    assert promising_cycles(y, 0 * y, 3).size == 0
    assert promising_cycles(0 * y, y, 3).size == 0
