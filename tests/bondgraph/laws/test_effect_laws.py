"""Laws of springs, contacts, dampers, tanks and hot resistors: what every law has to keep."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import (
    AsymmetricDamping,
    Backlash,
    Bilinear,
    ContactLoss,
    Coulomb,
    CurrentLimit,
    DahlFriction,
    DigressiveDamping,
    Diode,
    EndStop,
    GrowingDamping,
    HuntCrossley,
    Law,
    LawSum,
    Magnet,
    NonlinearResistance,
    Overflow,
    Polynomial,
    Radiation,
    SaturatingInductance,
    SelfHeating,
)
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.support.ops import NUMPY
from tests.bondgraph.laws.back_ends import back_ends_agree
from tests.settled import simulate
from tests.spring import spring

SPRINGS: dict[str, Law] = {
    "backlash": Backlash(stiffness=3.0, width=0.15, centre=0.05),
    "backlash of a compliance": Backlash(stiffness=3.0, inverse=True, width=0.15, centre=0.05),
    "bilinear": Bilinear(0.8, 0.1, 3.0),
    "contact": ContactLoss(stiffness=3.0, depth=0.9, edge=-1.0),
    "contact above": ContactLoss(stiffness=3.0, depth=0.9, edge=1.0, side=-1.0),
    "stop": EndStop(20.0, -0.3, 0.25),
    "stop above": EndStop(20.0, -0.3, 0.25, "high"),
    "stop below": EndStop(20.0, -0.3, 0.25, "low"),
    "lossy stop": HuntCrossley(20.0, -0.3, 0.25, loss=0.01),
    "lossy stop above": HuntCrossley(20.0, -0.3, 0.25, "high", loss=0.01),
    "growing damping": GrowingDamping(0.2, 0.05),
    "magnet": Magnet(0.1, 2.5),
    "magnet beside a spring": Magnet(-0.1, -2.5, free_standing=False),
    "series from rest": Polynomial(0.2, 1.5, 1.0, from_rest=True),
    "saturating": SaturatingInductance(1.5, 0.4),  # a curve of its own state, wherever it stands
}
RESISTORS: dict[str, Law] = {
    "asymmetric": AsymmetricDamping(0.2, 0.4),
    "digressive": DigressiveDamping(stiffness=0.4, difference=0.1, flow=0.5),
    "bristle": DahlFriction(0.3, 0.05),
    "short bristle": DahlFriction(0.3, 1e-4),
    "heating": SelfHeating(0.3, 0.4, 0.5),
    "softening": SelfHeating(-0.3, 0.4, 0.5),
    "resistance": NonlinearResistance(0.3, 0.5),
    "diode": Diode(stiffness=0.4, share=0.7, onset=0.1, width=0.05),
    "diode backwards": Diode(stiffness=0.4, share=0.7, onset=0.1, width=0.05, sense=-1.0),
    "current limit": CurrentLimit(stiffness=0.4, low=-0.3, high=0.5),
    "radiation": Radiation(0.7, 2.0, resistance=0.4),
}
STORES: dict[str, Law] = {**SPRINGS, "overflow": Overflow(stiffness=3.0, depth=0.8, top=1.0)}
LAWS = {**STORES, **RESISTORS}
STEP = 0.01


def numbers(law: Law) -> list[float]:
    """Parameter values, something else where they are zero; then the step."""
    values = [q.value or 0.37 for q in law.parameters("e")]
    return [*values, STEP] if law.timed else values


def walk(n: int, seed: int = 3) -> Any:
    return np.clip(np.cumsum(np.random.default_rng(seed).normal(size=n)) * 0.3, -1.2, 1.2)


def test_numbers_of_a_recording_are_no_structure() -> None:
    assert DahlFriction(1.0, 0.2).structure == DahlFriction(3.0, 0.7).structure
    assert Backlash(coefficient="k", width=0.1).structure == Backlash(width=0.7).structure
    assert Backlash().structure != Backlash(inverse=True).structure
    assert EndStop(sides="low").structure != EndStop(sides="high").structure
    assert ContactLoss(side=-1.0, edge=3.0).structure == ContactLoss().structure
    assert Overflow(top=4.0).structure == Overflow().structure
    assert CurrentLimit(low=-3.0).structure == CurrentLimit(coefficient="r", high=2.0).structure
    assert SelfHeating(level=3.0).structure == SelfHeating().structure


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("name", LAWS)
def test_back_ends_agree(name: str) -> None:
    back_ends_agree(LAWS[name], numbers(LAWS[name]), walk(25))


@pytest.mark.parametrize("name", LAWS)
def test_solution_of_the_implicit_relation(name: str) -> None:
    law = LAWS[name]
    p = numbers(law)
    free, gain, last = ca.SX.sym("f"), ca.SX.sym("g"), ca.SX.sym("l")
    memory = law.advance(NUMPY, 0.4, law.initial_memory(0.0), p)
    w = law.solve(free, gain, tuple(memory), tuple(p), last)
    solve = ca.Function("solve", [free, gain, last], [w])
    rng = np.random.default_rng(11)
    for _ in range(80):
        f, g = rng.uniform(-1, 1), -rng.uniform(0.0, 0.3)
        value = float(solve(f, g, float(law.deviation(NUMPY, f, memory, p))))
        s = f + g * value
        tolerance = 1e-9
        if "bristle" in name:  # within the jump the slope multiplies the rounding of s
            tolerance = 1e-12 * (1.0 + p[0] * STEP / p[1]) + 1e-12
        assert value == pytest.approx(float(law.deviation(NUMPY, s, memory, p)), abs=tolerance)


def test_a_short_bristle_is_dry_friction() -> None:
    dry, bristle = Coulomb(0.3), DahlFriction(0.3, 1e-9)
    for free in (-0.9, -0.02, 0.01, 0.4):
        memory = (0.0, free)
        a = float(ca.DM(dry.solve(ca.DM(free), ca.DM(-0.2), (), (ca.DM(0.3),), 0.0)))
        p = (ca.DM(0.3), ca.DM(1e-9), ca.DM(STEP))
        b = float(ca.DM(bristle.solve(ca.DM(free), ca.DM(-0.2), memory, p, 0.0)))
        assert b == pytest.approx(a, abs=1e-6)


def test_bristle_between_spring_and_slip() -> None:
    """Dahl's curve: slope F_c / delta at rest, F_c (1 - exp(-x / delta)) when loaded."""
    law, p = DahlFriction(0.3, 0.05), [0.3, 0.05, STEP]
    memory, forces = law.initial_memory(0.2), []
    way = np.cumsum(np.full(60, 0.2 * STEP))
    for _ in way:
        forces.append(law.deviation(NUMPY, 0.2, memory, p))
        memory = law.advance(NUMPY, 0.2, memory, p)
    np.testing.assert_allclose(forces, 0.3 * (1 - np.exp(-way / 0.05)), rtol=1e-12)


def test_bristle_is_second_order_and_settles_in_stiction() -> None:
    """Few long steps agree with many short ones, and a short bristle does not ring."""

    def record(way: float, n_sub: int) -> Any:
        g = spring(1.3, 0.9, 30.0, friction=DahlFriction(1.0, way))
        model = compile_model(g)
        t = 0.02 * np.arange(600)
        u = (6 * np.sin(2.1 * t) + 5 * np.sin(5.3 * t))[:, None]
        return run_record(model, model.nominal(), u, 0.02, np.zeros(2), n_sub=n_sub).y[:, 0]

    exact = record(0.03, 64)
    errors = [np.std(record(0.03, n) - exact) / np.std(exact) for n in (1, 4)]
    assert errors[0] < 8e-3
    assert errors[1] < errors[0] / 8
    assert np.std(record(1e-9, 2) - record(1e-9, 32)) < 0.02 * np.std(exact)


@pytest.mark.parametrize("name", STORES)
def test_energy_of_a_store(name: str) -> None:
    """Closed cycles give all back; an overflow keeps some."""
    law = STORES[name]
    p = numbers(law)
    rng = np.random.default_rng(5)
    kept = []
    for _ in range(4):
        corners = rng.uniform(-1.0, 1.0, 5)
        period = np.interp(np.linspace(0, 5, 2001), np.arange(6), [*corners, corners[0]])
        memory = law.initial_memory(period[0])
        for _cycle in range(2):
            efforts = []
            for s in period:
                efforts.append(law.value(NUMPY, s, memory, p, 3.0))
                memory = law.advance(NUMPY, s, memory, p)
            e = np.array(efforts)
        kept.append(float(np.sum(0.5 * (e[1:] + e[:-1]) * np.diff(period))))
        if law.energy == "stores":  # out and back over the same knots: the rule leaves corners only
            assert abs(kept[-1]) < 1e-3
    assert min(kept) >= -1e-3


@pytest.mark.parametrize("name", RESISTORS)
def test_energy_of_a_resistor(name: str) -> None:
    law = RESISTORS[name]
    p = numbers(law)
    flows = 0.5 * np.sin(np.linspace(0, 12 * np.pi, 3001))
    memory, work = law.initial_memory(0.0), []
    for s in flows:
        work.append(s * law.deviation(NUMPY, s, memory, p))
        memory = law.advance(NUMPY, s, memory, p)
    if law.energy == "dissipates":
        assert min(np.cumsum(work)) >= -1e-3 * max(np.cumsum(work))
    else:  # the claim is no claim: alone it does give energy
        assert min(work) < 0


def oscillator(name: str) -> Compiled:
    law = LAWS[name]
    spring_law, friction = (law if name in names else None for names in (STORES, RESISTORS))
    return compile_model(spring(1.3, 0.4, 3.0, spring_law, friction, speed="v"))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", [n for n in LAWS if n != "short bristle"])
def test_derivatives_against_central_differences(name: str) -> None:
    model = oscillator(name)
    p = np.array([v or 0.37 for v in model.nominal()])
    t = 0.05 * (np.arange(50) + 3)
    u = np.zeros((t.size, model.n_u))
    u[:, 0] = 2.0 * np.sin(2.1 * t) + 1.1 * np.sin(5.3 * t)
    x0 = np.array([0.11, -0.23])
    every = range(len(p))
    run = run_record(model, p, u, 0.05, x0, directions=every, state_directions=True, n_sub=2)
    for d in range(len(p) + 2):
        h = 1e-6

        def shifted(sign: float, d: int = d, h: float = h) -> Any:
            q, z = p.copy(), x0.copy()
            (q if d < len(p) else z)[d if d < len(p) else d - len(p)] += sign * h
            return run_record(model, q, u, 0.05, z, n_sub=2).y

        central = (shifted(1) - shifted(-1)) / (2 * h)
        size = max(np.abs(central).max(), 1e-3)
        assert np.abs(run.dy[:, :, d] - central).max() < 1e-5 * size, (d, size)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_diode_with_a_resistor_across_it_by_its_circuit(sense: float) -> None:
    """Both branches have one voltage: R (i - j) = R_s j + V_T ln(j / I_s)."""
    across, series, thermal, least = 50.0, 2.0, 0.05, 1e-7
    p = (
        across,
        across / (across + series),
        -thermal / across * np.log(least * (across + series) / thermal),
        thermal / across,
        sense,
    )
    law = Diode()
    assert Diode(share=1.0, onset=2.0, width=3.0, sense=sense).structure == law.structure
    for j in (1e-12, 1e-6, 1e-3, 0.3, 4.0):
        voltage = series * j + thermal * np.log(j / least)
        i = j + voltage / across
        found = across * sense * i + law.deviation(NUMPY, sense * i, (), p)
        assert found == pytest.approx(sense * voltage, rel=1e-9)


def test_damping_that_grows_by_hand_and_in_every_step() -> None:
    """gamma (s - rest)^2 v in the middle of a step; a step's work is never negative."""
    law, p = GrowingDamping(0.2), (0.9, 0.2, STEP)
    before, now = 0.519, 0.521
    wanted = 0.9 * (0.52 - 0.2) ** 2 * (now - before) / STEP
    assert law.deviation(NUMPY, now, (before,), p) == pytest.approx(wanted, rel=1e-4)
    way = walk(200)
    for a, b in pairwise(way):
        assert law.deviation(NUMPY, b, (a,), p) * (b - a) >= 0
    # a step over the place of rest loses its exact integral: gamma (b^3 - a^3) / 3 times the rate
    assert law.deviation(NUMPY, 0.5, (-0.1,), p) == pytest.approx(0.9 * 0.018 / STEP)
    assert law.deviation(NUMPY, 0.3, (0.3,), (0.9, 0.2, 0.0)) == 0.0


def test_a_lossy_spring_is_a_damper_that_the_spring_modulates() -> None:
    """``m x'' + (d + gamma x^2) x' + k x + a_3 x^3 = F`` by an integrator that knows no laws."""
    law = LawSum((Polynomial(orders=(3,)), GrowingDamping(loss=8.0)))
    with BondGraph("lossy") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.3)
        body >> R("d", 0.4)
        body >> C("k", stiffness=3.0, law=law)
        body >> Dq("x")
    t = 0.05 * np.arange(400)

    def rate(time: float, z: Any) -> Any:
        x, v = z
        loss = (0.4 + 8.0 * x**2) * v
        return v, (2.0 * np.sin(2.1 * time) - loss - 3.0 * x - 5.0 * x**3) / 1.3

    told = solve_ivp(rate, (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    fine = 0.005 * np.arange(3991)
    u = {"F": 2.0 * np.sin(2.1 * fine)}
    x = simulate(g, fine, u, {"a_3_k": 5.0}, x0=np.zeros(2), hold="linear", accuracy=1e-4)["x"]
    assert np.std(x[::10] - told) < 1e-3 * np.std(told)


def test_a_shared_coefficient_is_one_parameter() -> None:
    """A gap wider than the motion leaves no spring, whatever the spring's value is."""
    g = spring(1.0, 0.4, 3.0, Backlash(coefficient="k", stiffness=9.0, width=50.0))
    model = compile_model(g)
    assert model.vector({})[model.parameter_names.index("k")] == 3.0
    t = np.arange(100) * 0.05
    u = np.sin(t)[:, None]
    runs = [
        run_record(model, model.vector({"k": k}), u, 0.05, np.zeros(model.n_x)).y
        for k in (3.0, 9.0)
    ]
    # the law is a straight line within a step, the spring is exact: they differ by that only
    np.testing.assert_allclose(runs[0], runs[1], atol=2e-3 * np.abs(runs[0]).max())
    assert np.abs(runs[0]).max() > 1.0
