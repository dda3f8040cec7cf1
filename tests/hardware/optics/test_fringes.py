"""Miscounts: found, not invented, and repaired only on request."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.optics import find_miscounts, largest_amplitude, repaired

FRINGE = 316.405e-9


def _motion(
    amplitude: float, frequency: float, rate: float, noise: float, seed: int, n: int = 4096
) -> Array:
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    wave = amplitude * np.sin(2.0 * np.pi * frequency * t + rng.uniform(0.0, 6.0))
    return np.asarray(wave + noise * rng.standard_normal(n))


@pytest.mark.parametrize(
    ("amplitude", "frequency", "rate", "noise"),
    [
        (2.2e-6, 2.0, 3125.0, 1e-9),
        (2.2e-6, 2.0, 3125.0, 15e-9),
        (2.2e-6, 100.0, 3125.0, 1e-9),  # 1.4 fringes a sample
        (2.2e-6, 100.0, 16e3, 5e-9),
        (2.2e-6, 1000.0, 1e6, 5e-9),
        (0.0, 1.0, 3125.0, 0.0),
    ],
)
def test_all_are_found_none_is_invented(
    amplitude: float, frequency: float, rate: float, noise: float
) -> None:
    for seed in range(25):
        x = _motion(amplitude, frequency, rate, noise, seed)
        clean = find_miscounts(x, FRINGE)
        assert clean.jumps == ()
        assert clean.able
        assert not clean.flags.any()
        rng = np.random.default_rng(1000 + seed)
        # an end is not enough for fast motion
        end = 1 if frequency < 100.0 else 6
        at = np.sort(rng.choice(np.arange(end, x.size - end + 1), 3, replace=False))
        k = rng.choice([-3, -2, -1, 1, 2, 3], 3)
        steps = np.zeros(x.size)
        steps[at] = k
        offset = np.cumsum(steps)
        found = find_miscounts(x + FRINGE * offset, FRINGE)
        assert [(j.sample, j.fringes, j.whole) for j in found.jumps] == [
            (int(a), int(c), True) for a, c in zip(at, k, strict=True)
        ]
        assert np.array_equal(found.flags == Flag.MISCOUNT, offset != 0.0)
        mended = repaired(x + FRINGE * offset, found, FRINGE)
        assert np.abs(mended.position - x).max() < 1e-15
        assert f"{k[0]:+d} at sample {at[0]}" in mended.report


def test_a_spike_of_one_fringe_is_two_jumps() -> None:
    x = _motion(2.2e-6, 2.0, 3125.0, 1e-9, 0)
    x[500] += FRINGE
    found = find_miscounts(x, FRINGE)
    assert [(j.sample, j.fringes) for j in found.jumps] == [(500, 1), (501, -1)]
    assert np.flatnonzero(found.flags).tolist() == [500]


def test_what_is_no_whole_number_is_told_and_left() -> None:
    x = _motion(2.2e-6, 2.0, 3125.0, 1e-9, 0)
    x[1000:] += 1.5 * FRINGE
    found = find_miscounts(x, FRINGE)
    assert [(j.sample, j.whole) for j in found.jumps] == [(1000, False)]
    assert not found.flags.any()
    mended = repaired(x, found, FRINGE)
    assert np.array_equal(mended.position, x)
    assert "no whole number: +474 nm at sample 1000" in mended.report


def test_a_commanded_step_is_not_looked_at() -> None:
    x = _motion(0.1e-6, 2.0, 3125.0, 1e-9, 0)
    x[1000:] += 4.0 * FRINGE
    x[3000:] += FRINGE
    step = np.zeros(x.size, np.bool_)
    step[990:1011] = True
    assert [j.sample for j in find_miscounts(x, FRINGE).jumps] == [1000, 3000]
    assert [j.sample for j in find_miscounts(x, FRINGE, step).jumps] == [3000]


def test_a_jump_beside_a_broken_one_is_not_trusted() -> None:
    x = _motion(0.1e-6, 2.0, 3125.0, 1e-9, 0)
    x[1000:] += 1.5 * FRINGE
    x[1002:] += 1.0 * FRINGE
    assert all(not j.whole for j in find_miscounts(x, FRINGE).jumps)


def test_where_it_cannot_see_it_says_so() -> None:
    rate = 3125.0
    limit = largest_amplitude(300.0, rate, FRINGE)
    below = find_miscounts(_motion(0.9 * limit, 300.0, rate, 0.0, 0), FRINGE)
    above = find_miscounts(_motion(1.3 * limit, 300.0, rate, 0.0, 0), FRINGE)
    assert below.able
    assert not above.able
    assert below.jumps == above.jumps == ()
    x = _motion(0.9 * limit, 300.0, rate, 0.0, 0)
    x[2000:] += FRINGE
    assert [j.sample for j in find_miscounts(x, FRINGE).jumps] == [2000]
    assert not find_miscounts(_motion(0.0, 1.0, rate, 100e-9, 0), FRINGE).able


def test_what_is_no_record_is_refused() -> None:
    with pytest.raises(UnusableInput, match="at least 12"):
        find_miscounts(np.zeros(5), FRINGE)
    with pytest.raises(UnusableInput, match="finite"):
        find_miscounts(np.full(50, np.nan), FRINGE)
    with pytest.raises(UnusableInput, match="fringe of 0"):
        find_miscounts(np.zeros(50), 0.0)
    wild = FRINGE * (np.arange(45000) // 40)
    with pytest.raises(UnusableInput, match="more than 1000 jumps"):
        find_miscounts(wild, FRINGE)
