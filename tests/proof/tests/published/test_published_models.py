"""The benchmark devices against formulas and independent integration; no data."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bondgraph import BondGraph
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import compile_model
from bondgraph.support.ops import CASADI, NUMPY
from tests.proof.published.models.band_brake import band_brake
from tests.proof.published.models.bouc_wen import bouc_wen
from tests.proof.published.models.coupled_drives import coupled_drives
from tests.proof.published.models.diode_clamp import DiodeClamp
from tests.proof.published.models.positioning_axis import positioning_axis
from tests.proof.published.models.silverbox import RANGE, silverbox
from tests.proof.published.models.wiener_hammerstein import wiener_hammerstein
from tests.settled import simulate

GRAPHS = [wiener_hammerstein, silverbox, bouc_wen, coupled_drives, positioning_axis, band_brake]
DIODE = (9e3, 7.0, 0.6, 0.048)


@pytest.mark.parametrize("make", GRAPHS)
def test_sound_and_fast(make: Any) -> None:
    graph: BondGraph = make()
    assert graph.check() == ()
    assert compile_model(graph).model.readings  # the form with sensitivities exists


def test_diode_clamp_solves_its_network() -> None:
    law, (leak, series, knee, thermal) = DiodeClamp(), DIODE
    least = law.current * np.exp(-knee / thermal)

    def excess(v: float, i: float) -> float:
        """Current into the node less what leaves it; the diode's voltage is eliminated."""
        j = i - v / leak
        return float(v - series * j - thermal * np.log1p(j / least))

    for i in (1e-7, 3e-5, 6.5e-5, 1e-4, 1e-3, 5e-3):
        lowest = leak * (i - 5e-2)
        root = brentq(excess, lowest, leak * i, args=(i,), xtol=1e-14)
        assert float(law.voltage(NUMPY, i, DIODE)) == pytest.approx(root, rel=1e-6, abs=1e-9)
    currents = np.linspace(-2e-3, 5e-3, 400)
    v = law.voltage(NUMPY, currents, DIODE)
    assert (v * currents >= -1e-15).all()  # it never gives power
    assert np.allclose(v[currents < 0], leak * currents[currents < 0], atol=1.1 * leak * least)
    assert float(CASADI.maximum(law.voltage(CASADI, 1e-3, DIODE), -1e9)) == pytest.approx(
        float(law.voltage(NUMPY, 1e-3, DIODE))
    )


def test_circuit_is_the_two_published_filters() -> None:
    compiled = compile_model(wiener_hammerstein())
    p = compiled.vector({"V_k_D": 1e3, "tau_y": 1e-9})  # no diode, no lag
    space = blocks(compiled, np.asarray(compiled.matrices(p).full()))
    # without current in the diode the law is its leak resistor
    law = compiled.laws[0].law
    numbers = [p[i] for i in compiled.law_parameters]
    slope = float(law.deviation(NUMPY, 1e-4, (), numbers)) / 1e-4
    e, rest = space.b[:, 1:], 1.0 / (1.0 - slope * space.ds[0, 1])
    a = space.a + slope * rest * e @ space.cs
    b = space.b[:, :1] + slope * rest * e * space.ds[0, 0]
    f = np.array([100.0, 1500.0, 4400.0, 5000.0, 5773.5, 8000.0])
    found = np.array(
        [(space.cy @ np.linalg.solve(2j * np.pi * v * np.eye(a.shape[0]) - a, b)).item() for v in f]
    )
    turn = 2 * np.pi
    first = signal.cheby1(3, 0.5, turn * 4400, analog=True, output="zpk")
    second = signal.cheby2(3, 40, turn * 5000, analog=True, output="zpk")
    (_, wanted), (_, more) = (signal.freqs_zpk(*z, worN=turn * f) for z in (first, second))
    share = numbers[0] / (1e3 + numbers[0])
    assert np.allclose(found, share * wanted * more, atol=2e-4)
    assert abs(found[2]) / share == pytest.approx(10 ** (-0.5 / 20) * abs(more[2]), rel=1e-2)


def test_circuit_saturates_one_way() -> None:
    graph = wiener_hammerstein()
    t = np.arange(600) / 51200.0
    up, down = (simulate(graph, t, {"u": s * 2.0 * np.ones(t.size)})["y"][-1] for s in (1, -1))
    assert down == pytest.approx(-2.0 * 10 / 11, rel=1e-3)
    assert 0.5 < up < 0.7


def test_silverbox_against_an_ordinary_integrator() -> None:
    values = {"a_2_N": -0.002, "a_3_N": 0.06, "tau": 1e-4}
    graph = silverbox().with_values(values)
    m, d, k = (graph.parameters[n].value for n in ("m", "d", "k"))
    t = np.arange(800) / 2000.0
    u = 0.08 * np.sin(2 * np.pi * 55.0 * t)

    def rate(time: float, x: Any) -> list[float]:
        y, v = x
        z = y / RANGE
        force = values["a_2_N"] * z**2 + values["a_3_N"] * z**3
        slope = (2 * values["a_2_N"] * z + 3 * values["a_3_N"] * z**2) / RANGE
        return [
            v,
            (np.interp(time, t, u) - d * v - k * y - force - values["tau"] * slope * v) / m,
        ]

    exact = solve_ivp(rate, (0, t[-1]), [0, 0], t_eval=t, rtol=1e-8, atol=1e-12, max_step=2.5e-4)
    found = simulate(graph, t, {"u": u}, accuracy=1e-5)["y"]
    assert np.ptp(exact.y[0]) > 0.3
    assert np.sqrt(np.mean((found - exact.y[0]) ** 2)) < 3e-3 * exact.y[0].std()


def test_bouc_wen_against_an_ordinary_integrator() -> None:
    b, g, alpha, k, m, c = 800.0, -1100.0, 5e4, 5e4, 2.0, 10.0
    values = {"m": m, "c": c, "slope_h": k, "growth_h": alpha, "beta_h": b, "gamma_h": g}
    t = np.arange(400) / 750.0
    u = 60.0 * np.sin(2 * np.pi * 30 * t) * t / t[-1]

    def rate(time: float, s: Any) -> list[float]:
        x, v, z = s
        slope = alpha * v - b * abs(v) * z - g * v * abs(z)
        return [v, (np.interp(time, t, u) - c * v - k * x - z) / m, slope]

    exact = solve_ivp(rate, (0, t[-1]), [0, 0, 0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=1e-4)
    found = simulate(bouc_wen(), t, {"F": u}, values, accuracy=1e-5)["x"]
    assert np.sqrt(np.mean((found - exact.y[0]) ** 2)) < 1e-3 * exact.y[0].std()


def test_counter_does_not_see_the_direction() -> None:
    t = np.arange(300) * 0.02
    u = np.sign(np.sin(1.1 * t) + 0.3)
    one, other = (simulate(coupled_drives(), t, {"u": s * u})["y"] for s in (1.0, -1.0))
    settled = slice(60, None)  # the filter starts where it would rest with the sign
    assert np.allclose(one[settled], other[settled], atol=2e-2 * one.max())
    assert one[settled].min() > 0.0
    assert one.max() > 0.5
    signed = simulate(coupled_drives(rectified=False), t, {"u": u})["y"]
    assert signed.min() < -0.1


def test_axis_slides_and_sticks() -> None:
    graph = positioning_axis(95.0, 200.0, 20.0)
    t = np.arange(6000) * 1e-3
    moving = simulate(graph, t, {"F": np.full(t.size, 60.0)}, {"F_0": 3.0})["x"]
    assert (moving[-1] - moving[-101]) / 0.1 == pytest.approx((63.0 - 20.0) / 200.0, rel=1e-3)
    stuck = simulate(graph, t, {"F": np.full(t.size, 16.0)}, {"F_0": 3.0}, x0=np.zeros(2))["x"]
    assert np.abs(stuck).max() < 1e-12


def test_band_brake_is_a_slider_behind_a_spring_with_play() -> None:
    """``e' = v - s'``, ``F = k (e less the gap)``, ``F = F_i + c s'`` where it slides."""
    k, gap, forth, back, c, step = 5e6, 2e-3, 1e4, 1.5e4, 2e4, 2e-4
    t = step * np.arange(7500)
    v = 0.06 * np.sin(2 * np.pi * t)
    made = simulate(
        band_brake(k, gap), t, {"v": v}, {"F_1_c": forth, "F_2_c": back}, hold="linear"
    )["F"]
    fine, e, force = 10, 0.0, np.zeros(t.size)
    for i in range(t.size - 1):
        for j in range(fine):
            f = k * (e - np.clip(e, -gap, gap))
            level = forth if f > 0 else back
            slides = np.sign(f) * max(abs(f) - level, 0.0) / c
            e += step / fine * (v[i] + (v[i + 1] - v[i]) * (j + 0.5) / fine - slides)
        force[i + 1] = k * (e - np.clip(e, -gap, gap))
    assert np.ptp(made) > forth + back
    np.testing.assert_allclose(made, force, atol=0.01 * (forth + back))
