"""Instruments by name: what each reads against a formula of its own."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

from bondgraph import BondGraph, C, Dq, I, One, R, Se, Sf
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.composing.instruments import (
    INSTRUMENTS,
    accelerometer,
    encoder,
    force_cell,
    monitor,
    strain_gauge,
    tachometer,
)
from bondgraph.signals.wrapping import unwrapped, wrap_period
from bondgraph.support.errors import GraphError
from tests.settled import simulate

T = np.linspace(0.0, 2.0, 2001)


def turning(*, wraps: bool = False, counted: bool = False) -> BondGraph:
    """A shaft that is turned at a given speed."""
    with BondGraph("shaft") as g:
        shaft = One("shaft")
        speed = Sf("speed", unit="rad/s")
        speed >> shaft >> R("b", 0.1, unit="N*m*s")
        shaft >> Dq("angle", unit="rad")
        shaft >> encoder("count", 500, wraps=wraps, counted=counted)
        shaft >> tachometer("volts", 0.02, lag=0.05)
        monitor("copy", speed)
    return g


def pushed() -> BondGraph:
    with BondGraph("pushed") as g:
        length = g.parameter("length", 0.25, "m")
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> R("d", 2.0, unit="N*s/m")
        v >> accelerometer("a", 300.0, 0.6, sensitivity=0.01, unit="V")
        force_cell(
            "cell", "k", sensitivity=0.5, unit="V", natural_frequency=400.0, damping_ratio=0.1
        )
        strain_gauge("strain", "k", length)
        strain_gauge("bridge", "k", length, factor=2.1, arms=2)
    return g


def test_all_are_sound_and_go_through_a_file() -> None:
    assert set(INSTRUMENTS) == {
        "accelerometer", "encoder", "force_cell", "monitor", "strain_gauge", "tachometer",
    }  # fmt: skip
    for g in (turning(wraps=True, counted=True), pushed()):
        assert g.check() == ()
        assert dict(from_json(to_json(g)).elements) == dict(g.elements)


@pytest.mark.parametrize("counted", [False, True])
def test_an_encoder_counts_and_begins_anew_after_each_turn(counted: bool) -> None:
    speed = 9.0 * np.cos(1.3 * T) + 4.0
    straight = simulate(turning(counted=counted), T, {"speed": speed})
    around = simulate(turning(wraps=True, counted=counted), T, {"speed": speed})
    angle, step = np.asarray(straight["angle"]), 2 * math.pi / 500
    scale = 1 / step if counted else 1.0
    assert angle.max() > 2 * math.pi
    assert np.abs(np.asarray(straight["count"]) / scale - angle).max() <= 0.5001 * step
    count = np.asarray(around["count"])
    steps = count / scale / step
    assert np.abs(steps - np.round(steps)).max() < 1e-6
    assert set(np.round(steps)) <= set(range(500))  # 0 to 499: a turn is 0 again
    period = wrap_period(
        np.asarray(simulate(turning(wraps=True), T, {"speed": 9.0 + 0 * T})["count"])
    )
    assert period == pytest.approx(2 * math.pi, rel=1e-2)
    whole = unwrapped(count, 500.0 if counted else 2 * math.pi)
    assert whole - whole[0] == pytest.approx(
        np.asarray(straight["count"]) - np.asarray(straight["count"])[0], abs=1e-6
    )


def test_a_tachometer_is_late_and_a_monitor_is_not() -> None:
    speed = np.sin(5.0 * T)
    run = simulate(turning(), T, {"speed": speed})
    _, late, _ = signal.lsim(signal.TransferFunction([0.02], [0.05, 1.0]), speed, T)
    assert np.abs(np.asarray(run["volts"]) - late).max() < 1e-6
    assert np.asarray(run["copy"]) == pytest.approx(speed, abs=1e-12)


def test_accelerometer_force_cell_and_strain_gauge() -> None:
    force = np.sin(9.0 * T) + 0.3 * np.sin(60.0 * T)
    plant = signal.TransferFunction([1.0], [0.5, 2.0, 200.0])
    run = simulate(pushed(), T, {"F": force})

    def seen(numerator: list[float], w: float, z: float) -> np.ndarray:
        denominator = np.polymul(plant.den, [1 / w**2, 2 * z / w, 1.0])
        _, y, _ = signal.lsim(
            signal.TransferFunction(np.polymul(plant.num, numerator), denominator), force, T
        )
        return np.asarray(y)

    for name, wanted in {
        "a": 0.01 * seen([1.0, 0.0, 0.0], 300.0, 0.6),
        "cell": 0.5 * 200.0 * seen([1.0], 400.0, 0.1),
        "strain": seen([1.0], 1e6, 1.0) / 0.25,
        "bridge": 2 / 4 * 2.1 * seen([1.0], 1e6, 1.0) / 0.25,
    }.items():
        assert np.abs(np.asarray(run[name]) - wanted).max() < 1e-4 * np.ptp(wanted), name


def test_what_is_no_encoder_is_one_line() -> None:
    with pytest.raises(GraphError, match="count: an encoder has counts"):
        encoder("count", 0)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: encoder("e", 100, turn="x"), "e: an encoder has counts and a turn"),  # type: ignore[arg-type]
        (lambda: encoder("e", True), "e: an encoder has counts"),
        (lambda: strain_gauge("s", "k", "L"), "s: the length 'L' is no number above 0"),
        (lambda: strain_gauge("s", "k", 0.0), "s: the length 0.0 is no number above 0"),
        (lambda: strain_gauge("s", "k", -1.0), "s: the length -1.0 is no number above 0"),
        (lambda: strain_gauge("s", "k", 1.0, factor="F"), "s: the gauge factor 'F'"),
        (lambda: strain_gauge("s", "k", 1.0, factor=2.0, arms=0), "s: the number of arms 0"),
        (lambda: monitor("m", "F"), "m: monitors 'F', which is no source"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_instrument_is_one_line(make: Callable[[], object], says: str) -> None:
    with pytest.raises(GraphError, match=says):
        make()


def test_numbers_of_numpy_count() -> None:
    assert encoder("e", np.int64(100)) == encoder("e", 100)  # type: ignore[arg-type]
    gauge = strain_gauge("s", "k", np.float64(0.5), factor=np.float64(2.0))
    assert gauge == strain_gauge("s", "k", 0.5, factor=2.0)
