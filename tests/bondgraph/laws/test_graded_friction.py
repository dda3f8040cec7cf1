"""Friction with a level each way, each place, each load; bristles that slip more easily moving."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, C, De, Dq, One, R, Sf, Zero
from bondgraph.equations.codegen import program
from bondgraph.equations.derivation import equations
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import MTF
from bondgraph.graph.modulation import displacement
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import (
    AsymmetricCoulomb,
    Coulomb,
    FrictionAlongWay,
    FrictionUnderLoad,
    Law,
    LawSum,
    LettingGo,
    MaxwellSlip,
    Odometer,
    Parametrised,
    Sliding,
)
from bondgraph.laws.watching import Gauge
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import GraphError, UnusableInput
from bondgraph.support.ops import CASADI, NUMPY, SYMPY
from tests.settled import simulate
from tests.spring import spring

DIRECTED: dict[str, Law] = {
    "uneven": AsymmetricCoulomb(0.8, 0.3),
    "along the way": FrictionAlongWay("q_k", 0.5, 0.1, 0.9),
    "under a load": FrictionUnderLoad("e_k", 0.2, 0.3),
}
LETTING_GO = LettingGo("q_k", "", 0.9, 0.2, 0.03, 0.05)
LAWS: dict[str, Law] = {
    **DIRECTED,
    "letting go": LETTING_GO,
    "slip": MaxwellSlip((0.02, 0.1), 0.4, 0.5, 0.3),
    "slip of one level": MaxwellSlip((0.02, 0.1), 0.4, fitted="ways"),
}
STEP = 0.01


def numbers(law: Law) -> list[float]:
    values = [q.value or 0.17 for q in law.parameters("d")]
    return [*values, STEP] if law.timed else values


def memories(law: Law) -> list[tuple[float, ...]]:
    if law.watched:
        return [(0.3, 0.35), (-0.2, -0.6), (0.1, 0.1)]
    made = law.initial_memory(0.2)
    for s in (0.3, -0.4, 1.2):
        made = law.advance(NUMPY, s, made, numbers(law))
    return [law.initial_memory(-0.1), tuple(float(v) for v in made)]


def oscillator(law: Law) -> BondGraph:
    return spring(1.3, 0.9, 30.0, friction=law, speed="v")


@pytest.mark.parametrize("name", LAWS)
def test_back_ends_agree_and_the_step_is_solved(name: str) -> None:
    law, p = LAWS[name], numbers(LAWS[name])
    s, free, gain, last = (ca.SX.sym(n) for n in ("s", "f", "g", "l"))
    x = sp.Symbol("x", real=True)
    rng = np.random.default_rng(2)
    for memory in memories(law):
        compiled = ca.Function("law", [s], [law.deviation(CASADI, s, memory, p)])
        w = law.solve(free, gain, tuple(map(ca.DM, memory)), tuple(map(ca.DM, p)), last)
        solve = ca.Function("solve", [free, gain, last], [w])
        for value in rng.uniform(-1.5, 1.5, 12):
            plain = float(law.deviation(NUMPY, value, memory, p))
            assert float(compiled(value)) == pytest.approx(plain, abs=1e-12)
            symbolic = sp.sympify(law.deviation(SYMPY, x, memory, p)).subs(x, value)
            assert float(symbolic) == pytest.approx(plain, abs=1e-12)
            g = -float(rng.uniform(0.01, 0.5))
            found = float(solve(value, g, plain))
            end = value + g * found
            if name in DIRECTED and abs(end) < 1e-9:  # at rest: anything between the levels
                forth, back = (law.deviation(NUMPY, way, memory, p) for way in (1.0, -1.0))
                assert back - 1e-12 <= found <= forth + 1e-12
            else:
                assert found == pytest.approx(float(law.deviation(NUMPY, end, memory, p)), abs=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_it_takes_energy(name: str) -> None:
    law, p = LAWS[name], numbers(LAWS[name])
    if law.watched:  # beside the damper that lets go nothing is given either
        slope = 0.9 if law is LETTING_GO else 0.0
        for memory in memories(law):
            for v in np.linspace(-1, 1, 9):
                assert v * law.value(NUMPY, v, memory, p, slope) >= 0
        return
    memory, work = law.initial_memory(0.0), []
    for v in 0.5 * np.sin(np.linspace(0, 12 * np.pi, 3001)):
        work.append(v * law.deviation(NUMPY, v, memory, p))
        memory = law.advance(NUMPY, v, memory, p)
    assert min(np.cumsum(work)) >= -1e-3 * max(np.cumsum(work))


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_against_central_differences(name: str) -> None:
    """Of the watched signal too, which parameters and initial states move."""
    model = compile_model(oscillator(LAWS[name]))
    p = np.array([v or 0.17 for v in model.nominal()])
    t = 0.05 * (np.arange(40) + 3)
    u = (15.0 * np.sin(2.1 * t) + 8.0 * np.sin(5.3 * t))[:, None]
    x0 = np.array([0.11, -0.23])
    run = run_record(
        model, p, u, 0.05, x0, directions=range(p.size), state_directions=True, n_sub=2
    )
    for d in range(p.size + 2):
        ends = []
        for sign in (1, -1):
            q, z = p.copy(), x0.copy()
            (q if d < p.size else z)[d if d < p.size else d - p.size] += sign * 1e-6
            ends.append(run_record(model, q, u, 0.05, z, n_sub=2).y)
        central = (ends[0] - ends[1]) / 2e-6
        size = max(np.abs(central).max(), 1e-3)
        assert np.abs(run.dy[:, :, d] - central).max() < 1e-5 * size, d


def pulled(law: Law, velocity: Any, dt: float, **values: float) -> tuple[Any, Any]:
    """Position and force of a rod that a spring holds, drawn through its seal."""
    with BondGraph("pulled") as g:
        cell, rod = Zero("cell"), One("rod")
        Sf("v", unit="m/s") >> cell >> De("F", unit="N")
        cell >> rod >> R("seal", 0.0, law=law)
        rod >> C("k", stiffness=30.0, unit="N/m")
        rod >> C("way", law=Odometer())
        rod >> Dq("x", unit="m")
    t = dt * np.arange(velocity.size)
    run = simulate(g, t, {"v": velocity}, values)
    return np.asarray(run["x"]), np.asarray(run["F"])


def there_and_back() -> Any:
    return np.where(np.arange(400) < 200, 0.4, -0.4)


def test_level_along_the_way_by_hand() -> None:
    law = FrictionAlongWay("q_way", 2.0, 0.5, 0.5)
    x, force = pulled(law, there_and_back(), 0.01, F_1_seal=-0.7, F_2_seal=1.1)
    z = (x - 0.5) / 0.5
    level = 2.0 - 0.7 * z + 1.1 * z**2
    kept = np.r_[3:198, 204:399]  # a turn within a step is continued from before it
    wanted = 30.0 * x + np.sign(there_and_back()) * level
    np.testing.assert_allclose(force[kept], wanted[kept], atol=1e-3)


def test_a_level_never_falls_below_zero() -> None:
    law = FrictionAlongWay("q_k", 0.1, 0.0, 1.0)
    assert law.deviation(NUMPY, 1.0, (1.0, 1.0), [0.1, -5.0, 0.0, 0.0, 1.0]) == 0.0


def test_a_band_helps_itself_in_one_direction() -> None:
    """``exp(mu phi) - 1`` of the tension forwards, ``1 - exp(-mu phi)`` backwards."""
    turn = 0.3 * np.pi
    forwards, backwards = np.exp(turn) - 1, 1 - np.exp(-turn)
    law = FrictionUnderLoad("e_k", 0.5, 0.2)
    x, force = pulled(law, there_and_back(), 0.01, mu_1_seal=forwards, mu_2_seal=backwards)
    there = there_and_back() > 0
    load = 30.0 * np.abs(x)
    wanted = 30.0 * x + np.where(there, 0.5 + forwards * load, -0.5 - backwards * load)
    kept = np.r_[3:198, 204:399]
    np.testing.assert_allclose(force[kept], wanted[kept], atol=2e-2)


def test_asymmetric_friction_is_coulomb_friction_and_a_constant_force() -> None:
    t = 0.01 * np.arange(600)
    u = 12.0 * np.sin(2.1 * t) + 5.0 * np.sin(5.3 * t)
    asked = ((AsymmetricCoulomb(3.0, 1.0), u), (Coulomb(2.0), u - 1.0))
    x, y = (
        np.asarray(simulate(oscillator(law), t, {"F": f}, x0=np.zeros(2), accuracy=1e-6)["x"])
        for law, f in asked
    )
    np.testing.assert_allclose(x, y, atol=1e-6)
    assert np.ptp(x) > 0.1


def test_bristles_without_a_drop_are_maxwell_slip() -> None:
    ways, forces = (0.02, 0.1), (0.3, 0.5)
    slip = MaxwellSlip(ways, 0.4, 0.0, 0.3)
    steady = MaxwellSlip(ways, 0.4, fitted="levels")
    operator = MaxwellResistiveCapacitor(
        tuple(f / w for f, w in zip(forces, ways, strict=True)), forces
    )
    other = Sliding(operator)
    p = [*forces, 0.0, 0.3, *ways, STEP]
    a, b = slip.initial_memory(0.0), other.initial_memory(0.0)
    c, q = steady.initial_memory(0.0), [*forces, *ways, STEP]
    assert [x.fixed for x in steady.parameters("d")] == [False, False, True, True]
    for v in 0.8 * np.sin(2 * np.pi * np.arange(1, 2001) / 400):
        one, two = slip.deviation(NUMPY, v, a, p), other.deviation(NUMPY, v, b, [STEP])
        assert float(steady.deviation(NUMPY, v, c, q)) == float(one)
        a, b = slip.advance(NUMPY, v, a, p), other.advance(NUMPY, v, b, [STEP])
        c = steady.advance(NUMPY, v, c, q)
        assert float(one) == pytest.approx(float(two), abs=2e-3)  # a turn lies within a step


def test_bristles_bear_more_near_rest() -> None:
    law = MaxwellSlip((0.001, 0.01), 1.0, 0.6, 0.05)
    p = [0.4, 0.6, 0.6, 0.05, 0.001, 0.01, STEP]
    for speed, level in ((0.005, 1.0 + 0.6 * np.exp(-0.01)), (0.5, 1.0)):
        memory = law.initial_memory(speed)
        for _ in range(800):
            memory = law.advance(NUMPY, speed, memory, p)
        assert float(law.deviation(NUMPY, speed, memory, p)) == pytest.approx(level, rel=1e-6)


def test_numbers_of_a_recording_are_no_structure() -> None:
    assert MaxwellSlip((0.1, 0.2)).structure == MaxwellSlip((0.3, 0.4), 2.0).structure
    assert MaxwellSlip((0.1,)).structure != MaxwellSlip((0.1, 0.2)).structure
    assert MaxwellSlip((0.1,)).structure != MaxwellSlip((0.1,), fitted="ways").structure
    same = FrictionAlongWay("q_k"), FrictionAlongWay("q_way", 3.0, 0.2, 0.4)
    assert same[0].structure == same[1].structure
    assert FrictionUnderLoad("e_k").structure == FrictionUnderLoad("e_F", 2.0).structure


def test_a_damper_that_lets_go_by_hand() -> None:
    p = [0.9, 0.2, 0.03, 0.05]
    at = (0.1, 0.0), (0.2, 0.0), (0.255, 0.5), (0.4, 1.0), (-0.195, 0.5)  # and what still acts
    for q, share in at:
        force = LETTING_GO.value(NUMPY, 2.0, (q, q), p, 0.9)
        assert float(force) == pytest.approx(share * 1.8, abs=1e-12)


def test_a_watched_signal_has_to_be_there() -> None:
    with pytest.raises(GraphError, match="no signal 'e_z'"):
        compile_model(oscillator(FrictionUnderLoad("e_z")))
    for g in (
        oscillator(FrictionAlongWay("q_m")),
        oscillator(FrictionUnderLoad("f_kk")),
        oscillator(AsymmetricCoulomb()).with_element("F", drive=Drive(law=FrictionAlongWay("k"))),
    ):
        (line,) = g.check()
        assert "for its law to read" in line
    with pytest.raises(UnusableInput, match="law of d reads e_k"):
        program(oscillator(FrictionUnderLoad("e_k")))
    with pytest.raises(UnusableInput, match="exported equations cannot carry"):
        equations(oscillator(FrictionUnderLoad("e_k"))).program()
    bent = oscillator(FrictionUnderLoad("e_k"))
    bent = bent.with_branch("body", [MTF("lever", 1 + displacement("k")), R("r", 1.0)])
    with pytest.raises(UnusableInput, match="take modulated elements") as error:
        simulate(bent, np.arange(3.0), {"F": np.zeros(3)})
    assert "export" not in str(error.value)
    assert Gauge().deviation(NUMPY, 3.0, (), ()) == 0.0


def test_a_signal_may_have_a_second_name() -> None:
    """The flow of the spring is that of the body, the effort at it that of their bond."""
    t = 0.01 * np.arange(300)
    for first, second in (("f_body", "f_k"), ("e_k", "e_body>k")):
        one, two = (
            simulate(oscillator(FrictionUnderLoad(n, 0.3, 0.5)), t, {"F": 9 * np.sin(3 * t)})["x"]
            for n in (first, second)
        )
        np.testing.assert_allclose(one, two, atol=1e-12)


def test_a_law_that_watches_stays_on_its_own() -> None:
    for held in (lambda: LawSum((LETTING_GO,)), lambda: Parametrised(LETTING_GO, ("depth",))):
        with pytest.raises(UnusableInput, match="reads q_k"):
            held()


@pytest.mark.parametrize("beside", ["", "q k", None, 3.0])
def test_a_watched_signal_has_a_name(beside: Any) -> None:
    with pytest.raises(UnusableInput, match="coulomb_along_way: beside="):
        FrictionAlongWay(beside)
    assert FrictionUnderLoad("e_a>b").watched == "e_a>b"
