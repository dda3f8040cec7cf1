"""Derived equations of small graphs against pencil and paper; refusals by name."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
import sympy as sp

from actuators.models.textbook import mass_with_viscous_friction, resonator, thermal_lag
from bondgraph import (
    GY,
    TF,
    BondGraph,
    C,
    De,
    DerivativeCausality,
    Df,
    Dq,
    GraphError,
    I,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    Zero,
)
from bondgraph.equations.derivation import equations
from bondgraph.laws import Polynomial
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import UnusableInput
from tests.symbols import P, S, closed, same


def rates(g: BondGraph) -> dict[Any, Any]:
    space = closed(equations(g))
    return dict(zip(space.x, space.dxdt, strict=True))


def test_textbook_machines() -> None:
    m, d, k, M, Fv, Kt, Rth, Cth = P("m d k M F_v K R_th C_th")
    u, F, p_m, q_k, p_M, q_C = S("u F p_m q_k p_M q_C_th")
    f = rates(resonator())
    assert same(f[p_m], u - d * p_m / m - k * q_k)
    assert same(f[q_k], p_m / m)
    assert same(rates(mass_with_viscous_friction())[p_M], F - Fv * p_M / M)
    assert same(rates(thermal_lag())[q_C], (u / Kt - q_C / Cth) / Rth)


def test_transformer_convention() -> None:
    """e_in = n e_out, f_out = n f_in: the mass behind it counts n^2."""
    with BondGraph("g") as g:
        a, b = One("a"), One("b")
        Se("F") >> a >> R("d", 1.0)
        a >> TF("n", ratio=2.0) >> b >> I("m", 1.0)
        a >> Df("v")
    n, d, m = P("n d m")
    F, p = S("F p_m")
    assert same(rates(g)[p], (F - d * p / m / n) / n)
    assert same(equations(g).outputs[0], p / m / n)


@pytest.mark.parametrize("from_the_motor", [True, False])
def test_gyrator_convention(from_the_motor: bool) -> None:
    """e_in = r f_out, e_out = r f_in: a motor, its torque K i, its back voltage K w."""
    with BondGraph("motor") as g:
        loop, shaft = One("loop"), One("shaft")
        Se("V") >> loop >> R("R_a", 1.0)
        loop >> I("L_a", 1.0)
        gyrator = GY("K_t", ratio=0.1)
        loop >> gyrator >> shaft if from_the_motor else shaft >> gyrator >> loop
        shaft >> I("J", 1.0)
        shaft >> R("b", 1.0)
    Ra, La, K, J, b = P("R_a L_a K_t J b")
    V, pl, pj = S("V p_L_a p_J")
    f = rates(g)
    sign = 1 if from_the_motor else -1
    assert same(f[pl], V - Ra * pl / La - sign * K * pj / J)
    assert same(f[pj], sign * K * pl / La - b * pj / J)


def test_resistive_side_of_two_ports() -> None:
    """Behind a transformer R counts n^2, behind a gyrator r^2 / R."""
    n, m, d = P("n m d")
    F, p = S("F p_m")
    for kind, load in ((TF, n**2 * d), (GY, n**2 / d)):
        with BondGraph("g") as g:
            a, b = One("a"), One("b")
            Se("F") >> a >> I("m", 1.0)
            a >> kind("n", ratio=2.0) >> b >> R("d", 3.0)
        assert same(rates(g)[p], F - load * p / m)


def test_displacement_is_read_from_stores() -> None:
    """No state is added where stored displacements integrate the flow already."""
    with BondGraph("g") as g:
        a, b = One("a"), One("b")
        mid = Zero("mid")
        Se("F") >> a >> I("m", 1.0)
        a >> mid >> C("k_1", stiffness=2.0)
        mid >> b >> C("k_2", stiffness=3.0)
        b >> R("d", 1.0)
        a >> Dq("x")
    q1, q2 = S("q_k_1 q_k_2")
    space = equations(g)
    assert same(space.outputs[0], q1 + q2)
    assert len(space.states) == 3
    free = equations(mass_with_viscous_friction())
    assert free.states == ("p_M", "q_x")


def test_sensors() -> None:
    with BondGraph("g") as g:
        node = Zero("node")
        Sf("i") >> node >> R("R_1", 2.0)
        node >> C("C_1", 3.0)
        node >> De("v")
    C1, q = P("C_1"), S("q_C_1")
    assert same(equations(g).outputs[0], q / C1)


def test_named_functions() -> None:
    g = resonator().with_element("k", law=Polynomial())
    q, u, p = S("q_k u p_m")
    d, m = P("d m")
    assert same(rates(g)[p], u - d * p / m - sp.Function("k")(q))
    space = equations(g)
    assert str(space).count(":=") == len(space.relations) + len(space.states) + 1
    with pytest.raises(UnknownName, match="Did you mean 'e_k'"):
        space.signal("e_kk")
    assert compile_model(g).n_w == 1


def test_dependent_compliance_is_solved_in_displacements() -> None:
    """Two capacitors in a voltage loop with a source are one: q = V C1 C2 / (C1 + C2)."""
    with BondGraph("g") as g:
        loop = One("loop")
        Se("V") >> loop >> C("C_1", 1.0)
        loop >> C("C_2", 2.0)
    c1, c2, V, z = P("C_1"), P("C_2"), S("V"), S("z_q_C_1")
    space = compile_model(g).model
    q2 = space.signal("q_C_2").subs(z, 0)
    assert same(q2, V * c1 * c2 / (c1 + c2))
    assert same(space.rates[0], 0)


def test_imposed_compliance() -> None:
    with BondGraph("g") as g:
        node = Zero("node")
        Se("V") >> node >> C("C_1", 2.0)
        node >> R("R_1", 1.0)
    assert same(equations(g).signal("q_C_1"), P("C_1") * S("V"))


def test_dependent_inertia_moves_along() -> None:
    """Two masses on one body: one state, the sum of the momenta, and v = p / (m_1 + m_2)."""
    with BondGraph("pair") as g:
        a = One("a")
        Se("F") >> a >> I("m_1", 1.0)
        a >> I("m_2", 2.0)
        a >> Df("v")
    space = compile_model(g).model
    assert space.states == ("z_p_m_1",)
    assert same(space.rates[0], S("F"))
    assert same(space.outputs[0], S("z_p_m_1") / (P("m_1") + P("m_2")))


def test_two_nonlinear_stores_in_a_loop_are_refused_by_name() -> None:
    with BondGraph("pair") as g:
        loop = One("loop")
        Se("V") >> loop >> C("C_1", 1.0, law=Polynomial())
        loop >> C("C_2", 1.0, law=Polynomial())
    with pytest.raises(DerivativeCausality, match="C_2 has derivative causality"):
        compile_model(g)


def test_linear_loop_is_solved() -> None:
    """V = (R_1 + R_2) f has no state: the loop is solved in closed form."""
    with BondGraph("divider") as g:
        a = One("a")
        Se("V") >> a >> R("R_1", 1.0)
        a >> R("R_2", 1.0)
        a >> Df("i")
    assert same(equations(g).outputs[0], S("V") / (P("R_1") + P("R_2")))


def test_undetermined_flows_are_refused() -> None:
    """Two 0-junctions joined by two paths: how the flow splits is not determined."""
    with BondGraph("ring") as g:
        a, b = Zero("a"), Zero("b")
        Sf("F") >> a
        for n in "lr":
            j = One(f"j_{n}")
            a >> j >> b
        b >> C("c", 1.0)
    with pytest.raises(GraphError, match="ring: "):
        equations(g)


def test_a_position_at_a_spring_that_a_source_imposes() -> None:
    """The displacement of the dependent spring is read, through a lever too."""
    with BondGraph("pressed") as g:
        tip = One("tip")
        Se("F") >> tip >> TF("n", ratio=2.0) >> C("k", stiffness=4.0)
        tip >> Dq("x")
    space = equations(g)
    assert space.states == ()
    (reading,) = space.outputs
    values = {"n": 2.0, "k": 4.0, "F": 3.0}
    numbers = {s: values[str(s)] for s in reading.free_symbols}
    assert float(reading.subs(numbers)) == pytest.approx(3.0 / 2.0 / 4.0 / 2.0)


def test_the_linear_rest_is_a_property_of_the_equations() -> None:
    """Rows dx/dt, argument, reading; columns x, F, one, w: of a spring with a law and an offset."""
    with BondGraph("spring") as g:
        g.parameter("F_0", 0.25, "N", positive=False)
        body = One("body")
        Se("F", offset="F_0") >> body >> I("m", 2.0)
        body >> C("k", stiffness=3.0, law=Polynomial())
        body >> Df("v")
    lure = equations(g).lure
    assert lure is not None
    assert (lure.states, lure.inputs) == (("p_m", "q_k"), ("F", "one"))
    assert lure.matrices(lure.nominal()).full().tolist() == [
        [0.0, -3.0, 1.0, 0.25, -1.0],
        [0.5, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.5, 0.0, 0.0, 0.0, 0.0],
    ]
    moved = g.with_element("k", law=None).with_branch("body", [I("n", 1.0)])
    assert equations(moved).states == ("p_m", "q_k")
    assert getattr(equations(moved).lure, "states", None) == ("z_p_m", "q_k")


def test_numbers_of_the_linear_rest_and_their_derivatives() -> None:
    with BondGraph("spring") as g:
        body = One("body")
        Se("F") >> body >> I("m", 2.0)
        body >> C("k", stiffness=3.0)
        body >> R("d", 0.5)
        body >> Df("v")
    lure = equations(g).lure
    assert lure is not None
    p = lure.nominal()
    p.setflags(write=False)
    at = np.asarray(lure.matrices(p).full())
    np.testing.assert_array_equal(lure.block(p), at)
    moved = lure.block_by_parameters(p)
    assert moved.shape == (p.size, *at.shape)
    for i in range(p.size):
        ends = [lure.block(p + sign * 1e-6 * np.eye(p.size)[i]) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(moved[i], (ends[0] - ends[1]) / 2e-6, atol=1e-8)


def test_numbers_of_a_linear_rest_without_parameters() -> None:
    with BondGraph("bare") as g:
        node = Zero("node")
        Se("F") >> node >> De("e")
    lure = equations(g).lure
    assert lure is not None
    assert lure.block(lure.nominal()).tolist() == [[1.0]]
    assert lure.block_by_parameters(lure.nominal()).shape == (0, 1, 1)


def test_values_in_place_of_a_causality_are_refused_with_where_they_go() -> None:
    with pytest.raises(UnusableInput, match=r"dict is no causality.*graph\.with_values"):
        equations(resonator(), cast(Any, {"m": 1.0}))
