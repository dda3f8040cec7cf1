"""Effects of friction, springs, storages and flow: inserted, absent at zero, seen when weak."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

from bondgraph.graph.elements import C, Source
from bondgraph.laws import ContactLoss
from bondgraph.simulation.lure import exact_form
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Effect, Hint, Signature
from identification.diagnosis.catalogue.flow.current_limit import CurrentLimitEffect
from identification.diagnosis.catalogue.flow.diode import DiodeEffect
from identification.diagnosis.catalogue.flow.nonlinear_resistance import NonlinearResistanceEffect
from identification.diagnosis.catalogue.flow.square_root_flow import SquareRootFlow
from identification.diagnosis.catalogue.flow.voltage_drop import VoltageDrop
from identification.diagnosis.catalogue.friction.asymmetric_damping import AsymmetricDampingEffect
from identification.diagnosis.catalogue.friction.coulomb import CoulombFriction
from identification.diagnosis.catalogue.friction.presliding import PreslidingFriction
from identification.diagnosis.catalogue.friction.quadratic_drag import Drag
from identification.diagnosis.catalogue.friction.stribeck import StribeckFriction
from identification.diagnosis.catalogue.restoring.backlash import BacklashEffect
from identification.diagnosis.catalogue.restoring.bilinear_stiffness import BilinearStiffness
from identification.diagnosis.catalogue.restoring.contact_loss import ContactLossEffect
from identification.diagnosis.catalogue.restoring.end_stop import EndStopEffect
from identification.diagnosis.catalogue.restoring.nonlinear_stiffness import NonlinearStiffness
from identification.diagnosis.catalogue.storage.added_mode import AddedMode
from identification.diagnosis.catalogue.storage.eddy_current_loss import EddyCurrentLoss
from identification.diagnosis.catalogue.storage.leakage import HOLE, SEEPS, Leakage
from identification.diagnosis.catalogue.storage.overflow import OverflowEffect
from identification.diagnosis.catalogue.storage.self_heating import SelfHeatingEffect
from identification.diagnosis.screening.port_history import PortHistory
from identification.estimation.single_record import fit, start_cost
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import (
    N,
    electrical,
    hydraulic,
    mechanical,
    response,
    response_to_effort,
    scene,
)


@dataclass(frozen=True)
class Case:
    """An effect, its plant and place; parameters at full strength `at` one signature's shape."""

    effect: Effect
    plant: str
    element: str
    pick: Callable[[Signature], bool]
    values: Callable[[Signature, float], Mapping[str, float]]
    weights: Callable[[float], tuple[float, ...]]
    weak: float
    tolerance: float = 0.03


def deepest(store: str) -> float:
    """Highest effort of a hydraulic store."""
    return float(np.abs(scene("hydraulic").past[store].output).max())


def first(signature: Signature) -> bool:
    return True


def shape(signature: Signature, name: str) -> float:
    assert signature.shape is not None
    return signature.shape[name]


def stops(element: str, signature: Signature) -> dict[str, float]:
    past = scene("mechanical").past[element]
    away = shape(signature, "share") * past.half
    return {f"low_{element}": past.centre - away, f"high_{element}": past.centre + away}


def diode(signature: Signature) -> dict[str, float]:
    reach = float(np.abs(scene("electrical").past["R_1"].argument).max())
    onset, width = (reach * shape(signature, n) for n in ("onset", "width"))
    return {"onset_R_1": onset, "width_R_1": width, "sense_R_1": shape(signature, "sense")}


CASES = [
    Case(CoulombFriction(), "mechanical", "d", first,
         lambda s, e: {"F_c_d": e}, lambda e: (e,), 1e-3, 0.05),
    Case(StribeckFriction(), "mechanical", "d", lambda s: shape(s, "speed") > 0.2,
         lambda s, e: {"F_c_d": e, "F_d_d": 2 * e, "f_s_d": shape(s, "speed")},
         lambda e: (e, 2 * e), 1e-3, 0.1),
    Case(PreslidingFriction(), "mechanical", "d", lambda s: shape(s, "way") > 0.05,
         lambda s, e: {"F_c_d": e, "delta_d": shape(s, "way")}, lambda e: (e,), 1e-3, 0.05),
    Case(Drag(), "mechanical", "d", first, lambda s, e: {"c_2_d": e}, lambda e: (e,), 1e-4),
    Case(AsymmetricDampingEffect(), "mechanical", "d", first,
         lambda s, e: {"d_a_d": e}, lambda e: (e,), 1e-4),
    Case(NonlinearStiffness(), "mechanical", "k", first,
         lambda s, e: {"a_2_k": e, "a_3_k": -2 * e}, lambda e: (e, -2 * e), 1e-3),
    Case(BilinearStiffness(), "mechanical", "k", lambda s: shape(s, "knee") > 0,
         lambda s, e: {"dk_k": e, "knee_k": shape(s, "knee")}, lambda e: (e,), 1e-3),
    Case(EndStopEffect(), "mechanical", "k", lambda s: shape(s, "side") == 0.0,
         lambda s, e: {"k_s_k": e, **stops("k", s)},
         lambda e: (e,), 1e-3),
    Case(EndStopEffect(), "mechanical", "k", lambda s: shape(s, "side") == -1.0,
         lambda s, e: {"k_s_k": e, **stops("k", s), "high_k": 9.0}, lambda e: (e,), 1e-3),
    Case(BacklashEffect(), "mechanical", "k", first,
         lambda s, e: {"gap_k": e * shape(s, "width"), "centre_k": shape(s, "centre")},
         lambda e: (e,), 0.02, 0.2),
    Case(Leakage(), "electrical", "C_1", first, lambda s, e: {"leak_C_1": e}, lambda e: (e,), 1e-4),
    Case(Leakage(), "hydraulic", "T_1", first, lambda s, e: {"leak_T_1": e}, lambda e: (e,), 1e-4),
    Case(Leakage(), "hydraulic", "T_1", lambda s: shape(s, "way") == HOLE,
         lambda s, e: {"full_R_leak_T_1": e * np.sqrt(deepest("T_1"))}, lambda e: (e,), 1e-5),
    Case(AddedMode(), "mechanical", "m", lambda s: shape(s, "omega") < 30.0,
         lambda s, e: {"mu_m": e, "omega_m": shape(s, "omega")}, lambda e: (e,), 1e-5, 0.05),
    Case(EddyCurrentLoss(), "coil", "L", lambda s: shape(s, "tau") > 0.1,
         lambda s, e: {"eddy_L": e, "tau_eddy_L": shape(s, "tau")}, lambda e: (e,), 1e-4),
    Case(SelfHeatingEffect(), "electrical", "R_1", lambda s: shape(s, "tau") > 1.0,
         lambda s, e: {"r_heat_R_1": e, "tau_heat_R_1": shape(s, "tau")}, lambda e: (e,), 1e-4),
    Case(SelfHeatingEffect(), "mechanical", "d", lambda s: shape(s, "tau") > 1.0,
         lambda s, e: {"r_heat_d": -e, "tau_heat_d": shape(s, "tau")}, lambda e: (-e,), 1e-4),
    Case(SquareRootFlow(), "hydraulic", "R_2", first,
         lambda s, e: {"c_2_R_2": e}, lambda e: (e,), 1e-2),
    Case(NonlinearResistanceEffect(), "electrical", "R_1", first,
         lambda s, e: {"a_2_R_1": e, "a_3_R_1": 2 * e}, lambda e: (e, 2 * e), 1e-4),
    Case(NonlinearResistanceEffect(), "hydraulic", "R_1", first,
         lambda s, e: {"a_2_R_1": e, "a_3_R_1": 2 * e}, lambda e: (e, 2 * e), 1e-5),
    Case(DiodeEffect(), "electrical", "R_1",
         lambda s: shape(s, "sense") < 0 and shape(s, "onset") > 0 and shape(s, "width") > 0.05,
         lambda s, e: {"share_R_1": e, **diode(s)}, lambda e: (e,), 1e-4),
]  # fmt: skip
SHALLOW = [
    (ContactLossEffect(), "mechanical", "k", "lift", lambda s: shape(s, "side") == 1.0),
    (ContactLossEffect(), "mechanical", "k", "lift", lambda s: shape(s, "side") == -1.0),
    (OverflowEffect(), "hydraulic", "T_1", "rim", lambda s: True),
]
PLACES = sorted({(c.effect.name, c.plant, c.element) for c in CASES}
                | {(e.name, plant, place) for e, plant, place, *_ in SHALLOW})  # fmt: skip
BY_NAME = {
    e.name: e
    for e in (
        *(c.effect for c in CASES), *(e for e, *_ in SHALLOW), CurrentLimitEffect(), VoltageDrop(),
    )
}  # fmt: skip


def label(value: object) -> str:
    return value.effect.name if isinstance(value, Case) else ""


def chosen(case: Case) -> Signature:
    s = scene(case.plant)
    found = case.effect.signatures(s, s.graph[case.element])
    return next(f for f in found if case.pick(f))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("case", CASES, ids=label)
def test_weak_effect_does_what_its_signature_says(case: Case) -> None:
    s = scene(case.plant)
    signature = chosen(case)
    weights = np.array(case.weights(case.weak))
    hint = Hint(signature.shape or {}, weights)
    inserted = case.effect.insert(s, s.graph[case.element], hint)
    quiet = response(s.graph, case.plant, {})
    seen = response(inserted.graph, case.plant, case.values(signature, case.weak)) - quiet
    said = response_to_effort(case.plant, case.element, signature.columns @ weights) - quiet
    for c in range(seen.shape[1]):
        size = np.abs(said[:, c]).max()
        assert size > 0
        assert np.abs(seen[:, c] - said[:, c]).max() < case.tolerance * size


@pytest.mark.parametrize(
    ("effect", "plant", "element", "at", "pick"), SHALLOW, ids=lambda v: getattr(v, "name", "")
)
def test_shallow_effect_does_what_its_signature_says(
    effect: Effect, plant: str, element: str, at: str, pick: Callable[[Signature], bool]
) -> None:
    """These are weak when they touch only the ends of the motion."""
    s = scene(plant)
    signature = next(f for f in effect.signatures(s, s.graph[element]) if pick(f))
    past = s.past[element]
    assert signature.shape is not None
    above = signature.shape[at] > past.centre
    end = past.argument.max() if above else past.argument.min()
    near = end + 0.01 * (past.centre - end)
    inserted = effect.insert(s, s.graph[element], Hint(signature.shape, np.ones(1)))
    (name,) = inserted.strengths
    deeper = 1.0 if above else -1.0
    depth = inserted.starts[0][name] + deeper * (signature.shape[at] - near)
    quiet = response(s.graph, plant, {})
    seen = response(inserted.graph, plant, {name: depth}) - quiet
    excess = np.maximum(deeper * (past.argument - near), 0.0)
    if effect.name == "overflow":
        excess = np.maximum.accumulate(excess)
    said = response_to_effort(plant, element, -deeper * past.slope * excess) - quiet
    for c in range(seen.shape[1]):
        assert np.abs(seen[:, c] - said[:, c]).max() < 0.15 * np.abs(said[:, c]).max()
    # and the column itself is that effort at its own shape
    own = np.maximum(deeper * (past.argument - signature.shape[at]), 0.0)
    if effect.name == "overflow":
        own = np.maximum.accumulate(own)
    np.testing.assert_allclose(signature.columns[:, 0], -deeper * past.slope * own, atol=1e-9)


@pytest.mark.parametrize(("name", "plant", "element"), PLACES)
def test_insertion(name: str, plant: str, element: str) -> None:
    effect, s = BY_NAME[name], scene(plant)
    place = s.graph[element]
    assert place in effect.places(s.graph)
    signatures = effect.signatures(s, place)
    assert signatures
    for f in signatures:
        assert f.columns.shape[0] == N
        assert np.isfinite(f.columns).all()
    quiet = response(s.graph, plant, {})
    wrong = [Hint(f.shape or {}, -np.ones(f.columns.shape[1])) for f in signatures[:2]]
    for hint in (None, *wrong):
        inserted = effect.insert(s, place, hint)
        compiled = exact_form(inserted.graph)
        assert compiled is not None
        assert inserted.graph.check() == ()
        assert set(inserted.strengths) <= set(compiled.parameter_names)
        known = inserted.graph.parameters
        for start in inserted.starts:
            for n, v in start.items():
                low, high = known[n].lower, known[n].upper
                assert low is None or v >= low, (n, v)
                assert high is None or v <= high, (n, v)
            assert np.isfinite(response(inserted.graph, plant, start, 1e-3)).all()
        # a conductance, a mass or an inductance of zero leaves nothing to divide by
        nothing = 1e-12 if name in ("leakage", "added_mode", "eddy_current_loss") else 0.0
        absent = response(inserted.graph, plant, dict.fromkeys(inserted.strengths, nothing))
        np.testing.assert_allclose(absent, quiet, atol=1e-6 * np.abs(quiet).max())


RECOVERED: list[tuple[str, str, str, dict[str, float], dict[str, float], tuple[float, ...]]] = [
    ("presliding_friction", "mechanical", "d",
     {"F_c_d": 2.0, "delta_d": 0.05}, {"way": 0.1}, (1.3,)),
    ("bilinear_stiffness", "mechanical", "k", {"dk_k": 9.0, "knee_k": 0.3}, {"knee": 0.15}, (6.0,)),
    ("backlash", "mechanical", "k",
     {"gap_k": 0.1, "centre_k": 0.0}, {"width": 0.2, "centre": 0.03}, (0.7,)),
    ("added_mode", "mechanical", "m",
     {"mu_m": 0.3, "omega_m": 9.0, "zeta_m": 0.03}, {"omega": 11.0}, (0.2,)),
    ("eddy_current_loss", "coil", "L", {"eddy_L": 0.6, "tau_eddy_L": 0.1}, {"tau": 0.2}, (0.3,)),
    ("square_root_flow", "hydraulic", "R_2", {"c_2_R_2": 300.0}, {}, (150.0,)),
    ("diode", "electrical", "R_1", {"share_R_1": 0.8, "onset_R_1": 0.25, "width_R_1": 0.03},
     {"sense": 1.0, "onset": 0.35, "width": 0.1}, (0.4,)),
    ("current_limit", "electrical", "R_1", {"low_R_1": -1.2, "high_R_1": 0.9},
     {"share": 0.5}, (0.02, 0.02)),
    ("voltage_drop", "electrical", "R_1", {"F_c_R_1": 0.6}, {}, (0.2,)),
    ("hysteresis", "electrical", "R_1", {"F_3_R_1": 0.7, "F_5_R_1": 1.1}, {},
     (0.1, 0.1, 0.4, 0.1, 0.5, 0.1, 0.1)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "plant", "element", "truth", "about", "weights"), RECOVERED, ids=lambda v: str(v)[:20]
)
def test_a_rough_hint_leads_to_the_truth(
    name: str,
    plant: str,
    element: str,
    truth: dict[str, float],
    about: dict[str, float],
    weights: tuple[float, ...],
) -> None:
    s = scene(plant)
    inserted = by_name(name).insert(s, s.graph[element], Hint(about, np.array(weights)))
    clean = response(inserted.graph, plant, truth, 1e-4)
    noise = 1e-3 * clean.std(axis=0)
    readings = clean + noise * np.random.default_rng(4).normal(size=clean.shape)
    data = replace(s.data, readings=readings, floor=noise)
    problems = [Problem(inserted.graph, data, starts=start, n_sub=2) for start in inserted.starts]
    best = fit(min(problems, key=start_cost), max_iterations=20)
    assert best.cost < 1.5
    for parameter, value in truth.items():
        if parameter == "centre_k":
            continue  # a gap that holds the rest position moves with the zero of the sensor
        assert best.values[parameter] == pytest.approx(value, rel=0.1, abs=0.01)


@pytest.mark.parametrize("effect", BY_NAME.values(), ids=lambda e: e.name)
def test_words(effect: Effect) -> None:
    words = (effect.looks, effect.separated_by, effect.source, effect.sentence, effect.law)
    assert all(words)
    assert effect.confused_with
    assert effect.name not in effect.confused_with


def test_only_where_the_domain_makes_sense() -> None:
    mass, circuit, tanks = mechanical(), electrical(), hydraulic()
    for name in ("coulomb_friction", "backlash", "added_mode", "end_stop"):
        assert BY_NAME[name].places(mass)
        assert not BY_NAME[name].places(circuit)
        assert not BY_NAME[name].places(tanks)
    assert {e.name for e in BY_NAME["overflow"].places(tanks)} == {"T_1", "T_2"}
    assert not BY_NAME["overflow"].places(circuit)
    assert not BY_NAME["leakage"].places(mass)
    assert not BY_NAME["self_heating"].places(tanks)
    assert {e.name for e in BY_NAME["self_heating"].places(mass)} == {"d"}
    assert {e.name for e in BY_NAME["self_heating"].places(circuit)} == {"R_1"}
    assert not BY_NAME["square_root_flow"].places(circuit)
    assert not any(isinstance(p, Source) for e in BY_NAME.values() for p in e.places(mass))


def test_bend_of_a_bristle_over_many_slip_lengths() -> None:
    """Against the recursion, sample by sample."""
    s = scene("mechanical")
    way = np.cumsum(np.random.default_rng(2).normal(size=400))
    past = {"d": PortHistory(way, way, moved=way)}
    effect, d = PreslidingFriction(), s.graph["d"]
    at = effect.site(replace(s, past=past), d)
    for length in (0.003, 0.4, 20.0):
        z, plain = 0.0, [0.0]
        for step in np.diff(way):
            z = np.sign(step) + (z - np.sign(step)) * np.exp(-abs(step) / length)
            plain.append(z)
        bend = effect.added(at, effect.made(at, length), {"F_c": 1.0})
        np.testing.assert_allclose(bend, plain, atol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_weight_says_on_which_side_a_contact_opens(side: float) -> None:
    """More force above a corner is less below it beside a stiffness that is free."""
    s = scene("mechanical")
    effect, lift = ContactLossEffect(), s.of(s.graph["k"]).centre
    for told in (side, -side):
        hint = Hint({"side": told, "lift": lift}, np.array([told * side]))
        spring = effect.insert(s, s.graph["k"], hint).graph["k"]
        law = spring.law if isinstance(spring, C) else None
        assert isinstance(law, ContactLoss)
        assert law.side == side


@pytest.mark.parametrize(("way", "law"), [(SEEPS, "parallel_resistor"), (HOLE, "orifice")])
def test_a_leak_says_whether_it_goes_through_a_hole(way: float, law: str) -> None:
    s = scene("hydraulic")
    made = Leakage().insert(s, s.graph["T_1"], Hint({"way": way}, np.array([1e-4])))
    assert made.law == law


def test_a_bend_about_the_middle_of_the_motion_asks_for_no_constant() -> None:
    """A cubic spring about its rest is one about any centre, less what that adds at rest."""
    s = scene("mechanical")
    k, effect = s.graph["k"], NonlinearStiffness()
    past = s.of(k)
    aside = PortHistory(past.argument + 0.4 * past.half - past.centre, past.output, past.dt)
    (bend,) = effect.signatures(replace(s, past={"k": aside}), k)
    made = np.column_stack([aside.argument, bend.columns])
    cube = (aside.argument / aside.half) ** 3
    left = cube - made @ np.linalg.lstsq(made, cube, rcond=None)[0]
    assert np.abs(left).max() < 1e-9
    # far from rest the rest says nothing, and its powers would be large
    far = PortHistory(past.argument + 30 * past.half, past.output, past.dt)
    (bend,) = effect.signatures(replace(s, past={"k": far}), k)
    assert np.abs(bend.columns).max() < 1.1
