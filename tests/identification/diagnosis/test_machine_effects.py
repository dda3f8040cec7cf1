"""Magnets, saturating iron, radiation, and noise that grows: found, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import GY, BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.laws import Law, Radiation, SaturatingInductance
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.flow.nonlinear_resistance import NonlinearResistanceEffect
from identification.diagnosis.catalogue.restoring.nonlinear_stiffness import NonlinearStiffness
from identification.diagnosis.catalogue.storage.added_mode import AddedMode
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.estimation.estimate import estimate
from identification.study.study import Study
from tests.identification.diagnosis.effect_plants import response, scene
from tests.settled import simulate
from tests.spring import spring


def coil(law: Law | None = None) -> BondGraph:
    with BondGraph("coil") as g:
        loop = One("loop")
        Se("V", unit="V") >> loop >> R("R_w", 1.0, unit="ohm")
        loop >> I("L", 0.05, unit="H", law=law)
        loop >> Df("i", unit="A")
    return g


def heater(law: Law | None = None) -> BondGraph:
    with BondGraph("heater") as g:
        body = Zero("body")
        Sf("Q", unit="W") >> body >> C("C_h", 20.0, unit="J/K")
        body >> R("R_h", 8.0, unit="K/W", law=law)
        body >> De("T", unit="K")
    return g


def tones(t: np.ndarray, low: float, high: float, seed: int) -> np.ndarray:
    rng, f = np.random.default_rng(seed), np.geomspace(low, high, 12)
    waves = np.sin(2 * np.pi * np.outer(t, f) + rng.uniform(0, 2 * np.pi, f.size))
    return np.asarray(waves.sum(axis=1) / np.sqrt(6.0))


def recorded(g: BondGraph, t: np.ndarray, u: np.ndarray, share: float = 0.0) -> Recording:
    (source,) = [n for n in ("F", "V", "Q") if n in g.elements]
    (sensor,) = [n for n in ("x", "i", "T") if n in g.elements]
    y = simulate(g, t, {source: u})[sensor]
    noise = np.random.default_rng(5).standard_normal(t.size) * np.hypot(2e-3 * y.std(), share * y)
    units = {n: g[n].unit for n in (source, sensor)}  # type: ignore[attr-defined]
    return Recording("run", t, {source: u, sensor: y + noise}, units)


def diagnosed(g: BondGraph, r: Recording) -> Diagnosis:
    return diagnose(g, r, options=DiagnosisOptions(jobs=1, keep=4, more=2))


SLOW = 0.01 * np.arange(2000)
FAST = 1e-3 * np.arange(1500)
LONG = np.asarray(2.0 * np.arange(1500), np.float64)
HEAT = np.repeat(np.random.default_rng(3).uniform(0, 20, 15), 100)
CONCEALED = [
    (coil(), coil(SaturatingInductance(60.0, 0.12)),
     FAST, 6.0 * tones(FAST, 1.0, 20.0, 2), "nonlinear_stiffness at L", "saturating_inductance",
     {"c_s_L": 60.0, "p_s_L": 0.12}),
    pytest.param(
        heater(), heater(Radiation(0.7, 293.15, "R_h", 8.0)),
        LONG, HEAT, "nonlinear_resistance at R_h", "radiation", {"radiates_R_h": 0.7},
        marks=pytest.mark.long,
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("model", "plant", "t", "u", "label", "law", "truth"), CONCEALED, ids=lambda v: str(v)[:20]
)
def test_what_was_concealed_is_found_by_its_own_law(
    model: BondGraph,
    plant: BondGraph,
    t: np.ndarray,
    u: np.ndarray,
    label: str,
    law: str,
    truth: dict[str, float],
) -> None:
    d = diagnosed(model, recorded(plant, t, u))
    named = d.findings[0].chosen
    assert d.kind == "missing_physics"
    assert named is not None
    assert (named.label, named.insertion.law) == (label, law)
    assert named.insertion.sentence
    for n, value in truth.items():
        assert named.fit.values[n] == pytest.approx(value, rel=0.05)
    assert d.left is not None
    assert d.left.most < 1.3


def voice_coil() -> BondGraph:
    with BondGraph("voice coil") as g:
        loop, stage = One("loop"), One("stage")
        Se("V", unit="V") >> loop >> R("R_w", 2.2, unit="ohm")
        loop >> I("L", 1.1e-3, unit="H")
        loop >> Df("i", unit="A")
        loop >> GY("Bl", 8.0, unit="N/A") >> stage >> I("m", 0.35, unit="kg")
        stage >> R("d", 3.0, unit="N*s/m")
        stage >> C("k", stiffness=1500.0, unit="N/m")
        stage >> Dq("x", unit="m")
    return g


@pytest.mark.long
def test_a_shunted_part_of_a_coil_is_no_distortion_of_the_command() -> None:
    """By equations of its own: current, velocity, position and the current of the shunted part."""
    from scipy.signal import cont2discrete

    r, coil_l, bl, m, d, k, shunt, part = 2.35, 1.3e-3, 7.4, 0.38, 3.6, 1620.0, 3.0, 0.9e-3
    a = np.array([
        [-(r + shunt) / coil_l, -bl / coil_l, 0.0, shunt / coil_l],
        [bl / m, -d / m, -k / m, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [shunt / part, 0.0, 0.0, -shunt / part],
    ])  # fmt: skip
    b = np.array([[1.0 / coil_l], [0.0], [0.0], [0.0]])
    t, rng = np.asarray(5e-4 * np.arange(4000), np.float64), np.random.default_rng(7)
    f = np.geomspace(0.5, 120.0, 40)
    waves = np.cos(2 * np.pi * np.outer(t, f) + rng.uniform(0, 2 * np.pi, f.size)) / (1 + f / 15)
    u = 4.0 * waves.sum(axis=1) * (t > 0.2)
    step, drive, *_ = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), 5e-4)
    z = np.zeros((t.size, 4))
    for n in range(t.size - 1):
        z[n + 1] = step @ z[n] + drive[:, 0] * u[n]
    noise = rng.standard_normal((t.size, 2)) * (4e-3, 3e-7)
    y = z[:, [0, 2]] + noise
    run = Recording("run", t, {"V": u, "i": y[:, 0], "x": y[:, 1]}, {"V": "V", "i": "A", "x": "m"})
    options = DiagnosisOptions(jobs=1, keep=4, more=2, effects=1, holds=("hold",))
    found = diagnose(voice_coil(), run, options=options)
    named = found.findings[0].chosen
    assert named is not None
    assert named.label == "eddy_current_loss at L"
    values = named.fit.values
    assert values["eddy_L"] == pytest.approx(part / coil_l, rel=0.3)
    assert values["tau_eddy_L"] == pytest.approx(part / shunt, rel=0.2)
    assert values["L"] * (1 + values["eddy_L"]) == pytest.approx(coil_l + part, rel=0.01)
    assert found.left is not None
    assert found.left.most < 1.2


def test_radiation_lies_beside_conduction() -> None:
    """By Stefan's and Boltzmann's equation: the share is that of the flow, not of a resistance."""
    from scipy.integrate import solve_ivp

    capacity, conducts, room = 20.0, 0.05, 293.15
    b = 0.08 / (4 * room**3)

    def warming(at: float, e: np.ndarray) -> np.ndarray:
        lost = conducts * e + b * ((room + e) ** 4 - room**4)
        return np.asarray((HEAT[int(at / 2.0)] - lost) / capacity)

    e, told = np.zeros(1), []
    for at in LONG:
        told.append(float(e[0]))
        e = solve_ivp(lambda _, e, at=at: warming(at, e), (0.0, 2.0), e, rtol=1e-8).y[:, -1]
    noise = 0.02 * np.random.default_rng(5).standard_normal(LONG.size)
    run = Recording("run", LONG, {"Q": HEAT, "T": np.array(told) + noise}, {"Q": "W", "T": "K"})
    got = estimate(Study(heater(Radiation(0.3, room, "R_h", 8.0)), [run]))
    assert got.values["radiates_R_h"] == pytest.approx(0.08 / 0.13, rel=0.02)
    assert got.values["R_h"] == pytest.approx(1.0 / 0.13, rel=0.01)


def test_noise_that_grows_is_told_and_nothing_is_named() -> None:
    r = recorded(spring(), SLOW, 3.0 * tones(SLOW, 0.2, 5.0, 1), share=0.08)
    d = diagnosed(spring(), r)
    assert d.kind in ("explained", "parameters_only")
    assert any("the noise of x grows with the reading" in note for note in d.notes)
    assert d.left is not None
    assert "which grows with the reading" in d.left.words


def test_intervals_are_robust_where_noise_grows() -> None:
    r = recorded(spring(), SLOW[:1000], 3.0 * tones(SLOW, 0.2, 5.0, 1)[:1000], share=0.08)
    notes = estimate(Study(spring(), [r])).notes
    assert any("grows with the reading" in n and "robust" in n for n in notes)


def test_a_magnet_is_tried_where_the_series_bends_as_one_does() -> None:
    s = scene("mechanical")
    k, past = s.graph["k"], s.of(s.graph["k"])
    z = (past.argument - past.centre) / past.half
    gap = -(past.centre + 1.6 * past.half)  # beyond the upper end
    u = past.argument / gap
    powers = np.stack([np.ones_like(z), z, z**2, z**3], axis=1)
    weights = np.linalg.lstsq(powers, (1.0 + u) ** -2, rcond=None)[0][2:]
    ended = {"nonlinear_stiffness": {"k": 31.0, "a_2_k": weights[0], "a_3_k": weights[1]}}
    (made,) = NonlinearStiffness().forms(s, k, ended)
    assert (made.law, made.form, made.effect) == ("magnet", True, "nonlinear_stiffness")
    assert made.starts[0]["k"] == 31.0
    assert np.sign(made.starts[0]["gap_k"]) == np.sign(gap)
    quiet = response(s.graph, "mechanical", {})
    absent = response(made.graph, "mechanical", {"F_g_k": 0.0, "gap_k": gap})
    np.testing.assert_allclose(absent, quiet, atol=1e-9)
    # a plain cubic spring bends in both directions alike, which is no magnet's
    assert NonlinearStiffness().forms(s, k, {"nonlinear_stiffness": {"a_3_k": 1.0}}) == ()
    assert NonlinearStiffness().forms(s, k, {}) == ()


def radiator(weights: tuple[float, float]) -> str:
    g = heater()
    flow = 10.0 + 10.0 * np.sin(0.1 * np.arange(500))
    past = {"R_h": PortHistory(flow, 8.0 * flow)}
    nothing: object = None
    s = FittedModel(g, nothing, nothing, np.zeros((0, 1)), past)  # type: ignore[arg-type]
    return NonlinearResistanceEffect().insert(s, g["R_h"], Hint({}, np.array(weights))).law


def test_only_what_bends_as_radiation_does_is_tried_as_such() -> None:
    assert radiator((-44.0, 13.0)) == "radiation"
    assert radiator((44.0, -13.0)) == "cubic_characteristic"  # heat that holds itself back
    assert radiator((0.0, 20.0)) == "cubic_characteristic"
    assert radiator((-400.0, 100.0)) == "cubic_characteristic"  # more than a black body


def test_radiation_far_above_the_room_is_begun_as_such_and_not_as_a_curve_alone() -> None:
    """A plate 500 K above the room: no cubic fits it, and none may stand for radiation."""
    g = heater()
    rise = 250.0 + 250.0 * np.sin(0.1 * np.arange(500))
    room, share, cold = 293.15, 0.2, 0.9
    flow = (1.0 - share) * rise + share * ((room + rise) ** 4 - room**4) / (4.0 * room**3)
    flow /= cold
    slope = float(flow @ rise / (flow @ flow))  # what a linear resistor takes for it
    past = {"R_h": PortHistory(flow, slope * flow)}
    nothing: object = None
    s = FittedModel(g, nothing, nothing, np.zeros((0, 1)), past)  # type: ignore[arg-type]
    effect = NonlinearResistanceEffect()
    columns = {c.course: c for c in effect.signatures(s, g["R_h"])}
    assert set(columns) == {"", "radiates"}
    missing = rise - slope * flow
    line = np.stack([np.ones_like(flow), flow], axis=1)
    shapes = [c for c in effect.signatures(s, g["R_h"]) if c.course]
    best = min(shapes, key=lambda c: _left(np.hstack([line, c.columns]), missing))
    assert _left(np.hstack([line, best.columns]), missing) < 0.1 * _left(line, missing)
    assert best.shape is not None
    made = effect.insert(s, g["R_h"], Hint(best.shape, np.array([0.2])))
    assert made.law == "radiation"
    assert made.starts[0]["radiates_R_h"] == 0.2
    assert 0.3 * cold < made.starts[0]["R_h"] < 3.0 * cold


def _left(columns: np.ndarray, values: np.ndarray) -> float:
    weights = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.linalg.norm(values - columns @ weights))


def test_what_is_damped_beyond_critical_is_no_resonance() -> None:
    s = scene("mechanical")
    made = AddedMode().insert(s, s.graph["m"])
    values = {p.name: p.value for p in made.graph.parameters.values()}
    assert made.is_itself(values)
    assert not made.is_itself({**values, "zeta_m": 1.2})


def test_coils_are_inductors_only() -> None:
    with BondGraph("both") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
    assert not NonlinearStiffness().places(g)
    assert [e.name for e in NonlinearStiffness().places(coil())] == ["L"]


def test_the_branch_of_eddy_currents_is_electrical_to_what_comes_after() -> None:
    """Without units a next round would have looked for friction in it."""
    seen = scene("coil")
    declared = seen.graph
    made = by_name("eddy_current_loss").insert(seen, declared["L"]).graph
    new = made.elements.keys() - declared.elements.keys()
    there = [made[n] for n in new]
    mechanical = [
        c.name for c in CATALOGUE
        if c.family == "friction" or c.name == "added_mode"
        for e in c.places(made) if e in there
    ]  # fmt: skip
    assert {"I_eddy_L", "R_eddy_L"} <= new
    assert mechanical == []
