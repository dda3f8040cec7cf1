"""What is a loop in a law plane, and what only jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis import PrandtlIshlinskii
from identification.diagnosis.report.law import LawPath
from identification.diagnosis.report.law_figures import many_valued

TIME = np.linspace(0.0, 10.0, 4000)
WAY = np.sin(2 * np.pi * 0.7 * TIME) * np.linspace(0.2, 1.0, TIME.size)
STUCK = np.where(np.abs(WAY) < 0.01, 0.0, WAY)
PLAYS, _ = PrandtlIshlinskii((0.0, 0.1, 0.4), (1.0, 0.8, 0.5)).run(WAY)
RNG = np.random.default_rng(1)


@pytest.mark.parametrize(
    ("argument", "deviation", "loop"),
    [
        (WAY, WAY**3, False),
        (STUCK, np.where(STUCK == 0, RNG.uniform(-1, 1, TIME.size), np.sign(STUCK)), False),
        (WAY, np.sign(WAY - 0.3) + np.sign(WAY + 0.4), False),
        (WAY, np.asarray(PLAYS) - 1.5 * WAY, True),
        (WAY, 0.3 * np.sign(np.gradient(WAY)), True),
    ],
    ids=["cubic", "friction that sticks", "two jumps", "plays", "reversals"],
)
def test_a_jump_is_no_loop(argument: Any, deviation: Any, loop: bool) -> None:
    seen = LawPath(TIME, argument, deviation, 0.0, "m", "N", "way", "force")
    assert many_valued(seen) is loop
