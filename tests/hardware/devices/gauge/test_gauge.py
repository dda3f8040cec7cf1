"""The force gauge on its line, and forces averaged with outliers excluded."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.devices.gauge import ForceGauge, averaged, plateaus
from hardware.devices.gauge.averaging import outlying
from hardware.devices.transport import TcpTransport
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.controllers.faults import Fault
from hardware.simulators.gauge import GaugeConfig, GaugeFront
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.rig import Rig


class Spring:
    """A micrometre a volt."""

    step = 1e-3

    def advance(self, volts: Any) -> PlantMotion:
        v = np.asarray(volts, dtype=float)
        return PlantMotion(1e-6 * v, np.full(v.size, np.nan))


class RigTime:
    """Time of the program is the rig's."""

    def __init__(self, rig: Rig) -> None:
        self.now = lambda: rig.now
        self.sleep = rig.wait


@pytest.fixture
def line() -> Iterator[tuple[Rig, GaugeFront, ForceGauge]]:
    rig = Rig(Spring())
    front = GaugeFront(rig, GaugeConfig(spring=1e5, noise=0.002, outliers=0.0))
    host, _, port = front.start().rpartition(":")
    gauge = ForceGauge(TcpTransport(host, int(port)), RigTime(rig))
    yield rig, front, gauge
    gauge.close()
    front.stop()


def test_a_reading_is_a_force_and_no_two_are_one(line: Any) -> None:
    rig, _, gauge = line
    rig.drive(20.0)
    rig.wait(0.1)
    gauge.kickoff()
    forces, instants = [], []
    for _ in range(60):
        rig.wait(0.004)
        for chunk in gauge.poll():
            forces += chunk.channels["F"].tolist()
            instants += chunk.channels["instant"].tolist()
    # 20 um on 0.1 N/um; in 0.24 s no more than a hundred a second
    assert np.mean(forces) == pytest.approx(2.0, abs=0.002)
    assert 20 <= len(forces) <= 25
    assert np.diff(instants).min() > 0.0079
    rig.drive(60.0)
    rig.wait(0.1)
    (chunk,) = gauge.poll()
    assert int(chunk.flags[0]) & Flag.SATURATED


def test_one_garbled_or_late_answer_is_asked_for_again(line: Any) -> None:
    rig, front, gauge = line
    rig.drive(10.0)
    rig.wait(0.1)
    for fault in (Fault(garbage=b"\xff+9"), Fault(silent=True), Fault(chunk=1)):
        front.faults.next(fault)
        rig.wait(0.02)
        (chunk,) = gauge.poll()
        assert float(chunk.channels["F"][0]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("faults", "kind", "says"),
    [
        ([Fault(garbage=b"??")] * 3, ProtocolFault, "no reading such as"),
        ([Fault(silent=True)] * 3, TimedOut, "no answer to 3 requests"),
        ([Fault(drop_after=2)], LinkLost, "link lost"),
    ],
)
def test_a_gauge_that_is_none_says_so(
    line: Any, faults: list[Fault], kind: type[HardwareError], says: str
) -> None:
    _, front, gauge = line
    front.faults.next(*faults)
    with pytest.raises(kind, match=says):
        gauge.kickoff()
    gauge.abort()


def test_outliers_are_left_out_and_wandering_is_not() -> None:
    rng = np.random.default_rng(4)
    n = 400
    wander = 0.05 * np.sin(2.0 * np.pi * np.arange(n) / n)
    clean = 1.0 + wander + 0.005 * rng.standard_normal(n)
    spoiled = clean.copy()
    at = rng.choice(n, 20, replace=False)
    spoiled[at] += rng.choice([-1.0, 1.0], 20) * rng.uniform(0.3, 2.0, 20)
    found = averaged(spoiled)
    assert found.excluded == pytest.approx(20, abs=6)
    assert found.mean == pytest.approx(np.delete(clean, at).mean(), abs=5e-4)
    # neighbours of a wandering output say nearly the same: they do not count as 400
    assert found.uncertainty > 2.0 * clean.std() / np.sqrt(n)
    white = averaged(1.0 + 0.005 * rng.standard_normal(n))
    assert white.uncertainty == pytest.approx(0.005 / np.sqrt(n), rel=0.3)


def test_a_force_that_moves_is_no_outlier_of_itself() -> None:
    rng = np.random.default_rng(2)
    n = 300
    moving = 2.0 * (1.0 - np.cos(2.0 * np.pi * np.arange(n) / 100)) + 0.004 * rng.standard_normal(n)
    at = rng.choice(n, 9, replace=False)
    moving[at] += 0.8
    found = np.flatnonzero(outlying(moving))
    assert set(at) <= set(found)
    assert found.size < 15


def test_readings_in_whole_steps_are_no_outliers_of_each_other() -> None:
    steps = np.round(np.random.default_rng(1).normal(1.0, 0.0004, 100), 3)
    assert averaged(steps).excluded == 0
    assert averaged(np.full(10, 2.0)).uncertainty == 0.0


def test_an_outlier_among_equal_readings_is_left_out() -> None:
    found = averaged(np.array([1.0] * 8 + [4.0]))
    assert (found.mean, found.uncertainty, found.kept, found.excluded) == (1.0, 0.0, 8, 1)
    assert averaged(np.array([4.0] + [1.0] * 7 + [1.001])).excluded == 1
    # an output that stands between two steps of the gauge has no outliers
    between = np.tile([1.0, 1.0, 1.001, 1.0, 1.0], 8)
    assert averaged(between).excluded == 0


def test_a_reading_one_step_off_is_no_outlier_where_the_other_plateaus_know_the_step() -> None:
    volts = np.repeat([0.0, 1.0, 2.0, 3.0], 10)
    force = np.repeat([1.0, 2.0, 3.0, 5.0], 10)
    force[[3, 14]] += [0.001, -0.001]
    force[25] = 4.0
    found = plateaus(volts, force, skip=0)
    assert [a.excluded for a in found] == [0, 0, 1, 0]
    assert found[0].uncertainty == pytest.approx(1e-4)
    # all equal to within a step
    assert found[3].uncertainty == pytest.approx(0.001 / np.sqrt(12.0))
    assert averaged(np.array([1.0] * 8 + [1.001]), step=0.001).excluded == 0
    # a spike on each of two plateaus proves no step
    spiked = np.repeat([1.0, 2.0], 10)
    spiked[[4, 14]] += [3.0, 5.0]
    assert [a.excluded for a in plateaus(volts[:20], spiked, skip=0)] == [1, 1]


def test_every_stretch_of_voltage_has_its_mean() -> None:
    volts = np.repeat([0.0, 3.0, 5.0], [30, 4, 30])
    found = plateaus(volts, 0.1 * volts, skip=5)
    assert [(a.volts, a.kept) for a in found] == [(0.0, 25), (5.0, 25)]
    assert found[1].mean == pytest.approx(0.5)
    with pytest.raises(UnusableInput, match="hold it longer"):
        plateaus(np.arange(50.0), np.arange(50.0), 5)
    with pytest.raises(UnusableInput, match="0 readings"):
        plateaus(volts, np.nan * volts, 5)
    with pytest.raises(UnusableInput, match="4 readings"):
        averaged(np.ones(4))


def test_two_spikes_of_one_size_prove_no_step() -> None:
    x = np.repeat([1.0, 2.0], 10)
    x[[4, 14]] += 3.0
    found = plateaus(np.repeat([0.0, 1.0], 10), x, 0)
    assert [a.excluded for a in found] == [1, 1]
    assert [a.mean for a in found] == [1.0, 2.0]


def test_a_middle_between_two_readings_makes_no_half_step() -> None:
    x = np.concatenate(
        [[1.0, 1.0, 1.0, 1.1, 1.1, 1.1, 1.1], [1.0, 1.0, 1.0, 1.1, 1.1, 1.1], np.full(6, 2.0)]
    )
    volts = np.repeat([0.0, 1.0, 2.0], [7, 6, 6])
    assert plateaus(volts, x, 0)[2].uncertainty == pytest.approx(0.1 / np.sqrt(12.0))
