"""Redundancy relations against hand derivations, and against data of the graph they come from."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

from actuators.models.catalogue import MODELS
from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import (
    GY,
    TF,
    BondGraph,
    C,
    De,
    Df,
    Dq,
    GraphError,
    I,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    UnusableInput,
    Zero,
)
from bondgraph.analysis.exact_algebra import generic_values
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.redundancy import Redundancy, redundancy
from bondgraph.analysis.redundancy_relation import RedundancyRelation
from bondgraph.analysis.sensor_advice import splitting_sensors
from bondgraph.equations.derivation import equations
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import RS, Field, TwoPort
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Polynomial, TableLaw
from identification.diagnosis.localisation.structural_classes import structure
from tests.properties.graphs import pencil, random_graph
from tests.spring import spring
from tests.symbols import P, S, same

s = LAPLACE


def two_tanks() -> BondGraph:
    with BondGraph("two_tanks") as g:
        first, second, pipe = Zero("first"), Zero("second"), One("pipe")
        Sf("Q") >> first >> C("C_1", 2.0)
        first >> pipe >> R("R_12", 3.0)
        pipe >> second >> C("C_2", 5.0)
        second >> R("R_2", 7.0)
        first >> De("p_1")
        second >> De("p_2")
    return g


def dc_motor() -> BondGraph:
    with BondGraph("dc_motor") as g:
        armature, shaft = One("armature"), One("shaft")
        Se("u") >> armature >> R("R_a", 2.0)
        armature >> I("L_a", 0.1)
        armature >> GY("K", ratio=0.3) >> shaft >> I("J", 0.01)
        shaft >> R("b", 0.05)
        armature >> Df("i")
        shaft >> Df("w")
    return g


def nominal(g: BondGraph) -> dict[str, float]:
    return {n: p.value for n, p in g.parameters.items()}


def relative(
    r: RedundancyRelation, at: complex, known: dict[str, Any], values: dict[str, float]
) -> float:
    """Residual over the sum of the sizes of its terms."""
    size = sum(abs(r.laplace(at, {n: 0.0 for n in known} | {k: known[k]}, values)) for k in r.known)
    return abs(r.laplace(at, known, values)) / size if size else 0.0


# -- published examples, derived by hand ---------------------------------------------------------
def test_two_tanks_symbol_by_symbol() -> None:
    """Mass balance of either tank (Samantaray and Ould Bouamama 2008, two-tank system).

    ``Q - C_1 p_1' - (p_1 - p_2) / R_12`` and ``(p_1 - p_2) / R_12 - C_2 p_2' - p_2 / R_2``.
    """
    found = redundancy(two_tanks())
    C1, C2, R12, R2 = P("C_1 C_2 R_12 R_2")
    Q, p1, p2 = S("Q p_1 p_2")
    assert same(found["p_1"].expression, Q - C1 * s * p1 - (p1 - p2) / R12)
    assert same(found["p_2"].expression, (p1 - p2) / R12 - C2 * s * p2 - p2 / R2)
    assert found.inverted == ("p_1", "p_2")
    assert found.integrated == ()
    assert [r.order for r in found.relations] == [1, 1]
    assert found["p_1"].orders == {"Q": 0, "p_1": 1, "p_2": 0}
    assert found["p_1"].parameters == ("C_1", "R_12")
    columns = {e: found.signatures.column(e) for e in found.signatures.elements}
    assert columns == {
        "Q": (True, False),
        "C_1": (True, False),
        "R_12": (True, True),
        "C_2": (False, True),
        "R_2": (False, True),
        "p_1": (True, True),
        "p_2": (True, True),
    }
    assert set(found.signatures.classes) == {
        ("Q", "C_1"),
        ("R_12", "p_1", "p_2"),
        ("C_2", "R_2"),
    }
    # the middle class is separable, but not by these two residuals: R_12 acts like Q and C_2 mixed
    assert set(found.signatures.inseparable) == {
        ("Q", "C_1"),
        ("R_12",),
        ("C_2", "R_2"),
        ("p_1",),
        ("p_2",),
    }


def test_dc_motor_symbol_by_symbol() -> None:
    """Voltage balance of the armature and torque balance of the shaft."""
    found = redundancy(dc_motor())
    Ra, La, K, J, b = P("R_a L_a K J b")
    u, i, w = S("u i w")
    assert same(found["i"].expression, u - (Ra + La * s) * i - K * w)
    assert same(found["w"].expression, K * i - (J * s + b) * w)
    assert set(found.signatures.classes) == {("u", "R_a", "L_a"), ("K", "i", "w"), ("J", "b")}
    # a wrong K is wrong in both balances, times the speed and times the current: no linear
    # combination is free of both
    with pytest.raises(UnusableInput, match="no relation is blind to K"):
        found.blind_to("K")


def test_pipe_eliminated_from_two_relations() -> None:
    """The balance of both tanks together does not need the pipe."""
    g = two_tanks()
    (blind,) = redundancy(g).blind_to("R_12")
    C1, C2, R2 = P("C_1 C_2 R_2")
    Q, p1, p2 = S("Q p_1 p_2")
    total = Q - C1 * s * p1 - C2 * s * p2 - p2 / R2
    ratio = sp.cancel(blind.expression / total)
    assert not ratio.free_symbols & {Q, p1, p2}
    assert ratio != 0
    assert "R_12" not in blind.parameters
    assert "R_12" not in blind.touched


def test_position_of_a_spring_at_the_level_of_positions() -> None:
    """No needless derivative: ``F - m x'' - d x' - k x``."""
    g = spring()
    found = redundancy(g)
    m, d, k = P("m d k")
    F, x = S("F x")
    assert same(found["x"].expression, F - (m * s**2 + d * s + k) * x)
    assert found["x"].order == 2
    assert found.integrated == ("k",)


def test_a_sensor_that_cannot_be_inverted_is_compared() -> None:
    """Two gauges at one junction, one of them lagged, and one where a source rules."""
    g = two_tanks().with_branch("first", [De("p_3", lag="tau")])
    g = g.with_parameters([Parameter("tau", 0.2)])
    found = redundancy(g)
    assert len(found.inverted) == 2
    (other,) = {"p_1", "p_3"} - set(found.inverted)
    tau = P("tau")
    p1, p3 = S("p_1 p_3")
    ratio = sp.cancel(found[other].expression / ((1 + tau * s) * p3 - p1))
    assert ratio in (1, -1)
    with BondGraph("held") as h:
        node = Zero("node")
        Se("V") >> node >> R("R_1", 1.0)
        node >> De("v")
    held = redundancy(h)
    assert held.inverted == ()
    assert same(held["v"].expression, S("v") - S("V"))
    assert set(held.signatures.elements) - set(held.signatures.detectable) == {"R_1"}


def test_unseen_oscillation_keeps_its_factor() -> None:
    """What the source cannot move still rings: ``(m s^2 + k) x``, not ``x``, vanishes."""
    with BondGraph("ringing") as g:
        v = One("v")
        v >> I("m", 1.0)
        v >> C("k", stiffness=4.0)
        v >> Dq("x")
    m, k = P("m k")
    x = S("x")
    assert same(redundancy(g)["x"].expression, -(m * s**2 + k) * x)


# -- verified on data -----------------------------------------------------------------------------
def sensed(seed: int, largest: int = 16) -> BondGraph | None:
    """Return a random graph with two or three De and Df."""
    rng = np.random.default_rng(seed)
    g = random_graph(seed, largest, loops=seed % 3 == 0)
    junctions = g.of_type(One, Zero)
    for k in range(int(rng.integers(2, 4))):
        j = junctions[rng.integers(len(junctions))]
        kind: Any = De if isinstance(j, Zero) else Df
        g = g.with_branch(j.name, [kind(f"y_{k}")])
    try:
        equations(g)
    except GraphError:
        return None
    return g


def readings(g: BondGraph, z: np.ndarray, at: dict[str, int]) -> dict[str, complex]:
    """Read the sensors from brute-force efforts and flows of bonds."""
    found = {}
    for sensor in g.of_type(Sensor):
        junction = g.neighbour(sensor.name)
        bond = next(
            b for b in g.bonds_of(junction) if not isinstance(g[b.head], Sensor)
        )  # sensors are the heads of their bonds here
        value = z[at[f"{'e' if isinstance(sensor, De) else 'f'}_{bond.name}"]]
        found[sensor.name] = value if abs(value) > 1e-12 * np.abs(z).max() else 0j
    return found


def bare(g: BondGraph) -> BondGraph:
    """Return the graph without sensors, for the brute force."""
    h = BondGraph(g.name)
    for e in g.elements.values():
        if not isinstance(e, Sensor):
            h.add(e)
    for b in g.bonds:
        if b.head in h.elements:
            h.bond(h[b.tail], h[b.head])
    return h


@cache
def sensed_relations(seed: int) -> tuple[BondGraph, Redundancy] | None:
    """Give a random graph with its relations, the same to every test."""
    g = sensed(seed, 12)
    return None if g is None else (g, redundancy(g))


@pytest.mark.parametrize("count", [15, pytest.param(60, marks=pytest.mark.long)])
def test_random_graphs_satisfy_their_relations(count: int) -> None:
    """Forced at random complex s, by a solve that knows neither causality nor this package's rows.

    A parameter in a relation breaks it when changed; one that is not in it does not.
    """
    graphs = changes = 0
    for seed in range(count):
        if (known_relations := sensed_relations(seed)) is None:
            continue
        g, found = known_relations
        assert len(found.relations) == len(g.of_type(Sensor))
        rng = np.random.default_rng(seed)
        at = complex(rng.uniform(0.3, 1.5), rng.uniform(0.3, 1.5))
        values = nominal(g)
        e, a, b, where = pencil(bare(g))
        known = {"u": 1.0 + 0j, **readings(g, np.linalg.solve(at * e - a, b), where)}
        graphs += 1
        for r in found.relations:
            assert relative(r, at, known, values) < 1e-9, (seed, str(r))
            for n in values:
                changed = relative(r, at, known, {**values, n: 1.3 * values[n]})
                if n not in r.parameters:
                    assert changed < 1e-9, (seed, n, str(r))
                elif abs(known[r.name]) > 1e-9:
                    changes += changed > 1e-9
                assert (n in r.parameters) <= (n in r.touched)
    assert graphs > 2 * count / 3
    assert changes > 200 * count / 60


@pytest.mark.parametrize("count", [30, pytest.param(60, marks=pytest.mark.long)])
def test_random_graphs_satisfy_their_relations_in_free_motion(count: int) -> None:
    """Every natural motion without input: no factor in s has been lost."""
    modes = 0
    for seed in range(count):
        if (known_relations := sensed_relations(seed)) is None:
            continue
        g, relations = known_relations[0], known_relations[1].relations
        values = nominal(g)
        e, a, _, where = pencil(bare(g))
        rates, vectors = scipy.linalg.eig(a, e)
        for rate, z in zip(rates, vectors.T, strict=True):
            if not np.isfinite(rate) or abs(rate) > 1e3:
                continue
            z = z / np.abs(z).max()
            rate = rate if abs(rate) > 1e-7 else 0j  # rounding of a conserved quantity
            if np.abs((rate * e - a) @ z).max() > 1e-9:
                continue  # a defective pair of rates: no accurate mode
            known = {"u": 0j, **readings(g, z, where)}
            if max(abs(v) for v in known.values()) < 1e-6:
                continue
            modes += 1
            for r in relations:
                size = sum(
                    abs(r.laplace(rate, {n: float(n == k) for n in known}, values)) for k in r.known
                )
                assert abs(r.laplace(rate, known, values)) < 1e-6 * max(size, 1e-12), seed
    assert modes > count


def test_every_parameter_of_a_relation_breaks_it() -> None:
    """On the motor, the tanks and the stack: zero at the truth, not zero beside it."""
    stack = stack_bond_graph(sensors=("x", "i"))
    for g in (two_tanks(), dc_motor(), stack):
        model = equations(g)
        values = nominal(g)
        at = complex(3.0, 40.0) if g is not stack else complex(300.0, 4000.0)
        put = {model.parameters[n].symbol: v for n, v in values.items()}
        source = model.inputs[0]
        known: dict[str, Any] = {source: 1.0}
        for y in model.output_names:
            h = model.transfer_function(source, y)
            known[y] = complex(h.xreplace(put).xreplace({s: sp.sympify(at)}).evalf())
        for r in redundancy(g).relations:
            assert r.parameters
            assert relative(r, at, known, values) < 1e-10
            for n in r.parameters:
                broken = relative(r, at, known, {**values, n: 1.05 * values[n]})
                assert broken > 1e-9, (g.name, r.name, n)
            for y in known:
                if y in r.known:
                    assert relative(r, at, {**known, y: 1.01 * known[y]}, values) > 1e-9


def test_stack_relations_symbol_by_symbol() -> None:
    """Voltage balance of the loop and force balance of the body, each differentiated once.

    With the charge ``q = i / s`` the spring carries ``k (x - T q)``, and the polarisation takes
    ``l^2 q / C_nl - T k (x - T q)`` of the voltage.
    """
    found = redundancy(stack_bond_graph(sensors=("x", "i")))
    Re, Cnl, ell, T, k, m, d = P("R_e C_nl l T k m R_nl")
    V, x, i = S("V_in x i")
    q = i / s
    loop = V - Re * i - ell**2 * q / Cnl + k * T * (x - T * q)
    body = -m * s**2 * x - d * s * x - k * (x - T * q)
    assert same(found["i"].expression, s * loop)
    assert same(found["x"].expression, s * body)
    assert found["x"].orders == {"i": 0, "x": 3}


def test_motion_in_time() -> None:
    """From any state under a polynomial input, with analytic derivatives; sizes of a real stack."""
    g = stack_bond_graph(sensors=("x", "i"))
    found = redundancy(g)
    values = nominal(g)
    a, b, c, d = equations(g).linearise().numbers(values)
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 1e-3, 40)
    rates = np.stack([1e4 * t, np.full_like(t, 1e4), 0 * t, 0 * t, 0 * t])
    x = rng.normal(size=(3, t.size)) * np.array([[1e-8], [1e-5], [1e-3]])
    readings = []
    for k in range(4):
        readings.append(c @ x + d @ rates[k][None])
        x = a @ x + b @ rates[k][None]
    names = list(equations(g).output_names)
    data = {"V_in": list(rates)} | {n: [y[names.index(n)] for y in readings] for n in names}
    for r in found.relations:
        zero = {n: [0 * v for v in record] for n, record in data.items()}
        size = sum(np.abs(r.residual({**zero, n: data[n]}, values)).max() for n in r.known)
        assert np.abs(r.residual(data, values)).max() < 1e-10 * size
        for n in r.parameters:
            broken = r.residual(data, {**values, n: 1.1 * values[n]})
            assert np.abs(broken).max() > 1e-9 * size
    with pytest.raises(UnusableInput, match="needs derivative"):
        found["x"].residual({n: record[:2] for n, record in data.items()}, values)


def test_nonlinear_law_enters_as_a_deviation() -> None:
    """The residual without the law is what the law deviates by; with it, zero."""
    g = spring(k=20.0, law=Polynomial())
    found = redundancy(g)
    (r,) = found.relations
    assert list(r.deviations) == ["k"]
    assert found.signatures.column("k") == (True,)
    t = np.linspace(0.0, 1.0, 50)
    x = [np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)]
    deviation = 7.0 * x[0] ** 3
    force = 0.5 * x[2] + 2.0 * x[1] + 20.0 * x[0] + deviation
    values = {"m": 0.5, "d": 2.0, "k": 20.0}
    data = {"F": [force], "x": x}
    np.testing.assert_allclose(r.residual(data, values), deviation, atol=1e-12)
    full = r.residual({**data, "k_deviation": [deviation]}, values)
    np.testing.assert_allclose(full, 0.0, atol=1e-12)


def test_whole_laws_of_a_drive_and_a_sensor_deviate_from_their_own_slope() -> None:
    """Not from the identity: with ``1.2 u + d_u`` as force and ``0.8 x + d_x`` as reading."""
    drive = Drive(law=Hysteretic(PrandtlIshlinskii((0.0, 1.0), (1.2, 0.3))))
    seen = TableLaw((-9.0, 9.0), (-7.2, 7.2), flat=False, reference=0.8)
    g = spring(k=20.0).with_element("F", drive=drive).with_element("x", law=seen)
    (r,) = redundancy(g).relations
    t = np.linspace(0.0, 1.0, 50)
    x = [np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)]
    play = 0.3 * np.cos(t)  # any course: the relation is linear in the deviation
    command = (0.5 * x[2] + 2.0 * x[1] + 20.0 * x[0] - play) / 1.2
    data = {"F": [command], "x": [0.8 * v for v in x], "F_deviation": [play]}
    data["x_deviation"] = [0.0 * v for v in x]
    values = {"m": 0.5, "d": 2.0, "k": 20.0}
    size = np.abs(r.residual({**data, "F": [0.0 * t]}, values)).max()
    np.testing.assert_allclose(r.residual(data, values), 0.0, atol=1e-12 * size)


# -- signatures, isolability and advice -------------------------------------------------------
def test_signature_is_where_a_latent_fault_enters() -> None:
    """A latent fault at every R, C and I, by brute force, reaches exactly the residuals told."""
    checked = 0
    for seed in range(40):
        if (known_relations := sensed_relations(seed)) is None:
            continue
        g, found = known_relations
        values = {n: float(v) for n, v in generic_values(g.parameters).items()}
        h = bare(g).with_values(values)
        e, a, _, where = pencil(h)
        at = complex(0.7, 1.1)
        order = rows_of_pencil(h)
        for name in (x.name for x in h.of_type(R, C, I)):
            latent = np.zeros(len(order))
            latent[order.index(name)] = 1.0
            z = np.linalg.solve(at * e - a, latent)
            known = {"u": 0j, **readings(g, z, where)}
            scale = np.abs(z).max()
            for r in found.relations:
                size = sum(
                    abs(r.laplace(at, {n: float(n == k) for n in known}, values)) for k in r.known
                )
                seen = abs(r.laplace(at, known, values)) > 1e-10 * size * scale
                assert seen == (name in r.touched), (seed, name, str(r))
                checked += 1
    assert checked > 200


def rows_of_pencil(g: BondGraph) -> list[str]:
    """Elements that own the rows of the brute-force pencil, in its order; the law row first."""
    owners: list[str] = []
    for e in g.elements.values():
        n = len(g.bonds_of(e.name))
        if isinstance(e, One | Zero):
            count = n
        elif isinstance(e, TF | GY | C | I):
            count = 2
        else:
            count = 1
        owners += [e.name] * count
    return owners


@pytest.mark.parametrize("name", sorted(n for n in MODELS if not MODELS[n]().of_type(Field)))
def test_inseparable_classes_are_those_of_transfer_columns(name: str) -> None:
    """The diagnosis compares transfer functions over frequency: the classes must be the same."""
    if name.startswith("stack_lumped"):
        pytest.skip("the compiled diagnosis refuses its dependent storage")
    if name == "switching_disc":
        pytest.skip("a memory beside a ratio that turns with it has no linearisation")
    g = MODELS[name]()
    theirs = structure(g, np.geomspace(1.0, 1e4, 24))
    # a wrong ratio acts on both sides of a two-port, a latent effort on one
    names = {n for c in theirs.classes for n in c if not isinstance(g[n], TwoPort)}
    mine = {frozenset(set(c) & names) for c in redundancy(g).signatures.inseparable} - {frozenset()}
    assert mine == {frozenset(set(c) & names) for c in theirs.classes} - {frozenset()}


def test_one_sensor_tells_nothing_apart_and_a_second_does() -> None:
    g = stack_bond_graph()
    alone = redundancy(g).signatures
    assert len(alone.classes) == 1
    assert alone.isolable == ()
    advice = splitting_sensors(g)
    best = advice.ranked[0]
    assert (best.kind, best.junction) == ("Df", "loop")
    then = redundancy(stack_bond_graph(sensors=("x", "i"))).signatures
    assert {frozenset(p) for p in best.parts} == {
        frozenset(c) - {"i"} for c in then.classes if set(c) - {"i"}
    }
    assert best.pairs >= advice.ranked[-1].pairs
    assert "Df at loop" in str(advice)
    assert "<table>" in advice._repr_html_()


def test_advice_for_the_pipe_of_two_tanks() -> None:
    """A flow meter in the pipe splits pipe and gauges; nothing splits a tank from its inflow."""
    advice = splitting_sensors(two_tanks(), ["R_12", "p_1", "p_2"])
    (best,) = advice.ranked
    assert (best.kind, best.junction, best.pairs) == ("Df", "pipe", 3)
    assert splitting_sensors(two_tanks(), ["Q", "C_1"]).ranked == ()
    assert "no single" in str(splitting_sensors(two_tanks(), ["Q", "C_1"]))
    with pytest.raises(UnknownName, match="Did you mean"):
        splitting_sensors(two_tanks(), ["R_21"])


def test_two_relations_can_be_blind_to_one_fault_not_to_two() -> None:
    found = redundancy(two_tanks())
    for n in ("Q", "R_12", "C_2", "p_1"):
        (r,) = found.blind_to(n)
        assert n not in r.touched
        assert symbol(n) not in r.expression.free_symbols
    with pytest.raises(UnusableInput, match="no relation is blind to C_1, C_2"):
        found.blind_to("C_1", "C_2")
    with pytest.raises(UnknownName):
        found.blind_to("C_3")


def test_printing() -> None:
    found: Redundancy = redundancy(two_tanks())
    text = str(found)
    assert "p_1 (inverted, derivatives up to 1): 0 = " in text
    assert "R_12      1   1" in text
    assert "inseparable: Q, C_1; C_2, R_2" in text
    assert found._repr_html_().count("<table>") == 2
    assert str(found["p_1"]) == "0 = -C_1*d_p_1 + Q - p_1/R_12 + p_2/R_12"
    with pytest.raises(UnknownName):
        found["p_9"]


def test_refusals() -> None:
    with BondGraph("blind") as g:
        Se("u") >> One("j") >> R("r", 1.0)
        g["j"] >> I("m", 1.0)
    with pytest.raises(GraphError, match="blind: without a sensor"):
        redundancy(g)
    with BondGraph("hot") as h:
        j, bath = One("j"), Zero("bath")
        Se("u") >> j >> RS("brake", ratio=1.0) >> bath >> C("c", 1.0)
        j >> I("m", 1.0)
        j >> Df("v")
    with pytest.raises(GraphError, match="brake"):
        redundancy(h)
