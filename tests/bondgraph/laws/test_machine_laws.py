"""Magnets, iron and radiation against the physics they come from."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, C, De, I, One, R, Se, Sf, Zero
from bondgraph.equations.derivation import equations
from bondgraph.graph.sensors import Df
from bondgraph.laws import Magnet, Radiation, SaturatingInductance
from bondgraph.laws.radiating_level import radiating_level
from bondgraph.support.ops import NUMPY
from tests.settled import simulate


def test_a_black_body_warms_up_as_stefan_and_boltzmann_say() -> None:
    capacity, resistance, room = 20.0, 8.0, 293.0
    with BondGraph("body") as g:
        body = Zero("body")
        Sf("Q", unit="W") >> body >> C("C", capacity, unit="J/K")
        law = Radiation(1.0, room, "R", resistance)
        body >> R("R", resistance, unit="K/W", law=law)
        body >> De("T", unit="K")
    t = 0.5 * np.arange(1200)
    run = simulate(g, t, {"Q": np.full(t.size, 20.0)}, x0=np.zeros(1))
    b = 1.0 / (4.0 * resistance * room**3)

    def warming(_: float, e: np.ndarray) -> np.ndarray:
        return (20.0 - b * ((room + e) ** 4 - room**4)) / capacity

    told = solve_ivp(warming, (0, t[-1]), [0.0], t_eval=t, rtol=1e-10, atol=1e-10).y[0]
    np.testing.assert_allclose(run["T"], told, atol=1e-4)
    assert told[-1] < 100.0 < 20.0 * resistance  # the straight line would stand at 160 K


@pytest.mark.parametrize("share", [0.0, 0.01, 0.4, 0.9, 1.0])
def test_radiation_beside_conduction(share: float) -> None:
    """``f = (1 - share) e/R + b ((T + e)^4 - T^4)``, put into the law."""
    t, r, e = 300.0, 2.0, np.linspace(-100.0, 600.0, 701)
    b = share / (4.0 * r * t**3)
    f = (1.0 - share) * e / r + b * ((t + e) ** 4 - t**4)
    found = r * f + Radiation().deviation(NUMPY, f, (), (r, share, t))
    np.testing.assert_allclose(found, e, atol=1e-3)
    (cold,) = Radiation().deviation(NUMPY, np.array([-500.0]), (), (r, 1.0, t)) - 1000.0
    assert -t < cold < 0.0  # a flow that no surface gives leaves it above 0 K


def test_a_magnet_is_the_inverse_square_with_or_without_its_spring() -> None:
    s, a, g = np.linspace(-0.5, 0.8, 27), 0.3, 1.2
    p = (a / g**2, g)
    force = Magnet(a / g**2, g).deviation(NUMPY, s, (), p)
    np.testing.assert_allclose(force, a / (s + g) ** 2)
    beside = Magnet(a / g**2, g, free_standing=False)
    np.testing.assert_allclose(
        beside.deviation(NUMPY, s, (), p), force - a / g**2 + 2 * a / g**3 * s, atol=1e-12
    )
    assert (beside.slope, Magnet().slope) == (None, 0.0)
    upper = Magnet(a / g**2, -g).deviation(NUMPY, -s, (), (a / g**2, -g))
    np.testing.assert_allclose(upper, force)  # the same magnet, seen from the other side


def test_a_saturating_coil_has_the_inductances_that_it_says() -> None:
    """For small changes: L and 1/c in parallel beyond the knee, nearly L about zero."""
    inductance, knee, change = 0.1, 0.05, 40.0
    law, h = SaturatingInductance(change, knee), 1e-7
    for flux, share in ((0.0, 0.019), (knee, 0.5), (-knee, 0.5), (20.0 * knee, 1.0)):
        ends = np.array([flux - h, flux + h])
        current = law.value(NUMPY, ends, (), (change, knee), 1.0 / inductance)
        wanted = 1.0 / (1.0 / inductance + share * change)
        assert 2 * h / np.ptp(current) == pytest.approx(wanted, rel=5e-3)
    assert [p.unit for p in law.parameters("L")] == ["1/H", "V*s"]


def test_a_saturating_coil_takes_in_what_it_gives_back() -> None:
    """Two slopes of the flux, the same current either way, and all of the work in the coil."""
    inductance, knee, change = 0.1, 0.05, 40.0
    law = SaturatingInductance(change, knee)
    flux = np.array([0.005, 10.0])
    current = law.value(NUMPY, flux, (), (change, knee), 1.0 / inductance)
    assert current[0] == pytest.approx(flux[0] / inductance, rel=0.1)
    assert current[1] == pytest.approx(10.0 / inductance + change * (10.0 - knee), rel=1e-4)
    with BondGraph("coil") as g:
        loop = One("loop")
        Se("u", unit="V") >> loop >> I("L", inductance, unit="H", law=law)
        loop >> Df("i", unit="A")
    t = 1e-4 * np.arange(2001)
    u = 5.0 * np.cos(2 * np.pi * 20.0 * t)  # four periods of a flux of 40 mV s
    run = simulate(g, t, {"u": u}, x0=np.zeros(1), hold="linear")
    work = np.sum(0.5 * (u[1:] * run["i"][1:] + u[:-1] * run["i"][:-1])) * 1e-4
    assert run["i"].max() == pytest.approx(-run["i"].min(), rel=1e-2)
    assert abs(work) < 1e-3 * 5.0 * float(np.abs(run["i"]).max()) * t[-1]


def test_radiation_is_linearised_at_once() -> None:
    """Its steps unrolled were an expression that SymPy did not get to the end of."""
    with BondGraph("heater") as g:
        body = Zero("body")
        Sf("P", unit="W") >> body >> C("C_h", 100.0, unit="J/K")
        body >> R("R_h", 8.0, unit="K/W", law=Radiation(0.7, 293.15, "R_h", 8.0))
        body >> De("T", unit="K")
    model = equations(g)
    numbers = {n: p.value for n, p in model.parameters.items()}
    a = model.linearise().numbers(numbers)[0]
    assert a[0, 0] == pytest.approx(-1.0 / 800.0)


@pytest.mark.parametrize("share", [0.2, 0.7, 1.0])
def test_its_symbolic_level_is_that_of_the_steps(share: float) -> None:
    w = np.array([-0.2, -0.05, 0.0, 0.1, 0.4])
    told = [float(radiating_level(float(x), share).evalf()) for x in w]
    heat = [(1 - share) * v + 0.25 * share * ((1 + v) ** 4 - 1) for v in told]
    assert heat == pytest.approx(w.tolist(), abs=1e-12)
