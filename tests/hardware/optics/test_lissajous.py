"""The figure of the two signals: what it says of the head, and of the displacement."""

from __future__ import annotations

import numpy as np
import pytest

from hardware.optics import HELIUM_NEON, Ellipse, lissajous, periodic_error, quadrature_displacement
from hardware.optics.phase import quadrature_phase, unwrap

Pair = tuple[np.ndarray, np.ndarray]
POOR = Ellipse(320.0, -240.0, 1.07, 0.07, 8000.0)


def figure(ellipse: Ellipse, first: float, last: float, noise: float = 0.0) -> Pair:
    phase = np.linspace(first, last, 4000)
    rng = np.random.default_rng(1)
    u1, u2 = ellipse.signals(phase)
    return u1 + noise * rng.standard_normal(4000), u2 + noise * rng.standard_normal(4000)


def test_the_error_is_that_of_the_count_from_raw_signals() -> None:
    u1, u2 = figure(POOR, 0.0, 12.0)
    raw = unwrap(quadrature_phase(u1, u2))[0]
    true = np.linspace(0.0, 12.0, 4000)
    error = (raw - true) * HELIUM_NEON / (4.0 * np.pi)
    found = lissajous(u1, u2)
    assert found.before == pytest.approx(np.ptp(error), rel=0.01)
    assert found.good
    x = quadrature_displacement(u1, u2, found.fit.ellipse)
    assert np.ptp(x - true * HELIUM_NEON / (4.0 * np.pi)) < 1e-13


def test_small_faults_have_their_textbook_errors() -> None:
    # an offset p bends by p sin, twice its size from top to bottom; a gain and a skew act twice
    # a fringe with half their size, so each is worth its own size peak to peak
    assert periodic_error(Ellipse(offset_1=0.01)) == pytest.approx(0.02, rel=0.01)
    assert periodic_error(Ellipse(ratio=1.01)) == pytest.approx(0.01, rel=0.02)
    assert periodic_error(Ellipse(skew=0.01)) == pytest.approx(0.01, rel=0.02)


def test_what_is_not_closed_or_not_thin_is_told() -> None:
    arc = lissajous(*figure(POOR, 0.0, 5.0))
    assert not arc.good
    assert np.degrees(arc.gap) == pytest.approx(np.degrees(2.0 * np.pi - 5.0), abs=5.0)
    assert any("not closed" in s and "RG-10" in s for s in arc.sentences)
    fat = lissajous(*figure(POOR, 0.0, 30.0, noise=640.0))
    assert not fat.good
    assert any("not thin" in s for s in fat.sentences)
    assert not any("not closed" in s for s in fat.sentences)
