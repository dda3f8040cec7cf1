"""Limits hold between the samples too; what does not fit is scaled, slowed or refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import irfft, rfft

from bondgraph.signals.band_limited import between_samples
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput
from identification.experiments.design import (
    Signal,
    extremes,
    fitted,
    multisine,
    prbs,
    reversal_curves,
    staircase,
    sweep,
    within,
)

RATE = 1000.0


def examples() -> dict[str, Signal]:
    return {
        # close to the Nyquist rate the samples miss the peaks by far
        "sharp": multisine(RATE, 100, lines=[37, 41, 47], peak=10.0, bias=2.0, seed=2),
        "low": multisine(RATE, 500, band=(4, 60), rms=3.0, phases="low_crest", periods=2),
        "sweep": sweep(RATE, 5.0, 430.0, 1.0, amplitude=4.0, bias=1.0),
        "loops": reversal_curves(8.0, 3, RATE, slew=50.0),
        "stairs": staircase(RATE, 0.05, [0.0, 3.0, -2.0], rise=0.01),
        "prbs": prbs(RATE, 0.02, order=5, rise=0.004, periods=2),
    }


NAMES = tuple(examples())


def dense(s: Signal) -> tuple[float, float, float]:
    """Lowest, highest, steepest on a grid 200 times finer, by other means than `extremes`."""
    if s.between == "linear":
        x = s.values
        return float(x.min()), float(x.max()), float(np.abs(np.diff(x)).max() * s.rate)
    if s.period:
        n = s.period
        fine = irfft(rfft(s.one_period), 200 * n) * 200
    else:
        fine = between_samples(s.values[:, None], 200)[:, 0]
    return float(fine.min()), float(fine.max()), float(np.abs(np.diff(fine)).max() * 200 * s.rate)


@pytest.mark.parametrize("name", NAMES)
def test_bounds_are_above_the_course_and_close(name: str) -> None:
    s = examples()[name]
    low, high, slew = extremes(s)
    least, most, steep = dense(s)
    room = 1e-9 * (most - least)
    assert low <= least + room
    assert high >= most - room
    assert slew >= steep * (1 - 1e-9)
    span = most - least
    assert least - low < 0.006 * span
    assert high - most < 0.006 * span
    assert slew < 1.01 * steep


def test_samples_alone_would_miss_the_peak() -> None:
    s = examples()["sharp"]
    assert np.abs(s.values - 2.0).max() < 0.999 * max(extremes(s)[1] - 2.0, 2.0 - extremes(s)[0])


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("by", ["amplitude", "frequency"])
def test_what_is_fitted_is_within(name: str, by: str) -> None:
    s = examples()[name]
    low, high, slew = extremes(s)
    tight = DriveLimits(
        s.bias - 0.3 * (s.bias - low), s.bias + 0.4 * (high - s.bias), slew=slew / 5
    )
    assert not within(s, tight)
    found = fitted(s, tight, by)
    check = within(found.signal, tight)
    assert check, str(check)
    if by == "frequency":
        assert found.amplitude == pytest.approx(0.3, rel=0.4)
        assert found.slower == pytest.approx(5 * found.amplitude)
        assert "times slower" in str(found)
    else:
        assert found.slower == 1.0
        assert found.amplitude == pytest.approx(0.2)
    # no more than needed: something touches
    touch = max(
        check.slew / tight.slew,
        (check.high - s.bias) / (tight.high - s.bias),
        (s.bias - check.low) / (s.bias - tight.low),
    )
    assert touch == pytest.approx(1.0, rel=1e-6)


def test_current_is_capacitance_times_slew() -> None:
    s = reversal_curves(50.0, 2, RATE, slew=400.0)
    stack = DriveLimits(-60, 60, current=1e-3, capacitance=1.5e-6)
    assert stack.steepest == pytest.approx(1e-3 / 1.5e-6)
    assert within(s, stack)
    large = DriveLimits(-60, 60, current=1e-3, capacitance=5e-6)
    assert "2 of 1 mA" in str(within(s, large))
    assert fitted(s, large, "frequency").slower == pytest.approx(2.0)


def test_nothing_changes_what_fits() -> None:
    s = examples()["low"]
    found = fitted(s, DriveLimits(-100, 100))
    assert found.signal is s
    assert "nothing had to change" in str(found)
    assert fitted(s, DriveLimits(-100, 100), bias=5.0).signal.bias == pytest.approx(5.0)


def test_what_cannot_be_is_refused() -> None:
    jumps = prbs(RATE, 0.02, order=5)
    assert within(jumps, DriveLimits(-1, 1))
    assert "give the steps a rise" in str(within(jumps, DriveLimits(slew=1e9)))
    with pytest.raises(UnusableInput, match="give the steps a rise"):
        fitted(jumps, DriveLimits(-1, 1, slew=1e9))
    with pytest.raises(UnusableInput, match="give bias="):
        fitted(examples()["sharp"], DriveLimits(3.0, 20.0))
    with pytest.raises(UnusableInput, match="leaves no room"):
        DriveLimits(2.0, 1.0)
    with pytest.raises(
        UnusableInput, match=r"needs the capacitance .* give capacitance in F, or slew"
    ):
        DriveLimits(current=1.0)
    assert DriveLimits(-1.0, 1.0, slew=2.0).steepest == 2.0  # nothing else needs a load
