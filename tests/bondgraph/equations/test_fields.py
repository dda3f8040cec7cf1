"""Fields where they hurt: inverted ports, mixed causality, both sides of transformers, limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from bondgraph import TF, BondGraph, C, Df, Dq, GraphError, I, One, R, Se, Sf, Zero
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.equations.derivation import equations
from bondgraph.equations.refusals import AlgebraicLoop
from bondgraph.graph.elements import MTF, CField, IField, RField
from bondgraph.graph.modulation import displacement, port_variables
from tests.settled import simulate

q1, q2, q3 = port_variables("q", 3)
p1, p2 = port_variables("p", 2)
f1, f2 = port_variables("f", 2)
LINEAR = q1**2 + q2**2 + q1 * q2
CURVED = q1**2 / 2 + q1**4 / 4 + q2**2 / 2 + sp.Rational(3, 10) * q1 * q2 + q2**4 / 5


def real(names: str) -> Any:
    return sp.symbols(names, real=True)


def positive(names: str) -> Any:
    return sp.symbols(names, positive=True)


def same(a: Any, b: Any) -> bool:
    return bool(sp.cancel(sp.together(a - b)) == 0)


def two_port(field: Any, first: str, second: str) -> BondGraph:
    """A field between an electrical source and a source, a mass or a resistor."""
    with BondGraph("two_port") as g:
        a, b = One("a"), One("b")
        (Se if first == "e" else Sf)("u") >> a >> field("device")
        b >> g["device"]
        if second in "ef":
            (Se if second == "e" else Sf)("w") >> b
        elif second == "r":
            Se("w") >> b >> R("r", 0.3)
        else:
            b >> I("m", 1.0)
            b >> R("r", 0.3)
        a >> Df("i")
        b >> Dq("x")
    return g


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("energy", [LINEAR, CURVED], ids=["linear", "curved"])
@pytest.mark.parametrize("first", "ef")
@pytest.mark.parametrize("second", "efmr")
def test_every_causality_keeps_the_ledger(energy: Any, first: str, second: str) -> None:
    g = two_port(lambda n: CField(n, energy=energy), first, second)
    t = np.linspace(0.0, 1.0, 401)
    inputs = {"u": np.sin(6 * t)}
    if second in "efr":
        inputs["w"] = 0.5 * np.cos(3 * t) - 0.5
    run = simulate(g, t, inputs, observed=observables(g))
    account = ledger(g, run)
    assert account.closes
    assert account.relative_residual < 1e-5
    assert len(equations(g).held) == (first == "e") + (second == "e")


def test_an_inverted_port_against_a_hand_made_reduction() -> None:
    """``u = q + q^3 + 0.3 x`` solved by Cardano, the rest by another integrator."""
    g = two_port(lambda n: CField(n, energy=CURVED), "e", "m")

    def charge(u: Any, x: Any) -> Any:
        r = u - 0.3 * x
        root = np.sqrt(r**2 / 4 + 1 / 27)
        return np.cbrt(r / 2 + root) + np.cbrt(r / 2 - root)

    def rhs(t: float, y: Any) -> Any:
        x, v = y
        force = x + 0.3 * charge(np.sin(6 * t), x) + 0.8 * x**3
        return [v, -force - 0.3 * v]

    t = np.linspace(0.0, 5.0, 2001)
    run = simulate(g, t, {"u": np.sin(6 * t)}, accuracy=1e-7)
    exact = solve_ivp(rhs, (0.0, 5.0), [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12).y
    assert np.abs(run["x"] - exact[0]).max() < 2e-5 * np.ptp(exact[0])
    rate = np.gradient(charge(np.sin(6 * t), exact[0]), t, edge_order=2)
    assert np.abs(run["i"] - rate)[5:-5].max() < 1e-2 * np.abs(rate).max()


def test_the_rate_of_an_inverted_curved_port_is_implicit_differentiation() -> None:
    model = equations(two_port(lambda n: CField(n, energy=CURVED), "e", "m"))
    (current, _) = model.outputs
    q, p, du = real("q_device1 p_m d_u")
    m = positive("m")
    assert same(current, (du - sp.Rational(3, 10) * p / m) / (1 + 3 * q**2))


def test_two_linear_ports_of_three_are_inverted_beside_a_curved_one() -> None:
    with BondGraph("three") as g:
        energy = q1**2 + q2**2 + q1 * q2 + q3**2 + q1 * q3 / 2 + q3**4
        device = CField("device", energy=energy, ports=3)
        for i in (1, 2):
            Se(f"u_{i}") >> One(f"a_{i}") >> device
        body = One("body")
        body >> device
        body >> I("m", 1.0)
    model = equations(g)
    assert model.is_explicit
    assert set(model.held) == {"q_device1", "q_device2"}
    u, w, q = real("u_1 u_2 q_device3")
    expected = -(2 * q + 4 * q**3 + (2 * u - w - q) / 6)
    assert same(model.rates[1], expected)


def test_fields_on_both_sides_of_a_transformer() -> None:
    matrix = ((2, 1), (1, 3))
    with BondGraph("pair") as g:
        f, h = CField("f", matrix=matrix), CField("h", matrix=matrix)
        a, b, c, d = Zero("a"), Zero("b"), One("c"), One("d")
        Sf("i") >> a >> f
        a >> TF("n", ratio=2.0) >> b >> h
        c >> f
        d >> h
        c >> I("m", 1.0)
        d >> I("m2", 1.5)
    model = equations(g)
    assert set(model.held) == {"q_h1"}
    n, m, m2 = positive("n m m2")
    i, p, r = real("i p_m p_m2")
    # 2 f + f2 = n (2 h + h2) with h' = n (i - f'), differentiated by hand
    expected = (2 * n**2 * i - p / m + n * r / m2) / (2 * (1 + n**2))
    assert same(model.rates[0], expected)


def test_a_store_behind_a_ratio_that_the_field_sets() -> None:
    """u = e + n q_c/c, n = 2 + x^2: the charge of c depends on states and on the drive."""
    with BondGraph("ratio") as g:
        device = CField("device", energy=q1**2 / 2 + q2**2 + q1 * q2 / 3)
        a, b, c = One("a"), One("b"), One("c")
        Se("u") >> a >> device
        a >> MTF("n", ratio=2 + displacement("device2") ** 2) >> c >> C("c_2", 1.0)
        b >> device
        b >> I("m", 1.0)
    model = equations(g)
    q, x, p, u, du = real("q_device1 q_device2 p_m u d_u")
    k, m = positive("c_2 m")
    n, v = 2 + x**2, p / m
    top = n * (du - v / 3) + 2 * x * v * (q + x / 3 - u)
    assert same(model.rates[0], k * top / (n * (n**2 + k)))


# -- inductances ----------------------------------------------------------------------------------
def coupled_coils(k: float) -> BondGraph:
    """Two windings, coupling k, a source with resistance and a load."""
    with BondGraph("coils") as g:
        l1, l2 = g.parameter("L_1", 1.0), g.parameter("L_2", 4.0)
        m = g.parameter("k", k) * sp.sqrt(l1 * l2)
        d = l1 * l2 - m**2
        device = IField("device", matrix=((l2 / d, -m / d), (-m / d, l1 / d)))
        a, b = One("a"), One("b")
        Se("u") >> a >> R("R_1", 1.0)
        a >> device
        b >> device
        b >> R("R_2", 2.0)
        a >> Df("i_1")
        b >> Df("i_2")
    return g


def test_mutual_inductance_becomes_the_ideal_transformer() -> None:
    """For k -> 1 and inductances that grow, i2 = -i1/n and the load looks like R_2/n^2."""
    model = equations(coupled_coils(0.5))
    s, k, l1, l2, r1, r2, z = positive("s k L_1 L_2 R_1 R_2 z")
    n = sp.sqrt(l2 / l1)
    tf = {o: model.transfer_function("u", o).subs(sp.Symbol("s"), s) for o in ("i_1", "i_2")}
    closed = {o: sp.limit(sp.simplify(v), k, 1) for o, v in tf.items()}
    # magnetising inductance L_1 in parallel with the transformed load
    load = 1 / (1 / (s * l1) + n**2 / r2)
    assert same(sp.simplify(closed["i_1"] - 1 / (r1 + load)), 0)
    grown = {o: v.subs({l1: z * l1, l2: z * l2}) for o, v in closed.items()}
    ideal = {o: sp.limit(sp.simplify(v), z, sp.oo) for o, v in grown.items()}
    assert sp.simplify(ideal["i_1"] - 1 / (r1 + r2 / n**2)) == 0
    assert sp.simplify(ideal["i_2"] + ideal["i_1"] / n) == 0
    # the transformer itself, declared as one
    with BondGraph("ideal") as g:
        a, b = One("a"), One("b")
        Se("u") >> a >> R("R_1", 1.0)
        a >> TF("r", ratio=0.5) >> b >> R("R_2", 2.0)
        a >> Df("i_1")
    exact = equations(g).transfer_function("u", "i_1").subs({positive("r"): 1 / n})
    assert sp.simplify(exact - ideal["i_1"]) == 0


def test_a_winding_driven_by_a_current_depends() -> None:
    with BondGraph("driven") as g:
        device = IField("device", energy=p1**2 + p2**2 + p1 * p2 + p1**4)
        a, b = One("a"), One("b")
        Sf("u") >> a >> device
        b >> device
        b >> R("r", 1.0)
        b >> C("c", 1.0)
    model = equations(g)
    assert model.held == {"p_device1": "device"}
    t = np.linspace(0.0, 1.0, 401)
    run = simulate(g, t, {"u": np.sin(6 * t)}, observed=observables(g))
    assert ledger(g, run).relative_residual < 2e-5


# -- resistive fields -----------------------------------------------------------------------------
@pytest.mark.parametrize("pair", ["ee", "ef", "fe", "ff"])
@pytest.mark.parametrize("cubic", [0, 1])
def test_a_resistive_field_in_every_causality(pair: str, cubic: int) -> None:
    law = (2 * f1 + f2 + cubic * f1**3, -f1 + 3 * f2)
    with BondGraph("resistive") as g:
        device = RField("device", law=law)
        a, b = One("a"), One("b")
        (Se if pair[0] == "e" else Sf)("u") >> a >> device
        (Se if pair[1] == "e" else Sf)("w") >> b >> device
        a >> Df("i")
        b >> Df("j")
    model = equations(g)
    assert model.is_explicit == (not cubic or pair[0] == "f")
    flows = dict(zip((f1, f2), model.outputs, strict=True))
    given = real("u w")
    solved: dict[Any, Any] = {}
    if not model.is_explicit:
        solved = dict(zip(given, (sp.Rational(7, 10), sp.Rational(-2, 5)), strict=True))
        (z,) = (sp.Symbol(a.name, real=True) for a in model.algebraic)
        solved[z] = sp.nsolve(model.residuals[0].subs(solved), z, 0, prec=30)
    for letter, value, flow, effort in zip(pair, given, (f1, f2), law, strict=True):
        found = effort.subs(flows) if letter == "e" else flows[flow]
        rest = (found - value).subs(solved)
        assert abs(rest) < 1e-20 if solved else same(rest, 0)


def test_a_gyrator_written_as_a_resistive_field_is_solved() -> None:
    """No slope of its own at either port: both are inverted together."""
    for matrix in (((0, 1), (-1, 0)), ((0, 2), (-2, 1))):
        model = equations(two_port(lambda n, m=matrix: RField(n, matrix=m), "e", "e"))
        assert model.is_explicit
        i, j = (model.signal(f"f_{n}") for n in "ab")
        u, w = real("u w")
        (a, b), (c, d) = matrix
        assert same(a * i + b * j, u)
        assert same(c * i + d * j, w)


def test_a_gyrator_that_imposes_the_flow_of_an_inertia_is_simulated_right() -> None:
    """The law of the first port has no slope of its own: it must not become an assignment."""
    with BondGraph("imposed") as g:
        device = RField("device", matrix=((0, 1), (-1, 3)))
        a, b = One("a"), One("b")
        Se("u") >> a >> device
        b >> device
        b >> I("m", 1.0)
        b >> Df("v")
    t = np.linspace(0.0, 1.0, 101)
    u = 1.0 - np.cos(3 * t)
    assert simulate(g, t, {"u": u})["v"] == pytest.approx(u, abs=1e-9)


def test_a_slope_that_vanishes_at_the_declared_values_is_not_divided_by() -> None:
    with BondGraph("balanced") as g:
        k1, k2 = g.parameter("k_1", 1.0), g.parameter("k_2", 1.0)
        device = RField("device", matrix=((k1 - k2, 1), (-1, 3)))
        a, b = One("a"), One("b")
        Se("u") >> a >> device
        b >> device
        b >> I("m", 1.0)
        b >> Df("v")
    t = np.linspace(0.0, 1.0, 101)
    u = 1.0 - np.cos(3 * t)
    assert simulate(g, t, {"u": u})["v"] == pytest.approx(u, abs=1e-9)


# -- refusals -------------------------------------------------------------------------------------
def refused(field: Any, **parameters: Any) -> str:
    with BondGraph("wrong") as g:
        for name, (value, options) in parameters.items():
            g.parameter(name, value, **options)
        a, b = One("a"), One("b")
        Se("u") >> a >> field
        b >> field
        b >> I("m", 1.0)
    with pytest.raises(GraphError) as error:
        equations(g)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_what_is_written_wrong_is_said() -> None:
    plain = sp.symbols("q1 q2")
    assert "port_variables" in refused(CField("f", energy=plain[0] ** 2 + plain[1] ** 2))
    clash = refused(CField("f", energy=LINEAR), q1=(2.0, {"positive": False}))
    assert "both a port variable and a parameter" in clash
    foreign = refused(CField("f", energy=LINEAR + sp.Symbol("a") * q1**2), a=(2.0, {}))
    assert "BondGraph.parameter" in foreign
    array: Any = np.array([[2.0, 1.0], [1.0, 3.0]])
    assert "tolist()" in refused(CField("f", matrix=array))
    assert "not reciprocal" in refused(CField("f", law=(q1 + q2, q2)))
    assert "no lowest energy" in refused(CField("f", energy=q1 * q2 + q2**2))
    assert "it has matrix and energy" in refused(CField("f", energy=q1**2, matrix=((1, 0), (0, 1))))


def test_numbers_of_numpy_are_numbers() -> None:
    rows = tuple(map(tuple, np.array([[2.0, 1.0], [1.0, 3.0]])))
    model = equations(two_port(lambda n: CField(n, matrix=rows), "e", "m"))
    q, u = real("q_device2 u")
    assert same(model.signal("q_device1"), (u - q) / 2)


def test_two_voltages_on_a_spring_without_ends_are_refused() -> None:
    with BondGraph("spring") as g:
        device = CField("device", energy=(q1 - q2) ** 2 / 2)
        Se("u") >> One("a") >> device
        Se("w") >> One("b") >> device
    with pytest.raises(AlgebraicLoop, match="singular"):
        equations(g)
