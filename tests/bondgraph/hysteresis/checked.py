"""What several kinds of operators are asked, each over a range of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis.numeric_inverse import numeric_inverse
from bondgraph.support.ops import NUMPY


def energy_of_a_move(
    operator: Any, seed: int, size: float, points: int, near: float, least: float = 0.0
) -> tuple[float, float]:
    """Work of a monotone move is what is stored and lost; return its end's output and store."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-size, size, 20)
    memory, start, end = operator.run(x)[1], float(x[-1]), float(rng.uniform(-size, size))
    way = np.linspace(start, end, points)
    y, _ = operator.run(way, memory)
    effort, displacement = (y, way) if operator.passive_port == "output" else (way, y)
    work = float(np.sum(0.5 * (effort[1:] + effort[:-1]) * np.diff(displacement)))
    first, last = (float(operator.stored_energy(NUMPY, at, memory)) for at in (start, end))
    lost = float(operator.dissipated_energy(NUMPY, end, memory))
    assert min(first, last) >= least
    assert lost >= 0.0
    assert last - first + lost == pytest.approx(work, abs=near)
    return float(y[-1]), last


def found_back(
    operator: Any, seed: int, reach: tuple[float, float], n: int = 200, near: float = 1e-9
) -> Any:
    """The numeric inverse from a memory with a past, which is returned."""
    rng = np.random.default_rng(seed)
    past, x = rng.uniform(*reach, 20), rng.uniform(*reach, n)
    memory = operator.run(past)[1]
    y, after = operator.run(x, memory)
    back, after_back = numeric_inverse(operator, y, memory, start=float(past[-1]))
    assert np.max(np.abs(back - x)) < near
    np.testing.assert_allclose(after_back, after, atol=near)
    return memory
