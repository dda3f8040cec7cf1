"""Diffusion, a propeller and a magnetorheological damper against what is known of them."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, De, Df, I, One, R, Se, Sf, Zero
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.graph.composing.diffusion import warburg_ladder
from bondgraph.graph.composing.hierarchy import ports_of, use
from bondgraph.graph.composing.modulated_components import MODULATED
from bondgraph.graph.elements import C
from tests.settled import simulate


def test_the_ladder_is_the_root_over_its_band() -> None:
    """``1/sqrt(j omega)`` to a per cent, between the two times and on both edges."""
    ladder = warburg_ladder(1000.0, 0.1)
    s = 1j / np.geomspace(0.1, 1000.0, 60)
    z = ladder.direct + 1 / (s * ladder.kept)
    z = z + sum(r / (1 + s * tau) for r, tau in ladder.branches)
    assert np.abs(z * np.sqrt(s) - 1).max() < 0.01


def test_a_current_step_through_diffusion_grows_with_the_root_of_time() -> None:
    part = COMPONENTS.make("warburg", coefficient=2.0, slowest=100.0, fastest=0.1)
    assert set(part.parameters) == {"W"}
    with BondGraph("cell") as g:
        node, cell = Zero("node"), use(part, "cell")
        Sf("i", unit="A") >> node >> cell.left
        cell.right >> R("load", 1e-9)
        node >> De("u", unit="V")
    t = 0.01 * np.arange(10001)
    run = simulate(g, t, {"i": np.ones(t.size)}, x0=np.zeros(len(part.of_type(C))))
    for at in (10, 100, 1000, 10000):
        assert run["u"][at] == pytest.approx(2.0 * 2.0 * np.sqrt(t[at] / np.pi), rel=0.01)


def test_thrust_follows_the_square_of_the_speed_behind_its_lag() -> None:
    with BondGraph("boat") as g:
        screw = use(COMPONENTS.make("propeller", thrust=0.02, torque=1e-3, lag=0.5), "p")
        Se("M", unit="N*m") >> screw.shaft
        screw.hull >> R("drag", 50.0)
        screw["hub"] >> Df("v")
        screw["blades"] >> Df("w")
    t = 1e-3 * np.arange(4001)
    run = simulate(g, t, {"M": np.where(t < 2.0, 0.1, -0.1)}, x0=np.zeros(2))
    settled = run["w"][1999]  # 0.1 N m = k_M w^2
    assert settled == pytest.approx(10.0, rel=1e-3)
    assert run["v"][1999] * 50.0 == pytest.approx(2.0, rel=0.03)  # k_T w^2, after four lags
    assert run["w"][-1] == pytest.approx(-settled, rel=1e-3)
    # from one thrust to its opposite through the lag: 2 - 4 (1 - exp(-t / tau))
    assert run["v"][2500] * 50.0 == pytest.approx(2.0 - 4.0 * (1 - np.exp(-1)), abs=0.15)


def test_a_command_sets_the_yield_of_a_damper_and_it_never_gives_energy() -> None:
    part = MODULATED.make("magnetorheological_damper", damping=1e3, force=100.0, sensitivity=2.0)
    text = MODULATED.documentation("magnetorheological_damper")
    assert all(f"``{n}``" in text for n in (*part.parameters, *(p.name for p in ports_of(part))))
    with BondGraph("bench") as g:
        damper = use(part, "d")
        ram, wall = Zero("ram"), One("wall")
        Sf("v", unit="m/s") >> ram >> damper.left
        damper.right >> wall >> I("M", 1e9, unit="kg")
        ram >> De("F", unit="N")
    assert g.check() == ()
    t = 1e-3 * np.arange(3000)
    v, u = 0.1 * np.sin(2 * np.pi * t), np.where(t < 1.5, 0.0, 1.0)
    run = simulate(g, t, {"v": v, "in_d_current": u})
    moving = np.abs(v) > 1e-3
    told = 1e3 * v + 100.0 * (1 + 2.0 * u) * np.sign(v)
    np.testing.assert_allclose(run["F"][moving], told[moving], atol=1e-2)
    assert (run["F"] * v)[moving].min() > 0
