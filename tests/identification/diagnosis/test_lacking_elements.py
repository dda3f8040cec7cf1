"""A spring, or a damper, that the model lacks altogether: the plainest thing to leave out."""

from __future__ import annotations

from base64 import b64decode
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph import GY, TF, BondGraph, C, De, Df, Dq, I, One, R, Recording, Se, Sf, Zero
from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Split
from bondgraph.support.arrays import Array
from identification import DiagnosisOptions, diagnose
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.lacking_element import LackingElement, per
from identification.diagnosis.catalogue.places import law_of, unsprung
from identification.diagnosis.catalogue.words import called
from identification.diagnosis.explanation.law_formula import meaning_of
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import PortHistory
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.lacking_plane import _hung
from identification.diagnosis.studio.law_plane import planes
from identification.diagnosis.verdict import in_words
from identification.diagnosis.verdict.document import sort_of
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate

T = np.asarray(4e-3 * np.arange(1000), np.float64)
PUSH = 5 * np.sin(2 * np.pi * (0.6 + 1.2 * T) * T) + 3 * np.sin(2 * np.pi * 0.9 * T + 1)
NOISE = 2e-6
OPTIONS = DiagnosisOptions(jobs=1, effects=1, keep=3, more=2)


def stage(*held: Element) -> BondGraph:
    with BondGraph("stage") as g:
        body = One("body")
        Se("F", unit="N") >> body
        for e in held:
            body >> e
        body >> Dq("x", unit="m")
    return g


MASS = I("m", 1.2, unit="kg")
SPRING, DAMPER = C("k", stiffness=150.0, unit="N/m"), R("d", 12.0, unit="N*s/m")
LACKING = [
    ("linear_inertia", (DAMPER, SPRING), "d", 1.2, "kg"),
    ("linear_spring", (MASS, DAMPER), "m", 150.0, "N/m"),
    ("linear_loss", (MASS, SPRING), "m", 12.0, "N*s/m"),
]


def places(name: str, graph: BondGraph) -> list[str]:
    return [e.name for e in by_name(name).places(graph)]


def test_only_where_none_is_on_the_same_flow() -> None:
    rubbing = R("d", 1.0, unit="N*s/m", law=Coulomb(1.0))
    for held, spring, loss, inertia in (
        ((MASS, SPRING, DAMPER), [], [], []), ((MASS, DAMPER), ["m"], [], []),
        ((MASS, SPRING), [], ["m"], []), ((MASS,), ["m"], ["m"], []),
        ((MASS, rubbing), ["m"], [], []), ((SPRING, DAMPER), [], [], ["d"]),
    ):  # fmt: skip
        assert places("linear_spring", stage(*held)) == spring
        assert places("linear_loss", stage(*held)) == loss
        assert places("linear_inertia", stage(*held)) == inertia


def test_what_is_behind_a_gear_counts_and_what_is_behind_a_spring_does_not() -> None:
    with BondGraph("train") as g:
        motor, load, end, between, link = (
            One("motor"), One("load"), One("end"), Zero("between"), One("link")
        )  # fmt: skip
        Se("M", unit="N*m") >> motor >> I("J", 1.0, unit="kg*m2")
        motor >> TF("gear", ratio=5.0) >> load >> R("b", 1.0, unit="N*m*s/rad")
        load >> between >> end >> I("J_2", 1.0, unit="kg*m2")
        between >> link >> C("k", stiffness=9.0, unit="N*m/rad")
        end >> Dq("phi", unit="rad")
    assert places("linear_loss", g) == ["J_2", "k"]
    assert places("linear_spring", g) == ["J", "J_2"]
    assert places("linear_inertia", g) == []
    assert per(g, g["J_2"], 1) == "N*m*s/rad"
    assert per(g, g["k"], 2) == "N*m/rad"


def test_heat_has_no_inertia_and_no_spring() -> None:
    with BondGraph("oven") as g:
        hot, flow = Zero("hot"), One("flow")
        Se("T", unit="K") >> flow >> R("R_th", 2.0, unit="K/W")
        flow >> hot >> C("C_th", 30.0, unit="J/K")
        hot >> De("T_1", unit="K")
    for name in ("linear_spring", "linear_loss", "linear_inertia"):
        assert places(name, g) == []


def test_elements_without_unit_are_what_hangs_beside_them() -> None:
    with BondGraph("circuit") as circuit:
        loop = One("loop")
        Se("U", unit="V") >> loop >> I("L", 1e-3)
        loop >> C("C_1", 1e-6, unit="F")
    assert places("linear_loss", circuit) == ["L"]
    assert places("coulomb_friction", circuit) == places("linear_spring", circuit) == []
    assert per(circuit, circuit["L"], 1) == "ohm"
    with BondGraph("flexure") as flexure:
        body = One("body")
        Se("F", unit="N") >> body >> R("d", 3.0)
        body >> C("k", stiffness=9.0, unit="N/m")
    assert places("linear_inertia", flexure) == ["d"]
    assert per(flexure, flexure["d"], 0) == "kg"


def test_an_element_that_is_declared_backwards_is_lacking_the_same() -> None:
    for backwards in (False, True):
        with BondGraph("stage") as g:
            body = One("body")
            Se("F", unit="N") >> body >> SPRING
            _ = I("m", 1.2, unit="kg") >> body if backwards else body >> MASS
            body >> Dq("x", unit="m")
        push = PUSH - PUSH[0]
        x = simulate(g, T, {"F": push}, hold="linear")["x"][:, None]
        split = Split(slice(0, T.size), slice(T.size, T.size), "all")
        data = Data("run", T, {"F": push}, x, ("x",), np.array([NOISE]), split, hold="linear")
        seen = scene(fit(Problem(g, data), max_iterations=0))
        (s,) = by_name("linear_loss").signatures(seen, g["m"])
        made = by_name("linear_loss").insert(seen, g["m"], Hint({}, np.ones(1)))
        there = made.graph.with_values({made.strengths[0]: 1e-3})
        more = simulate(there, T, {"F": push}, hold="linear")["x"] - x[:, 0]
        told = probes(seen.nominal).respond("m", s.columns)[:, 0, 0]
        assert float(np.corrcoef(more, told)[0, 1]) > 0.99


def test_friction_at_a_damper_that_is_declared_backwards() -> None:
    with BondGraph("stage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> MASS
        body >> SPRING
        R("d", 3.0, unit="N*s/m") >> body
        body >> Dq("x", unit="m")
    push = PUSH - PUSH[0]
    x = simulate(g, T, {"F": push}, hold="linear")["x"][:, None]
    split = Split(slice(0, T.size), slice(T.size, T.size), "all")
    data = Data("run", T, {"F": push}, x, ("x",), np.array([NOISE]), split, hold="linear")
    seen = scene(fit(Problem(g, data), max_iterations=0))
    drag = by_name("quadratic_drag")
    (s,) = drag.signatures(seen, g["d"])
    there = drag.insert(seen, g["d"]).graph.with_values({"c_2_d": 0.05})
    more = simulate(there, T, {"F": push}, hold="linear")["x"] - x[:, 0]
    told = probes(seen.nominal).respond("d", s.columns)[:, 0, 0]
    assert float(np.corrcoef(more, told)[0, 1]) > 0.99


def test_names_that_are_taken_stay_what_they_are() -> None:
    graph = stage(MASS, C("k", stiffness="damping_m", unit="N/m")).with_parameters(
        [Parameter("damping_m", 150.0, "N/m")]
    )
    data = Data(
        "run", T, {"F": PUSH}, np.zeros((T.size, 1)), ("x",), np.array([NOISE]),
        Split(slice(0, T.size), slice(T.size, T.size), "all"),
    )  # fmt: skip
    seen = scene(fit(Problem(graph, data), max_iterations=0))
    made = by_name("linear_loss").insert(seen, graph["m"])
    assert made.strengths == ("damping_m_",)
    assert made.graph.parameters["damping_m"].value == 150.0


def test_a_lag_of_heat_may_be_a_lump_that_the_model_lacks() -> None:
    with BondGraph("oven") as g:
        hot, loss = Zero("hot"), One("loss")
        Sf("P", unit="W") >> hot >> C("C_th", 30.0, unit="J/K")
        hot >> loss >> R("R_th", 2.0, unit="K/W")
        hot >> De("T_1", unit="K")
    split = Split(slice(0, T.size), slice(T.size, T.size), "all")
    still = np.zeros((T.size, 1))
    data = Data("run", T, {"P": PUSH}, still, ("T_1",), np.array([NOISE]), split)
    seen = scene(fit(Problem(g, data), max_iterations=0))
    said = {n: by_name(n).insert(seen, g[at]).sentence for n, at in LAGS}
    assert said["low_pass"].endswith("as a heater with heat of its own does")
    assert said["sensor_lag"].endswith("as a probe with heat of its own does")
    data = Data("run", T, {"F": PUSH}, still, ("x",), np.array([NOISE]), split)
    moved = stage(MASS, SPRING)
    seen = scene(fit(Problem(moved, data), max_iterations=0))
    assert by_name("low_pass").insert(seen, moved["F"]).sentence.endswith("first-order lag")


LAGS = (("low_pass", "P"), ("sensor_lag", "T_1"))


def test_what_is_lacking_is_begun_over_decades() -> None:
    """The way of a stage without its spring drifts: what is typical of it says little."""
    graph = stage(MASS, DAMPER)
    split = Split(slice(0, T.size), slice(T.size, T.size), "all")
    data = Data("run", T, {"F": PUSH}, np.zeros((T.size, 1)), ("x",), np.array([NOISE]), split)
    made = by_name("linear_spring").insert(scene(fit(Problem(graph, data), max_iterations=0)), MASS)
    (name,) = made.strengths
    begun = sorted(s[name] for s in made.starts)
    assert begun[-1] > 9e4 * begun[0]
    assert max(b / a for a, b in pairwise(begun)) < 11


def test_a_winding_without_inductance_may_have_one() -> None:
    with BondGraph("motor") as g:
        loop, shaft = One("loop"), One("shaft")
        Se("U", unit="V") >> loop >> R("R_w", 1.5, unit="ohm")
        loop >> GY("K", ratio=0.04, unit="N*m/A") >> shaft >> I("J", 1e-4, unit="kg*m2")
        shaft >> R("b", 5e-5, unit="N*m*s/rad")
        shaft >> Df("w", unit="rad/s")
    assert places("linear_inertia", g) == ["R_w"]
    assert per(g, g["R_w"], 0) == "H"
    assert places("linear_loss", g) == []


def lacking(effect: LackingElement, g: BondGraph, at: str, given: str, read: str) -> Candidate:
    """What an effect puts beside an element, not fitted."""
    split = Split(slice(0, T.size), slice(T.size, T.size), "all")
    y = np.asarray(simulate(g, T, {given: PUSH}, hold="linear")[read])[:, None]
    data = Data("run", T, {given: PUSH}, y, (read,), np.array([1e-3]), split)
    seen = scene(fit(Problem(g, data), max_iterations=0))
    made = effect.insert(seen, g[at])
    there: Any = SimpleNamespace(problem=SimpleNamespace(graph=made.graph), values={})
    return Candidate(made, True, there, 1.0, 1.0, np.ones(1))


def winding() -> BondGraph:
    with BondGraph("winding") as g:
        loop = One("loop")
        Se("U", unit="V") >> loop >> R("R_w", 1.5, unit="ohm")
        loop >> C("K", 1e-2, unit="F")
        loop >> Df("i", unit="A")
    return g


def test_what_is_lacking_is_called_as_its_domain_calls_it() -> None:
    """A coil that the model lacked was told as a linear inertia that opposes a flow."""
    effect = by_name("linear_inertia")
    assert isinstance(effect, LackingElement)
    of_coil = lacking(effect, winding(), "R_w", "U", "i")
    of_mass = lacking(effect, stage(DAMPER, SPRING), "d", "F", "x")
    for t, thing, flow, effort in (
        (of_coil, "inductance", "current", "voltage"), (of_mass, "mass", "velocity", "force")
    ):  # fmt: skip
        graph = t.insertion.graph
        assert called("linear_inertia", graph, t.element) == f"{thing} (linear inertia)"
        assert f" {thing} that the model lacks opposes every change of the {flow}" in (
            t.insertion.sentence
        )
        assert meaning_of(f"inertia_{t.element}", t) == f"missing {thing}"
        d: Any = SimpleNamespace(graph=graph)
        assert sort_of(t, "slow", d) == f"a {effort} in proportion to the rate of the {flow}"
    with BondGraph("bare") as bare:
        One("body") >> R("d", 1.0)
    assert called("linear_inertia", bare, "d") == "linear inertia"
    assert called("nonlinear_stiffness", winding(), "K").startswith("nonlinear capacitance (")


class Trim(LackingElement):
    """A user's own element: it is in no catalogue."""

    name = "trim"
    kind = "restoring"
    law = "trim"
    sentence = "a trim spring pulls"
    where = staticmethod(unsprung)
    word = "trim"
    over = 2

    def variable(self, past: PortHistory, element: Element) -> Array:
        return past.moved if past.moved is not None else np.zeros(past.n)

    def held(self, name: str, coefficient: str, unit: str) -> C:
        return C(name, stiffness=coefficient, unit=unit)


def test_a_users_own_lacking_element_has_a_plane() -> None:
    g = stage(MASS, DAMPER)
    t = lacking(Trim(), g, "m", "F", "x")
    assert t.insertion.sentence == "a trim spring pulls"
    d: Any = SimpleNamespace(graph=g)
    held = _hung(d, t)
    assert held is not None
    assert held.name == "lacking_m"


def test_a_rotor_without_inertia_may_have_one() -> None:
    """What is behind its gear, or at the other end of its shaft, is another flow."""
    with BondGraph("drive") as g:
        rotor, between, load, shaft = One("rotor"), Zero("between"), One("load"), One("shaft")
        Se("M", unit="N*m") >> rotor >> R("b", 5e-5, unit="N*m*s/rad")
        rotor >> TF("n", ratio=0.2) >> between >> load >> I("J", 1e-3, unit="kg*m2")
        between >> shaft >> C("k", stiffness=9.0, unit="N*m/rad")
        load >> Df("w", unit="rad/s")
    assert places("linear_inertia", g) == ["b"]


def test_what_was_inserted_joins_nothing_in_the_model_before() -> None:
    """A mass that was found is another one for a law between two; the probed model has it not."""
    graph = chain_of_two()
    push = PUSH - PUSH[0]
    data = Data(
        "run", T, {"F": push}, np.zeros((T.size, 1)), ("x",), np.array([NOISE]),
        Split(slice(0, T.size), slice(T.size, T.size), "all"), hold="linear",
    )  # fmt: skip
    seen = scene(fit(Problem(graph, data), max_iterations=0))
    repaired = by_name("linear_inertia").insert(seen, graph["d_2"]).graph
    later = scene(fit(Problem(repaired, data), max_iterations=0))
    found = screen(later, probes(later.nominal, graph), (by_name("cross_coupling"),))
    assert [s.element.name for s in found] == []


def chain_of_two() -> BondGraph:
    """Two bodies on a spring, the far one without its mass."""
    with BondGraph("chain") as g:
        near, far, link, between = One("near"), One("far"), One("link"), Zero("between")
        Se("F", unit="N") >> near >> MASS
        near >> DAMPER
        near >> between >> link >> SPRING
        between >> TF("lever", ratio=1.0) >> far >> R("d_2", 3.0, unit="N*s/m")
        near >> Dq("x", unit="m")
    return g


@pytest.mark.parametrize(("name", "held", "at", "value", "unit"), LACKING)
def test_the_signature_is_what_the_element_does(
    name: str, held: tuple[Element, ...], at: str, value: float, unit: str
) -> None:
    """What is inserted with a small coefficient moves the readings as its column says."""
    graph, effect = stage(*held), by_name(name)
    push = PUSH - PUSH[0]  # at rest at first, with the element and without
    x = simulate(graph, T, {"F": push}, hold="linear")["x"][:, None]
    split = Split(slice(0, T.size), slice(T.size, T.size), "all")
    data = Data("run", T, {"F": push}, x, ("x",), np.array([NOISE]), split)
    seen = scene(fit(Problem(graph, data), max_iterations=0))
    (s,) = effect.signatures(seen, graph[at])
    made = effect.insert(seen, graph[at], Hint({}, np.ones(1)))
    (strength,) = made.strengths
    assert made.graph.parameters[strength].unit == unit
    small = 1e-4 * float(np.abs(PUSH).max() / np.abs(s.columns).max())
    there = made.graph.with_values({strength: small})
    more = simulate(there, T, {"F": push}, hold="linear")["x"] - x[:, 0]
    pushed = push - small * s.columns[:, 0]
    said = simulate(graph, T, {"F": pushed}, hold="linear")["x"] - x[:, 0]
    moving = slice(200, None)  # where the start, which an inertia rounds, has died away
    assert np.abs(more - said)[moving].max() < 0.03 * np.abs(more[moving]).max()


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(("name", "held", "at", "value", "unit"), LACKING)
def test_it_is_named_with_its_value(
    name: str, held: tuple[Element, ...], at: str, value: float, unit: str
) -> None:
    x = simulate(stage(MASS, SPRING, DAMPER), T, {"F": PUSH}, hold="linear")["x"]
    x = x + NOISE * np.random.default_rng(7).standard_normal(T.size)
    run = Recording.from_arrays("run", {"t[s]": T, "F[N]": PUSH, "x[m]": x})
    found = diagnose(stage(*held), run, hold="linear", options=OPTIONS)
    (step,) = found.findings
    assert step.chosen is not None
    assert step.chosen.label == f"{name} at {at}"
    assert found.repaired is not None
    (e,) = (e for e in found.repaired.estimates if e.name in step.chosen.insertion.strengths)
    assert e.value == pytest.approx(value, rel=2e-3)
    assert e.ci95[0] - 1e-3 * value < value < e.ci95[1] + 1e-3 * value
    plane = planes(found)["of"][at]
    (law,) = plane["laws"]
    assert law["label"] == name.replace("_", " ")
    x, y, along, told = (
        np.frombuffer(b64decode(v), "<f4") for v in (plane["x"], plane["y"], law["x"], law["y"])
    )
    # what must act there, no law assumed, lies on the line of the law but at the ends of the record
    assert np.median(np.abs(y - np.interp(x, along, told))) < 0.02 * np.ptp(told)


def drive(at_load: R | None = None) -> BondGraph:
    """A motor that turns a load over a shaft; only the motor's bearing is in the model."""
    with BondGraph("drive") as g:
        motor, load, between, shaft = One("motor"), One("load"), Zero("between"), One("shaft")
        Se("M", unit="N*m") >> motor >> I("J_m", 3e-4, unit="kg*m2")
        motor >> R("b_m", 8e-4, unit="N*m*s/rad")
        motor >> between >> load >> I("J_l", 1.2e-3, unit="kg*m2")
        if at_load is not None:
            load >> at_load
        between >> shaft >> C("k_s", stiffness=40.0, unit="N*m/rad")
        shaft >> R("d_s", 0.012, unit="N*m*s/rad")
        motor >> Df("w_m", unit="rad/s")
        load >> Df("w_l", unit="rad/s")
    return g


@pytest.mark.long
def test_friction_where_the_model_has_no_damper() -> None:
    """It was told at the damper that the model has."""
    rubs = R("b_l", 1e-6, unit="N*m*s/rad", law=Coulomb(0.06, unit="N*m"))
    torque = 0.04 * PUSH
    seen = simulate(drive(rubs), T, {"M": torque}, hold="linear")
    read = {f"{n}[rad/s]": seen[n] + 0.1 * np.random.default_rng(7 + k).standard_normal(T.size)
            for k, n in enumerate(("w_m", "w_l"))}  # fmt: skip
    run = Recording.from_arrays("run", {"t[s]": T, "M[N*m]": torque, **read})
    found = diagnose(drive(), run, hold="linear", options=OPTIONS)
    (step,) = found.findings
    assert step.chosen is not None
    assert step.chosen.label == "coulomb_friction at J_l"
    assert found.repaired is not None
    assert found.repaired.values["F_c_d_J_l"] == pytest.approx(0.06, rel=0.01)
    assert "a force of constant size" in in_words(found)


def test_a_damper_that_friction_brings_takes_no_name_of_another() -> None:
    graph = drive(None).with_branch("load", [C("d_J_l", stiffness=1.0, unit="N*m/rad")])
    data = Data(
        "run", T, {"M": PUSH}, np.zeros((T.size, 2)), ("w_m", "w_l"), np.full(2, 0.1),
        Split(slice(0, T.size), slice(T.size, T.size), "all"),
    )  # fmt: skip
    seen = scene(fit(Problem(graph, data), max_iterations=0))
    made = by_name("coulomb_friction").insert(seen, graph["J_l"])
    assert made.strengths == ("F_c_d_J_l_",)
    assert isinstance(law_of(made.graph["d_J_l_"]), Coulomb)
