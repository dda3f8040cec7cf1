"""Domains from units: a voltage never meets a force unnoticed, and ambiguity is no error."""

from __future__ import annotations

import pytest

from actuators.models.catalogue import MODELS
from bondgraph import GY, TF, BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.graph.domain_check import domain_problems, groups_of_bonds, statements
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import RS, CField, Element
from bondgraph.graph.unit_notes import unit_notes
from bondgraph.graph.unit_slips import COEFFICIENTS, expected_unit
from bondgraph.laws import Polynomial


@pytest.mark.parametrize("name", sorted(MODELS))
def test_the_models_pass(name: str) -> None:
    assert domain_problems(MODELS[name]()) == ()
    assert unit_notes(MODELS[name]()) == ()


def test_a_voltage_on_a_mass_names_both_and_the_remedy() -> None:
    with BondGraph("g") as g:
        body = One("body")
        Se("V_in", unit="V") >> body >> I("m", 1.0, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    (line,) = domain_problems(g)
    for word in (
        "V_in (Se, unit V: electrical, bond V_in>body)",
        "m (I, unit kg: translation, bond body>m)",
        "TF",
        "GY",
    ):
        assert word in line


def through(coupling: Element) -> BondGraph:
    """A voltage, a coupling, a mass on a spring."""
    with BondGraph("g") as g:
        loop, body = One("loop"), One("body")
        Se("V", unit="V") >> loop >> R("R_1", 1.0, unit="ohm")
        loop >> coupling >> body >> I("m", 1.0, unit="kg")
        body >> C("k", stiffness=3.0, unit="N/m")
    return g


def test_a_transducer_separates_domains_and_its_unit_is_checked() -> None:
    assert domain_problems(through(GY("K", ratio=1.0, unit="N/A"))) == ()
    assert unit_notes(through(GY("K", ratio=1.0, unit="V*s/m"))) == ()
    assert unit_notes(through(GY("K", ratio=1.0))) == ()
    assert unit_notes(through(TF("n", ratio=1.0, unit="V/N"))) == ()
    (note,) = unit_notes(through(TF("n", ratio=1.0, unit="N/V")))
    assert "n (TF): its ratio is in N/V" in note
    assert "e_in/e_out" in note
    (note,) = unit_notes(through(GY("K", ratio=1.0, unit="A/N")))
    assert "its modulus is in A/N" in note
    assert len(domain_problems(through(One("wire")))) == 1


def test_units_of_parameters_make_the_unit_of_a_ratio() -> None:
    with BondGraph("g") as g:
        length, moment = g.parameter("l", 0.1, "m"), g.parameter("c", 2.0, "N*m")
        loop, body = One("loop"), One("body")
        Se("M", unit="N*m") >> loop >> TF("lever", ratio=2 * length) >> body
        loop >> TF("wrong", ratio=moment / length**2) >> Zero("tip") >> Sf("v", unit="m/s")
        body >> I("m", 1.0, unit="kg")
    (note,) = unit_notes(g)
    assert note.startswith("wrong (TF)")


@pytest.mark.parametrize(
    ("element", "domain"),
    [
        (lambda: Se("x", unit="kN"), "translation"),
        (lambda: Sf("x", unit="l/min"), "hydraulic"),
        (lambda: R("x", 1.0, unit="K/W"), "thermal"),
        (lambda: C("x", 1.0, unit="J/K"), "thermal"),
        (lambda: C("x", stiffness=1.0, unit="N*m/rad"), "rotation"),
        (lambda: I("x", 1.0, unit="H"), "electrical"),
        (lambda: I("x", 1.0, unit="kg*m^2"), "rotation"),
        (lambda: De("x", unit="bar"), "hydraulic"),
        (lambda: Df("x", unit="rpm"), "rotation"),
        (lambda: Dq("x", unit="um"), "translation"),
        (lambda: Dq("x", unit="rad"), "rotation"),
        (lambda: R("x", 1.0, unit="A/V"), "magnetic"),
    ],
)
def test_each_unit_is_understood(element: object, domain: str) -> None:
    with BondGraph("g") as g:
        One("a") >> element()  # type: ignore[operator]
    (said,) = statements(g)
    assert said.domains == {domain}


def test_what_says_nothing_or_is_ambiguous_is_no_error() -> None:
    with BondGraph("g") as g:
        a = One("a")
        Se("V", unit="V", drive=Drive(law=Polynomial())) >> a >> I("m", 1.0, unit="kg")
        a >> R("plain", 1.0)
        a >> R("one", 1.0, unit="1")
        a >> Dq("read", unit="V", law=Polynomial())
        a >> TF("n") >> Zero("odd") >> C("c", 1.0, unit="kg^3")
    assert domain_problems(g) == ()


def test_the_same_quantity_in_two_dimensions_is_an_error_outside_of_the_table_too() -> None:
    with BondGraph("g") as g:
        a = Zero("a")
        Se("u", unit="m") >> a
        a >> De("y", unit="kg")
        a >> R("r", 1.0)
    (line,) = domain_problems(g)
    assert "u (Se, unit m: no domain of the table" in line
    with BondGraph("three") as three:
        a, b = Zero("a"), One("b")
        Se("u", unit="m") >> a >> b >> R("r", 1.0, unit="s^2")
        b >> Df("f", unit="m^2")
    (line,) = domain_problems(three)
    assert "do not fit together" in line


def test_fields_and_heating_resistors_have_a_domain_at_each_port() -> None:
    with BondGraph("g") as g:
        loop, body, heat = One("loop"), One("body"), Zero("heat")
        Se("V", unit="V") >> loop >> CField("plate", units=("V", "N"), law=(0.0, 0.0))
        body >> g["plate"]
        body >> I("m", 1.0, unit="kg")
        loop >> RS("winding", 2.0, "ohm") >> heat >> C("c", 1.0, unit="J/K")
    assert domain_problems(g) == ()
    assert len(set(groups_of_bonds(g).values())) == 3
    with BondGraph("swapped") as swapped:
        loop, body = One("loop"), One("body")
        Se("V", unit="V") >> loop >> CField("plate", units=("N", "V"), law=(0.0, 0.0))
        body >> swapped["plate"]
        body >> I("m", 1.0, unit="kg")
    assert len(domain_problems(swapped)) == 2


def test_a_unit_that_cannot_be_read_is_named() -> None:
    with BondGraph("g") as g:
        Se("V", unit="volts") >> One("a") >> R("r", 1.0, unit="ohm")
    (line,) = domain_problems(g)
    assert line.startswith("V (Se): ")
    assert "volts" in line


def test_a_gearbox_on_a_motor_by_mistake_without_the_rack() -> None:
    with BondGraph("g") as g:
        motor = COMPONENTS.use("dc_motor", "motor")
        mass = COMPONENTS.use("mass_spring_damper", "table")
        Se("V", unit="V") >> motor.terminal
        motor.shaft >> mass.left
        mass.right >> R("load", 1.0)
    (line,) = domain_problems(g)
    assert "rotation" in line
    assert "translation" in line


def spring(**given: object) -> BondGraph:
    """A mass on a spring."""
    with BondGraph("g") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", **given)  # type: ignore[arg-type]
        body >> Dq("x", unit="m")
    return g


def test_a_stiffness_given_as_a_compliance_is_told() -> None:
    (line,) = domain_problems(spring(value=600.0, unit="N/m"))
    assert 'write C("k", stiffness=600, unit="N/m")' in line
    assert "transducer" not in line
    assert domain_problems(spring(stiffness=600.0, unit="N/m")) == ()
    assert domain_problems(spring(value=1e-3, unit="m/N")) == ()
    (other,) = domain_problems(spring(value=1e-3, unit="F"))
    assert "transducer" in other


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"d": "N*s"}, "an R has N*s/m here"),
        ({"d": "ohm"}, "an R has N*s/m here"),
        ({"m": "H"}, "an I has kg here"),
        ({"k": "Wb"}, "the stiffness of a C has N/m here"),
        ({"F": "A"}, "an Se has N here"),
        ({"x": "m/s"}, "a Dq has m here"),
    ],
)
def test_one_unit_against_all_its_neighbours_is_a_slip_first(
    changed: dict[str, str], expected: str
) -> None:
    unit = {"F": "N", "m": "kg", "d": "N*s/m", "k": "N/m", "x": "m"} | changed
    with BondGraph("g") as g:
        body = One("body")
        Se("F", unit=unit["F"]) >> body >> I("m", 0.5, unit=unit["m"])
        body >> R("d", 4.0, unit=unit["d"])
        body >> C("k", stiffness=2e3, unit=unit["k"])
        body >> Dq("x", unit=unit["x"])
    (line,) = domain_problems(g)
    (name,) = changed
    assert line.startswith(f"{name} ({g[name].kind}, unit {unit[name]}: ")
    assert f"its unit looks like a slip, {expected}" in line
    assert "all of translation" in line
    if "put a transducer" in line:
        assert line.index("correct it") < line.index("put a transducer")


def test_a_sensor_of_the_other_variable_is_offered() -> None:
    with BondGraph("g") as g:
        loop = One("loop")
        Se("u", unit="V") >> loop >> R("R_w", 2.0, unit="ohm")
        loop >> Df("i", unit="V")
    (line,) = domain_problems(g)
    assert "a Df has A here" in line
    assert line.endswith("correct it, or take a De, which reads V")
    with BondGraph("two") as two:  # nobody knows which of two is wrong
        Se("u", unit="V") >> One("loop") >> R("R_w", 2.0, unit="N*s/m")
    (line,) = domain_problems(two)
    assert line.index("correct a unit") < line.index("put a transducer")


def test_the_usual_units_are_those_of_their_domain() -> None:
    for name, (resistance, compliance, stiffness, inertia) in COEFFICIENTS.items():
        for element, unit in (
            (R("r", 1.0, unit=resistance), resistance),
            (C("c", 1.0, unit=compliance), compliance),
            (C("k", stiffness=1.0, unit=stiffness), stiffness),
            (I("i", 1.0, unit=inertia), inertia),
        ):
            if not unit:
                continue
            with BondGraph("g") as g:
                One("a") >> element
            (said,) = statements(g)
            assert name in said.domains
            assert expected_unit(element, name) == unit
