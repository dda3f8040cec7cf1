"""Designed signals: spectra, peaks, phases, dwell, turning points."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.stack.excitation import demagnetisation
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.experiments.design import (
    demagnetise,
    multisine,
    orthogonal_multisines,
    prbs,
    reversal_curves,
    staircase,
    sweep,
    through,
)
from identification.experiments.design.crest import course, crest_factor, phases_of

RATE, N = 1000.0, 1000


def amplitudes(values: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft(values)) * 2 / values.size)


# -- multisines -------------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["full", "odd", "random_odd"])
@pytest.mark.parametrize("phases", ["random", "schroeder", "low_crest"])
def test_only_the_lines_are_excited(kind: str, phases: str) -> None:
    s = multisine(RATE, N, band=(3.0, 120.0), kind=kind, phases=phases, rms=2.0, periods=2, bias=5)
    assert (s.values.size, s.period, s.periods) == (2 * N, N, 2)
    assert np.array_equal(s.values[:N], s.values[N:])
    found = amplitudes(s.one_period)
    lines = np.flatnonzero(found[1:] > 1e-9) + 1
    assert tuple(lines) == s.lines
    assert np.ptp(found[lines]) < 1e-9
    assert (s.bias, s.rms) == pytest.approx((5.0, 2.0))
    assert lines[0] >= 3
    assert lines[-1] <= 120
    if kind != "full":
        assert (lines % 2 == 1).all()


def test_one_detection_line_in_every_group() -> None:
    s = multisine(RATE, N, band=(1.0, 160.0), kind="random_odd", group=4, seed=5)
    candidates = np.arange(1, 161, 2).reshape(-1, 4)
    held = np.isin(candidates, s.detection)
    assert (held.sum(axis=1) == 1).all()
    assert set(s.lines) | set(s.detection) == set(candidates.ravel().tolist())
    assert len(set(np.argmax(held, axis=1))) == 4
    again, other = (multisine(RATE, N, band=(1, 160), kind="random_odd", seed=k) for k in (5, 6))
    assert np.array_equal(again.values, s.values)
    assert other.detection != s.detection


@pytest.mark.parametrize("count", [31, 100, 390])
def test_crest_factor_is_low(count: int) -> None:
    lines, a = np.arange(1, count + 1), np.ones(count)
    rng = np.random.default_rng(0)
    low, schroeder, random = (
        crest_factor(lines, a, phases_of(k, lines, a, rng))
        for k in ("low_crest", "schroeder", "random")
    )
    assert low < 1.45  # 1.41, 1.40 and 1.40 measured; a sine has 1.414
    assert 1.6 < schroeder < 2.0
    assert random > 2.5


def test_crest_factor_bounds_the_course() -> None:
    rng = np.random.default_rng(3)
    lines, a = np.arange(2, 40), rng.uniform(0.1, 1.0, 38)
    phi = rng.uniform(0, 6, 38)
    dense = np.abs(course(lines, a, phi, 200_000)).max() / np.sqrt(0.5 * np.sum(a**2))
    bound = crest_factor(lines, a, phi)
    assert dense <= bound * (1 + 1e-12)
    assert bound < 1.0013 * dense


def test_shape_and_peak() -> None:
    shape = np.linspace(1, 3, 20)
    s = multisine(RATE, N, lines=range(1, 21), shape=shape, peak=7.0, phases="low_crest")
    found = amplitudes(s.values)[1:21]
    assert found / found[0] == pytest.approx(shape)
    fine = np.fft.irfft(np.fft.rfft(s.values), 50 * N) * 50
    assert np.abs(fine).max() <= 7.0
    assert np.abs(fine).max() > 6.98


def test_realisations_are_orthogonal() -> None:
    rows = orthogonal_multisines(RATE, N, ["a", "b", "c"], band=(1, 80), kind="random_odd", rms=0.3)
    assert [s.name for s in rows[1]] == ["a", "b", "c"]
    u = np.stack([[np.fft.rfft(s.values) for s in row] for row in rows])[
        :, :, list(rows[0][0].lines)
    ]
    gram = np.einsum("mjk,mik->kji", u, u.conj())
    size = np.trace(gram, axis1=1, axis2=2).real / 3
    assert np.abs(gram / size[:, None, None] - np.eye(3)).max() < 1e-9
    assert {s.detection for row in rows for s in row} == {rows[0][0].detection}
    assert rows[2][1].rms == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"band": (600.0, 900.0)}, "no line"),
        ({"lines": [1, 700]}, "Nyquist"),
        ({"lines": [0, 3]}, "must lie within"),
        ({"rms": 1.0, "peak": 2.0}, "not both"),
        ({"band": (1, 2), "lines": [1]}, "not both"),
        ({"lines": [1, 2], "shape": [1.0]}, "2 positive numbers"),
        ({"rms": -1.0}, "must be positive"),
        ({"kind": "random_odd", "group": 1}, "at least 2"),
        ({"unit": "mV"}, "not SI"),
    ],
)
def test_multisine_refuses(options: dict, words: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(UnusableInput, match=words):
        multisine(RATE, N, **options)
    with pytest.raises(UnknownName, match="Did you mean 'random_odd'"):
        multisine(RATE, N, kind="random-odd")


# -- sweeps and steps -------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["linear", "log"])
def test_sweep_has_its_frequency_at_every_time(kind: str) -> None:
    s = sweep(10_000.0, 10.0, 400.0, 2.0, kind=kind, fade=0.0, amplitude=3.0)
    crossings = s.time[1:][np.diff(np.signbit(s.values)) & (s.values[1:] > 0)]
    middle, found = 0.5 * (crossings[1:] + crossings[:-1]), 1 / np.diff(crossings)
    part = middle / 2.0
    expected = 10 + 390 * part if kind == "linear" else 10 * 40**part
    # one sample of 10 kHz against the period, and the course of the frequency over one period
    assert np.median(np.abs(found / expected - 1)) < 0.02
    assert s.values[0] == 0.0
    assert abs(s.values).max() == pytest.approx(3.0, rel=1e-3)


def test_sweep_fades_and_runs_down() -> None:
    s = sweep(1000.0, 50.0, 1.0, 4.0, kind="log", fade=0.1)
    assert np.abs(s.values[:40]).max() < 0.05
    assert np.abs(s.values[-40:]).max() < 0.05
    with pytest.raises(UnusableInput, match="raise the rate"):
        sweep(100.0, 1.0, 60.0, 1.0)


def test_prbs_is_white_and_dwells() -> None:
    s = prbs(RATE, 0.01, order=6, low=-2.0, high=2.0, periods=2)
    assert s.period == 63 * 10
    assert s.between == "hold"
    assert set(s.values) == {-2.0, 2.0}
    chips = s.one_period[::10]
    correlation = [np.dot(chips, np.roll(chips, k)) / 4 for k in range(63)]
    assert correlation == pytest.approx([63.0] + 62 * [-1.0])
    changes = np.flatnonzero(np.diff(s.values)) + 1
    assert np.diff(changes).min() >= 10
    assert set(changes) <= set(s.marks)


def test_staircase_rises_in_time() -> None:
    s = staircase(RATE, 0.1, [1.0, 3.0, 2.0], start=0.0, rise=0.02)
    assert s.values.size == 300
    assert np.abs(np.diff(s.values)).max() == pytest.approx(0.1)
    assert [float(s.values[k]) for k in (99, 199, 299)] == [1.0, 3.0, 2.0]
    assert s.marks == (0, 100, 200)
    with pytest.raises(UnusableInput, match="lengthen the dwell"):
        staircase(RATE, 0.01, [1.0], rise=0.02)


# -- memories ---------------------------------------------------------------------------------
def test_demagnetise_is_that_of_the_stack() -> None:
    room = DriveLimits(-20, 120, current=0.2, capacitance=1.5e-6)
    s = demagnetise([1.0, 10.0, 20.0], 50.0, 3125.0, step=2.0, envelope=room)
    limits = DriveLimits(-20, 120, current=0.2, capacitance=1.5e-6)
    same = demagnetisation([1.0, 10.0, 20.0], 50.0, step=2.0, rate=3125.0, limits=limits)
    assert np.array_equal(s.values, same.volt)
    assert s.values[list(s.marks)][1:3] == pytest.approx([71.0, 30.909], abs=0.01)
    with pytest.raises(UnusableInput, match=r"no bias has room"):
        demagnetise([100.0], 50.0, 3125.0, envelope=room)


@pytest.mark.parametrize("shape", ["linear", "cosine"])
def test_reversal_curves_return_to_saturation(shape: str) -> None:
    s = reversal_curves(40.0, 4, 500.0, slew=100.0, lowest=-40.0, course=shape, dwell=0.1)
    at = s.values[list(s.marks)]
    assert at.tolist() == [40.0, 20.0, 40.0, 0.0, 40.0, -20.0, 40.0, -40.0, 40.0]
    assert np.abs(np.diff(s.values)).max() * 500.0 <= 100.0 * (1 + 1e-9)
    # every reversal curve ends in the same state: the memory of the one before is wiped out
    operator = PrandtlIshlinskii((0.0, 5.0, 15.0, 35.0), (1.0, 0.5, 0.3, 0.2))
    y, _ = operator.run(s.values)
    assert y[list(s.marks)][0::2] == pytest.approx(np.full(5, y[s.marks[0]]))


def test_turning_points_in_any_order() -> None:
    s = through([0.0, 5.0, -5.0, 1.0], 100.0, slew=10.0)
    assert s.values[list(s.marks)].tolist() == [0.0, 5.0, -5.0, 1.0]
    with pytest.raises(UnusableInput, match="below the saturation"):
        reversal_curves(10.0, [12.0], 100.0, slew=1.0)
    with pytest.raises(UnknownName, match="course"):
        through([0.0, 1.0], 100.0, slew=1.0, course="sine")


# -- the value --------------------------------------------------------------------------------
def test_signal_travels() -> None:
    s = multisine(RATE, N, band=(1, 50), name="F", unit="N")
    r = s.recording
    assert np.array_equal(r["F"], s.commands["F"])
    assert r.units["F"] == "N"
    assert "crest factor" in r.notes[1]
    assert s.scaled(2.0).rms == pytest.approx(2 * s.rms)
    assert s.moved(3.0).bias == pytest.approx(3.0)
    assert s.slowed(2.0).frequencies == pytest.approx(s.frequencies / 2)
    assert s.repeated(3).periods == 3
    with pytest.raises(UnusableInput, match="no period"):
        staircase(RATE, 0.1, [1.0, 2.0]).repeated(2)
    with pytest.raises(ValueError, match="read-only"):
        s.values[0] = 1.0
