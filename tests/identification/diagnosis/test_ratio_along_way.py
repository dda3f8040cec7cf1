"""A ratio that changes along the way: what counts the way, what is said of the law."""

from __future__ import annotations

from base64 import b64decode
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph import GY, MGY, BondGraph, C, Df, Dq, I, One, R, Se, displacement
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.places import store_of_way
from identification.diagnosis.catalogue.transduction.nonlinear_ratio import (
    BY_FLOW,
    BY_WAY,
    NonlinearRatio,
)
from identification.diagnosis.explanation.law_formula import in_symbols, meaning_of
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.law_plane import planes
from identification.diagnosis.verdict.document import law_constants
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate

N, DT = 600, 2e-3
WITH_FLAW = 7.0 * (1 + 5 * displacement("k") - 200 * displacement("k") ** 2)
LAW = (
    "ratio of Bl = Bl*(a_1_Bl*({0} - centre_Bl)/span_Bl + a_2_Bl*({0} - centre_Bl)^2/span_Bl^2 + 1)"
)


WIDTH, TOP = 0.03, 0.006
BELL = 7.0 / (1 + ((displacement("k") - TOP) / WIDTH) ** 2)


def stage(spring: str = "at the stage", flawed: object = None) -> BondGraph:
    """A voice coil moves a stage; its spring may hang the other way round, farther or nowhere."""
    with BondGraph("stage") as g:
        coil, body = One("coil"), One("body")
        Se("u", unit="V") >> coil >> R("R_c", 2.0, unit="ohm")
        coil >> I("L_c", 2e-3, unit="H")
        coil >> Df("i", unit="A")
        two_port = MGY("Bl", flawed, unit="N/A") if flawed else GY("Bl", 7.0, unit="N/A")
        coil >> two_port >> body >> I("m", 0.3, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        if spring == "at the stage":
            body >> C("k", stiffness=900.0, unit="N/m")
        elif spring == "turned":
            C("k", stiffness=900.0, unit="N/m") >> body
        elif spring == "farther":
            body >> One("frame") >> C("k", stiffness=900.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


@pytest.fixture(scope="module")
def data() -> Data:
    return recorded(WITH_FLAW)


def recorded(ratio: object) -> Data:
    t = np.asarray(DT * np.arange(N))
    u = 5 * np.sin(2 * np.pi * 3 * t) + 4 * np.sin(2 * np.pi * 8.3 * t)
    run = simulate(stage(flawed=ratio), t, {"u": u})
    floor = np.array([1e-3, 1e-5])
    noise = floor * np.random.default_rng(0).standard_normal((N, 2))
    y = np.stack([run["i"], run["x"]], axis=1) + noise
    return Data("run", t, {"u": u}, y, ("i", "x"), floor, interleaved(0, N), floor_measured=True)


def seen(g: BondGraph, data: Data) -> FittedModel:
    return scene(fit(Problem(g, data), max_iterations=3))


def unpacked(text: str) -> Any:
    return np.frombuffer(b64decode(text), "<f4").astype(float)


def said_of(made: Any) -> Candidate:
    held: Any = SimpleNamespace(problem=SimpleNamespace(graph=made.graph))
    return Candidate(made, True, held, 1.0, 1.0, np.ones(1))


@pytest.mark.parametrize("spring", ["at the stage", "turned", "farther"])
def test_the_spring_of_the_side_that_moves_tells_the_way(spring: str, data: Data) -> None:
    looked, effect = seen(stage(spring), data), NonlinearRatio()
    bent = Hint({"by": BY_WAY}, np.array([0.1, -0.1]))
    made = effect.insert(looked, looked.graph["Bl"], bent)
    assert "counter_Bl" not in made.graph.elements
    turned = -1 if spring == "turned" else 1
    assert dict(made.starts[0]) == {"a_1_Bl": turned * 0.1, "a_2_Bl": -0.1}
    values = {n: v for n, v in looked.nominal.values.items() if n in made.graph.parameters}
    found = fit(Problem(made.graph, data, starts={**values, **made.starts[0]}))
    assert found.chi2("train") < 1.3
    own = {e.name: e for e in found.estimates}
    for name in ("Bl", "a_1_Bl", "a_2_Bl"):  # each by itself, not only together
        assert own[name].ci95[1] - own[name].ci95[0] < 0.1 * abs(own[name].value)
    centre, span = (made.graph.parameters[f"{n}_Bl"].value for n in ("centre", "span"))
    way = np.linspace(-0.02, 0.02, 9)
    z = (turned * way - centre) / span
    ratio = own["Bl"].value * (1 + own["a_1_Bl"].value * z + own["a_2_Bl"].value * z**2)
    np.testing.assert_allclose(ratio, 7.0 * (1 + 5 * way - 200 * way**2), rtol=5e-3)


@pytest.mark.parametrize(
    ("spring", "by", "signal", "words", "unit"),
    [
        ("at the stage", BY_WAY, "q_k", "position of k", "m"),
        ("nowhere", BY_WAY, "q_counter_Bl", "position counted at way_Bl", "m"),
        ("at the stage", BY_FLOW, "f_current_Bl", "current at current_Bl", "A"),
    ],
)
def test_the_law_is_a_formula_with_all_its_numbers(
    spring: str, by: float, signal: str, words: str, unit: str, data: Data
) -> None:
    looked = seen(stage(spring), data)
    hint = Hint({"by": by}, np.array([0.1, -0.1]))
    made = NonlinearRatio().insert(looked, looked.graph["Bl"], hint)
    assert made.graph.check() == ()
    trial = said_of(made)
    assert in_symbols(trial) == f"{LAW.format(signal)}, where {signal} is the {words}"
    d: Any = SimpleNamespace(repaired=None, graph=looked.graph)
    constants = law_constants(trial, d)
    assert [(p.name, p.unit) for p in constants] == [("centre_Bl", unit), ("span_Bl", unit)]
    assert all(meaning_of(p.name, trial) for p in constants)


def test_friction_along_the_way_reads_a_store_behind_a_junction(data: Data) -> None:
    looked = seen(stage("farther"), data)
    forms = by_name("coulomb_friction").forms(looked, looked.graph["d"], {})
    (along,) = (f for f in forms if f.law == "coulomb_along_way")
    held: Any = along.graph["d"]
    assert held.law.watched == "q_k"
    assert set(along.graph.elements) == set(looked.graph.elements)


def test_the_plane_of_a_ratio_is_drawn_over_the_way(data: Data) -> None:
    looked = seen(stage(), data)
    made = NonlinearRatio().insert(looked, looked.graph["Bl"])
    values = {"Bl": 6.0, "a_1_Bl": 0.1, "a_2_Bl": -0.2}
    held: Any = SimpleNamespace(problem=SimpleNamespace(graph=made.graph), values=values)
    t = Candidate(made, True, held, 1.0, 1.0, np.ones(1))
    found: Any = [SimpleNamespace(chosen=t, possible=(), same_place=())]
    d: Any = SimpleNamespace(
        repaired=None, scene=looked, findings=found, data=data, graph=looked.graph, steps=[],
        trials=[], recording=SimpleNamespace(read_in={}),
    )  # fmt: skip
    plane = planes(d)["of"]["Bl"]
    assert (plane["xLabel"], plane["yLabel"]) == ("position of k (mm)", "ratio of Bl (N/A)")
    (law,) = plane["laws"]
    x, y = unpacked(law["x"]), unpacked(law["y"])
    centre, span = (made.graph.parameters[f"{n}_Bl"].value for n in ("centre", "span"))
    z = (1e-3 * x - centre) / span
    np.testing.assert_allclose([z[0], z[-1]], [-1, 1], atol=1e-4)
    np.testing.assert_allclose(y, 6.0 * (1 + 0.1 * z - 0.2 * z**2), rtol=1e-4)
    level = unpacked(plane["nominal"]["y"])
    np.testing.assert_allclose(level, looked.nominal.values["Bl"], rtol=1e-4)
    # points tell the ratio that the plant has, not the one of the law that is drawn; their level
    # is that of the law
    way, ratio = 1e-3 * unpacked(plane["x"]), unpacked(plane["y"])
    told = np.isfinite(ratio)
    assert told.mean() > 0.5
    true = 7.0 * (1 + 5 * way[told] - 200 * way[told] ** 2)
    off = ratio[told] - true
    assert np.std(off) < 0.2 * np.std(true)
    z = (way[told] - centre) / span
    assert np.mean(ratio[told] - 6.0 * (1 + 0.1 * z - 0.2 * z**2)) == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("spring", "by", "over"),
    [("nowhere", BY_WAY, "position counted"), ("at the stage", BY_FLOW, "current at current_Bl")],
)
def test_points_of_a_ratio_lie_over_what_it_changes_with(
    spring: str, by: float, over: str, data: Data
) -> None:
    looked = seen(stage(spring), data)
    hint = Hint({"by": by}, np.array([0.1, -0.1]))
    made = NonlinearRatio().insert(looked, looked.graph["Bl"], hint)
    values = {"Bl": 6.0, "a_1_Bl": 0.1, "a_2_Bl": -0.2}
    held: Any = SimpleNamespace(problem=SimpleNamespace(graph=made.graph), values=values)
    t = Candidate(made, True, held, 1.0, 1.0, np.ones(1))
    found: Any = [SimpleNamespace(chosen=t, possible=(), same_place=())]
    d: Any = SimpleNamespace(
        repaired=None, scene=looked, findings=found, data=data, graph=looked.graph, steps=[],
        trials=[], recording=SimpleNamespace(read_in={}),
    )  # fmt: skip
    plane = planes(d)["of"]["Bl"]
    assert plane["xLabel"].startswith(over)
    x, (low, *_, high) = unpacked(plane["x"]), unpacked(plane["laws"][0]["x"])
    x = x[np.isfinite(x)]
    assert x.size > 50
    reach = high - low
    assert low - 0.05 * reach < x.min() < x.max() < high + 0.05 * reach


def test_a_store_of_another_flow_does_not_hold_the_way() -> None:
    assert store_of_way(stage("farther"), "body") == "k"
    assert store_of_way(stage("farther"), "coil") == ""
    assert store_of_way(stage("farther"), "m") == ""


def test_a_bell_is_followed_where_a_series_is_not_enough() -> None:
    """As of the force factor of a loudspeaker whose coil leaves the gap."""
    data = recorded(BELL)
    looked, effect = seen(stage(), data), NonlinearRatio()
    made = effect.insert(looked, looked.graph["Bl"], Hint({"by": BY_WAY}, np.array([0.0, -0.3])))
    known = {n: v for n, v in looked.nominal.values.items() if n in made.graph.parameters}
    series = fit(Problem(made.graph, data, starts={**known, **made.starts[0]}))
    assert series.chi2("test") > 10
    bell, freer = effect.forms(looked, looked.graph["Bl"], {effect.name: series.values})
    assert (bell.law, bell.form, bell.graph.check()) == ("bell_shaped_ratio", True, ())
    assert set(freer.graph.parameters) - set(bell.graph.parameters) == {"fall_Bl"}
    found = fit(Problem(bell.graph, data, starts=bell.starts[0], n_sub=4))
    assert found.chi2("test") < 1.3
    own = {e.name: e for e in found.estimates}
    centre, span = (bell.graph.parameters[f"{n}_Bl"].value for n in ("centre", "span"))
    for name, truth in {"Bl": 7.0, "bend_Bl": (span / WIDTH) ** 2, "top_Bl": TOP - centre}.items():
        low, high = own[name].ci95
        assert low < truth < high, name
    assert in_symbols(said_of(bell)).endswith("where q_k is the position of k")


@pytest.mark.parametrize("ended", [{}, {"a_1_Bl": 0.1, "a_2_Bl": 0.3, "span_Bl": 0.02}])
def test_what_does_not_fall_to_both_sides_is_no_bell(ended: dict[str, float], data: Data) -> None:
    looked, effect = seen(stage(), data), NonlinearRatio()
    assert effect.forms(looked, looked.graph["Bl"], {effect.name: ended}) == ()
    by_current = Hint({"by": BY_FLOW}, np.array([0.0, -0.1]))
    made = effect.insert(looked, looked.graph["Bl"], by_current)
    held = {n: p.value for n, p in made.graph.parameters.items()} | dict(made.starts[0])
    assert effect.forms(looked, looked.graph["Bl"], {effect.name: held}) == ()
