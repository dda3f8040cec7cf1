"""What every law has to keep: one formula on three back ends, its energy claim, its solution."""

from __future__ import annotations

import json
import re
from typing import Any

import casadi as ca
import numpy as np
import pytest

import bondgraph.laws
from bondgraph import BondGraph, One, R, Se
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import (
    MaxwellResistiveCapacitor,
    PrandtlIshlinskii,
    RateDependentPrandtlIshlinskii,
)
from bondgraph.laws import (
    Coulomb,
    DeadZone,
    Diode,
    Gravity,
    Hysteretic,
    Law,
    LawSum,
    LuGre,
    Magnet,
    MaxwellSlip,
    Orifice,
    Parametrised,
    PiecewiseLinear,
    Polynomial,
    QuadraticDrag,
    Rectifier,
    Rounding,
    Saturation,
    SlewLimit,
    Sliding,
    StopSum,
    Stribeck,
    TableLaw,
    Viscous,
    Wrapping,
)
from bondgraph.support.errors import GraphError, UnusableInput
from bondgraph.support.ops import NUMPY
from tests.bondgraph.laws.back_ends import back_ends_agree
from tests.bondgraph.laws.test_bouc_wen_memory import LAWS as BOUC_WEN_LAWS
from tests.bondgraph.laws.test_effect_laws import LAWS as EFFECT_LAWS
from tests.bondgraph.laws.test_graded_friction import LAWS as GRADED_LAWS
from tests.bondgraph.laws.test_laws_in_time_and_way import LAWS as TIMED_LAWS

LAWS: dict[str, Law] = {
    "Coulomb": Coulomb(0.8),
    "Stribeck": Stribeck(0.8, 0.4, 0.3),
    "Viscous": Viscous(0.6),
    "Gravity": Gravity(2.0),
    "Gravity beside a spring": Gravity(0.5, free_standing=False),
    "LuGre": LuGre(0.8, 0.4, 0.3, 60.0, 0.2),
    "Sliding": Sliding(MaxwellResistiveCapacitor((60.0, 40.0), (0.3, 0.6))),
    "QuadraticDrag": QuadraticDrag(0.7),
    "Orifice": Orifice(0.7, 0.4),
    "Polynomial": Polynomial(0.2, 1.5, 1.0, (2, 3)),
    "Hats": PiecewiseLinear((-1.0, -0.5, 0.5, 1.0), 1.0),
    "Table": TableLaw((-1.0, 0.2, 1.0), (-0.5, 0.0, 2.0), free=True),
    "Saturation": Saturation(-1.0, 1.5, 0.2),
    "DeadZone": DeadZone(0.1, 0.3),
    "Rectifier": Rectifier(0.7),
    "Rounding": Rounding(0.31, 0.05, 0.8),
    "Wrapping": Wrapping(1.1, -0.2),
    "SlewLimit": SlewLimit(0.02, 0.01),
    "SlewLimit uneven": SlewLimit(0.02, 0.01, even=False, falling=0.05),
    "StopSum": StopSum((0.2, 0.5, 0.9), 0.6),
    "StopSum rated": StopSum((0.2, 0.5, 0.9), 0.6, rated=True, speed=50.0),
    "LawSum": LawSum((StopSum((0.2, 0.5), 0.6), Polynomial(0.2, 4.0, 1.0, (3, 5)))),
    "Lifted": Parametrised(StopSum((0.2, 0.5, 0.9), 0.6), ("thresholds",)),
    "Hysteretic": Hysteretic(MaxwellResistiveCapacitor((1.0, 0.5), (0.3, 0.6))),
    "Hysteretic PI": Hysteretic(PrandtlIshlinskii((0.0, 0.4), (1.0, 0.8))),
}
# their back ends, solutions and energy are tested where their tables stand
EVERY: dict[str, Law] = {
    **LAWS,
    **BOUC_WEN_LAWS,
    **EFFECT_LAWS,
    **GRADED_LAWS,
    **{f"{type(law).__name__} {i}": law for i, law in enumerate(TIMED_LAWS)},
}
FRICTION = {"Coulomb", "Stribeck", "QuadraticDrag", "Orifice", "Viscous"}
PRESLIDING = {"LuGre", "Sliding"}
JUMPING = {"Rounding", "Wrapping"}
STEP = 0.01


def numbers(law: Law, seed: int = 0) -> list[float]:
    """Parameter values: the start, or something random where the start is zero; then the step."""
    rng = np.random.default_rng(seed)
    values = [q.value if q.value else float(rng.uniform(-0.5, 0.5)) for q in law.parameters("e")]
    return [*values, STEP] if law.timed else values


def walk(n: int, seed: int = 3) -> Any:
    return np.clip(np.cumsum(np.random.default_rng(seed).normal(size=n)) * 0.5, -2.2, 2.2)


def test_no_law_is_left_out() -> None:
    every = {n: getattr(bondgraph.laws, n) for n in dir(bondgraph.laws)}
    known = {n for n, c in every.items() if isinstance(c, type) and issubclass(c, Law)} - {"Law"}
    assert known == {type(law).__name__ for law in EVERY.values()}


@pytest.mark.parametrize("name", EVERY)
def test_parameters_and_memory_are_declared(name: str) -> None:
    law = EVERY[name]
    parameters = law.parameters("spring")
    assert all(q.name.endswith("_spring") for q in parameters)
    assert len({q.name for q in parameters}) == len(parameters)
    assert law.name
    assert law.energy in ("stores", "dissipates", "signal")
    memory = law.initial_memory(0.3)
    assert len(memory) == law.n_memory == len(law.memory_sensitivity(0.3))
    assert len(law.advance(NUMPY, 0.4, memory, numbers(law))) == law.n_memory
    assert law == EVERY[name]
    assert hash(law) == hash(EVERY[name])  # kernels are shared by equal laws


@pytest.mark.parametrize("name", EVERY)
def test_memory_round_trip(name: str) -> None:
    law = EVERY[name]
    memory = law.initial_memory(0.3)
    for value in walk(20):
        memory = law.advance(NUMPY, float(value), memory, numbers(law))
    memory = tuple(float(v) for v in memory)
    again = law.memory_from_dict(json.loads(json.dumps(law.memory_to_dict(memory))))
    assert again == memory
    with pytest.raises(UnusableInput, match=f"has {law.n_memory} memory states"):
        law.memory_to_dict((*memory, 0.0))
    with pytest.raises(UnusableInput, match="not a list of states"):
        law.memory_from_dict({"law": "another", "states": []})
    if memory:
        with pytest.raises(UnusableInput, match=r"memory\[0\] = nan"):
            law.memory_to_dict((float("nan"), *memory[1:]))


@pytest.mark.parametrize("name", EVERY)
def test_memory_sensitivity(name: str) -> None:
    law, h = EVERY[name], 1e-6
    for s in (0.05, 0.3, 0.37, -1.3):
        upper, lower = law.initial_memory(s + h), law.initial_memory(s - h)
        central = [(a - b) / (2 * h) for a, b in zip(upper, lower, strict=True)]
        np.testing.assert_allclose(law.memory_sensitivity(s), central, atol=1e-9)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("name", LAWS)
def test_back_ends_agree(name: str) -> None:
    back_ends_agree(LAWS[name], numbers(LAWS[name]), walk(40))


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("name", LAWS)
def test_energy_claim(name: str) -> None:
    """Closed cycles: a store gives all back, a dissipating law never more than it took."""
    law = LAWS[name]
    p = numbers(law)
    if law.energy == "signal":
        assert name not in FRICTION | {"StopSum", "Polynomial"}
        return
    if name in FRICTION:  # in a resistor: never against the flow
        flows = walk(200)
        assert all(s * law.deviation(NUMPY, s, (), p) >= 0 for s in flows)
        return
    if name in PRESLIDING:  # in a resistor: a closed cycle of the bristle takes work
        flows = 0.5 * np.sin(np.linspace(0, 40 * np.pi, 8001))
        memory, work = law.initial_memory(0.0), []
        for s in flows:
            work.append(STEP * s * law.deviation(NUMPY, s, memory, p))
            memory = law.advance(NUMPY, s, memory, p)
        assert min(np.cumsum(work)) >= -1e-3 * max(np.cumsum(work))
        assert all(np.sum(part) > 0 for part in np.split(np.array(work[1:]), 20))
        return
    rng = np.random.default_rng(5)
    for _ in range(6):
        corners = rng.uniform(-1.5, 1.5, 5)
        period = np.interp(np.linspace(0, 5, 2001), np.arange(6), [*corners, corners[0]])
        if law.energy == "stores":  # Simpson's rule is exact for a cubic
            ends = law.value(NUMPY, period, (), p, 1.0)
            mid = law.value(NUMPY, 0.5 * (period[1:] + period[:-1]), (), p, 1.0)
            work = np.sum((ends[1:] + 4 * mid + ends[:-1]) * np.diff(period)) / 6
            assert abs(work) < 1e-12
            continue
        memory, works = law.initial_memory(period[0]), []
        for _cycle in range(2):
            efforts = []
            for s in period:
                efforts.append(law.value(NUMPY, s, memory, p, law.slope or 1.0))
                memory = law.advance(NUMPY, s, memory, p)
            e = np.array(efforts)
            works.append(float(np.sum(0.5 * (e[1:] + e[:-1]) * np.diff(period))))
        assert works[1] >= -1e-12


@pytest.mark.parametrize("name", LAWS)
def test_solution_of_the_implicit_relation(name: str) -> None:
    """``s = free + gain w`` and ``w = law(s)`` (for dry friction: w in the set at s)."""
    law = LAWS[name]
    p = numbers(law)
    free, gain, last = ca.SX.sym("f"), ca.SX.sym("g"), ca.SX.sym("l")
    memory = law.advance(NUMPY, 0.8, law.initial_memory(0.0), p)
    w = law.solve(free, gain, tuple(memory), tuple(p), last)
    solve = ca.Function("solve", [free, gain, last], [w])
    rng = np.random.default_rng(11)
    for _ in range(60):
        f, g = rng.uniform(-2, 2), -rng.uniform(0.0, 0.3)
        if name in JUMPING:  # of signals alone: a loop through a jump has no solution
            g = 0.0
        start = float(law.deviation(NUMPY, f, memory, p))
        value = float(solve(f, g, start))
        s = f + g * value
        if name in ("Coulomb", "Stribeck"):
            level = abs(float(law.deviation(NUMPY, abs(s) if abs(s) > 1e-9 else 1e-12, (), p)))
            assert abs(value) <= level + 1e-9
            if abs(s) > 1e-9:
                assert value == pytest.approx(level * np.sign(s), abs=2e-3 * level)
        else:
            assert value == pytest.approx(float(law.deviation(NUMPY, s, memory, p)), abs=1e-9)


def test_rated_stops_are_those_of_the_rate_dependent_operator() -> None:
    """``sum h (s - play)`` of widths ``r (1 + b |v| / speed)``, the rate known from before."""
    law = StopSum((0.2, 0.5), rated=True, speed=4.0)
    heights, b = (0.6, 0.3), 0.7
    operator = RateDependentPrandtlIshlinskii(
        (0.0, 0.2, 0.5), (0.0, 0.2 * b / 4.0, 0.5 * b / 4.0), (sum(heights), -0.6, -0.3)
    )
    x = walk(200)
    wanted, _ = operator.run(x, operator.initial_memory(0.0, (0.0,) * 4), step=STEP)
    memory, p, got = law.initial_memory(0.0), (*heights, b, STEP), []
    for s in x:
        got.append(law.deviation(NUMPY, s, memory, p))
        memory = law.advance(NUMPY, s, memory, p)
    np.testing.assert_allclose(got, wanted, atol=1e-12)
    # no time has passed: the rate stays
    stopped = law.advance(NUMPY, x[-1], memory, (*heights, b, 0.0))
    assert list(map(float, stopped)) == pytest.approx(list(map(float, memory)))


def test_a_sum_is_the_sum_and_refuses_what_cannot_share_a_solution() -> None:
    stops, curve = StopSum((0.2,), 0.6, rated=True), Polynomial(0.2, 4.0, 1.0, (3,))
    both = LawSum((curve, stops))
    assert (both.energy, both.timed, both.n_memory) == ("dissipates", True, 3)
    memory, p = stops.initial_memory(0.1), (0.4, 0.6, 0.3, STEP)
    own = curve.deviation(NUMPY, 0.7, (), p[:1]) + stops.deviation(NUMPY, 0.7, memory, p[1:])
    assert both.deviation(NUMPY, 0.7, both.initial_memory(0.1), p) == pytest.approx(own)
    assert LawSum((curve, Polynomial(0.0, 1.0, 1.0, (5,)))).energy == "stores"
    with pytest.raises(UnusableInput, match="parameters a_3"):
        LawSum((curve, curve))
    for law in (Coulomb(0.8), Hysteretic(PrandtlIshlinskii((0.0, 0.4), (1.0, 0.8)))):
        with pytest.raises(UnusableInput, match="element of its own"):
            LawSum((curve, law))


def test_printed_stack_operators_are_passive_as_charge_stores() -> None:
    """Maxwell elements dissipate 4 sum v_i (A - q_i)+ in a cycle of amplitude A."""
    operator = MaxwellResistiveCapacitor.stack_2hz()
    law = Hysteretic(operator)
    period = 60e-6 * np.sin(np.linspace(0, 2 * np.pi, 4001))
    memory = law.initial_memory(0.0)
    for _ in range(2):
        efforts = []
        for s in period:
            efforts.append(law.value(NUMPY, s, memory, (), law.slope))
            memory = law.advance(NUMPY, s, memory, ())
    e = np.array(efforts)
    work = float(np.sum(0.5 * (e[1:] + e[:-1]) * np.diff(period)))
    assert work == pytest.approx(float(operator.loop_loss(60e-6)), rel=1e-4)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (Magnet(gap=0.0), "gap = 0.0 of its law magnet is not a number other than 0"),
        (Diode(sense=0.0), "sense = 0.0 of its law diode"),
        (LawSum(()), "parts = () of its law sum is not long enough"),
        (LawSum((Diode(sense=0.0),)), "sense = 0.0 of its law diode"),
        (MaxwellSlip(()), "ways = () of its law maxwell_slip is not long enough"),
        (MaxwellSlip((1.0, -1.0)), "is not a number above 0"),
        (MaxwellSlip(3.0), "ways = 3.0 of its law maxwell_slip is not a value of its type"),  # type: ignore[arg-type]
    ],
)
def test_a_law_out_of_its_bounds_is_one_line(law: Law, says: str) -> None:
    with BondGraph("g") as g:
        One("v") >> R("d", 1.0, law=law)
        Se("F") >> g["v"]
    with pytest.raises(GraphError, match=re.escape(says)):
        equations(g)


def test_a_magnet_starts_within_its_own_bounds() -> None:
    for gap in (0.01, -0.01):
        (_, p) = Magnet(gap=gap, closest=0.1).parameters("k")
        assert p.value == np.clip(p.value, p.lower, p.upper)


def test_what_is_no_law_is_no_part_of_a_sum() -> None:
    with pytest.raises(UnusableInput, match=r"cannot hold MaxwellSlip\(ways=3.0.*not of its type"):
        LawSum((MaxwellSlip(3.0),))  # type: ignore[arg-type]
    with pytest.raises(UnusableInput, match="cannot hold 3, which is no law"):
        LawSum((3,))  # type: ignore[arg-type]
