"""Slopes of loading curves: values, intervals that hold, what remanence does."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.stack.excitation import join, loading_ramp, printed_demagnetisation, sine
from actuators.stack.loading_curve import (
    LoadingCurve,
    loading_curve,
    loading_slopes,
    transducer_constant,
)
from bondgraph import Recording
from bondgraph.hysteresis import AlJanaideh
from bondgraph.support.errors import UnusableInput

STACK = AlJanaideh.stack_2hz()
RAMP = loading_ramp()


def after(history: list[float], top: float = 100.0) -> LoadingCurve:
    ramp = loading_ramp(0.0, top)
    x = STACK.run(np.concatenate((history, ramp.volt)))[0][-ramp.volt.size :]
    return LoadingCurve(ramp.volt, x)


def test_published_slopes() -> None:
    found = loading_slopes(after([0.0]))
    assert found.last.value == pytest.approx(54.21e-9, abs=0.01e-9)
    assert found.chord.value == pytest.approx(54.21e-9, abs=0.01e-9)
    assert found.first.value == pytest.approx(18.42e-9 * 1.21, abs=0.01e-9)
    assert found.last.window == (98.0, 100.0)
    # k = 65 N/um, table 6.1
    assert transducer_constant(found.last, 65e6).value == pytest.approx(3.52, abs=0.01)


def test_remanence_spoils_the_end_slope_of_short_strokes_only() -> None:
    used = [0.0, 100.0, 0.0]
    assert loading_slopes(after(used)).last.value == pytest.approx(54.21e-9, abs=0.01e-9)
    fresh, stale = (loading_slopes(after(h, 60.0)).last.value for h in ([0.0], used))
    assert fresh == pytest.approx(54.21e-9, abs=0.01e-9)
    assert stale == pytest.approx(49.1e-9, abs=0.5e-9)
    # plays move up from 2 r, not from r: the curve in between is another one
    rise_fresh, rise_stale = (np.array(after(h).displacement) for h in ([0.0], used))
    off = np.abs((rise_fresh - rise_fresh[0]) - (rise_stale - rise_stale[0])).max()
    assert off == pytest.approx(507e-9, abs=1e-9)


def test_intervals_cover_with_white_and_with_correlated_noise() -> None:
    rng = np.random.default_rng(3)
    truth, line = 54e-9, 54e-9 * RAMP.volt
    for rho in (0.0, 0.8):
        hits_line = hits_chord = 0
        errors = []
        for _ in range(200):
            white = rng.standard_normal(RAMP.volt.size)
            noise = white
            if rho:
                from scipy.signal import lfilter

                noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white)
            found = loading_slopes(RAMP.volt, line + 2e-9 * noise)
            hits_line += found.last.ci95[0] <= truth <= found.last.ci95[1]
            hits_chord += found.chord.ci95[0] <= truth <= found.chord.ci95[1]
            errors.append(found.last.standard_error)
        assert 180 <= hits_line <= 199, rho
        assert 180 <= hits_chord <= 199, rho
        if rho == 0.0:
            wanted = 2e-9 * np.sqrt(12 / 626) / 2.0
            assert np.mean(errors) == pytest.approx(wanted, rel=0.05)


def test_a_line_beats_two_points() -> None:
    rng = np.random.default_rng(0)
    found = loading_slopes(RAMP.volt, 54e-9 * RAMP.volt + 2e-9 * rng.standard_normal(31251))
    assert found.noise == pytest.approx(2e-9, rel=0.1)
    assert found.chord.standard_error > 8 * found.last.standard_error


def test_loading_is_found_in_a_recording() -> None:
    signal = join(sine(2.0, 1.0, high=60.0), printed_demagnetisation())
    volt = np.concatenate((signal.volt[:-1], RAMP.volt, RAMP.volt[::-1]))
    x = STACK.run(volt)[0]
    rng = np.random.default_rng(1)
    for noise in (0.0, 0.02):
        seen = volt + noise * rng.standard_normal(volt.size)
        arrays = {"V_in[V]": seen, "x[m]": x}
        recording = Recording.from_arrays("loading", arrays, fs=3125.0)
        curve = loading_curve(recording)
        # the last half wave of the decay rises too, from -0.7 V
        assert 31251 <= curve.volt.size <= 31251 + 400
        assert curve.volt.max() == pytest.approx(100.0, abs=0.1)
        found = loading_slopes(curve)
        assert found.last.value == pytest.approx(54.2e-9, rel=0.01)


def test_stiffness_error_widens_the_constant() -> None:
    found = loading_slopes(after([0.0]))
    sharp = transducer_constant(found.last, 65e6)
    wide = transducer_constant(found.last, 65e6, 6.5e6)
    assert wide.value == sharp.value
    assert wide.ci95[1] - wide.value == pytest.approx(0.196 * wide.value, rel=1e-3)


@pytest.mark.parametrize(
    ("volt", "x", "segments", "match"),
    [
        (np.arange(100.0), np.arange(99.0), 50, "one length"),
        (np.arange(100.0), np.full(100, np.nan), 50, "finite"),
        (np.ones(100), np.arange(100.0), 50, "must rise"),
        (np.arange(100.0), np.arange(100.0), 1, "2 or more"),
        (np.arange(100.0), np.arange(100.0), 50, "fewer than 50 segments"),
        (np.arange(100.0), None, 50, "beside the voltage"),
        (np.repeat([0.0, 1.0], 50), np.arange(100.0), 50, "one value, 0 V, over 50 samples"),
    ],
)
def test_refusals(volt: np.ndarray, x: np.ndarray | None, segments: int, match: str) -> None:
    with pytest.raises(UnusableInput, match=match):
        loading_slopes(volt, x, segments)


def test_recordings_without_a_rise() -> None:
    flat = Recording.from_arrays("flat", {"V_in[V]": np.ones(50), "x[m]": np.ones(50)}, fs=1.0)
    with pytest.raises(UnusableInput, match="constant"):
        loading_curve(flat)
    falls = {"V_in[V]": np.arange(50.0)[::-1], "x[m]": np.ones(50)}
    with pytest.raises(UnusableInput, match="never rises"):
        loading_curve(Recording.from_arrays("falls", falls, fs=1.0))
    with pytest.raises(UnusableInput, match="positive"):
        transducer_constant(loading_slopes(RAMP.volt, RAMP.volt).last, 0.0)
