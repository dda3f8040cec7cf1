"""A channel that holds another quantity than its sensor reads is told as such."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Da, Df, Dq, I, One, R, Se
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import Diagnosis, diagnose
from tests.settled import simulate
from tests.spring import spring

pytestmark = pytest.mark.slow

N, DT = 250, 0.02


def found(true: Sensor, unit: str, factor: float = 1.0) -> Diagnosis:
    """What a model with a displacement says of a recording of something else."""
    t = np.asarray(DT * np.arange(N), np.float64)
    rng = np.random.default_rng(0)
    force = np.asarray(
        np.sin(2 * np.pi * 0.7 * t) + np.sin(2 * np.pi * (1 + 0.2 * t) * t), np.float64
    )
    y = np.asarray(simulate(spring().replace("x", true), t, {"F": force})["x"])
    y = factor * (y + 1e-3 * y.std() * rng.standard_normal(N))
    read = {"F": force, "x": np.asarray(y, np.float64)}
    return diagnose(spring(), Recording("run", t, read, {"F": "N", "x": unit}))


@pytest.mark.parametrize(
    ("true", "says"),
    [
        (Da("x"), "an acceleration (read by Da)"),
        pytest.param(Df("x"), "a velocity", marks=pytest.mark.long),
    ],
)
def test_it_is_told_with_the_sensor_that_reads_it(true: Sensor, says: str) -> None:
    d = found(true, "m")
    assert d.kind == "unknown_physics"
    assert says in d.advice[0]
    assert "model's sensor" in d.advice[0]


def test_a_right_channel_is_no_mistake() -> None:
    assert found(Dq("x"), "m").kind in ("explained", "parameters_only")


@pytest.mark.long
def test_a_wrong_sign_is_still_one() -> None:
    d = found(Dq("x"), "m", -1.0)
    assert "wrong sign" in d.advice[0]
    assert "acceleration" not in d.advice[0]


@pytest.mark.long
def test_columns_of_different_quantities_that_are_exchanged() -> None:
    with BondGraph("two readings") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 1.0, unit="kg")
        v >> C("k", stiffness=100.0, unit="N/m")
        v >> R("d", 2.0, unit="N*s/m")
        v >> Dq("x", unit="m")
        v >> Da("a", unit="m/s^2")
    t = np.asarray(DT * np.arange(N), np.float64)
    rng = np.random.default_rng(0)
    force = np.asarray(np.sin(2 * np.pi * (0.5 + 0.2 * t) * t), np.float64)
    made = simulate(g, t, {"F": force})
    x, a = (np.asarray(made[n] + 1e-3 * made[n].std() * rng.standard_normal(N)) for n in ("x", "a"))
    units = {"F": "N", "x": "m", "a": "m/s^2"}
    d = diagnose(g, Recording("run", t, {"F": force, "x": a, "a": x}, units))
    assert d.kind == "unknown_physics"
    assert "exchanged" in d.advice[0]
