"""Units of declarations are converted or refused; no factor of a thousand passes in silence."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import GY, TF, BondGraph, C, Df, I, One, R, Se, Zero
from bondgraph.graph.elements import CField, Element
from bondgraph.laws import Polynomial
from bondgraph.simulation.simulate import simulate


def cart(mass: Element, damper: Element) -> BondGraph:
    with BondGraph("cart") as g:
        body = One("body")
        Se("F", unit="N") >> body >> mass
        body >> damper
        body >> Df("v", unit="m/s")
    return g


def test_values_are_brought_to_si() -> None:
    time = np.arange(100) * 1e-3
    push = {"F": np.ones(100)}
    small = cart(I("m", 500.0, unit="g"), R("d", 0.002, unit="N*s/mm"))
    plain = cart(I("m", 0.5, unit="kg"), R("d", 2.0, unit="N*s/m"))
    assert small.check() == ()
    assert small.parameters == plain.parameters
    assert np.array_equal(simulate(small, time, push)["v"], simulate(plain, time, push)["v"])
    assert C("k", stiffness=3.0, unit="N/mm").stiffness == 3000.0
    assert TF("n", 2.0, unit="mm").ratio == 0.002


def test_declared_parameters_are_brought_to_si_with_their_bounds() -> None:
    with BondGraph("g") as g:
        g.parameter("l", 20.0, "cm", lower=10.0, scale=20.0)
    p = g.parameters["l"]
    assert (p.value, p.lower, p.upper, p.scale, p.unit) == (0.2, 0.1, None, 0.2, "m")


@pytest.mark.parametrize(
    ("element", "says"),
    [
        (lambda: Se("u", unit="kN"), ("u (Se): unit kN is not SI", "give unit='N'")),
        (lambda: Df("u", unit="mm/s"), ("u (Df): unit mm/s is not SI", "give unit='m/s'")),
        (lambda: I("u", 0.5, unit="banana"), ("u (I): unit 'banana'",)),
        (lambda: TF("u", 0.5, unit="banana"), ("u (TF): unit 'banana'",)),
        (lambda: R("u", 1.0, unit="mN*s/m", law=Polynomial()), ("its law", "unit='N*s/m'")),
        (lambda: R("u", "shared", unit="mN*s/m"), ("its parameters", "unit='N*s/m'")),
        (lambda: CField("u", units=("kN", "V"), law=(0.0, 0.0)), ("unit kN is not SI",)),
    ],
)
def test_what_cannot_be_converted_is_refused(element: object, says: tuple[str, ...]) -> None:
    with BondGraph("g") as g:
        g.parameter("shared", 1.0, "N*s/m")
        body = One("body")
        body >> I("m", -0.5, unit="kg")
        body >> element()  # type: ignore[operator]
    lines = g.check()
    assert any(all(s in line for s in says) for line in lines), lines
    assert any("m (I): coefficient -0.5" in line for line in lines), "one fault hides no other"


def test_a_parameter_with_an_unknown_unit_is_named() -> None:
    with BondGraph("g") as g:
        g.parameter("l", 1.0, "banana")
        Se("F") >> One("body") >> I("m", "l")
    assert any(line.startswith("parameter l: unit 'banana'") for line in g.check())


def cylinder(area: Element) -> BondGraph:
    """A pressure that pushes a mass."""
    with BondGraph("cylinder") as g:
        chamber, rod = Zero("chamber"), One("rod")
        Se("p", unit="Pa") >> chamber >> area >> rod >> I("m", 1.0, unit="kg")
    return g


def test_the_unit_of_a_ratio_is_compared_with_both_ends() -> None:
    assert cylinder(TF("A", 1 / 1.2e-3, unit="1/m^2")).check() == ()
    assert cylinder(TF("A", 1 / 1.2e-3, unit="1/mm^2")).check() == ()  # converted
    (line,) = cylinder(TF("A", 1.2e-3, unit="m^2")).check()
    for word in ("A (TF)", "m^2", "along the half arrows e_in/e_out is in 1/m^2", "give 1/ratio"):
        assert word in line
    (line,) = cylinder(TF("A", 1.2e-3, unit="m")).check()
    assert "correct a unit" in line
    (line,) = cylinder(GY("A", 1.2e-3, unit="m")).check()
    assert "e_in/f_out" in line
