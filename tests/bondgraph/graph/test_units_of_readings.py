"""Units of readings: of what they add, and their own against that of what they read."""

from __future__ import annotations

import pytest
import sympy as sp

from bondgraph import TF, BondGraph, C, I, One, R, Reading, Se, Zero
from bondgraph.graph.modulation import TIME, displacement, effort, external, flow, momentum
from bondgraph.laws import Polynomial

FORCE, SPEED, PLACE = effort("k"), flow("v"), displacement("k")
LENGTH, NUMBER = sp.Symbol("length", positive=True), sp.Symbol("number", positive=True)


def reading(value: sp.Expr, unit: str, **more: object) -> BondGraph:
    """A mass on a spring that drives a pump, and a damper without a unit."""
    with BondGraph("g") as g:
        g.parameter("length", 0.3, "m")
        g.parameter("number", 4.0)
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 1.0, unit="kg")
        v >> C("k", stiffness=2.0, unit="N/m")
        v >> R("d", 3.0)
        oil, pipe = Zero("oil"), One("pipe")
        v >> TF("area", ratio=1e-3, unit="m2") >> oil >> pipe >> R("r", 2.0, unit="Pa*s/m3")
        oil >> C("chamber", 1e-9, unit="m3/Pa")
        Reading("dp", value, unit=unit, **more)  # type: ignore[arg-type]
    return g


def unit_lines(g: BondGraph) -> tuple[str, ...]:
    return tuple(line for line in g.check() if line.startswith("dp "))


@pytest.mark.parametrize(
    ("value", "unit", "says"),
    [
        (FORCE - SPEED, "N", "adds e_k in m*kg/s^2 and f_v in m/s; correct its expression"),
        (FORCE - effort("oil"), "", "adds e_k in m*kg/s^2 and e_oil in kg/m/s^2"),
        (FORCE - effort("oil>pipe"), "", "and e_oil>pipe in kg/m/s^2"),
        ((FORCE + SPEED) / 2, "N", "adds e_k in m*kg/s^2 and f_v in m/s"),
        (sp.sin(FORCE - SPEED), "1", "adds e_k"),
        (FORCE + LENGTH, "N", "adds e_k in m*kg/s^2 and length in m"),
        (FORCE - effort("F"), "Pa", "its unit is Pa, but -e_F + e_k is in m*kg/s^2; correct one"),
        (FORCE * SPEED, "J", "its unit is J, but e_k*f_v is in m^2*kg/s^3"),
        (TIME * SPEED, "m/s", "its unit is m/s, but f_v*time is in m"),
        (momentum("m"), "N", "its unit is N, but p_m is in m*kg/s"),
        (PLACE / LENGTH, "m", "its unit is m, but q_k/length is in 1"),
        (sp.sqrt(SPEED**2 + SPEED * PLACE / TIME), "m", "is in m/s"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_one_line(value: sp.Expr, unit: str, says: str) -> None:
    (line,) = unit_lines(reading(value, unit))
    assert line.startswith("dp (Reading): ")
    assert says in line


@pytest.mark.parametrize(
    ("value", "unit", "more"),
    [
        (FORCE + effort("d"), "N", {}),
        (PLACE / 0.3, "1", {}),  # a number may hide a unit
        (2000.0 * PLACE, "N", {}),
        (2000.0 * PLACE + FORCE, "N", {}),
        (FORCE + 3.0, "N", {}),
        (NUMBER * PLACE, "N", {}),  # as may a parameter without one
        (FORCE * SPEED, "W", {}),
        (abs(FORCE), "N", {}),
        (effort("F") / SPEED, "N*s/m", {}),
        (FORCE * external("share"), "m", {}),
        (PLACE, "mm", {}),  # refused, but not here
        (FORCE, "V", {"gain": 0.5}),
        (FORCE, "V", {"law": Polynomial(orders=(3,), size=1.0)}),
        (FORCE, "", {}),
    ],
)
def test_what_is_not_known_is_no_contradiction(
    value: sp.Expr, unit: str, more: dict[str, object]
) -> None:
    assert not [n for n in unit_lines(reading(value, unit, **more)) if "(Reading): adds" in n]
    assert not [n for n in unit_lines(reading(value, unit, **more)) if "its unit is" in n]
