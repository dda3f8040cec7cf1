"""A disc that switches: three readings of one polarisation, and its power by hand."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.stack.switching_disc import COERCIVE, SATURATION, switching_disc
from tests.settled import simulate

H, A = 0.8e-3, 60e-6
T = np.linspace(0.0, 2.0, 401)
DRIVE = 1500.0 * np.interp(T % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
PERIOD = slice(201, 401)


def test_butterfly_and_power_of_one_polarisation() -> None:
    pull = 2000.0
    run = simulate(
        switching_disc(thickness=H, area=A), T, {"V_in": DRIVE, "F_e": np.full(T.size, pull)},
        x0=np.zeros(2), accuracy=1e-5,
    )  # fmt: skip
    i, p, x = (np.asarray(run[n]) for n in ("i", "P", "x"))
    # strain follows the polarisation alone, the current is its rate
    np.testing.assert_allclose(x, 0.02 * H * p**2, atol=1e-4 * np.ptp(x))
    charge = np.concatenate([[0.0], np.cumsum(0.5 * (i[1:] + i[:-1]) * np.diff(T))])
    np.testing.assert_allclose(charge, A * p, atol=0.02 * A * np.ptp(p))
    # the law by hand: slope, stops of 0.1 and 0.3 of saturation, Landau's third and fifth power
    most, coercive = SATURATION * A, COERCIVE * H
    q = A * p
    law = 0.2 * coercive * q / most + coercive * (0.1 * (q / most) ** 3 + 0.3 * (q / most) ** 5)
    for width in (0.1 * most, 0.3 * most):
        play = 0.0
        for k, value in enumerate(q):
            play = max(value - width, min(value + width, play))
            law[k] += 2.5 * coercive / most * (value - play)
    # a pull F takes 2 Q h q F / A^2 off the voltage: what electrostriction gives it takes back
    back = 2 * 0.02 * H * q / A**2 * pull
    np.testing.assert_allclose(DRIVE, 1e5 * i + law - back, atol=0.02 * DRIVE.max())
    # the butterfly: a full period comes back, lowest where P passes zero, once up and once down
    assert np.ptp(p) > 1.8 * SATURATION
    low = [k for k in range(PERIOD.start, PERIOD.stop - 1) if p[k] * p[k + 1] < 0]
    assert len(low) == 2
    assert DRIVE[low[0]] * DRIVE[low[1]] < 0
    assert x[low].max() < 0.05 * np.ptp(x)
    # and the loop of charge and voltage loses energy
    assert np.trapezoid(DRIVE[PERIOD], q[PERIOD]) > 0.0


@pytest.mark.parametrize("bias", [0.2, -0.2])
def test_small_signal_about_a_polarisation_is_linear_piezo(bias: float) -> None:
    """``dx = 2 Q h P dP``: the sign of the piezo coefficient is that of the polarisation."""
    t = np.linspace(0.0, 0.2, 101)
    volts = 30.0 * np.sin(2 * np.pi * 10 * t)
    start, rest = {"q_C_p": bias * A, "q_x": 0.0}, {"C_p": (bias * A,) * 2}
    # the stops rest there: the voltage that holds it is that of slope and potential
    z = bias / SATURATION
    hold = COERCIVE * H * (0.2 * z + 0.1 * z**3 + 0.3 * z**5)
    run = simulate(
        switching_disc(thickness=H, area=A), t, {"V_in": hold + volts, "F_e": 0.0 * t},
        x0=start, memory=rest,
    )  # fmt: skip
    p, x = np.asarray(run["P"]) - bias, np.asarray(run["x"])
    np.testing.assert_allclose(x, 2 * 0.02 * H * bias * p, atol=0.02 * np.ptp(x))
    assert np.sign(np.corrcoef(x, volts)[0, 1]) == np.sign(bias)
