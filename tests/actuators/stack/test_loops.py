"""Thickness of loops with a known answer."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.stack.loop_width import loop_of
from bondgraph.hysteresis import AlJanaideh, Ang
from bondgraph.support.errors import UnusableInput


def test_published_loops() -> None:
    t = np.linspace(0, 1.5, 6001)
    volt = 50 - 50 * np.cos(4 * np.pi * t)
    for operator, thick in ((AlJanaideh.stack_2hz(), 790e-9), (Ang.stack_2hz(), 766e-9)):
        x, _ = operator.run(volt)
        loop = loop_of(volt[4000:], x[4000:])
        assert loop.thickness == pytest.approx(thick, abs=1e-9)


@pytest.mark.parametrize("start", [0, 137, 500, 900])
def test_ellipse_from_any_start_and_sign(start: int) -> None:
    t = 2 * np.pi * (np.arange(1000) + start) / 1000
    for lag in (0.2, -0.2):
        loop = loop_of(np.sin(t), 3 * np.sin(t - lag))
        assert loop.thickness == pytest.approx(6 * np.sin(lag), rel=1e-3)
        assert loop.percent == pytest.approx(100 * np.sin(lag), rel=1e-3)


def test_refusals() -> None:
    with pytest.raises(UnusableInput, match="does not move"):
        loop_of(np.ones(20), np.arange(20.0))
    with pytest.raises(UnusableInput, match="one period"):
        loop_of(np.arange(20.0), np.arange(19.0))
