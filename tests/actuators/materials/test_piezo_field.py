"""The piezoelectric C field: one energy from four forms, four causalities, three models."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

from actuators.materials.constitutive import BadConstant
from actuators.materials.piezo_field import (
    Curvature,
    Layers,
    energy_density,
    field_energy,
    piezo_field,
    small_signal,
)
from actuators.materials.poled_ceramic import (
    coupling_factors,
    stack_constants,
    transversely_isotropic,
)
from actuators.materials.uniaxial import Uniaxial, uniaxial
from actuators.models.catalogue import MODELS
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.field import (
    CERAMIC,
    CURVED,
    LAYERS,
    stack_field_charge,
    stack_field_curved,
    stack_field_voltage,
)
from actuators.stack.lumped import stack_lumped
from bondgraph import BondGraph, Dq, GraphError, One, Se, Sf, UnusableInput
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.energy.stores import energy_problems, positivity, store_energy
from bondgraph.equations.derivation import equations
from bondgraph.graph.modulation import port_variables
from tests.counted import calls
from tests.settled import simulate

FORMS: Any = "degh"
Q, X = port_variables("q", 2)
S, D = sp.symbols("S D", real=True)
AREA, T, N = sp.symbols("A t n", positive=True)
SIZE = Layers(AREA, T, N)
s = sp.Symbol("s")


def letters(form: Any) -> Uniaxial:
    return Uniaxial(form, *sp.symbols("a k b", positive=True))


def zero(expression: Any) -> bool:
    return bool(sp.cancel(sp.together(expression)) == 0)


def same(a: Any, b: Any) -> bool:
    return zero(a - b)


# -- constants and energy -----------------------------------------------------------------------
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("other", FORMS)
def test_four_forms_have_one_energy(form: Any, other: Any) -> None:
    given = letters(form)
    back = given.to(other).to(form)
    assert all(same(u, v) for u, v in zip(back.values, given.values, strict=True))
    assert same(given.to(other).coupling_squared, given.coupling_squared)
    densities = energy_density(given, S, D), energy_density(given.to(other), S, D)
    assert same(*densities)
    assert same(field_energy(given, SIZE), field_energy(given.to(other), SIZE))


@pytest.mark.parametrize("form", FORMS)
def test_the_density_gives_back_the_law_of_its_form(form: Any) -> None:
    c = letters(form)
    a, k, b = c.values
    stress, field = (energy_density(c, S, D).diff(v) for v in (S, D))
    laws = {
        "d": (a * stress + k * field - S, k * stress + b * field - D),
        "e": (a * S - k * field - stress, k * S + b * field - D),
        "g": (a * stress + k * D - S, -k * stress + b * D - field),
        "h": (a * S - k * D - stress, -k * S + b * D - field),
    }[form]
    assert all(map(zero, laws))


def test_conversion_is_that_of_the_whole_material() -> None:
    m = transversely_isotropic(
        s11=16.5e-12, s12=-4.78e-12, s13=-8.45e-12, s33=20.7e-12, s44=43.5e-12, d31=-274e-12,
        d33=593e-12, d15=741e-12, eps11=27.7e-9, eps33=30.1e-9,
    )  # fmt: skip
    for form in FORMS:
        plate, whole = uniaxial(m, form, "clamped"), m.to(form)
        if form in "eh":
            entries = whole.elastic[2, 2], whole.coupling[2, 2], whole.dielectric[2, 2]
            assert plate.values == pytest.approx(entries, rel=1e-12)
        bar = uniaxial(m, form)
        assert bar.coupling_squared == pytest.approx(coupling_factors(m).k33 ** 2, rel=1e-12)
        assert plate.coupling_squared == pytest.approx(coupling_factors(m).kt ** 2, rel=1e-9)
        energy = field_energy(bar, LAYERS)
        found = small_signal(energy)
        known = stack_constants(m, LAYERS.number, LAYERS.area, LAYERS.thickness)
        for name in ("stiffness", "capacitance", "transducer"):
            assert getattr(found, name) == pytest.approx(getattr(known, name), rel=1e-9)
    with pytest.raises(UnusableInput, match="bar"):
        uniaxial(m, "d", "loose")  # type: ignore[arg-type]


def test_data_of_the_two_port_follow_from_its_energy() -> None:
    sE, d, eT = sp.symbols("sE d eT", positive=True)
    c = Uniaxial("d", sE, d, eT)
    two = small_signal(field_energy(c, SIZE))
    assert same(two.stiffness, AREA / (sE * N * T))
    assert same(two.open_stiffness, AREA / (c.to("g").elastic * N * T))
    assert same(two.free_capacitance, N * eT * AREA / T)
    assert same(two.capacitance, N * c.to("e").dielectric * AREA / T)
    assert same(two.displacement_per_volt, N * d)
    assert same(two.transducer, AREA * d / (sE * T))  # blocking force a volt: k n d33
    assert same(two.coupling_squared, d**2 / (sE * eT))
    # the same from the definition: energy given and energy taken
    w = sp.hessian(field_energy(c, SIZE), (Q, X))
    assert same(two.coupling_squared, w[0, 1] ** 2 / (w[0, 0] * w[1, 1]))


@pytest.mark.parametrize("form", FORMS)
def test_reciprocal_and_positive(form: Any) -> None:
    g = stack_field_voltage(form=form)
    assert g.check() == ()
    assert energy_problems(g) == ()
    found = positivity(g, "stack")
    assert found.sign == "positive definite"
    q, x = sp.symbols("q_stack1 q_stack2", real=True)
    w = store_energy(g, "stack")
    assert same(w.diff(q, x), w.diff(x, q))
    values = {p.symbol: p.value for p in g.parameters.values()}
    reference = field_energy(CERAMIC, LAYERS).subs({Q: q, X: x})
    for pair in ((q, q), (q, x), (x, x)):
        assert float(w.diff(*pair).subs(values)) == pytest.approx(float(reference.diff(*pair)))


def test_impossible_constants_are_refused_in_one_line() -> None:
    with pytest.raises(BadConstant, match=r"k\^2 = 1\.28.*below 1.*d is too large") as error:
        Uniaxial("d", 20e-12, 621.3e-12, 1.5e-8)
    assert "\n" not in str(error.value)
    with pytest.raises(BadConstant, match=r"k\^2"):
        Uniaxial("h", 1e11, 1.1e10, 1e9)
    with pytest.raises(BadConstant, match=r"s\^E = -2e-11 must be finite and positive"):
        Uniaxial("d", -2e-11, 1e-10, 1e-8)
    with pytest.raises(BadConstant, match="finite"):
        Uniaxial("g", 2e-11, float("nan"), 1e8)
    with pytest.raises(UnusableInput, match="thickness"):
        Layers(1e-5, 0.0, 3)
    with pytest.raises(UnusableInput, match="no lowest"):
        Curvature(saturation=-1.0)
    # forms e and g cannot reach k = 1: any constants are those of a store
    assert 0.99 < Uniaxial("e", 1e9, 1e3, 1e-8).coupling_squared < 1
    with pytest.raises(GraphError, match="nothing is bonded to the tip"):
        stack_field_voltage(mass=None, damping=None)


# -- causality ----------------------------------------------------------------------------------
def bare(electrical: str, mechanical: str) -> BondGraph:
    with BondGraph("bare") as g:
        symbols = [g.parameter(n, v) for n, v in zip("akb", CERAMIC.to("h").values, strict=True)]
        sizes = [g.parameter(n, v) for n, v in zip("Atn", (25e-6, 50e-6, 360), strict=True)]
        stack = piezo_field("stack", Uniaxial("h", *symbols), Layers(*sizes))
        loop, tip = One("loop"), One("tip")
        (Se if electrical == "V" else Sf)("u_1") >> loop >> stack
        (Se if mechanical == "F" else Sf)("u_2") >> tip >> stack
        loop >> Dq("q")
        tip >> Dq("x")
    return g


@pytest.mark.parametrize(
    ("pattern", "dependent"),
    [
        ("VF", {"q_stack1", "q_stack2"}),
        ("Vv", {"q_stack1"}),
        ("iF", {"q_stack2"}),
        ("iv", set()),
    ],
)
def test_every_causality_of_the_field_is_one_two_port(pattern: str, dependent: set[str]) -> None:
    model = equations(bare(*pattern))
    assert set(model.held) == dependent
    assert model.is_explicit
    c = letters("h")
    w = sp.hessian(field_energy(c, SIZE), (Q, X))
    # inputs u and answers: [e1, e2] = W [q, x], with q = i/s and x = v/s where flows are given
    for row, source in enumerate(("u_1", "u_2")):
        q, x = (model.transfer_function(source, n) for n in ("q", "x"))
        for port, letter in enumerate(pattern):
            given = sp.Integer(port == row)
            if letter in "VF":
                assert same(w[port, 0] * q + w[port, 1] * x, given)
            else:
                assert same(s * (q, x)[port], given)


def test_the_same_stack_by_voltage_and_by_charge() -> None:
    """Both port patterns of the electrical side: (x/i) / (u/i) = x/V, with and without resistor."""
    driven = equations(stack_field_charge(sensors=("x", "u")))
    x_i, u_i = (driven.transfer_function("i_in", n) for n in ("x", "u"))
    direct = equations(stack_field_voltage(sensors=("x", "i")))
    assert direct.held == {"q_stack1": "stack"}
    x_v, i_v = (direct.transfer_function("V_in", n) for n in ("x", "i"))
    assert same(x_i / u_i, x_v)
    assert same(u_i * i_v, 1)
    wired = equations(stack_field_voltage(resistance=5.0, sensors=("x", "i", "u")))
    assert wired.held == {}
    x_w, i_w, u_w = (wired.transfer_function("V_in", n) for n in ("x", "i", "u"))
    assert same(x_w, x_v / (1 + sp.Symbol("R_e", positive=True) * i_v))
    assert same(x_w / u_w, x_v)
    assert same(i_w / u_w, i_v)


def test_massless_tips_are_the_limit() -> None:
    m, b = sp.symbols("m b", positive=True)
    full = stack_field_voltage(external_force=True)
    for source in ("V_in", "F_e"):
        tf = equations(full).transfer_function(source, "x")
        bare_tip = equations(stack_field_voltage(mass=None, damping=None, external_force=True))
        damped = equations(stack_field_voltage(mass=None))
        assert set(bare_tip.held) == {"q_stack1", "q_stack2"}
        assert same(tf.subs({m: 0, b: 0}), bare_tip.transfer_function(source, "x"))
        if source == "V_in":
            assert same(tf.subs(m, 0), damped.transfer_function(source, "x"))
    two = small_signal(field_energy(CERAMIC, LAYERS))
    p = bare_tip.parameters
    stroke = bare_tip.transfer_function("V_in", "x")
    found = stroke.subs({v.symbol: v.value for v in p.values()})
    assert float(found) == pytest.approx(two.displacement_per_volt, rel=1e-12)


# -- the other two models -----------------------------------------------------------------------
def material_symbols(form: Any) -> tuple[Uniaxial, Layers]:
    graph = stack_field_voltage(form=form)
    found = [p.symbol for p in graph.declared_parameters.values()]
    return Uniaxial(form, *found[:3]), Layers(*found[3:6])


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("resistance", [None, 5.0])
def test_stack_lumped_coincides(form: Any, resistance: float | None) -> None:
    ours = equations(stack_field_voltage(form=form, resistance=resistance, external_force=True))
    theirs = equations(stack_lumped(resistance=resistance, external_force=True))
    two = small_signal(field_energy(*material_symbols(form)))
    mapped = {sp.Symbol(n, positive=True): v for n, v in two.as_lumped().items()}
    for source in ("V_in", "F_e"):
        expected = theirs.transfer_function(source, "x").subs(mapped, simultaneous=True)
        assert same(ours.transfer_function(source, "x"), expected)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("form", FORMS)
def test_stack_bond_graph_coincides(form: Any) -> None:
    sensors = ("x", "i")
    ours = equations(
        stack_field_voltage(form=form, resistance=5.0, external_force=True, sensors=sensors)
    )
    theirs = equations(stack_bond_graph(external_force=True, sensors=sensors))
    length, b = sp.symbols("l b", positive=True)
    two = small_signal(field_energy(*material_symbols(form)))
    named = {**two.as_bond_graph(length), "R_nl": b}
    mapped = {sp.Symbol(n, positive=True): v for n, v in named.items()}
    for source in ("V_in", "F_e"):
        for reading in sensors:
            expected = theirs.transfer_function(source, reading).subs(mapped, simultaneous=True)
            assert same(ours.transfer_function(source, reading), expected)


def test_the_mapping_printed_in_the_docstring() -> None:
    c, h, b = sp.symbols("c h b", positive=True)
    two = small_signal(field_energy(Uniaxial("h", c, h, b), SIZE))
    free, short, length = b - h**2 / c, c - h**2 / b, sp.Symbol("l", positive=True)
    lumped, graph = two.as_lumped(), two.as_bond_graph(length)
    assert same(lumped["C"], N * AREA / (T * b))
    assert same(lumped["k"], AREA * short / (N * T))
    assert same(lumped["T"], AREA * h / (T * b))
    assert same(graph["C_nl"], length**2 * N * AREA / (T * free))
    assert same(graph["k"], AREA * c / (N * T))
    assert same(graph["T"], h * T / (AREA * c))


# -- beyond the quadratic energy ----------------------------------------------------------------
def test_a_curved_energy_is_reciprocal_whatever_its_terms() -> None:
    m, z = sp.symbols("M z", positive=True)
    energies = [field_energy(letters("g").to(f), SIZE, Curvature(m, z)) for f in FORMS]
    assert all(same(energies[0], e) for e in energies[1:])
    voltage, force = (energies[0].diff(v) for v in (Q, X))
    assert same(voltage.diff(X), force.diff(Q))
    assert force.diff(Q, Q) != 0
    a, k, b = letters("g").values
    strain, d = X / (N * T), Q / (N * AREA)
    assert same(force, AREA * (strain - k * d - m * d**2) / a)
    expected = T * (-(k + 2 * m * d) * force / AREA + b * d + z * d**3)
    assert same(voltage, expected)
    assert energy_problems(stack_field_curved()) == ()


def test_the_curved_stack_rests_where_its_energy_says() -> None:
    t = np.linspace(0.0, 3e-3, 301)
    ramp = 50.0 - 50.0 * np.cos(np.pi * np.minimum(t / 1.5e-3, 1.0))
    run = simulate(stack_field_curved(), t, {"V_in": ramp})
    w = field_energy(CERAMIC, LAYERS, CURVED)
    # at rest F = 0: x follows from q, and the voltage decides q
    stroke = sp.lambdify(Q, sp.solve(w.diff(X), X)[0])
    voltage = sp.lambdify((Q, X), w.diff(Q))
    charge = brentq(lambda v: voltage(v, stroke(v)) - 100.0, 0.0, 1e-3, xtol=1e-18)
    assert run["x"][-1] == pytest.approx(stroke(charge), rel=1e-5)
    linear = small_signal(field_energy(CERAMIC, LAYERS))
    # the sizes that the docstring of the model states
    added = 0.1 * (charge / 9e-3) ** 2 * 18e-3
    assert added / stroke(charge) == pytest.approx(0.1, abs=0.01)
    assert charge / (100.0 * linear.free_capacitance) == pytest.approx(0.93, abs=0.01)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(
    "model",
    [
        stack_field_voltage(resistance=5.0, sensors=("x",)),
        stack_field_voltage(sensors=("x", "i")),
        stack_field_curved(),
        stack_field_charge(leak=1e4, resistance=5.0, curvature=CURVED),
    ],
    ids=["resistance", "direct", "curved", "charge"],
)
def test_the_ledger_closes(model: BondGraph) -> None:
    t = np.linspace(0.0, 2e-3, 2001)
    (source,) = model.of_type(Se, Sf)
    size = 50.0 if isinstance(source, Se) else 0.2
    drive = size * np.sin(np.pi * t / 2e-3) ** 2 * np.sin(2e4 * t)
    run = simulate(model, t, {source.name: drive}, observed=observables(model), accuracy=1e-7)
    account = ledger(model, run)
    assert account.closes
    assert account.relative_residual < 2e-5
    assert np.abs(account.stored).max() > 1e-6


def test_direct_drive_is_the_limit_of_a_small_resistance() -> None:
    t = np.linspace(0.0, 2e-3, 2001)
    v = 50.0 * np.sin(np.pi * t / 2e-3) ** 2
    direct = simulate(stack_field_voltage(), t, {"V_in": v})["x"]
    wired = simulate(stack_field_voltage(resistance=1e-4), t, {"V_in": v})["x"]
    assert np.abs(direct - wired).max() < 1e-5 * np.ptp(direct)


@pytest.mark.parametrize("name", [n for n in MODELS if n.startswith("stack_")])
def test_closed_forms_take_no_search(name: str) -> None:
    graph = MODELS[name]()
    assert all(isinstance(r, sp.Expr) for r in equations(graph).rates)
    # with what sympy remembers of the first time; a simplification takes a hundred times as many
    assert calls(lambda: equations(graph).rates) < 100_000
