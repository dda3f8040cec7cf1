"""A law's parameters are in the units of the element that holds it."""

from __future__ import annotations

import pytest

from bondgraph import BondGraph, C, One, R, Se
from bondgraph.graph.elements import Valued
from bondgraph.laws import (
    Backlash,
    Bilinear,
    Coulomb,
    CurrentLimit,
    EndStop,
    Law,
    QuadraticDrag,
    SlewLimit,
    Stribeck,
)
from bondgraph.signals.units import parse_unit


def held(element: Valued) -> dict[str, str]:
    with BondGraph("g") as g:
        Se("u") >> One("node") >> element
    assert g.check() == ()
    return {n: p.unit for n, p in g.parameters.items()}


def bearing(law: Law) -> R:
    return R("b", 1e-5, unit="N*m*s/rad", law=law)


def test_friction_of_a_bearing_is_a_torque() -> None:
    assert held(bearing(Coulomb(5e-3)))["F_c_b"] == "N*m"
    assert held(bearing(Coulomb(5e-3, unit="N*m")))["F_c_b"] == "N*m", "said is said"
    assert held(R("b", 1.0, unit="N*s/m", law=Coulomb(0.8)))["F_c_b"] == "N"
    assert held(R("b", 1.0, law=Coulomb(0.8)))["F_c_b"] == "N", "an element without unit tells none"


@pytest.mark.parametrize(
    ("element", "name", "unit"),
    [
        (bearing(Stribeck(1.0, 0.5, 0.1)), "f_s_b", "rad/s"),
        (bearing(QuadraticDrag(1.0)), "c_2_b", "N*m*s^2/rad^2"),
        (R("b", 1.0, unit="ohm", law=Coulomb(0.8)), "F_c_b", "V"),
        (R("b", 1.0, unit="ohm", law=QuadraticDrag(1.0)), "c_2_b", "V/A^2"),
        (R("b", 1.0, unit="Pa*s/m3", law=QuadraticDrag(1.0)), "c_2_b", "Pa*s^2/(m^3)^2"),
        (R("b", 1.0, unit="Pa*s/m3", law=CurrentLimit()), "low_b", "m^3/s"),
        (C("k", stiffness=1.0, unit="N*m/rad", law=EndStop()), "k_s_k", "N*m/rad"),
        (C("k", stiffness=1.0, unit="N*m/rad", law=Bilinear()), "knee_k", "rad"),
        (bearing(SlewLimit()), "slowness_b", "s/(N*m)"),
        (C("k", 1.0, unit="F", law=Backlash()), "gap_k", "C"),
    ],
)
def test_every_power_of_effort_and_flow_is_translated(
    element: Valued, name: str, unit: str
) -> None:
    found = held(element)[name]
    assert (found, parse_unit(found).dims) == (unit, parse_unit(unit).dims)
