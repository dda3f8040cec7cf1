"""Laws of time and of the way: tone, onset, ageing, periodic force, odometer."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, One, R, Se
from bondgraph.graph.sensors import Dq
from bondgraph.laws import Ageing, Law, Odometer, Onset, Periodic, Push, TimedSlope, Tone, WarmUp
from bondgraph.support.ops import NUMPY
from tests.bondgraph.laws.back_ends import back_ends_agree
from tests.settled import simulate

LAWS: tuple[Law, ...] = (
    Tone(3.0, 0.5),
    Onset(0.4, 0.05),
    Onset(0.4, 0.05, ramp=True, free_standing=False),
    Push(0.1, 0.05, end=0.2),
    Push(0.1, 0.05, ramp=True, free_standing=False, end=0.2),
    Ageing(2.0),
    TimedSlope(Tone(3.0, 0.5, free_standing=False)),
    TimedSlope(Onset(0.15, 0.05, free_standing=False)),
    WarmUp(0.2),
    Periodic(0.3),
    Odometer(),
)
STEP = 0.01


def numbers(law: Law) -> list[float]:
    values = [0.7 + 0.1 * j for j in range(len(law.parameters("e")))]
    return [*values, STEP] if law.timed else values


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_back_ends_agree_along_a_walk(law: Law) -> None:
    memory = back_ends_agree(law, numbers(law), np.random.default_rng(1).normal(size=30))
    assert len(memory) == law.n_memory
    assert all(v == pytest.approx(30 * STEP) for v in memory)


def test_start_values_do_not_change_the_structure() -> None:
    assert Tone(3.0, 0.5).structure == Tone(7.0, 0.1, 4.0).structure
    assert Onset(0.4).structure == Onset(0.9, 0.3).structure
    assert Onset(0.4).structure != Onset(0.4, ramp=True).structure
    assert Push(0.4).structure == Push(0.9, end=3.0).structure != Push(ramp=True).structure
    assert Ageing(2.0).structure == Ageing(9.0).structure
    assert WarmUp(2.0).structure == WarmUp(9.0, 3.0).structure
    made = [TimedSlope(Tone(f, free_standing=False)) for f in (3.0, 7.0)]
    assert made[0].structure == made[1].structure
    assert made[0].structure != TimedSlope(Onset(free_standing=False)).structure
    assert Periodic(0.3).structure == Periodic(0.7).structure


def test_a_periodic_force_gives_all_back() -> None:
    law, s = Periodic(0.3), np.linspace(0.0, 0.9, 4001)
    force = np.asarray(law.deviation(NUMPY, s, (), [2.0, 0.5, 0.3]))
    assert abs(np.trapezoid(force, s)) < 1e-9
    assert np.abs(force).max() == pytest.approx(np.hypot(2.0, 0.5), rel=1e-4)


def test_a_ramp_is_the_integral_of_the_step() -> None:
    t = np.linspace(0.0, 2.0, 20001)
    p = [1.5, 0.8, 0.1, 0.0]
    step = np.asarray(Onset().deviation(NUMPY, 0.0, (t,), p))
    ramp = np.asarray(Onset(ramp=True).deviation(NUMPY, 0.0, (t,), p))
    np.testing.assert_allclose(np.gradient(ramp, t)[1:-1], step[1:-1], atol=1e-6)


def test_a_push_is_there_for_a_while_and_its_integral_stays() -> None:
    t, p = np.linspace(0.0, 4.0, 40001), [1.5, 0.8, 2.0, 0.05, 0.0]
    push = np.asarray(Push().deviation(NUMPY, 0.0, (t,), p))
    gone = (t < 0.5) | (t > 2.3)
    assert np.abs(push[gone]).max() < 1e-4
    assert np.abs(push[(t > 1.1) & (t < 1.7)] - 1.5).max() < 1e-4
    stays = np.asarray(Push(ramp=True).deviation(NUMPY, 0.0, (t,), p))
    np.testing.assert_allclose(np.gradient(stays, t)[1:-1], push[1:-1], atol=1e-6)
    assert stays[-1] == pytest.approx(1.5 * 1.2, rel=1e-6)


def test_a_tone_moves_a_mass_as_the_formula_says() -> None:
    with BondGraph("mass") as g:
        body = One("body")
        Se("F") >> body >> I("m", 2.0)
        body >> R("hum", law=Tone(3.0, 0.1))
        body >> Dq("x")
    t = 1e-3 * np.arange(1500)
    run = simulate(g, t, {"F": np.zeros(t.size)}, parameters={"a_hum": 0.0, "b_hum": -4.0})
    w = 2 * np.pi * 3.0
    np.testing.assert_allclose(np.asarray(run["x"]), 2 / w**2 * (1 - np.cos(w * t)), atol=2e-6)


def test_an_ageing_spring_and_an_odometer() -> None:
    with BondGraph("mass") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 2.0)
        body >> C("k", stiffness=50.0, law=Ageing(4.0))
        body >> C("way", law=Odometer())
        body >> Dq("x")
    t = 2e-3 * np.arange(2000)
    run = simulate(g, t, {"F": np.full(t.size, 3.0)}, parameters={"a_t_k": 50.0})
    # slow enough to rest on the spring of the moment
    late = t > 3.5
    np.testing.assert_allclose(
        np.asarray(run["x"])[late], 3.0 / (50.0 + 50.0 * t[late] / 4.0), rtol=0.02
    )


def test_laws_of_time_say_so() -> None:
    """Fits on windows let their clocks go on instead of starting anew."""
    for law in (Tone(), Onset(), Push(), Ageing(), WarmUp()):
        assert law.counts_time
        assert law.n_memory == 1
