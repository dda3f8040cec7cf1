"""The functions of the thesis' Appendix A mean the same here."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hardware.devices.interferometer import ThesisInterface
from hardware.errors import Overrun, ProtocolFault, TimedOut
from hardware.simulators.control.client import LocalClock
from tests.hardware.devices.interferometer.bench import GAIN, Bench, make_bench, stub


@pytest.fixture
def thesis() -> Iterator[tuple[Bench, ThesisInterface]]:
    """Make the interface, not configured yet."""
    with make_bench() as bench:
        made = ThesisInterface(f"net:{bench.address}", library=stub(), clock=LocalClock(bench.rig))
        yield bench, made
        made.unconfig_sios_usb_device()


def test_normal_mode_gives_the_last_value(thesis: tuple[Bench, ThesisInterface]) -> None:
    bench, sios = thesis
    with pytest.raises(ProtocolFault, match="config_sios_usb_device"):
        sios.get_length_value()
    sios.config_sios_usb_device(1000.0, average=4)
    for volts in (10.0, 20.0, 5.0):
        bench.rig.drive(volts)
        bench.rig.wait(0.02)
        assert sios.get_length_value() == pytest.approx(volts * GAIN, abs=1e-10)
    bench.rig.wait(70.0)  # nobody asks; the buffer is full of old values by now
    bench.rig.drive(7.0)
    bench.rig.wait(0.02)
    assert sios.get_length_value() == pytest.approx(7.0 * GAIN, abs=1e-10)
    sios.unconfig_sios_usb_device()
    assert bench.front.requests[-1] == "CLOSE"
    sios.unconfig_sios_usb_device()


def test_superfast_block_of_the_thesis(thesis: tuple[Bench, ThesisInterface]) -> None:
    bench, sios = thesis
    sios.config_sios_usb_device()
    bench.rig.drive(3.0)
    taken = sios.superfast_sample(3125.0, 3125)
    assert taken.x.size == 3125
    assert taken.rate == 3125.0
    assert np.median(taken.x) == pytest.approx(3.0 * GAIN, abs=1e-10)
    assert not taken.flags.any()
    assert taken.environment.air.measured
    assert sios.get_envir_data().air.index == taken.environment.air.index
    assert sios.get_length_value() == pytest.approx(3.0 * GAIN, abs=1e-10)  # normal mode is back


def test_superfast_with_a_trigger(thesis: tuple[Bench, ThesisInterface]) -> None:
    bench, sios = thesis
    sios.config_sios_usb_device()
    with pytest.raises(TimedOut):
        sios.superfast_sample(10_000.0, 100, trigger=True, patience=0.3)
    bench.rig.at(bench.rig.now + 0.1, bench.rig.trigger)
    assert sios.superfast_sample(10_000.0, 100, trigger=True, patience=0.3).x.size == 100
    with pytest.raises(Overrun):
        sios.superfast_sample(10_000.0, 33_000)
