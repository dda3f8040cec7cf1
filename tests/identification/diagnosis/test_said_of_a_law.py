"""What is said of a found law: units, numbers that no fit moved, its whole, why it may be zero."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se, Sf, Zero
from bondgraph.graph.elements import Element
from bondgraph.laws import (
    Law,
    Onset,
    Overflow,
    Parametrised,
    Polynomial,
    Push,
    SaturatingInductance,
    StopSum,
    Tone,
)
from bondgraph.signals.recording import Split
from bondgraph.support.errors import UnusableInput
from identification.datasets.opening import match_by_unit
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.words import called
from identification.diagnosis.explanation.law_formula import (
    in_numbers,
    in_symbols,
    meaning_of,
    own_value,
)
from identification.diagnosis.explanation.notes import notes_on_size, taken_over
from identification.diagnosis.localisation.recording.variables import (
    displacement_words,
    restoring_words,
)
from identification.diagnosis.report.changed import definition, whole_law
from identification.diagnosis.screening.mixups import moved
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.verdict.document import law_constants
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import scene
from tests.identification.diagnosis.test_explain import finding, verdict
from tests.settled import simulate
from tests.spring import spring

PLACES = {"mechanical": ("k", "N", "m"), "electrical": ("C_1", "V", "C")}
PLACES["hydraulic"] = ("T_1", "Pa", "m^3")


def series() -> Parametrised:
    return Parametrised(Polynomial(1e-3, 2e-3, unit="N"), ("centre", "half"), ("m", "m"))


def trial(graph: BondGraph, element: str, effect: str = "nonlinear_stiffness") -> Any:
    """A candidate as far as its words are asked."""
    made = SimpleNamespace(form=False, law="polynomial", strengths=(f"a_3_{element}",))
    held = SimpleNamespace(problem=SimpleNamespace(graph=graph))
    return SimpleNamespace(fit=held, element=element, effect=effect, insertion=made)


@pytest.mark.parametrize("plant", PLACES)
@pytest.mark.parametrize("effect", ["nonlinear_stiffness", "hysteresis", "unknown"])
def test_a_law_has_the_units_of_its_place(plant: str, effect: str) -> None:
    name, effort, way = PLACES[plant]
    seen = scene(plant)
    made = by_name(effect).insert(seen, seen.graph[name])
    assert made.graph.check() == ()
    declared = [p for n, p in made.graph.parameters.items() if n not in seen.graph.parameters]
    assert {p.unit for p in declared if p.fixed} == {way}
    if effect != "hysteresis":
        assert {p.unit for p in declared if not p.fixed} == {effort}


def test_a_drag_has_the_unit_of_its_domain() -> None:
    e = R("b", 0.1, unit="N*m*s/rad")
    with BondGraph("wheel") as g:
        shaft = One("shaft")
        Se("M", unit="N*m") >> shaft >> I("J", 1.0, unit="kg*m^2")
        shaft >> e
    seen: Any = SimpleNamespace(graph=g, of=lambda _: scene("mechanical").past["d"])
    made = by_name("quadratic_drag").insert(seen, e)
    assert made.graph.check() == ()
    assert made.graph.parameters["c_2_b"].unit == "N*m*s2/rad2"


def test_lifted_fields_have_a_unit_each_or_none() -> None:
    with pytest.raises(UnusableInput, match="1 fields are lifted, 2 units are given"):
        Parametrised(StopSum((1e-3, 2e-3)), ("thresholds",), ("m", "m"))
    lifted = Parametrised(StopSum((1e-3, 2e-3)), ("thresholds",))
    assert [p.unit for p in lifted.parameters("k") if p.fixed] == ["1", "1"]
    told = Parametrised(StopSum((1e-3, 2e-3)), ("thresholds",), ("m",))
    assert told.structure == lifted.structure  # one kernel serves both


def test_numbers_that_no_fit_moved_are_given() -> None:
    d: Any = SimpleNamespace(repaired=None, graph=spring())
    found = law_constants(trial(spring(law=series()), "k"), d)
    assert [(p.name, p.value, p.unit) for p in found] == [
        ("centre_1_k", 1e-3, "m"), ("half_1_k", 2e-3, "m"),
    ]  # fmt: skip
    given = [{"name": p.name, "value": p.value, "unit": p.unit} for p in found]
    v = parse_verdict(json.dumps(verdict("missing_physics", finding(constants=given))))
    said = " ".join(retold(v).split())
    assert "Of its law, not fitted: centre_1_k = 0.001 m; half_1_k = 0.002 m." in said


def test_what_the_elements_own_value_means_is_said() -> None:
    spring_with = spring().with_element("k", law=series())
    assert own_value(trial(spring_with, "k")).startswith("k itself is the value in the middle of")
    assert own_value(trial(spring(), "k")) == ""
    d = "what this term adds at the end of the range, where (argument - centre)/half is 1; "
    assert meaning_of("a_3_k", trial(spring_with, "k")) == d + "about the centre, not about zero"


def test_a_capacitor_has_no_stiffness_in_the_headline() -> None:
    with BondGraph("stores") as g:
        One("loop") >> C("C_x", 1e-6, unit="F")
        One("body") >> C("k", stiffness=1.0, unit="N/m")
    said = [called("nonlinear_stiffness", g, n) for n in ("C_x", "k")]
    assert said == ["nonlinear capacitance (nonlinear stiffness)", "nonlinear stiffness"]


def geared() -> BondGraph:
    """A spring behind a gear: by what it multiplies, one reading does not tell."""
    with BondGraph("geared") as g:
        body, gear = One("body"), TF("gear", ratio=2.0)
        Se("F", unit="N") >> gear >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m", law=series())
        body >> Dq("x", unit="m")
    return g


def test_a_whole_law_is_written_in_every_graph() -> None:
    made = trial(spring(law=series()), "k")
    assert whole_law(made) == r"\varphi_{k}(s) = k\,s + w_{k}"
    with BondGraph("coil") as g:
        Se("V", unit="V") >> One("loop") >> I("L", 1e-3, unit="H", law=SaturatingInductance())
    made = trial(g, "L")
    assert whole_law(made) == r"\varphi_{L}(p) = \frac{1}{L}\,p + w_{L}"
    assert definition(made)[1] == "p is the flux linkage of L"


@pytest.mark.parametrize(
    ("law", "height", "words"),
    [
        (Onset(ramp=True, free_standing=False, unit="K/s"), "h_C_1", "the integral over time of h"),
        (Push(ramp=True, free_standing=False, unit="K/s"), "h_C_1", "the integral over time of a"),
        (Tone(free_standing=False, unit="K"), "a_C_1", "a sin(2 pi f t)"),
    ],
    ids=lambda v: getattr(v, "name", ""),
)
def test_what_acts_on_a_store_from_outside_is_told_as_a_flow(
    law: Law, height: str, words: str
) -> None:
    """Its number is of an effort: what flows in is told beside it, and no form that it has not."""
    with BondGraph("heater") as g:
        body = Zero("body")
        Sf("P", unit="W") >> body >> C("C_1", 50.0, unit="J/K", law=law)
    made = trial(g, "C_1", "external_disturbance")
    made.insertion.strengths = (height,)
    made.fit.values = {"C_1": 50.0, "b_C_1": 0.0, height: 0.02, "freq_C_1": 0.5 / np.pi}
    assert meaning_of(height, made).endswith(", 1 W of heat flow into C_1")
    assert "into" not in meaning_of("t_0_C_1", made)
    assert in_symbols(made).startswith(words)
    assert "or its integral" not in in_symbols(made)


def test_a_power_series_is_told_about_zero_with_its_numbers() -> None:
    """A cubic that the fit counts from the middle of the range is a cubic from zero."""
    made = trial(spring(law=series()), "k")
    made.fit.values = {"k": 200.0, "a_2_k": 0.3, "a_3_k": -0.5, "centre_1_k": 2e-3,
                       "half_1_k": 0.01}  # fmt: skip
    # 200 s + 0.3 (s - c)^2 / h^2 - 0.5 (s - c)^3 / h^3, written out
    told = "force of k = 0.016 + 182*s + 6000*s^2 - 5e+05*s^3, s in m, force in N"
    assert in_numbers(made) == told
    assert in_numbers(trial(spring(), "k")) == ""


@pytest.mark.parametrize(
    ("unit", "told"),
    [("m2", "; that is a level of 0.3 m"), ("m3/Pa", "; that is a pressure of 0.3 Pa")],
)
def test_a_rim_is_told_as_what_stands_in_the_tank(unit: str, told: str) -> None:
    with BondGraph("tank") as g:
        tank = Zero("tank")
        Sf("q", unit="m3/s") >> tank >> C("A", 0.02, unit=unit, law=Overflow(coefficient="A"))
    made = trial(g, "A", "overflow")
    made.fit.values = {"A": 0.02, "depth_A": 0.004, "top_A": 0.01}
    assert meaning_of("depth_A", made).endswith(told)
    assert "level" not in meaning_of("top_A", made)


def test_what_a_found_law_took_over_is_not_called_far_off() -> None:
    d = SimpleNamespace(name="d", value=2e-3, unit="", ci95=(1.9e-3, 2.1e-3))
    last: Any = SimpleNamespace(problem=SimpleNamespace(graph=spring()), estimates=[d])
    own = taken_over(last, [trial(spring(), "d")])
    assert own == {"d"}
    assert moved(last, spring().parameters)
    assert moved(last, spring().parameters, own) == ()


def test_why_the_size_of_a_sure_effect_may_be_zero() -> None:
    t = np.asarray(0.01 * np.arange(300), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    truth = geared().with_values({"a_3_k": 0.5})
    x = np.asarray(simulate(truth, t, {"F": u})["x"])
    x = x + 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    split = Split(slice(0, 200), slice(200, 300), "first part")
    data = Data("run", t, {"F": u}, x[:, None], ("x",), np.array([1e-5]), split)
    last = fit(Problem(truth, data), max_iterations=4)
    made = trial(truth, "k")
    (low, high) = next(e.ci95 for e in last.estimates if e.name == "a_3_k")
    assert low < 0 < high
    (said,) = notes_on_size(last, [made])
    assert said.startswith("the effect nonlinear stiffness at k is sure, the size of a_3_k is not")
    assert "gear, m, d, k" in said
    assert "may move together unseen" in said


def test_a_reading_is_not_taken_for_a_second_command() -> None:
    """One in the unit of a command that is lacking would act as it, and anything would fit."""
    t = np.asarray(0.01 * np.arange(20), np.float64)
    with BondGraph("two") as two:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        Se("F_2", unit="N") >> body
        body >> Dq("x", unit="m")
    frame = pd.DataFrame({"time (s)": t, "F (N)": np.sin(t), "cell (N)": t, "x (m)": np.cos(t)})
    (made,) = asked_of(two.remove("F_2"), frame, None, None, {}).given
    assert "cell" in made.channels
    with pytest.raises(UnusableInput, match="F_2"):
        asked_of(two, frame, None, None, {})


def test_what_was_matched_by_unit_is_noted_in_the_recording() -> None:
    t = np.asarray(0.01 * np.arange(20), np.float64)
    frame = pd.DataFrame({"time (s)": t, "push (N)": np.sin(t), "way (m)": np.cos(t)})
    (made,) = asked_of(spring(), frame, None, None, {}).given
    assert "channel push is taken as F (the only one in N)" in made.notes
    again, said = match_by_unit(made, spring())
    assert again is made
    assert said == ()


@pytest.mark.parametrize(
    ("element", "restores", "moved_by"),
    [
        (C("k", stiffness=1.0, unit="N/m"), "a force that depends on the displacement",
         "position of k"),
        (C("k", stiffness=1.0, unit="N*m/rad"), "a torque that depends on the angle", "angle of k"),
        (C("Cap", 1.0, unit="F"), "a voltage that depends on the charge", "charge of Cap"),
        (I("L", 1.0, unit="H"), "a current that depends on the flux linkage", "charge through L"),
        (R("leak", 1.0, unit="Pa*s/m^3"), "a pressure that depends on the volume",
         "volume through leak"),
        (C("q", 1.0), "a force that depends on the displacement", "displacement of q"),
    ],
)  # fmt: skip
def test_words_are_those_of_the_domain(element: Element, restores: str, moved_by: str) -> None:
    assert restoring_words(element) == restores
    assert displacement_words(element) == moved_by
