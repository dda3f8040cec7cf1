"""The component library: documentation, look-up, units, and equations against hand derivations."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, De, Df, Dq, GraphError, R, Se, Sf, UnknownName, Zero
from bondgraph.equations.derivation import equations
from bondgraph.graph.composing.components import COMPONENTS, mass_spring_damper, rc_section
from bondgraph.graph.composing.hierarchy import ports_of, use
from bondgraph.graph.composing.library import ComponentLibrary
from bondgraph.graph.domain_check import domain_problems
from bondgraph.graph.unit_notes import unit_notes
from tests.settled import simulate
from tests.symbols import closed


@pytest.mark.parametrize("name", list(COMPONENTS))
def test_every_component_says_what_it_is_and_has_fitting_units(name: str) -> None:
    g = COMPONENTS.make(name)
    text = COMPONENTS.documentation(name)
    for port in ports_of(g):
        assert port.unit
        assert f"``{port.name}``" in text
    assert len(ports_of(g)) >= 2
    assert domain_problems(g) == ()
    assert unit_notes(g) == ()
    for n in g.parameters:
        assert f"``{n}``" in text, n
    open_ends = {p.name for p in ports_of(g)}
    assert {line.split()[0] for line in g.check()} == open_ends


@pytest.mark.parametrize("name", list(COMPONENTS))
def test_every_component_can_be_driven_and_loaded(name: str) -> None:
    g = COMPONENTS.make(name)
    first, *_, last = ports_of(g)
    with BondGraph("bench") as bench:
        part = use(g, "part")
        entry = part.port(first.name)
        # a source of the variable that the junction does not share would meet no resistance
        (Sf if isinstance(entry, Zero) else Se)("drive") >> entry
        part.port(last.name) >> R("load", 1.0)
    assert bench.check() == ()
    assert domain_problems(bench) == ()
    equations(bench)


def test_the_library_finds_and_lists() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'dc_motor'"):
        COMPONENTS["dcmotor"]
    assert str(COMPONENTS).splitlines()[0] == "components"
    assert len(str(COMPONENTS).splitlines()) == len(COMPONENTS) + 1
    with pytest.raises(GraphError, match="there is a component 'rc_section' already"):
        COMPONENTS.with_component(rc_section)
    more = ComponentLibrary("mine").with_component(rc_section, "low_pass")
    assert list(more) == ["low_pass"]
    with pytest.raises(GraphError, match="no docstring"):
        more.with_component(lambda: BondGraph("x"), "x")


def test_a_motor_drives_an_axis_through_a_gearbox_and_a_rack() -> None:
    with BondGraph("axis") as g:
        motor = COMPONENTS.use("dc_motor", "motor")
        gear = COMPONENTS.use("elastic_gearbox", "gear", b=1e-9)
        rack = COMPONENTS.use("rack_and_pinion", "rack")
        table = use(mass_spring_damper(2.0, 50.0, 4.0), "table")
        Se("V", unit="V") >> motor.terminal
        motor.shaft >> gear.fast
        gear.slow >> rack.pinion
        rack.rack >> table.left
        table.right >> R("guide", 30.0, unit="N*s/m")
        motor["rotor"] >> Df("omega", unit="rad/s")
        table["body"] >> Df("v", unit="m/s")
        table["body"] >> Dq("x", unit="m")
    assert g.check() == ()
    assert domain_problems(g) == ()
    assert unit_notes(g) == ()
    time = np.linspace(0.0, 20.0, 4001)
    run = simulate(g, time, {"V": np.where(time > 0, 12.0, 0.0)})
    k, r, b = 0.05, 1.0, 1e-6 + 1e-9
    # at rest of the transients all speeds are tied: v = 0.02 omega / 10 once the spring holds
    reduced = 0.02 / 10.0
    omega = 12.0 * k / r / (k**2 / r + b + 30.0 * reduced**2)
    assert run["omega"][-1] == pytest.approx(omega, rel=1e-6)
    assert run["v"][-1] == pytest.approx(reduced * omega, rel=1e-6)


def test_a_chain_of_segments_has_the_frequencies_of_a_chain() -> None:
    n, mass, stiffness = 5, 0.2, 80.0
    with BondGraph("chain") as g:
        tail = None
        for i in range(n):
            part = use(mass_spring_damper(mass, stiffness, 1e-9), f"s{i}")
            if tail is None:
                Sf("base", unit="m/s") >> part.left
            else:
                tail >> part.left
            tail = part.right
        assert tail is not None
        Se("end", unit="N") >> tail
    model = equations(g)
    space = closed(model)
    values = {p.symbol: p.value for p in model.parameters.values()}
    a = np.array(space.dxdt.jacobian(space.x).subs(values), float)
    got = np.sort(np.abs(np.linalg.eigvals(a).imag))[::2]
    modes = np.arange(1, n + 1)
    expected = 2 * np.sqrt(stiffness / mass) * np.sin((2 * modes - 1) * np.pi / (4 * n + 2))
    np.testing.assert_allclose(got, expected, rtol=1e-6)


def test_the_motor_has_the_textbook_equations() -> None:
    with BondGraph("g") as g:
        motor = COMPONENTS.use("dc_motor", "m")
        Se("V") >> motor.terminal
        Se("M") >> motor.shaft
    space = closed(equations(g))
    p = {str(s): s for s in space.dxdt.free_symbols}
    i, w = p["p_m_L"] / p["m_L"], p["p_m_J"] / p["m_J"]
    flux = p["V"] - p["m_R"] * i - p["m_K"] * w
    spin = p["m_K"] * i - p["m_b"] * w + p["M"]
    rates = space.rates
    assert sp.simplify(rates["p_m_L"] - flux) == 0
    assert sp.simplify(rates["p_m_J"] - spin) == 0


def test_a_cylinder_has_the_textbook_equations() -> None:
    with BondGraph("g") as g:
        part = COMPONENTS.use("hydraulic_cylinder", "c")
        Sf("Q") >> part.oil
        part.rod >> R("load", 5.0)
        part["chamber"] >> De("p")
    space = closed(equations(g))
    s = {str(v): v for v in space.dxdt.free_symbols}
    pressure, v = s["q_c_C"] / s["c_C"], s["p_c_m"] / s["c_m"]
    rates = space.rates
    assert sp.simplify(rates["q_c_C"] - (s["Q"] - pressure / s["c_R"] - s["c_A"] * v)) == 0
    push = s["c_A"] * pressure - (s["c_d"] + s["load"]) * v
    assert sp.simplify(rates["p_c_m"] - push) == 0
    assert sp.simplify(space.y[0] - pressure) == 0


def test_a_transformer_of_two_walls_conducts_in_series() -> None:
    with BondGraph("wall") as g:
        a, b = COMPONENTS.use("thermal_section", "a"), COMPONENTS.use("thermal_section", "b", R=3.0)
        Se("T_in", unit="K") >> a.left
        a.right >> b.left
        b.right >> R("outside", 4.0, unit="K/W")
        b["node"] >> De("T", unit="K")
    time = np.linspace(0.0, 20000.0, 2001)
    run = simulate(g, time, {"T_in": np.full(time.size, 80.0)}, x0=np.zeros(2))
    assert run["T"][0] == 0.0
    assert run["T"][-1] == pytest.approx(80.0 * 4.0 / (1.0 + 3.0 + 4.0), rel=1e-9)
