"""The table law: through its points, monotone, one formula on three back ends, refusals."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from scipy.interpolate import PchipInterpolator

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, UnknownName, UnusableInput
from bondgraph.graph.drives import Drive
from bondgraph.laws.magnet import Magnet
from bondgraph.laws.table import TableLaw
from bondgraph.support.ops import CASADI, NUMPY, SYMPY
from tests.settled import simulate

KNOTS = (-2.0, -0.7, 0.1, 1.0, 1.4, 3.0)
ROUGH = (0.4, -1.0, -1.0, 0.3, 2.0, 1.8)
RISING = (-3.0, -1.0, -0.9, 0.0, 0.5, 4.0)
INSIDE = np.linspace(-2.0, 3.0, 401)
WIDE = np.linspace(-4.0, 5.0, 181)


@pytest.mark.parametrize("values", [ROUGH, RISING])
def test_agrees_with_reference_interpolations(values: tuple[float, ...]) -> None:
    straight = TableLaw(KNOTS, values).output(NUMPY, INSIDE, ())
    np.testing.assert_allclose(straight, np.interp(INSIDE, KNOTS, values), atol=1e-13)
    cubic = TableLaw(KNOTS, values, "pchip").output(NUMPY, INSIDE, ())
    np.testing.assert_allclose(cubic, PchipInterpolator(KNOTS, values)(INSIDE), atol=1e-12)


@pytest.mark.parametrize("join", ["linear", "pchip"])
def test_passes_the_points_and_keeps_their_order(join: str) -> None:
    law = TableLaw(KNOTS, RISING, join)
    np.testing.assert_allclose(law.output(NUMPY, np.array(KNOTS), ()), RISING, atol=1e-13)
    assert np.all(np.diff(law.output(NUMPY, INSIDE, ())) >= -1e-13)
    flat = law.output(NUMPY, np.array([-9.0, 9.0]), ())
    np.testing.assert_allclose(flat, [RISING[0], RISING[-1]])


@pytest.mark.parametrize("join", ["linear", "pchip"])
def test_goes_on_straight(join: str) -> None:
    law = TableLaw(KNOTS, RISING, join, flat=False)
    h = 1e-6
    for end, outward in ((-2.0, -1.0), (3.0, 1.0)):
        at, inside = (float(law.output(NUMPY, end - outward * d, ())) for d in (0.0, h))
        slope = (at - inside) / h
        far = float(law.output(NUMPY, end + 2.0 * outward, ()))
        assert far == pytest.approx(at + 2.0 * slope, abs=1e-4)


@pytest.mark.parametrize("join", ["linear", "pchip"])
@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("free", [True, False])
def test_back_ends_agree(join: str, flat: bool, free: bool) -> None:
    law = TableLaw(KNOTS, ROUGH, join, flat, free, reference=0.3)
    p = [q.value for q in law.parameters("a")]
    assert p == (list(ROUGH) if free else [])
    s, q = ca.SX.sym("s"), ca.SX.sym("q", len(p))
    f = ca.Function(
        "f", [s, q], [law.deviation(CASADI, s, (), tuple(ca.vertsplit(q)) if p else ())]
    )
    x = sp.Symbol("x", real=True)
    symbolic = law.deviation(SYMPY, x, (), p)
    plain = law.deviation(NUMPY, WIDE, (), p)
    compiled = np.array([float(f(v, p)) for v in WIDE])
    np.testing.assert_allclose(compiled, plain, atol=1e-12)
    for i in range(0, WIDE.size, 20):
        assert float(symbolic.subs(x, WIDE[i])) == pytest.approx(plain[i], abs=1e-12)


def test_odd_is_mirrored() -> None:
    law = TableLaw.odd((0.0, 2.0, 3.0, 6.0), (0.0, 0.0, 0.6, 1.0), join="pchip")
    up = law.output(NUMPY, WIDE, ())
    np.testing.assert_allclose(law.output(NUMPY, -WIDE, ()), -up, atol=1e-14)
    assert law.output(NUMPY, np.array([-2.0, 0.0, 1.9]), ()).tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(UnusableInput, match=r"start at the point \(0, 0\)"):
        TableLaw.odd((1.0, 2.0), (0.0, 1.0))


def test_gradient_by_free_values() -> None:
    law = TableLaw(KNOTS, ROUGH, "pchip", free=True)
    s, q = ca.SX.sym("s"), ca.SX.sym("q", len(KNOTS))
    w = law.deviation(CASADI, s, (), tuple(ca.vertsplit(q)))
    slope = ca.Function("g", [s, q], [ca.jacobian(w, q)])
    base, h = np.array(RISING), 1e-6
    for at in (-1.1, 0.4, 1.2, 2.9):
        exact = slope(at, base).full().ravel()
        for j in range(base.size):
            step = h * np.eye(base.size)[j]
            ends = [float(law.deviation(NUMPY, at, (), tuple(base + sg * step))) for sg in (1, -1)]
            assert exact[j] == pytest.approx((ends[0] - ends[1]) / (2 * h), abs=1e-7)


def _spring(law: Any) -> BondGraph:
    with BondGraph("body_on_a_table") as g:
        body = One("body")
        Se("F", unit="N") >> body
        body >> I("m", 0.1)
        body >> R("b", 2.0)
        body >> C("k", law=law)
        body >> Dq("x")
    return g


def test_spring_settles_on_the_curve_and_stores() -> None:
    """At rest the spring carries the load; without damping a swing keeps its energy."""
    law = TableLaw.odd((0.0, 1.0, 3.0), (0.0, 1.0, 9.0), flat=False, reference=2.0)
    time = np.arange(8001) * 1e-3
    run = simulate(_spring(law), time, {"F": np.full(time.size, 5.0)}, x0=np.zeros(2))
    assert run["x"][-1] == pytest.approx(2.0, abs=1e-6)
    swing = simulate(
        _spring(law), time, {"F": 0 * time}, {"b": 0.0}, x0=np.array([0.0, 2.0]), accuracy=1e-6
    )
    late = swing["x"][-2000:]
    assert np.ptp(late) == pytest.approx(4.0, rel=2e-3)


@pytest.mark.parametrize("reference", [1.0, 2.5, 0.0])
def test_drive_is_the_whole_table(reference: float) -> None:
    law = TableLaw((0.0, 1.0, 2.0), (0.0, 0.0, 3.0), reference=reference)
    with BondGraph("driven") as g:
        body = One("body")
        Se("u", drive=Drive(law=law)) >> body
        body >> I("m", 1e-3)
        body >> R("b", 2.0)
        body >> Dq("x")
    time = np.arange(2001) * 1e-3
    speed = np.gradient(
        simulate(g, time, {"u": np.full(time.size, 1.5)}, x0=np.zeros(2))["x"], time
    )
    assert speed[-2] == pytest.approx(0.75, rel=1e-6)


@pytest.mark.parametrize(
    ("knots", "values", "says"),
    [
        ((0.0,), (1.0,), "at least two points"),
        ((0.0, 1.0), (1.0,), "one value for each knot"),
        ((0.0, 0.0), (1.0, 2.0), "does not lie above"),
        ((0.0, float("nan")), (1.0, 2.0), "not finite"),
    ],
)
def test_refuses(knots: tuple[float, ...], values: tuple[float, ...], says: str) -> None:
    with pytest.raises(UnusableInput, match=says):
        TableLaw(knots, values)


def test_refuses_an_unknown_join() -> None:
    with pytest.raises(UnknownName, match="pchip"):
        TableLaw((0.0, 1.0), (0.0, 1.0), "pchp")


HALF = (-10.0, 0.0, 10.0), (-5.0, 0.0, 5.0)


@pytest.mark.parametrize("reference", [0.5, 2.0])
@pytest.mark.parametrize("make", [C, I, R])
def test_the_reference_slope_changes_nothing(make: type[C | I | R], reference: float) -> None:
    """A table of slope 1/2 is a spring of 1/2, a mass of 2, a damper of 1/2."""
    law = TableLaw(*HALF, flat=False, reference=reference)
    plain = {C: lambda: C("e", stiffness=0.5), I: lambda: I("e", 2.0), R: lambda: R("e", 0.5)}

    def reading(element: Any) -> Any:
        with BondGraph("g") as g:
            v = One("v")
            Se("F") >> v >> element()
            v >> R("d", 1.0)
            if make is not I:
                v >> I("m", 1.5)
            v >> Df("s")
        t = 0.02 * np.arange(200)
        return simulate(g, t, {"F": np.sin(t)})["s"]

    assert reading(lambda: make("e", law=law)) == pytest.approx(reading(plain[make]), abs=1e-4)


@pytest.mark.parametrize(
    ("element", "says"),
    [
        (
            lambda: C("k", stiffness=3.0, law=TableLaw(*HALF)),
            "k (C): its law table is whole, so that the stiffness 3.0 beside it would do nothing; "
            "leave the stiffness out, or give it to an element of its own",
        ),
        (lambda: C("k", 3.0, law=TableLaw(*HALF)), "the value 3.0 beside it"),
        (lambda: I("k", "given", law=TableLaw(*HALF)), "the value given beside it"),
        (lambda: R("k", 0.0, law=TableLaw(*HALF)), "the value 0.0 beside it"),
        (lambda: C("k", stiffness=3.0, law=Magnet()), "or give the law free_standing=False"),
    ],
)
def test_a_value_beside_a_whole_law_is_one_line(element: Any, says: str) -> None:
    with BondGraph("g") as g:
        g.parameter("given", 2.0)
        v = One("v")
        Se("F") >> v >> element()
        v >> R("d", 1.0)
    (line,) = g.check()
    assert says in line


def test_a_whole_law_takes_the_place_of_the_value() -> None:
    with BondGraph("g") as g:
        v = One("v")
        Se("F") >> v >> C("k", stiffness=3.0)
        v >> R("d", 1.0)
    bent = g.with_element("k", law=TableLaw(*HALF))
    assert bent.check() == ()
    assert "k" not in bent.parameters
    assert g.with_element("k", law=Magnet(free_standing=False)).parameters["k"].value == 3.0
