"""The catalogue against the vocabulary of the verdict: every effect, once, complete."""

from __future__ import annotations

import sys

import networkx as nx
import numpy as np
import pytest

from actuators.models.catalogue import stack_with_payload
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, One, R, Se, Sf, Zero
from bondgraph.graph.sensors import Df, Dq, Sensor
from bondgraph.signals.recording import Split
from bondgraph.support.errors import UnknownName
from hardware.simulators.generator.families import FAMILIES
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED, Effect, by_name
from identification.diagnosis.catalogue.places import mechanical_resistors, other_resistors
from identification.diagnosis.catalogue.starts import rubbing_units
from identification.diagnosis.localisation.recording.variables import losing_words
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.factors import drives
from identification.study.problem import Problem
from tests.settled import simulate

VOCABULARY = {
    "memory": ("hysteresis", "creep"),
    "friction": (
        "coulomb_friction", "stribeck_friction", "presliding_friction", "quadratic_drag",
        "asymmetric_damping",
    ),
    "restoring": (
        "nonlinear_stiffness", "bilinear_stiffness", "end_stop", "backlash", "contact_loss",
        "cross_coupling",
    ),
    "transduction": ("nonlinear_ratio", "position_periodic_force"),
    "drive": ("saturation", "slew_limit", "low_pass", "dead_zone", "inner_resistance"),
    "storage": (
        "leakage", "internal_leakage", "overflow", "added_mode", "linear_spring", "linear_loss",
        "linear_inertia", "linear_capacity", "eddy_current_loss", "self_heating",
    ),
    "flow": ("square_root_flow", "nonlinear_resistance", "diode", "current_limit", "voltage_drop"),
    "measurement": (
        "sensor_lag", "sensor_offset", "sensor_gain", "sensor_drift", "sensor_nonlinearity",
        "sensor_rectification", "periodic_error", "quantisation",
    ),
    "time": ("delay", "clock_skew"),
    "outside": ("external_disturbance", "time_varying_parameter"),
}  # fmt: skip
EVERY = (*CATALOGUE, UNNAMED)
NAMES = [e.name for e in EVERY]


def test_the_vocabulary_is_complete_and_in_order() -> None:
    wanted = [(n, family) for family, names in VOCABULARY.items() for n in names]
    assert [(e.name, e.family) for e in CATALOGUE] == wanted
    assert (UNNAMED.name, UNNAMED.family) == ("unknown", "outside")
    trial = {f: tuple(n for n in names if n != "unknown") for f, names in FAMILIES.items()}
    assert trial == VOCABULARY


def test_one_file_each() -> None:
    files = [sys.modules[type(e).__module__].__file__ for e in EVERY]
    assert len(set(files)) == len(EVERY)


@pytest.mark.parametrize("effect", EVERY, ids=NAMES)
def test_every_word_is_there(effect: Effect) -> None:
    cls = type(effect)
    for attribute in ("name", "family", "law", "sentence", "looks", "separated_by", "source"):
        text = getattr(cls, attribute)
        assert isinstance(text, str), attribute
        assert text.strip() == text != "", attribute
    assert not effect.sentence.endswith(".")
    known = {e.name for e in CATALOGUE}
    assert set(effect.simpler) <= known - {effect.name}
    assert set(effect.confused_with) <= known - {effect.name}
    assert len(set(effect.confused_with)) == len(effect.confused_with)
    assert effect.confused_with or effect is UNNAMED
    assert by_name(effect.name) is effect


def test_no_effect_contains_itself_on_the_way() -> None:
    contained = nx.DiGraph((e.name, s) for e in CATALOGUE for s in e.simpler)
    assert nx.is_directed_acyclic_graph(contained)


def test_an_unknown_name_gets_the_nearest() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'hysteresis'"):
        by_name("hysteris")
    with pytest.raises(UnknownName, match=rf"no effect 'gremlin'.* \({len(CATALOGUE)} in all\)"):
        by_name("gremlin")


# -- at every place of the stack actuator ------------------------------------------------------
N, DT = 300, 2e-4


def recorded(graph: BondGraph) -> Data:
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 40 * np.sin(2 * np.pi * 30 * t) + 20 * np.sin(2 * np.pi * 71 * t)
    run = simulate(graph, t, {"V_in": u})
    names = tuple(s.name for s in graph.of_type(Sensor))
    y = np.stack([np.asarray(run[n]) for n in names], axis=1)
    split = Split(slice(0, 200), slice(200, N), "first two thirds")
    return Data("run", t, {"V_in": u}, y, names, 1e-3 * y.std(axis=0), split)


@pytest.fixture(scope="module")
def stack() -> FittedModel:
    graph = stack_with_payload()
    return scene(fit(Problem(graph, recorded(graph)), max_iterations=2))


def test_scene_knows_every_port(stack: FittedModel) -> None:
    for effect in CATALOGUE:
        assert {e.name for e in effect.places(stack.graph)} <= set(stack.past), effect.name
    for past in stack.past.values():
        assert past.argument.shape == past.output.shape == (N,)
        assert np.isfinite(past.argument).all()
        assert np.isfinite(past.output).all()


@pytest.mark.parametrize("effect", EVERY, ids=NAMES)
def test_rewriting_keeps_the_graph_sound(effect: Effect, stack: FittedModel) -> None:
    before = dict(stack.graph.elements)
    for place in effect.places(stack.graph):
        i = effect.insert(stack, place)
        assert (i.effect, i.family, i.law) == (effect.name, effect.family, effect.law)
        assert i.label == f"{effect.name} at {place.name}"
        assert i.graph.check() == (), i.label
        assert [s.name for s in i.graph.of_type(Sensor)] == list(stack.data.names)
        assert [s.name for s in drives(i.graph)] == ["V_in"], i.label
        known = set(i.graph.parameters)
        assert i.strengths
        assert set(i.strengths) <= known, i.label
        assert i.starts
        for start in i.starts:
            assert set(start) <= known, i.label
            assert all(np.isfinite(v) for v in start.values())
        for s in effect.signatures(stack, place):
            assert s.columns.shape[0] == N
            assert np.isfinite(s.columns).all(), i.label
    assert stack.graph.elements == before


@pytest.mark.parametrize("effect", EVERY, ids=lambda e: e.name)
def test_an_input_measured_at_its_port_has_no_amplifier(effect: Effect) -> None:
    def places(measured: bool) -> set[str]:
        with BondGraph("body") as g:
            body = One("body")
            Se("F", unit="N", measured=measured) >> body
            body >> I("m", 1.0, unit="kg")
            body >> Df("v", unit="m/s")
        return {e.name for e in effect.places(g)}

    lost = places(measured=False) - places(measured=True)
    driven = {"saturation", "dead_zone", "slew_limit", "low_pass", "hysteresis", "unknown"}
    assert lost == ({"F"} if effect.name in driven else set())


def test_beside_measured_inputs_a_command_is_no_place_of_a_dead_time() -> None:
    """All inputs are late together: the same model twice would be told by a tie."""
    with BondGraph("joint") as g:
        joint = One("joint")
        Se("F") >> joint >> R("b", 1.0)
        joint >> I("m", 1.0)
        joint >> Se("p", measured=True)
    assert [e.name for e in by_name("delay").places(g)] == ["p"]


def test_a_resistance_times_an_area_is_electrical() -> None:
    with BondGraph("disc") as g:
        disc = One("disc")
        Se("V", unit="V") >> disc >> R("R_e", 37.0, unit="ohm*m2")
        disc >> C("C_p", 2.7e-5, unit="F/m2")
        disc >> Dq("P", unit="C/m2")
    assert "R_e" in {e.name for e in by_name("self_heating").places(g)}
    t = DT * np.arange(400)
    run = simulate(g, t, {"V": np.sin(20 * t)})
    split = Split(slice(0, 300), slice(300, 400), "the end")
    data = Data("run", t, {"V": np.sin(20 * t)}, run["P"][:, None], ("P",), np.ones(1), split)
    inserted = by_name("nonlinear_resistance").insert(scene(fit(Problem(g, data))), g["R_e"])
    units = {p.unit for n, p in inserted.graph.parameters.items() if n.startswith("a_")}
    assert units == {"V"}
    assert inserted.graph.check() == ()


UNITS = ("N*s/m", "N*m*s/rad", "", "ohm", "mohm", "ohm*m2", "K/W", "Pa*s/m3", "bar*s/l")


def test_what_may_rub_is_read_off_the_dimension_of_the_unit() -> None:
    with BondGraph("joint") as g:
        joint = One("joint")
        Se("F") >> joint
        for i, unit in enumerate(UNITS):
            joint >> R(f"r{i}", 1.0, unit=unit)
    rubbing = [e.unit for e in mechanical_resistors(g) if isinstance(e, R)]
    assert rubbing == ["N*s/m", "N*m*s/rad", ""]
    assert {e.name for e in other_resistors(g)} == {f"r{i}" for i in range(3, len(UNITS))}


def test_past_of_a_port() -> None:
    p = PortHistory(np.array([-1.0, 3.0]), np.array([0.0, 4.0]))
    assert (p.centre, p.half, p.swing, p.slope) == (1.0, 2.0, 2.0, 1.0)
    still = PortHistory(np.zeros(3), np.zeros(3))
    assert still.half == still.swing == still.rms == 1.0


def test_a_law_at_an_outlet_of_levels_has_units_of_levels() -> None:
    assert rubbing_units(R("outlet", 4000.0, unit="s/m2")) == ("m", "m3/s", "m3")
    assert rubbing_units(R("d", 4.0, unit="N*m*s/rad"))[0] == "N*m"
    assert rubbing_units(R("d", 4.0))[0] == "N"


def test_a_tank_in_levels_has_the_effects_of_a_fluid() -> None:
    with BondGraph("tank") as g:
        tank = Zero("tank")
        Sf("q", unit="m3/s") >> tank >> C("A", 0.02, unit="m2")
        tank >> R("outlet", 4000.0, unit="s/m2")
    held = {n: {e.name for e in by_name(n).places(g)} for n in ("square_root_flow", "overflow")}
    assert held == {"square_root_flow": {"outlet"}, "overflow": {"A"}}
    assert not by_name("quadratic_drag").places(g)
    assert losing_words(g["outlet"]) == "a loss that depends on the volume flow"
