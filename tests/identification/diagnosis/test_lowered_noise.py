"""A noise read too high is lowered to what the model leaves, and its reading weighs again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import GY, BondGraph, Df, I, One, R, Se
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search import material as module
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.nominal import (
    as_searched,
    deepest,
    held_to_residual,
    misread,
    nominal_fit,
)
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT = 900, 0.01
NOISE = np.array([2e-5, 3e-4])
T = DT * np.arange(N)
FORCE = 4 * np.sin(2 * np.pi * 0.7 * T) + 2 * np.sin(2 * np.pi * 2.3 * T)


def plant(k: float = 200.0) -> BondGraph:
    return spring(k=k).with_branch("v", [Df("speed", unit="m/s")])


def readings() -> np.ndarray:
    run = simulate(plant(210.0), T, {"F": FORCE})
    y = np.stack([np.asarray(run[n]) for n in ("x", "speed")], axis=1)
    return np.asarray(y + NOISE * np.random.default_rng(4).standard_normal(y.shape))


def fitted(read_as: np.ndarray) -> Fit:
    """The plain model, the noises taken for `read_as`."""
    data = Data(
        "run",
        np.asarray(T, np.float64),
        {"F": FORCE},
        readings(),
        ("x", "speed"),
        read_as,
        interleaved(0, N),
    )
    return nominal_fit(plant(), data, "linear")[1]


@settings(max_examples=12, deadline=None)
@given(st.floats(1.6, 1e4), st.floats(1.6, 1e4))
def test_each_is_lowered_to_its_own_level(one: float, other: float) -> None:
    found = held_to_residual(fitted(NOISE * np.array([one, other]))).problem.data.floor
    assert found == pytest.approx(NOISE, rel=0.1)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.01, 1.2), st.floats(0.01, 1.2))
def test_none_is_raised_and_none_that_fits_is_touched(one: float, other: float) -> None:
    before = NOISE * np.array([one, other])
    assert held_to_residual(fitted(before)).problem.data.floor.tolist() == before.tolist()


def test_a_stated_noise_stays() -> None:
    before = NOISE * np.array([20.0, 20.0])
    found = held_to_residual(fitted(before), given=("x",)).problem.data.floor
    assert found[0] == before[0]
    assert found[1] == pytest.approx(NOISE[1], rel=0.1)


def test_what_rounds_is_not_believed_below_its_rounding() -> None:
    f, step = fitted(20 * NOISE), 10 * NOISE[0]
    data = replace(f.problem.data, resolution={"x": step})
    found = held_to_residual(replace(f, problem=replace(f.problem, data=data))).problem.data.floor
    assert found[0] == pytest.approx(step / np.sqrt(12.0), rel=1e-6)
    assert found[1] == pytest.approx(NOISE[1], rel=0.1)


def test_the_model_says_what_rounds() -> None:
    y = readings()
    graph = plant().with_element("x", resolution=3e-4)
    units = {"F": "N", "x": "m", "speed": "m/s"}
    channels = {"F": FORCE, "x": y[:, 0], "speed": y[:, 1]}
    asked = asked_of(graph, Recording("run", np.asarray(T), channels, units), None, None, {})
    assert module.material_of(asked).data.resolution == {"x": 3e-4}


def test_a_short_record_says_nothing_of_the_noise() -> None:
    f = fitted(50 * NOISE)
    few = replace(f.problem.data.split, train=slice(0, 30), test=slice(30, 60))
    data = replace(f.problem.data, split=few)
    short = replace(f, problem=replace(f.problem, data=data))
    assert held_to_residual(short) is short


def test_the_answer_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """However it was read: what lies above the residual is not believed."""
    y = readings()
    seen = Recording(
        "run", np.asarray(T, np.float64), {"F": FORCE, "x": y[:, 0], "speed": y[:, 1]},
        {"F": "N", "x": "m", "speed": "m/s"},
    )  # fmt: skip
    monkeypatch.setattr(
        module, "read_noise",
        lambda *_: {n: (s, False) for n, s in zip(("x", "speed"), 30 * NOISE, strict=True)},
    )  # fmt: skip
    d = diagnose(plant(), seen, options=DiagnosisOptions(jobs=1, effects=1), hold="linear")
    assert d.kind in ("explained", "parameters_only")
    assert d.data is not None
    assert d.data.floor == pytest.approx(NOISE, rel=0.1)
    assert [n.split(" was read")[0] for n in d.notes if "was read at" in n] == [
        "the noise of x", "the noise of speed",
    ]  # fmt: skip


def test_another_minimum_is_looked_for_where_the_noise_was_read_too_high() -> None:
    first = fitted(NOISE * 8)
    data = replace(first.problem.data, floor=NOISE)
    caught = fit(replace(first.problem, data=data, starts={"k": 900.0}), max_iterations=0)
    found = deepest(first, caught, lambda d: Problem(plant(), d), "linear")
    assert found.chi2("train") == pytest.approx(1.0, abs=0.1)
    assert found.cost < 0.01 * caught.cost
    # a noise that was read right leaves the minimum that was found
    same = replace(first.problem, data=replace(data, floor=0.8 * first.problem.data.floor))
    kept = fit(replace(same, starts={"k": 900.0}), max_iterations=0)
    assert deepest(first, kept, lambda d: Problem(plant(), d), "linear") is kept


@pytest.mark.parametrize("times", [1.5, 8.0])
def test_a_noise_that_a_law_leaves_far_below_was_misread(times: float) -> None:
    found = misread(fitted(NOISE * np.array([1.0, times])))
    if times < 2.0:
        assert found is None
        return
    assert found == pytest.approx(NOISE, rel=0.1)
    assert misread(fitted(NOISE * np.array([1.0, times])), given=("speed",)) is None


def test_what_a_search_on_fewer_samples_found_of_the_noise_holds_for_all() -> None:
    whole = fitted(NOISE * np.array([1.0, 8.0]))
    data = whole.problem.data
    thin = replace(whole.problem, data=replace(data.thinned(2), floor=NOISE))
    seen = as_searched(whole, fit(thin, start=whole.point))
    assert seen.problem.data.n == data.n
    assert seen.problem.data.floor.tolist() == NOISE.tolist()
    assert as_searched(whole, whole) is whole


def motor(friction: Coulomb | None = None, resistance: float = 2.0) -> BondGraph:
    with BondGraph("motor") as g:
        coil, shaft = One("coil"), One("shaft")
        Se("U", unit="V") >> coil >> I("L", 1e-3, unit="H")
        coil >> R("R", resistance, unit="ohm")
        coil >> GY("K", 0.04, unit="N*m/A") >> shaft >> I("J", 1e-5, unit="kg*m2")
        shaft >> R("b", 1e-5, unit="N*m*s/rad", law=friction)
        coil >> Df("i", unit="A")
        shaft >> Df("w", unit="rad/s")
    return g


@pytest.mark.long
def test_a_noise_read_off_the_steps_of_a_command_is_read_anew_beside_the_found_law() -> None:
    """The current of a motor answers every step at once: its spectrum tells no noise."""
    samples, dt, noise = 1500, 2e-4, np.array([1e-3, 0.05])
    rng = np.random.default_rng(3)
    t = np.asarray(dt * np.arange(samples), np.float64)
    u = np.repeat(rng.uniform(-8.0, 8.0, samples // 20), 20)
    run = simulate(motor(Coulomb(5e-3)), t, {"U": u}, hold="hold")
    drawn = noise * rng.standard_normal((samples, 2))
    channels = {"U": u, "i": run["i"] + drawn[:, 0], "w": run["w"] + drawn[:, 1]}
    recording = Recording("run", t, channels, {"U": "V", "i": "A", "w": "rad/s"})
    options = DiagnosisOptions(jobs=1, effects=1, keep=2)
    d = diagnose(motor(resistance=2.2), recording, options=options, hold="hold")
    assert [s.chosen.label for s in d.findings if s.chosen] == ["coulomb_friction at b"]
    assert d.repaired is not None
    for made in (d.repaired, d.nominal):
        assert made is not None
        assert made.problem.data.floor == pytest.approx(noise, rel=0.15)
    assert [n for n in d.notes if n.startswith("the noise of i was read at")]
    left = d.repaired.residuals("test").std(axis=0)
    assert left == pytest.approx(noise, rel=0.15)
    true = {"R": 2.0, "L": 1e-3, "K": 0.04, "F_c_b": 5e-3}
    for e in d.repaired.estimates:
        if e.name in true:
            error = (e.ci95[1] - e.ci95[0]) / 3.92
            assert abs(e.value - true[e.name]) < 3.5 * error
