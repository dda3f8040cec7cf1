"""The port-Hamiltonian form reproduces the exact equations; passivity, or who breaks it."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import GY, BondGraph, C, GraphError, I, One, R, Se, Sf, Zero
from bondgraph.energy.definiteness import vanishes
from bondgraph.energy.passivity import judge
from bondgraph.energy.port_hamiltonian import PortHamiltonian, port_hamiltonian
from bondgraph.energy.structure import resistances
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import RE, RS, CField, IField, MSe, RField
from bondgraph.graph.modulation import flow, port_variables
from bondgraph.hysteresis import MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import Coulomb, Hysteretic, Polynomial
from tests.bondgraph.energy.energy_models import coupled, crank, plate, rlc
from tests.properties.test_random_graphs import random_graph
from tests.symbols import P, S


def proved(g: BondGraph) -> PortHamiltonian:
    form = port_hamiltonian(g)
    differences = form.differences()
    assert differences
    assert all(d == 0 for d in differences), [d for d in differences if d != 0]
    assert form.J == -form.J.T
    assert form.R == form.R.T
    assert form.N == -form.N.T
    assert form.S == form.S.T
    return form


def test_a_resonator_by_hand() -> None:
    form = proved(rlc())
    r, inductance, capacitance = P("R_1 L C_1")
    p, q = S("p_L q_C_1")
    assert form.states == ("p_L", "q_C_1")
    assert sp.expand(form.energy - p**2 / (2 * inductance) - q**2 / (2 * capacitance)) == 0
    assert form.J == sp.Matrix([[0, -1], [1, 0]])
    assert form.R == sp.Matrix([[r, 0], [0, 0]])
    assert form.G == sp.Matrix([1, 0])
    assert form.Q == sp.diag(1 / inductance, 1 / capacitance)
    assert (form.inputs, form.outputs) == (("e_V",), ("f_loop",))
    assert form.P.is_zero_matrix
    assert form.S.is_zero_matrix
    assert form.passivity.passive
    assert form.passivity.exact
    assert "H = " in str(form)
    assert "passive for all" in str(form)
    assert form._repr_latex_().startswith("$$x = ")


def test_a_dependent_inertia_is_part_of_the_energy() -> None:
    form = proved(coupled())
    m1, m2, n, d = P("m_1 m_2 n d")
    p = S("p_m_1")
    share = m1 / (m1 + m2 * n**2)
    kinetic = p**2 * (m1 + n**2 * m2) / (2 * m1**2)
    rest = form.energy.subs(S("q_k"), 0)
    assert vanishes(rest - kinetic)
    assert vanishes(form.R[0, 0] - d * share**2)
    assert vanishes(form.J[1, 0] - n * share)
    assert vanishes(form.G[0, 0] - share)
    assert form.P.is_zero_matrix
    assert form.passivity.exact


@pytest.mark.parametrize("dependent", [True, False])
def test_a_crank_has_structure_that_turns_with_it(dependent: bool) -> None:
    form = proved(crank(dependent))
    angle = S("q_spring")
    assert angle in form.R.free_symbols
    assert form.P.is_zero_matrix
    assert form.Q is None or not dependent
    assert form.passivity.passive
    if dependent:
        assert angle in form.J.free_symbols


def test_a_moving_plate() -> None:
    form = proved(plate())
    q, x = S("q_device1 q_device2")
    c0, x0, r = P("c0 x0 R_s")
    assert vanishes(form.gradient[0] - q * x / (c0 * x0))
    assert vanishes(form.gradient[1] - q**2 / (2 * c0 * x0))
    assert form.P == sp.Matrix([-1 / r, 0, 0, 0])  # a resistor between source and capacitor
    assert form.S == sp.Matrix([1 / r])
    assert form.Q is None
    assert form.passivity.passive
    assert form.passivity.unbounded == ("device",)
    assert "not shown to be bounded below: device" in str(form.passivity)


def test_the_published_plate_is_refused() -> None:
    with pytest.raises(GraphError, match=r"device.*ports 1 and 2 are not reciprocal"):
        port_hamiltonian(plate(published=True))


def test_the_linear_stack() -> None:
    form = proved(stack_bond_graph(sensors=("x", "i"), external_force=True))
    assert len(form.states) == 3
    assert form.Q is not None
    assert form.inputs == ("e_V_in", "e_F_e")
    assert form.passivity.exact


def test_the_hysteretic_stack_keeps_its_ceramics_as_a_port() -> None:
    law = Hysteretic(MaxwellResistiveCapacitor((1e9,), (1e3,)))
    form = proved(stack_bond_graph(law))
    assert form.laws == ("C_nl",)
    assert form.outside == ("q_C_nl",)
    assert form.passivity.relied_on == ("C_nl",)
    assert form.passivity.passive
    lags = Hysteretic(PrandtlIshlinskii((0.0, 1e-9), (1e9, 0.5e9)))
    broken = proved(stack_bond_graph(lags)).passivity
    assert not broken.passive
    assert "C_nl (C)" in broken.breakers[0]


def test_nonlinear_resistors_stay_ports() -> None:
    g = rlc().with_element("R_1", law=Coulomb())
    form = proved(g)
    assert form.laws == ("R_1",)
    assert form.R.is_zero_matrix
    assert form.passivity.relied_on == ("R_1",)
    bent = proved(rlc().with_element("R_1", law=Polynomial()))
    assert "R_1 (R): its law (polynomial)" in bent.passivity.breakers[0]


def test_a_nonlinear_loop_is_cut_at_its_resistor() -> None:
    with BondGraph("loop") as g:
        a, z, b = One("a"), Zero("z"), One("b")
        Se("V") >> a >> R("R_n", 1.0, law=Polynomial(orders=(3,)))
        a >> z >> R("R_2", 2.0)
        z >> b >> I("L", 1.0)
        b >> R("R_3", 3.0)
    assert equations(g).algebraic
    form = proved(g)
    assert form.S != sp.zeros(2, 2)


def test_a_linear_loop_is_solved() -> None:
    with BondGraph("bridge") as g:
        a, z, b = One("a"), Zero("z"), One("b")
        Se("V") >> a >> R("R_1", 1.0)
        a >> z >> R("R_2", 2.0)
        z >> b >> I("L", 1.0)
        b >> R("R_3", 3.0)
    assert equations(g).loops
    form = proved(g)
    r1, r2, r3 = P("R_1 R_2 R_3")
    assert vanishes(form.R[0, 0] - r3 - r1 * r2 / (r1 + r2))
    assert form.passivity.exact


def test_fields_in_every_place() -> None:
    with BondGraph("fields") as g:
        k = g.parameter("k", 0.5)
        a, b = One("a"), One("b")
        coils = IField("coils", matrix=((2.0, -k), (-k, 3.0)))
        losses = RField("losses", matrix=((1.0, 4.0), (-4.0, 2.0)))
        Se("u_1") >> a >> coils
        Se("u_2") >> b >> coils
        a >> losses
        b >> losses
    form = proved(g)
    assert form.R == sp.diag(1, 2)
    assert form.J == sp.Matrix([[0, -4], [4, 0]])
    assert form.passivity.passive


def test_an_active_source_breaks_passivity_by_name() -> None:
    with BondGraph("servo") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        MSe("helper", value=2 * flow("body")) >> body
        body >> R("d", 1.0)
    form = proved(g)
    assert form.inputs == ("e_F", "e_helper")
    assert not form.passivity.passive
    assert "helper (MSe) is an active source" in str(form.passivity)


def test_a_resistance_that_is_positive_at_its_values_only() -> None:
    with BondGraph("difference") as g:
        a, b = g.parameter("alpha", 3.0), g.parameter("beta", 1.0)
        loop = One("loop")
        Se("V") >> loop >> R("R_1", a - b)
        loop >> I("L", 1.0)
    found = proved(g).passivity
    assert found.passive
    assert not found.exact
    assert "at the declared values" in str(found)


def test_a_resistive_field_that_gives_power_is_named() -> None:
    with BondGraph("active") as g:
        a, b = One("a"), One("b")
        active = RField("amplifier", matrix=((1.0, 3.0), (0.0, 1.0)))
        a >> I("L_1", 1.0)
        b >> I("L_2", 1.0)
        a >> active
        b >> active
    found = judge(g, resistances(g))
    assert not found.passive
    assert found.breakers == ("amplifier gives power: its resistance is not positive",)


def test_reactions_and_entropy() -> None:
    with BondGraph("reaction") as g:
        a, b = Zero("A"), Zero("B")
        a >> RE("r", ratio=2.0) >> b
        a >> C("c_A", 1.0)
        b >> C("c_B", 1.0)
    form = proved(g)
    assert form.laws == ("r", "r")
    assert form.passivity.passive
    with BondGraph("heater") as h:
        loop, room = One("loop"), Zero("room")
        Se("V") >> loop >> RS("R_h", ratio=2.0) >> room
        loop >> I("L", 0.1)
        room >> C("air", 50.0)
    with pytest.raises(GraphError, match=r"R_h .RS. heats the pseudo"):
        port_hamiltonian(h)


def test_a_store_that_follows_an_input_is_refused_by_name() -> None:
    with BondGraph("forced") as g:
        top = Zero("top")
        Se("V") >> top >> C("C_1", 1.0)
        top >> R("R_1", 1.0)
    with pytest.raises(GraphError, match=r"C_1 .*follow an input"):
        port_hamiltonian(g)


def test_a_base_recorded_by_its_displacement_is_refused_by_name() -> None:
    with BondGraph("shaken") as g:
        gap = One("gap")
        Sf("base", given="integral") >> gap >> C("k", stiffness=200.0)
        gap >> R("d", 0.8)
    with pytest.raises(GraphError, match=r"because base follow an input \(d_base.*its rate"):
        port_hamiltonian(g)


def test_a_mixed_field() -> None:
    """One port of a C field is bound to a rigid partner: a dependent displacement."""
    q1, q2 = port_variables("q", 2)
    with BondGraph("mixed") as g:
        c = g.parameter("c", 2.0)
        device = CField("device", energy=q1**2 + q2**2 / 2 + c * q1 * q2 / 4)
        a, z = One("a"), Zero("z")
        Se("u") >> a >> device
        a >> R("R_1", 1.0)
        Sf("i") >> z >> device
        z >> C("C_2", 3.0)
        z >> R("R_2", 5.0)
    assert equations(g).held
    form = proved(g)
    assert form.passivity.passive


def test_gyrators_and_an_autonomous_graph() -> None:
    with BondGraph("coupled") as g:
        a, b = One("a"), One("b")
        a >> I("L_1", 1.0)
        a >> GY("g", ratio=2.0) >> b
        b >> I("L_2", 3.0)
        b >> C("C_1", 1.0)
    form = proved(g)
    assert form.inputs == ()
    assert form.R.is_zero_matrix
    assert "ports" in str(form)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("seed", range(40))
def test_random_graphs(seed: int) -> None:
    g = random_graph(seed)
    try:
        model = equations(g)
    except GraphError:
        pytest.skip("refused by the engine")
    if model.input_rates:
        with pytest.raises(GraphError, match="follow an input"):
            port_hamiltonian(g)
        return
    form = proved(g)
    assert form.passivity.passive
    assert form.passivity.exact
    values = {p.symbol: p.value for p in model.parameters.values()}
    numbers = np.array(form.dissipation.subs(values), float)
    if numbers.size:
        assert np.linalg.eigvalsh(numbers).min() > -1e-9 * max(1.0, abs(numbers).max())
