"""A law is what its name says only while its fitted parameters lie where the name holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.graph.composing.rewriting import rename
from bondgraph.graph.elements import Element
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.site import numbers, own_parameters
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.places_without_name import (
    APART,
    CLEAR,
    LEFT,
    located,
    places_of,
)
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.study.problem import Problem
from identification.study.residual import start_point
from tests.identification.diagnosis.effect_plants import PLANTS, scene

LAWS = [e for e in CATALOGUE if hasattr(e, "made")]


@pytest.mark.parametrize("effect", LAWS, ids=lambda e: e.name)
def test_an_element_may_be_called_as_a_parameter_of_its_law_is(effect: Effect) -> None:
    tried = 0
    for plant in PLANTS:
        s = at_its_ends(scene(plant))
        for place in effect.places(s.graph):
            law = effect.made(effect.site(s, place))
            wanted = effect.insert(s, place)
            for name in filter(str.isidentifier, own_parameters(law)):
                other, element = under_another_name(s, place, name)
                assert numbers(effect.made(effect.site(other, element))) == numbers(law), name
                mine = effect.insert(other, element)
                assert mine.graph.check() == (), name
                assert len(mine.strengths) == len(wanted.strengths)
                for a, b in zip(mine.starts, wanted.starts, strict=True):
                    assert set(a) <= set(mine.graph.parameters)
                    assert list(a.values()) == list(b.values()), name
                tried += 1
    assert tried


def at_its_ends(s: FittedModel) -> FittedModel:
    """Return a scene that knows what its sources and sensors say, too, as a fit left them."""
    said = dict(zip(s.data.names, s.data.readings.T, strict=True)) | dict(s.data.commands)
    past = {n: PortHistory(v, v, s.data.dt) for n, v in said.items()}
    problem = Problem(s.graph, s.data)
    nominal = Fit(problem, start_point(problem), FitStatus.CONVERGED, 1.0, 0, s.data.readings)
    return replace(s, past={**s.past, **past}, nominal=nominal)


def under_another_name(s: FittedModel, place: Element, name: str) -> tuple[FittedModel, Element]:
    def called(n: str) -> str:
        return name if n == place.name else n

    graph = rename(s.graph, place.name, name)
    data = replace(
        s.data, names=tuple(map(called, s.data.names)),
        commands={called(n): v for n, v in s.data.commands.items()},
    )  # fmt: skip
    past = {called(n): v for n, v in s.past.items()}
    nominal = replace(s.nominal, problem=Problem(graph, data))
    return replace(s, graph=graph, data=data, past=past, nominal=nominal), graph[name]


@pytest.mark.parametrize(("change", "holds"), [(-1.2, True), (2.5, True), (8.0, False)])
def test_a_second_slope_many_times_stiffer_is_a_stop(change: float, holds: bool) -> None:
    s = scene("mechanical")
    made = by_name("bilinear_stiffness").insert(s, s.graph["k"])
    slope = s.of(s.graph["k"]).slope
    assert made.is_itself({"dk_k": change * slope, "knee_k": 0.0}) is holds


@pytest.mark.parametrize(("periods", "holds"), [(0.5, False), (1.5, False), (4.0, True)])
def test_nothing_repeats_in_less_than_two_periods(periods: float, holds: bool) -> None:
    s = scene("mechanical")
    way = s.past["m"].moved
    assert way is not None
    made = by_name("position_periodic_force").insert(s, s.graph["m"])
    assert made.is_itself({"period_ripple_m": float(np.ptp(way)) / periods}) is holds


@pytest.mark.parametrize(("later", "holds"), [(0.3, True), (2.0, True), (3.0, False)])
def test_what_gives_way_without_end_is_no_creep(later: float, holds: bool) -> None:
    s = scene("mechanical")
    made = by_name("creep").insert(s, s.graph["k"])
    assert made.is_itself({"creep_1_k": 0.01, "creep_2_k": later}) is holds


@pytest.mark.parametrize(
    ("gained", "share", "holds"), [(0.2, 0.1, True), (-0.2, 0.1, False), (0.2, 0.001, False)]
)
def test_what_thins_under_work_or_is_quick_is_no_heat_for_sure(
    gained: float, share: float, holds: bool
) -> None:
    s = scene("mechanical")
    past = s.of(s.graph["d"])
    made = by_name("self_heating").insert(s, s.graph["d"])
    pace = share * past.dt * past.n
    assert made.is_itself({"r_heat_d": gained, "tau_heat_d": pace}) is holds


def test_a_law_without_such_a_range_is_always_itself() -> None:
    s = scene("mechanical")
    made = by_name("coulomb_friction").insert(s, s.graph["d"])
    assert made.is_itself({})
    assert made.is_itself({"F_c_d": 1e30})


def test_a_kind_that_only_its_own_port_can_have_stays_there() -> None:
    classes = Isolability((("F", "m", "d"), ("k",)))
    answer = Decision(
        "unknown_physics", None, (), (), 0.0, 0.0, (), answer="kind", physics="command",
        places=("F",),
    )  # fmt: skip
    assert places_of(answer, classes) == ("F",)
    anything = replace(answer, physics="dissipative", places=("d",))
    assert places_of(anything, classes) == ("d",)  # `decide` has looked which others can have it
    unknown = replace(answer, answer="unknown", physics="")
    assert set(places_of(unknown, classes)) == {"F", "m", "d"}


def relation(ports: str, train: float, test: float | None = None, z: float = 1e3) -> BlindRelation:
    return BlindRelation(tuple(ports.split()), 500.0, train, test or train, z, 1000.0, 401.0)


READINGS = ("x", "v")


def test_one_relation_at_the_floor_tells_the_place() -> None:
    best = relation("k b", 1.02, z=0.5)
    assert located([best, relation("m", 1.5, z=CLEAR + 1)], READINGS) == ("k", "b")
    assert located([best, relation("m", 1.2, z=CLEAR - 1)], READINGS) == ()
    assert located([best, relation("m", 1.02, z=0.6)], READINGS) == ()
    assert located([best], READINGS) == ()  # nothing to compare it with
    assert located([], READINGS) == ()


def test_both_sides_of_a_two_port_exclude_nobody() -> None:
    """What they hide holds all that lies behind them: the right port may miss the floor alone."""
    both = replace(relation("n", 0.9, z=-1.0), sides=2)
    assert located([both, relation("k b", 30.0), relation("m", 300.0)], READINGS) == ()
    one = relation("k b", 1.02, z=0.5)
    assert located([both, one, relation("m", 300.0)], READINGS) == ("k", "b", "n")


def test_one_relation_far_below_all_others_tells_the_place() -> None:
    left = 0.5 * LEFT * 400.0
    best = relation("k b", 1.0 + left)
    assert located([best, relation("m", 1.0 + 1.1 * APART * left)], READINGS) == ("k", "b")
    assert located([best, relation("m", 1.0 + 0.9 * APART * left)], READINGS) == ()
    much = relation("k b", 1.0 + 2.2 * left)
    assert located([much, relation("m", 400.0)], READINGS) == ()
    # it must hold on samples that it was not fitted to
    for late in (1.0 + 2.2 * left, np.nan):
        assert located([relation("k b", 1.0 + left, late), relation("m", 400.0)], READINGS) == ()
    # without the reading itself little is left to be missed
    deaf = relation("x d", 1.0 + left)
    assert located([deaf, relation("m", 400.0)], READINGS) == ()
    assert located([relation("x", 1.02, z=0.5), relation("m", 400.0)], READINGS) == ("x",)
