"""Equations where they are easily wrong: names, orders, shared flows, loops, zeros."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from bondgraph import (
    BondGraph,
    C,
    Df,
    GraphError,
    I,
    One,
    R,
    Se,
    Sf,
    Zero,
)
from bondgraph.analysis.linear import linear_rates
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import MTF, CField, MSe, MSf, RField
from bondgraph.graph.modulation import (
    momentum,
)
from bondgraph.laws import Polynomial
from tests.symbols import P, S, same


def test_ports_of_a_resistive_field_that_share_one_flow() -> None:
    with BondGraph("shared") as g:
        a, b = One("a"), One("b")
        Se("u") >> a >> b
        plate = RField("F", matrix=((2.0, 0.5), (0.5, 1.5)))
        a >> plate
        b >> plate
        b >> C("c", 1.0)
    assert same(equations(g).rates[0], (S("u") - S("q_c") / P("c")) * sp.Rational(2, 9))


@pytest.mark.parametrize(
    "name", ["q_c", "e_c", "f_loop", "y_i", "e_r", "d_V", "time", "one", "ramp"]
)
def test_one_name_has_one_meaning(name: str) -> None:
    with BondGraph("names") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 2.0)
        loop >> C("c", 0.5)
        loop >> Df("i")
        Se(name) >> loop
    with pytest.raises(GraphError, match=f"names: '{name}' is the name of a signal"):
        equations(g)


def test_a_parameter_may_not_be_called_like_another_or_a_signal() -> None:
    with BondGraph("names") as g:
        loop = One("loop")
        Se("V") >> loop >> R("N", 2.0, law=Polynomial())
        loop >> C("a_3_N", 0.5)
    with pytest.raises(GraphError, match="'a_3_N' is a parameter of N and of a_3_N"):
        equations(g)
    with BondGraph("names") as h:
        loop = One("loop")
        Se("V") >> loop >> R("r", 2.0, law=Polynomial())
        loop >> C("c", 0.5)
        loop >> R("w_r", 1.0)
    with pytest.raises(GraphError, match="'w_r' is the name of a signal"):
        equations(h)


def test_two_stores_may_not_share_a_name() -> None:
    with BondGraph("names") as g:
        loop, other = One("loop"), One("other")
        Se("V") >> loop >> R("r", 2.0)
        pair = CField("c", matrix=((2.0, 0.5), (0.5, 1.0)))
        loop >> pair
        other >> pair
        loop >> other
        other >> C("c2", 0.5)
    with pytest.raises(GraphError, match=r"names: (two stores|e_c2 is determined twice)"):
        equations(g)


def test_order_of_declaration_does_not_matter_for_a_store_in_a_loop() -> None:
    """A flow source modulated by the momentum it decides: the unknown's rate is solved too."""
    from itertools import permutations

    orders = set()
    for kinds in permutations(("u", "m", "L", "K")):
        g = BondGraph("deep")
        a, j = g.add(Zero("a")), g.add(One("j"))
        made = {
            "u": Sf("u"),
            "m": MSf("m", value=sp.sin(momentum("L")) / 5),
            "L": I("L", 2.0),
            "K": C("K", 1.0),
        }
        for k in kinds:
            g.add(made[k])
        g.bond(made["u"], a)
        g.bond(made["m"], j)
        g.bond(j, a)
        g.bond(a, made["L"])
        g.bond(j, made["K"])
        model = equations(g)
        known = {*model.states, *model.inputs, *model.input_rates, *model.parameters}
        known |= {x.name for x in model.algebraic}
        for expression in (*model.rates, model.signal("e_a")):
            assert {str(v) for v in expression.free_symbols} <= known
        orders.add((model.order, len(model.algebraic)))
    assert orders == {(1, 1)}


def test_a_store_behind_a_nonlinear_loop() -> None:
    """V = i + a i^3 + L2 di/dt with both inertias on one shaft after the loop: the rate of i."""
    with BondGraph("behind") as g:
        loop, node, out = One("loop"), Zero("node"), One("out")
        Se("V") >> loop >> R("r", 1.0)
        loop >> R("d", 0.0, law=Polynomial())
        loop >> node >> C("c1", 0.7)
        node >> out >> R("r2", 0.4)
        out >> C("c2", 0.3)
        node >> C("c3", 0.2)
    model = equations(g)
    assert model.order == 2
    known = {*model.states, *model.inputs, *model.input_rates, *model.parameters}
    known |= {x.name for x in model.algebraic}
    for expression in (*model.rates, *model.residuals):
        assert {str(v) for v in expression.free_symbols} <= known


def test_a_long_resistive_ladder_stays_small() -> None:
    sizes = []
    for n in (20, 40):
        with BondGraph("ladder") as g:
            a = One("a0")
            Se("V") >> a
            for i in range(n):
                a >> R(f"s{i}", 1.0 + i)
                z = Zero(f"z{i}")
                a >> z >> R(f"p{i}", 2.0 + i)
                if i < n - 1:
                    a = One(f"a{i + 1}")
                    z >> a
            z >> C("c", 1.0)
        model = equations(g)
        sizes.append(len(model.relations))
        # against the continued fraction of the ladder: rate = (V_th - q/c) / R_th
        v, r = 1.0, 0.0
        for i in range(n):
            r += 1.0 + i
            p = 2.0 + i
            v, r = v * p / (r + p), r * p / (r + p)
        (row,) = linear_rates(model)
        assert float(row["V"]) == pytest.approx(v / r)
        assert float(row["q_c"]) == pytest.approx(-1 / r)
    assert sizes[1] < 2.3 * sizes[0]


def test_numbers_of_numpy_and_numbers_that_are_none() -> None:
    with BondGraph("n") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", np.int64(2))
        loop >> C("c", np.float32(0.5))
    assert same(equations(g).rates[0], (S("V") - S("q_c") / P("c")) / P("r"))
    with pytest.raises(GraphError, match="value = "):
        R("r", 2 + 0j)
    for bad in (float("nan"), float("inf"), None):
        with BondGraph("n") as h:
            loop = One("loop")
            MSe("V", value=bad) >> loop >> R("r", 1.0)
            loop >> C("c", 1.0)
        with pytest.raises(GraphError):
            equations(h)
    with BondGraph("n") as k:
        loop = One("loop")
        Se("V") >> loop >> R("r", 1e308)
        loop >> C("c", 1.0)
    with pytest.raises(GraphError, match="choose other units"):
        equations(k)


def test_names_of_lags_offsets_and_delays_must_exist() -> None:
    cases: Any = (
        ({"offset": "nosuch"}, {}),
        ({"gain": "nosuch"}, {}),
        ({}, {"gain": "nosuch"}),
        ({}, {"lag": "nosuch"}),
        ({}, {"drift": ("nosuch",)}),
    )
    for source, sensor in cases:
        with BondGraph("n") as g:
            loop = One("loop")
            Se("V", **source) >> loop >> R("r", 1.0)
            loop >> C("c", 1.0)
            loop >> Df("i", **sensor)
        with pytest.raises(GraphError, match="'nosuch'"):
            equations(g)


def test_a_zero_ratio_is_not_divided_by() -> None:
    with BondGraph("n") as g:
        loop = One("loop")
        lever = MTF("m", ratio=0.0)
        Se("V") >> lever
        lever >> loop >> R("r", 1.0)
    with pytest.raises(GraphError, match="ratio 0"):
        equations(g)


def test_a_number_is_the_parameter_of_any_two_port() -> None:
    with BondGraph("n") as g:
        loop = One("loop")
        Se("V") >> MTF("m", ratio=2.0) >> loop >> R("r", 1.0)
        loop >> C("c", 1.0)
    (m, r, c), (q, v) = P("m r c"), S("q_c V")
    model = equations(g)
    assert same(model.shown(model.stored[0].rate), (v / m - q / c) / r)


def test_a_whole_law_has_its_own_slope() -> None:
    """Whatever stiffness or capacitance it takes the place of."""
    from bondgraph.hysteresis import MaxwellResistiveCapacitor
    from bondgraph.laws import Hysteretic

    law = Hysteretic(MaxwellResistiveCapacitor((3e3, 7e3), (2.0, 500.0)))
    choices: Any = ({"stiffness": 5e3}, {"value": 5e3}, {"law": law})
    for given in choices:
        with BondGraph("n") as g:
            body = One("body")
            Se("F") >> body >> I("m", 1.0)
            body >> C("k", **given)
        g = g.with_element("k", law=law)
        f = equations(g).program().rhs
        made = equations(g).program()
        x = [1e-3 if n == "q_k" else 0.0 for n in made.states]
        dx = f(0, x, [], [0], list(made.nominal), list(made.virgin), 0)[0].full().ravel()
        assert -dx[made.states.index("p_m")] == pytest.approx(9.0)
