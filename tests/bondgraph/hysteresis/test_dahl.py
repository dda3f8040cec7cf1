"""Dahl's model: a special Bouc-Wen, its closed forms, energy and inverse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis.duhem.dahl import Dahl
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.checked import energy_of_a_move, found_back

DAHL = Dahl(2.0, 1.5)


def test_textbook_branch() -> None:
    """From F at a reversal: F_c - (F_c - F) exp(-sigma dx/F_c) upwards, mirrored downwards."""
    memory = DAHL.run([0.0, 1.0, -0.4])[1]
    force, sigma, limit = float(memory[1]), 2.0, 1.5
    dx = np.linspace(0, 3, 50)
    up = limit - (limit - force) * np.exp(-sigma * dx / limit)
    down = -limit + (limit + force) * np.exp(-sigma * dx / limit)
    np.testing.assert_allclose(DAHL.value(NUMPY, -0.4 + dx, memory), up, atol=1e-14)
    np.testing.assert_allclose(DAHL.value(NUMPY, -0.4 - dx, memory), down, atol=1e-14)


def test_is_bouc_wen_without_gamma() -> None:
    x = np.random.default_rng(0).uniform(-2, 2, 300)
    force, memory = DAHL.run(x)
    other, after = DAHL.as_bouc_wen().run(x)
    np.testing.assert_allclose(other, force, atol=1e-14)
    np.testing.assert_allclose(after, memory, atol=1e-14)
    assert DAHL.as_bouc_wen().gamma == 0.0
    assert DAHL.linear_slope == DAHL.as_bouc_wen().linear_slope == 2.0


def test_one_step_is_a_thousand() -> None:
    once, many = (
        DAHL.run([0.0, 5.0, -5.0])[0],
        DAHL.run(np.concatenate((np.linspace(0, 5, 1001), np.linspace(5, -5, 1001))))[0],
    )
    assert abs(once[1] - many[1000]) < 1e-12
    assert abs(once[2] - many[-1]) < 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_energy_balance_on_a_monotone_move(seed: int) -> None:
    force, stored = energy_of_a_move(DAHL, seed, 2.0, 100_001, 1e-8)
    assert stored == pytest.approx(0.5 * force**2 / 2.0, rel=1e-12)


def test_loop_loss_tends_to_the_rectangle() -> None:
    """Long strokes lose 4 F_c A less the corners; the settled loop has a closed form."""
    for amplitude in (0.1, 1.0, 30.0):
        k = 2.0 / 1.5
        turn = 1.5 * np.tanh(k * amplitude)
        # per branch F_c h - F_c/sigma times the rise of F, from -turn to turn
        branch = 1.5 * 2 * amplitude - 1.5 / 2.0 * 2 * turn
        assert DAHL.loop_loss(amplitude) == pytest.approx(2 * branch, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_numeric_inverse_from_a_memory_with_a_past(seed: int) -> None:
    found_back(DAHL, seed, (-1.0, 1.0))


@pytest.mark.parametrize(("values", "name"), [((0.0, 1.0), "stiffness"), ((1.0, -1.0), "coulomb")])
def test_errors(values: Any, name: str) -> None:
    with pytest.raises(BadParameter, match=f"{name} = .* must be positive"):
        Dahl(*values)
