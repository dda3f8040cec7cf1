"""The printed parameters of the stack actuator thesis give the printed loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    MaxwellResistiveCapacitor,
    inverse_of_identity_plus,
)

SAMPLES = 4000  # per period


def drive(periods: int) -> np.ndarray:
    """0..100 V, sinusoidal, from 0 V."""
    t = np.arange(periods * SAMPLES + 1) / SAMPLES
    return 50.0 - 50.0 * np.cos(2.0 * np.pi * t)


def third_period(operator: Any) -> tuple[float, float, float]:
    """Bottom, top and thickness of the loop."""
    u = drive(3)
    z, _ = operator.run(u)
    u, z = u[2 * SAMPLES :], z[2 * SAMPLES :]
    top, grid = SAMPLES // 2, np.linspace(0.0, 100.0, 2001)
    up = np.interp(grid, u[: top + 1], z[: top + 1])
    down = np.interp(grid, u[top:][::-1], z[top:][::-1])
    return z.min(), z.max(), np.max(down - up)


def test_al_janaideh_6_2() -> None:
    assert third_period(AlJanaideh.stack_2hz()) == pytest.approx(
        (506.8e-9, 4914.7e-9, 790e-9), rel=6e-4
    )


def test_ang_6_3() -> None:
    assert third_period(Ang.stack_2hz()) == pytest.approx((475.5e-9, 4873.2e-9, 766e-9), rel=6e-4)


@pytest.mark.parametrize("operator", [AlJanaideh.stack_2hz(), Ang.stack_2hz()])
def test_inverse_on_the_reference_7_3(operator: Any) -> None:
    t = np.linspace(0.0, 3.0, 3001)
    fast = 2000.0 * np.sin(2 * np.pi * t - np.pi / 2) + 2000.0
    slow = 1500.0 * np.sin(2 * np.pi * t - np.pi / 2) + 2500.0
    z = 1e-9 * np.where(t < 0.5, fast, slow)
    u, _ = operator.inverse().run(z)
    assert np.max(np.abs(operator.run(u)[0] - z)) < 1e-11 * 1e-6
    assert u.max() == pytest.approx(83.1 if isinstance(operator, AlJanaideh) else 84.1, abs=0.1)


@pytest.mark.parametrize("operator", [AlJanaideh.stack_2hz(), Ang.stack_2hz()])
def test_inverse_of_an_actuator_with_a_past(operator: Any) -> None:
    _, memory = operator.run([0.0, 90.0, 20.0, 60.0])
    u = drive(2)
    z, _ = operator.run(u, memory)
    back, _ = operator.inverse().run(z, operator.inverse_memory(memory))
    assert np.max(np.abs(back - u)) < 1e-9 * 100.0


def test_maxwell_table_6_4_in_the_lumped_model() -> None:
    """Solve q + C H(q) = C V + T x with x = (T/k)(V - H): one capacitance C + T^2/k."""
    maxwell = MaxwellResistiveCapacitor.stack_2hz()
    free = 1.5e-6 + 3.52**2 / 65e6
    u = drive(3)
    q, _ = inverse_of_identity_plus(free, maxwell).run(free * u)
    v, _ = maxwell.run(q)
    assert np.max(np.abs(q / free + v - u)) < 1e-12
    q, v, u = (a[2 * SAMPLES :] for a in (q, v, u))
    assert q.max() == pytest.approx(140.8e-6, rel=1e-3)
    assert v.max() == pytest.approx(16.69, rel=1e-3)
    x = 3.52 / 65e6 * (u - v)
    assert (x.min(), x.max()) == pytest.approx((510.9e-9, 4511.6e-9), rel=1e-4)
    loss = np.sum(0.5 * (v[1:] + v[:-1]) * np.diff(q))
    assert loss == pytest.approx(1.18e-3, rel=5e-3)
    assert loss == pytest.approx(float(maxwell.loop_loss(np.ptp(q) / 2)), rel=1e-5)
