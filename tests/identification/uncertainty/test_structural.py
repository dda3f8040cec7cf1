"""Structural identifiability: textbook and stack answers, exact and by sensitivities."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.electrostatic.moving_plate import moving_plate, moving_plate_charge
from actuators.models.textbook import resonator, thermal_lag
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.lumped import stack_lumped
from bondgraph import TF, BondGraph, C, De, Df, Dq, I, One, R, Se, Zero
from bondgraph.equations.elimination import PRIME
from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.uncertainty.extra_sensor import helpful_sensors
from identification.uncertainty.joint_sensitivities import rich_nulls
from identification.uncertainty.structural import identifiability, structural_rank
from identification.uncertainty.transfer_jacobian import (
    random_integers,
    reconstructed,
    transfer_jacobian,
)


def with_gain() -> BondGraph:
    with BondGraph("gauged") as g:
        body = One("body")
        Se("u", unit="V") >> TF("b", ratio=1.3) >> body
        body >> I("m", 0.51)
        body >> R("d", 2.03)
        body >> C("k", stiffness=197.0)
        body >> Dq("y")
    return g


def two_springs() -> BondGraph:
    with BondGraph("two_springs") as g:
        body = One("body")
        Se("F") >> body >> I("m", 0.5)
        body >> R("d", 2.0)
        body >> C("k_1", stiffness=100.0)
        body >> C("k_2", stiffness=70.0)
        body >> Dq("x")
    return g


def test_resonator_is_determined_and_with_a_free_gain_only_ratios_are() -> None:
    plain = identifiability(resonator())
    assert plain.exact
    assert plain.determined == ("m", "d", "k")
    gauged = identifiability(with_gain())
    assert gauged.rank == 3
    (group,) = gauged.groups
    assert set(group.names) == {"b", "m", "d", "k"}
    assert group.complete
    # with e_in = b e_out the force is u / b
    assert {str(c) for c in group.determined} == {"b*m", "b*d", "b*k"}


def test_ratios_when_the_gain_is_named_the_other_way() -> None:
    with BondGraph("ratios") as g:
        body = One("body")
        Se("u") >> TF("lever", ratio=1 / g.parameter("h", 0.7)) >> body
        body >> I("m", 0.51)
        body >> R("d", 2.03)
        body >> C("k", stiffness=197.0)
        body >> Dq("y")
    (group,) = identifiability(g, ["h", "m", "d", "k"]).groups
    assert {str(c) for c in group.determined} in (
        {"h/m", "d/m", "k/m"},
        {"m/h", "d/h", "k/h"},
    )


def test_stack_needs_the_current_for_its_transducer_constant() -> None:
    displacement = identifiability(stack_bond_graph())
    assert displacement.missing == 2
    (group,) = displacement.groups
    assert "T" in group.names
    assert "T*C_nl" in {str(c) for c in group.determined}
    both = identifiability(stack_bond_graph(sensors=("x", "i")))
    assert both.missing == 0
    assert "T" in both.determined


def test_length_of_the_stack_is_a_gauge() -> None:
    g = stack_bond_graph(sensors=("x", "i"))
    found = identifiability(g, ["l", "T", "R_e", "C_nl", "k", "m", "R_nl"])
    (group,) = found.groups
    assert [str(c) for c in group.determined] == ["l^2/C_nl"]


def test_capacitance_beside_an_ideal_source_is_dead() -> None:
    found = identifiability(stack_lumped())
    assert found.dead == ("C",)
    (group,) = found.groups
    assert {str(c) for c in group.determined} == {"m/T", "b/T", "k/T"}


def test_advice_names_a_sensor_that_fixes_it() -> None:
    advice = helpful_sensors(stack_bond_graph())
    assert ("Df", "loop") in {(a.kind, a.junction) for a in advice}
    assert advice[0].missing == 0
    assert helpful_sensors(resonator()) == ()
    wider = stack_bond_graph().with_branch("loop", [Df("i_loop")])
    assert identifiability(wider, identifiability(stack_bond_graph()).free).missing == 0


def test_thermal_lag_determines_a_product() -> None:
    found = identifiability(thermal_lag(), ["K", "R_th", "C_th"])
    assert found.determined == ("K",)
    assert [str(c) for c in found.groups[0].determined] == ["R_th*C_th"]


def test_parallel_springs_determine_their_sum_with_or_without_a_linear_plant() -> None:
    found = identifiability(two_springs())
    assert found.determined == ("m", "d")
    assert [str(c) for c in found.groups[0].determined] == ["k_1 + k_2"]


def test_both_ways_agree_on_linear_graphs() -> None:
    for g in (with_gain(), two_springs(), thermal_lag()):
        exact = identifiability(g)
        _, nulls, gap = rich_nulls(g, exact.free, None, seed=2)
        assert nulls[0].shape[1] == exact.missing
        if exact.missing:
            assert gap > 1e3


def test_nonlinear_stack_is_judged_by_its_sensitivities() -> None:
    law = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    found = identifiability(stack_lumped(law, resistance=20.0, sensors=("x", "i")))
    assert not found.exact
    assert found.gap > 1e3
    assert "T" in found.determined


def test_charge_drive_does_not_see_the_gap() -> None:
    # the force q^2 / (2 eps A) of a charge does not depend on the gap
    charge = identifiability(moving_plate_charge())
    assert charge.dead == ("gap",)
    assert {str(c) for c in charge.groups[0].determined} == {"k*A", "m/k", "b/k"}
    voltage = identifiability(moving_plate())
    assert voltage.determined == ("gap",)
    assert {str(c) for c in voltage.groups[0].determined} == {"A/k", "m/k", "b/k"}
    assert voltage.gap > 1e3


def test_delays_in_a_row_add_up() -> None:
    g = resonator().with_parameters([Parameter("late", 1e-3, "s"), Parameter("lag", 2e-3, "s")])
    g = g.with_element("u", drive=Drive(delay="late")).with_element("y", delay="lag")
    found = identifiability(g, ["m", "d", "k", "late", "lag"])
    assert found.determined == ("m", "d", "k")
    assert [str(c) for c in found.groups[0].determined] == ["late + lag"]
    assert structural_rank(g, ["m", "d", "k", "late", "lag"]) == 4


def test_exact_jacobian_is_the_derivative() -> None:
    g = resonator()
    point = random_integers(("m", "d", "k"), 1)
    rows = transfer_jacobian(g, ("m", "d", "k"), point)
    found = {tuple(str(reconstructed(v)) for v in r) for r in rows if any(r)}
    # the second Markov parameter of y is 1/m: its relative derivative by ln m is -1/m
    m = point["m"]
    assert (f"-1/{m}", "0", "0") in found
    assert reconstructed(5 * pow(7, -1, PRIME) % PRIME) == pytest.approx(5 / 7)


def test_bad_questions_are_answered_in_one_line() -> None:
    with pytest.raises(UnknownName, match="no parameter 'kk'"):
        identifiability(resonator(), ["kk"])
    with BondGraph("blind") as g:
        body = One("v")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 1.0)
    with pytest.raises(UnusableInput, match="has no sensor"):
        identifiability(g)


def test_words() -> None:
    text = str(identifiability(stack_lumped()))
    assert "3 of 5 numbers, or combinations of them, can be determined (exactly)" in text
    assert "C: no output depends on it" in text
    assert "nothing is left open" in str(helpful_sensors(stack_bond_graph())[0])


def test_zero_junction_sensor_is_tried() -> None:
    with BondGraph("divider") as g:
        loop, node = One("loop"), Zero("node")
        Se("u") >> loop >> R("R", 2.0)
        loop >> node >> C("c", 0.5)
        loop >> Df("i")
        node >> De("v")
    assert identifiability(g).missing == 0
    assert np.isinf(identifiability(g).gap)
