"""A calibration that is off, or beyond its stated bounds, is found at its sensor, not elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Sf, Zero
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Law, Polynomial
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.estimation import Known, Nuisances, Study, estimate
from tests.settled import simulate
from tests.spring import spring

pytestmark = pytest.mark.slow

N, DT, NOISE = 1500, 0.04, 0.14
ONE = DiagnosisOptions(jobs=1, effects=1, keep=4, more=2)


def tanks() -> BondGraph:
    """Three tanks in a row, the pressure of each read."""
    with BondGraph("tanks") as g:
        nodes = [Zero(f"n{i}") for i in (1, 2, 3)]
        Sf("q", unit="m3/s") >> nodes[0]
        for i, node in enumerate(nodes, 1):
            node >> C(f"c{i}", i * 1e-6, unit="m3/Pa")
            node >> De(f"p{i}", unit="Pa")
        for i in (0, 1):
            pipe = One(f"l{i + 1}")
            nodes[i] >> pipe >> nodes[i + 1]
            pipe >> R(f"r{i + 1}", 2e5 * (i + 1), unit="Pa*s/m3")
        nodes[2] >> R("out", 3e5, unit="Pa*s/m3")
    return g


def found(wrong: str, factor: float) -> Diagnosis:
    rng = np.random.default_rng(3)
    t = np.asarray(DT * np.arange(N), np.float64)
    q = np.asarray(1e-3 * (1 + np.repeat(rng.uniform(-1, 1, N // 50), 50)), np.float64)
    truth = tanks().with_values({"c2": 2.3e-6, "r1": 1.7e5})
    run = simulate(truth, t, {"q": q}, hold="hold")
    read = {
        n: np.asarray((factor if n == wrong else 1.0) * np.asarray(run[n]), np.float64)
        + np.asarray(NOISE * rng.standard_normal(N), np.float64)
        for n in ("p1", "p2", "p3")
    }
    units = {"q": "m3/s", **dict.fromkeys(read, "Pa")}
    recording = Recording("run", t, {"q": q, **read}, units)
    return diagnose(tanks(), recording, hold="hold", noise=dict.fromkeys(read, NOISE), options=ONE)


@pytest.mark.parametrize("wrong", ["p1", pytest.param("p2", marks=pytest.mark.long)])
@pytest.mark.long
def test_a_sensor_that_is_four_per_cent_off(wrong: str) -> None:
    d = found(wrong, 1.04)
    assert d.kind == "missing_physics"
    (first, *_) = d.findings
    assert first.chosen is not None
    assert (first.chosen.effect, first.chosen.element) == ("sensor_gain", wrong)
    assert d.repaired is not None
    (error,) = (e for e in d.repaired.estimates if e.name == f"a_1_{wrong}")
    assert error.value == pytest.approx(0.04, abs=2e-3)


def test_a_right_calibration_is_no_finding() -> None:
    assert found("p2", 1.0).kind in ("explained", "parameters_only")


def swept(
    gain: float, law: Law | None = None, cubic: float = 0.0, speed: str = "v", push: float = 1.0
) -> Recording:
    """A mass on a spring, its place read by a sensor of that gain."""
    rng = np.random.default_rng(17)
    t = np.asarray(2e-3 * np.arange(750), np.float64)
    force = np.asarray(8.0 * np.sin(2 * np.pi * (0.5 + 3.0 * t) * t), np.float64)
    values = {"a_3_k": cubic} if law is not None else {}
    run = simulate(spring(k=800.0, law=law, speed=speed), t, {"F": push * force}, values)
    channels = {"F": force}
    for name, factor in (("x", gain), ("v", 1.0)) if speed else (("x", gain),):
        y = np.asarray(run[name])
        channels[name] = np.asarray(factor * y + 1e-3 * y.std() * rng.standard_normal(t.size))
    return Recording("run", t, channels, {"F": "N", "x": "m", **({"v": "m/s"} if speed else {})})


def stated(
    gain: float,
    law: Law | None = None,
    cubic: float = 0.0,
    speed: str = "v",
    of: str = "x",
    push: float = 1.0,
) -> Diagnosis:
    """The spring is known, the calibration right within 2 %."""
    study = Study(
        spring(m=0.6, k=800.0, speed=speed), swept(gain, law, cubic, speed, push), free=("m", "d"),
        nuisances=Nuisances(gains={of: Known(1.0, 0.02)}),
    )  # fmt: skip
    return diagnose(study, options=ONE)


@pytest.mark.parametrize(
    ("gain", "speed"),
    [
        pytest.param(1.06, "v", marks=pytest.mark.long),
        pytest.param(1.06, "", marks=pytest.mark.long),
        (0.94, ""),
    ],
)
def test_a_calibration_beyond_its_bounds_is_a_finding(gain: float, speed: str) -> None:
    """No second sensor is needed where the other numbers that could make up for it are known."""
    d = stated(gain, speed=speed)
    assert d.kind == "missing_physics"
    (first, *_) = d.findings
    assert first.chosen is not None
    assert (first.chosen.effect, first.chosen.element) == ("sensor_gain", "x")
    assert d.repaired is not None
    factor = d.repaired.values["gain_x"] * (1.0 + d.repaired.values["a_1_x"])
    assert factor == pytest.approx(gain, abs=2e-3)
    assert not any("ends at its bound" in n for n in d.notes)


@pytest.mark.parametrize("gain", [1.06, pytest.param(1.01, marks=pytest.mark.long)])
@pytest.mark.long
def test_a_bounded_gain_of_the_model_itself_is_one_that_was_stated(gain: float) -> None:
    graph = spring(m=0.6, k=800.0, speed="")
    graph = graph.with_parameters([Parameter("g", 1.0, lower=0.98, upper=1.02)])
    study = Study(graph.with_element("x", gain="g"), swept(gain, speed=""), free=("m", "d", "g"))
    d = diagnose(study, options=ONE)
    if gain == 1.01:
        assert d.kind in ("explained", "parameters_only")
        return
    assert d.kind == "missing_physics"
    (first, *_) = d.findings
    assert first.chosen is not None
    assert (first.chosen.effect, first.chosen.element) == ("sensor_gain", "x")
    assert d.repaired is not None
    factor = d.repaired.values["g"] * (1.0 + d.repaired.values["error_x"])
    assert factor == pytest.approx(gain, abs=2e-3)
    assert any("the gain of x ends at its bound" in n for n in estimate(study).notes)
    assert any("off by more than 2 %" in n for n in estimate(study).notes)


@pytest.mark.long
def test_a_command_beyond_its_bounds_is_no_sensors_fault() -> None:
    d = stated(1.0, speed="", of="F", push=1.06)
    assert not any(s.chosen and s.chosen.effect == "sensor_gain" for s in d.steps)
    assert any("the gain of F ends at its bound" in n for n in d.notes)


def test_a_calibration_within_its_bounds_is_none() -> None:
    assert stated(1.015).kind in ("explained", "parameters_only")


@pytest.mark.long
def test_a_gain_that_is_driven_to_its_bound_is_not_blamed() -> None:
    """What is missing is the spring's: it hardens."""
    d = stated(1.01, Polynomial(orders=(3,), size=1.0), 2e6)
    assert d.decision is not None
    assert d.decision.chosen is not None
    assert d.decision.chosen.element == "k"
