"""The exact equations: hand derivations symbol by symbol, what stays implicit, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import (
    TF,
    AlgebraicLoop,
    BondGraph,
    C,
    CausalConflict,
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
from bondgraph.analysis.linear import linear_rates, linearise, sensitivities, zeros
from bondgraph.causality.assignment import alternatives, assign_causality
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import MGY, MTF, RE, RS, CField, MSe, MSf
from bondgraph.graph.modulation import (
    TIME,
    displacement,
    effort,
    external,
    flow,
    port_variables,
)
from bondgraph.laws import Polynomial
from tests.symbols import P, S, same


def test_two_masses_share_the_force() -> None:
    with BondGraph("pair") as g:
        body = One("body")
        Se("F") >> body >> I("m_1", 2.0)
        body >> I("m_2", 3.0)
        body >> Df("v")
    model = equations(g)
    assert model.states == ("p_m_1",)
    m1, m2, p = P("m_1"), P("m_2"), S("p_m_1")
    assert same(model.rates[0], m1 / (m1 + m2) * S("F"))
    assert same(model.dependent["p_m_2"], m2 / m1 * p)
    assert same(model.transfer_function("F", "v"), 1 / ((m1 + m2) * sp.Symbol("s")))


def test_a_voltage_on_a_capacitance_needs_the_rate_of_the_input() -> None:
    with BondGraph("blocked") as g:
        loop = One("loop")
        Se("V") >> loop >> C("c", 2.0)
        loop >> Df("i")
    model = equations(g)
    assert (model.states, model.input_rates) == ((), ("d_V",))
    assert same(model.outputs[0], P("c") * S("d_V"))
    assert model.transfer_function("V", "i") == P("c") * sp.Symbol("s")


def test_a_linear_loop_is_solved() -> None:
    """The Wheatstone-like pair: V = R1 (f + e/R2) + e, f = (e - q/c)/R3."""
    with BondGraph("loop") as g:
        a, j, b = One("a"), Zero("j"), One("b")
        Se("V") >> a >> R("r1", 1.0)
        a >> j >> R("r2", 2.0)
        j >> b >> R("r3", 3.0)
        b >> C("c", 1.0)
    model = equations(g)
    r1, r2, r3, c, q = P("r1"), P("r2"), P("r3"), P("c"), S("q_c")
    bottom = r1 * r2 + r1 * r3 + r2 * r3
    assert same(model.rates[0], (r2 * S("V") - (r1 + r2) * q / c) / bottom)
    assert model.loops
    assert model.is_explicit


def crank() -> BondGraph:
    with BondGraph("crank") as g:
        length = g.parameter("L", 0.5)
        rotation, slide = One("rotation"), One("slide")
        Se("T") >> rotation >> I("J", 0.1)
        rotation >> C("phi", stiffness=1.0)
        crank = MTF("crank", ratio=-length * sp.sin(displacement("phi")))
        rotation >> crank
        crank >> slide >> I("m", 1.0)
        slide >> R("b", 0.2)
        rotation >> Df("w")
    return g


def test_a_mass_behind_a_modulated_lever() -> None:
    """(J + m L^2 sin^2) w' + m L^2 sin cos w^2 + b L^2 sin^2 w + k phi = T, by Lagrange."""
    model = equations(crank())
    L, J, m, b, k = (P(n) for n in ("L", "J", "m", "b", "phi"))
    p, q, T = S("p_J"), S("q_phi"), S("T")
    w = p / J
    accel = (
        T - k * q - b * L**2 * sp.sin(q) ** 2 * w - m * L**2 * sp.sin(q) * sp.cos(q) * w**2
    ) / (J + m * L**2 * sp.sin(q) ** 2)
    rate = dict(zip(model.states, model.rates, strict=True))
    assert same(rate["p_J"], J * accel)
    assert same(rate["q_phi"], w)


def test_two_nonlinear_stores_in_parallel() -> None:
    """k1 q1 + a q1^3 = k2 q2 + b q2^3 stays implicit; the rate of q2 follows by differentiation."""
    with BondGraph("pair") as g:
        node = Zero("node")
        Sf("F") >> node >> C("c1", 0.5, law=Polynomial())
        node >> C("c2", 2.0, law=Polynomial())
        node >> De("e")
    model = equations(g)
    assert model.order == 1
    assert len(model.algebraic) == 1
    (state,), (dependent,) = model.states, (a.name for a in model.algebraic)
    assert {state, dependent} == {"q_c1", "q_c2"}
    # the two rates sum to the inflow, and both efforts move together
    total = model.signal("f_c1") + model.signal("f_c2")
    assert same(total, S("F"))


def test_a_nonlinear_resistive_loop_stays_implicit() -> None:
    with BondGraph("diode") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 2.0)
        loop >> R("d", 0.0, law=Polynomial())
        loop >> Df("i")
    model = equations(g)
    assert [a.name for a in model.algebraic] == ["f_loop"] or len(model.algebraic) == 1
    known = {str(s) for r in model.residuals for s in r.free_symbols}
    assert known <= {*model.inputs, *model.parameters, *(a.name for a in model.algebraic)}


def test_modulation_by_any_signal() -> None:
    with BondGraph("motor") as g:
        gain = g.parameter("K", 2.0)
        loop, shaft = One("loop"), One("shaft")
        Se("V") >> loop >> R("Ra", 1.0)
        machine = MGY("machine", ratio=gain * external("field"))
        loop >> machine
        machine >> shaft >> I("J", 0.5)
        MSe("load", value=-0.25 * flow("J") ** 2 + sp.cos(TIME)) >> shaft
    model = equations(g)
    assert set(model.inputs) == {"V", "in_field"}
    K, Ra, J, p = P("K"), P("Ra"), P("J"), S("p_J")
    r = K * S("in_field")
    rate = r * (S("V") - r * p / J) / Ra - 0.25 * (p / J) ** 2 + sp.cos(S("time"))
    assert same(model.rates[0], rate)


def test_a_loop_through_the_modulation_is_found() -> None:
    """Gawthrop and Smith 1996, eq. 2.48: the amplifier's loop lies in its signal."""
    with BondGraph("amplifier") as g:
        gain = g.parameter("g", 100.0)
        a, n, b = One("a"), Zero("n"), One("b")
        Se("u") >> a >> R("Rin", 2.0)
        a >> n >> b >> C("Cf", 3.0)
        b >> MSe("amp", value=-gain * effort("n"))
    model = equations(g)
    assert model.loops
    q, c = S("q_Cf"), P("Cf")
    expected = (S("u") - q / ((1 + P("g")) * c)) / P("Rin")
    assert same(model.rates[0], expected)


def test_two_inputs_from_one_signal_loop_that_is_singular() -> None:
    """An amplifier of gain one that drives its own input determines nothing."""
    with BondGraph("mirror") as g:
        n = Zero("n")
        MSe("e", value=effort("n")) >> One("a") >> n
        n >> R("r", 1.0)
    with pytest.raises(AlgebraicLoop, match=r"mirror: .*singular"):
        equations(g)


def test_moving_plate_capacitor() -> None:
    with BondGraph("plate") as g:
        c0, x0 = g.parameter("c0", 1.0), g.parameter("x0", 1.0)
        q1, q2 = port_variables("q", 2)
        a, b = One("a"), One("b")
        Se("V") >> a >> R("r", 1.0)
        b >> C("k", 1.0)
        b >> I("m", 1.0)
        plate = CField("cm", energy=q1**2 * q2 / (2 * c0 * x0))
        a >> plate
        b >> plate
    model = equations(g)
    rate = dict(zip(model.states, model.rates, strict=True))
    q, x = S("q_cm1"), S("q_cm2")
    assert same(rate["q_cm1"], (S("V") - q * x / (P("c0") * P("x0"))) / P("r"))
    force = q**2 / (2 * P("c0") * P("x0"))
    assert same(rate["p_m"], -force - S("q_k") / P("k"))


def test_reaction_and_heat() -> None:
    with BondGraph("cell") as g:
        q = port_variables("q", 1)[0]
        a, b = CField("A", law=(sp.log(q),), ports=1), CField("B", law=(sp.log(q),), ports=1)
        na, nb = Zero("na"), Zero("nb")
        na >> a
        nb >> b
        na >> RE("k", ratio=0.3) >> nb
    model = equations(g)
    x, y = S("q_A1"), S("q_B1")
    rate = dict(zip(model.states, model.rates, strict=True))
    assert same(rate["q_A1"], -P("k") * (x - y))
    with BondGraph("heater") as h:
        loop, hot = One("loop"), Zero("hot")
        Se("V") >> loop >> RS("heat", ratio=5.0) >> hot >> C("C_th", 10.0)
    assert same(equations(h).rates[0], S("V") ** 2 / P("heat"))


def test_position_of_a_free_mass_is_a_state() -> None:
    with BondGraph("mass") as g:
        body = One("body")
        Se("F") >> body >> I("m", 2.0)
        body >> Dq("x")
    assert equations(g).states == ("p_m", "q_x")


# -- causality -------------------------------------------------------------------------------
def test_all_alternatives() -> None:
    with BondGraph("three") as g:
        body = One("body")
        Se("F") >> body
        for i in range(3):
            body >> I(f"m_{i}", 1.0)
    found = {c.derivative for c in alternatives(g)}
    assert {frozenset(d) for d in found} == {
        frozenset(pair) for pair in (("m_0", "m_1"), ("m_0", "m_2"), ("m_1", "m_2"))
    }
    for causality in alternatives(g):
        model = equations(g, causality)
        (rate,) = model.rates
        m = P("m_0") + P("m_1") + P("m_2")
        assert same(rate, P(model.states[0][2:]) / m * S("F"))


def test_preferred_derivative_and_inverted_sensors() -> None:
    with BondGraph("rc") as g:
        loop, node = One("loop"), Zero("node")
        Se("V") >> loop >> R("r", 1.0)
        loop >> node >> C("c", 1.0)
        node >> De("u")
    free = assign_causality(g, prefer="derivative")
    assert free.derivative == ("c",)
    inverted = assign_causality(g, prefer="derivative", inverted=("u",))
    bond = next(b for b in g.bonds if b.head == "u")
    assert inverted.strokes[bond].effort_to == "node"
    with pytest.raises(UnknownName, match="no sensor 'w'"):
        assign_causality(g, inverted=("w",))


def test_first_serves_a_store_first() -> None:
    with BondGraph("pair") as g:
        body = One("body")
        Se("F") >> body >> I("m_1", 1.0)
        body >> I("m_2", 1.0)
    assert assign_causality(g).derivative == ("m_2",)
    assert assign_causality(g, first=("m_2",)).derivative == ("m_1",)
    with pytest.raises(UnknownName, match="Did you mean 'm_1'"):
        assign_causality(g, first=("m1",))


def test_fighting_sources_are_named() -> None:
    with BondGraph("fight") as g:
        loop = One("loop")
        Sf("A") >> loop
        loop >> TF("n", ratio=2.0) >> One("far") >> Sf("B")
    with pytest.raises(CausalConflict, match=r"conflict at bond .*Sf [AB] imposes"):
        equations(g)


def test_a_law_without_inverse_in_a_loop_is_solved_numerically() -> None:
    """A polynomial resistor that must give flow, beside two capacitances on one node."""
    with BondGraph("hidden") as g:
        loop, node = One("loop"), Zero("node")
        Se("V") >> loop >> R("d", 0.0, law=Polynomial())
        loop >> R("r", 1.0)
        loop >> node >> C("c1", 1.0)
        node >> C("c2", 1.0)
    model = equations(g)
    assert model.order == 1
    assert len(model.algebraic) == 1
    assert "R d" in model.algebraic[0].reason


def test_a_graph_without_bonds_is_refused() -> None:
    with BondGraph("nothing") as g:
        One("a")
    with pytest.raises(GraphError, match="nothing: a"):
        equations(g)


# -- analysis --------------------------------------------------------------------------------
def test_linearisation_about_a_point() -> None:
    model = equations(crank())
    point = {"q_phi": 0.3, "p_J": 0.2, "T": 0.1}
    linear = linearise(model, point)
    values = {n: p.value for n, p in model.parameters.items()}
    a, b, c, d = linear.numbers(values)
    f = model.program().rhs
    x0, p = [point[s] for s in model.states], list(values.values())

    def rate(x: list[float], u: float) -> np.ndarray:
        return np.asarray(f(0, x, [], [u], p, [], 0)[0].full()).ravel()

    h = 1e-6
    for i in range(2):
        up, down = list(x0), list(x0)
        up[i] += h
        down[i] -= h
        assert a[:, i] == pytest.approx((rate(up, 0.1) - rate(down, 0.1)) / (2 * h), rel=1e-6)
    assert b[:, 0] == pytest.approx((rate(x0, 0.1 + h) - rate(x0, 0.1 - h)) / (2 * h), rel=1e-6)
    assert c.shape == (1, 2)
    assert d.shape == (1, 1)
    assert linear.outputs == ("w",)


def test_linearisation_through_an_implicit_loop() -> None:
    with BondGraph("diode") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 2.0)
        loop >> R("d", 0.0, law=Polynomial())
        loop >> C("c", 1.0)
    model = equations(g)
    cubic = next(n for n in model.parameters if n not in ("r", "c", "d"))
    a, _, _, _ = linearise(model, {model.algebraic[0].name: 0.0}).numbers(
        {n: q.value for n, q in model.parameters.items()} | {cubic: 0.7}
    )
    assert a[0, 0] == pytest.approx(-1 / 2.0)


def test_zeros_and_sensitivities() -> None:
    with BondGraph("absorber") as g:
        body, tuned, joint = One("body"), One("tuned"), Zero("joint")
        Se("F") >> body >> I("m_1", 2.0)
        body >> Df("v")
        body >> joint >> tuned >> I("m_2", 0.5)
        joint >> C("k", stiffness=8.0)
    model = equations(g)
    poly = zeros(model, "F", "v").as_expr()
    s = sp.Symbol("s")
    assert same(sp.cancel(poly / (P("m_2") * s**2 + P("k"))), sp.S.One * sp.LC(poly, s) / P("m_2"))
    by_k = sensitivities(model, ["k"])["k"]
    assert [same(a, sp.diff(b, P("k"))) for a, b in zip(by_k, model.rates, strict=True)]
    with pytest.raises(UnknownName):
        sensitivities(model, ["kk"])


def test_sensitivities_follow_algebraic_unknowns() -> None:
    """``V - q / C = (R_1 + R_2) f + a f^3`` leaves the current implicit: its slopes by hand."""
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 1.0)
        loop >> R("R_2", 2.0, law=Polynomial(0.0, 1.0, 1.0, (3,), unit="V"))
        loop >> C("C_1", 0.5)
    model = equations(g)
    assert model.algebraic
    (cubic,) = (n for n in model.parameters if n not in ("R_1", "R_2", "C_1"))
    a, charge, f = 0.7, 0.3, 0.4
    volt = charge / 0.5 + 3.0 * f + a * f**3
    put = {p.symbol: p.value for p in model.parameters.values()}
    put |= {model.parameters[cubic].symbol: a, S("q_C_1"): charge, S("V"): volt}
    left = [e.xreplace(put) for e in model.residuals]
    unknowns = [S(z.name) for z in model.algebraic]
    put |= dict(zip(unknowns, sp.nsolve(left, unknowns, [0.4] * len(unknowns)), strict=True))
    slope = 3.0 + 3.0 * a * f**2
    expected = {"R_1": -f / slope, "R_2": -f / slope, cubic: -(f**3) / slope}
    expected["C_1"] = charge / 0.5**2 / slope
    for n, column in sensitivities(model).items():
        assert float(column[0].xreplace(put)) == pytest.approx(expected[n], rel=1e-9), n


def test_exact_numbers_leave_nothing_behind() -> None:
    """The mechanical bridge on which floats leave a dangling variable in another tool."""
    with BondGraph("floats") as g:
        a, j, b = One("a"), Zero("j"), One("b")
        Se("F") >> a >> I("m1", 6 / 7)
        a >> j >> b >> I("m2", 7.6)
        j >> C("c", 31 / 3)
        b >> R("r", 0.1)
    rows = linear_rates(equations(g))
    known = {"p_m1", "p_m2", "q_c", "F"}
    assert all(set(row) <= known for row in rows)
    assert sum(len(row) for row in rows) == 2 + 2 + 2


def test_both_sources_imposed_on_stores() -> None:
    with BondGraph("deep") as g:
        node, loop = Zero("node"), One("loop")
        Se("V") >> node >> C("c", 2.0)
        Sf("F") >> loop >> I("L", 3.0)
        node >> loop
    model = equations(g)
    assert set(model.input_rates) == {"d_V", "d_F"}
    assert same(model.signal("f_V"), P("c") * S("d_V") + S("F"))
    assert same(model.signal("e_F"), P("L") * S("d_F") - S("V"))


def test_a_law_that_cannot_be_inverted_is_named() -> None:
    from bondgraph.laws import Coulomb

    with BondGraph("stuck") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 0.0, law=Coulomb())
        loop >> C("c", 1.0)
    with pytest.raises((CausalConflict, DerivativeCausality)):
        equations(g)


def test_unused_flow_source_modulated() -> None:
    with BondGraph("leak") as g:
        node = Zero("node")
        Sf("F") >> node >> C("c", 2.0)
        MSf("leak", value=-(effort("node") ** 3)) >> node
    assert same(equations(g).rates[0], S("F") - (S("q_c") / P("c")) ** 3)
