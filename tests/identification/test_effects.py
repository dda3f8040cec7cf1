"""What every effect of the catalogue promises."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.catalogue import stack_with_payload
from bondgraph.compiled import compile_model
from bondgraph.elements import C, R, Sensor, Source
from bondgraph.equations import derive
from bondgraph.graph import BondGraph
from bondgraph.signals import Split
from bondgraph.simulate import simulate
from identification.diagnosis.effects import CATALOGUE, UNNAMED, Effect, by_name
from identification.diagnosis.scene import Past, Scene, scene
from identification.fit import fit
from identification.problem import Data, Problem
from identification.residual import evaluate, start_point

EVERY = (*CATALOGUE, UNNAMED)
N, DT = 300, 2e-4


def recorded(graph: BondGraph) -> Data:
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 40 * np.sin(2 * np.pi * 30 * t) + 20 * np.sin(2 * np.pi * 71 * t)
    run = simulate(graph, t, {"V_in": u})
    y = np.stack([np.asarray(run[s.name]) for s in graph.of_type(Sensor)], axis=1)
    names = tuple(s.name for s in graph.of_type(Sensor))
    split = Split(slice(0, 200), slice(200, N), "first two thirds")
    return Data("run", t, {"V_in": u}, y, names, 1e-3 * y.std(axis=0), split)


@pytest.fixture(scope="module")
def stack() -> Scene:
    graph = stack_with_payload()
    return scene(fit(Problem(graph, recorded(graph)), max_iterations=2))


def ids(effects: tuple[Effect, ...]) -> list[str]:
    return [e.name for e in effects]


def test_names_are_unique_and_found() -> None:
    assert len(set(ids(EVERY))) == len(EVERY)
    assert all(by_name(e.name) is e for e in EVERY)


@pytest.mark.parametrize("effect", EVERY, ids=ids(EVERY))
def test_words(effect: Effect) -> None:
    for text in (effect.name, effect.family, effect.law, effect.sentence, effect.source):
        assert text
    assert not effect.sentence.endswith(".")
    known = {e.name for e in EVERY}
    assert set(effect.simpler) <= known
    assert effect.name not in effect.confused_with


@pytest.mark.parametrize("effect", EVERY, ids=ids(EVERY))
def test_effect_at_all_its_places(effect: Effect, stack: Scene) -> None:
    places = effect.places(stack.graph)
    assert places
    assert any(effect.home(p) for p in places)
    nominal = Problem(stack.graph, stack.data)
    quiet = evaluate(nominal, start_point(nominal), derivatives=False).y
    for place in places:
        i = effect.insert(stack, place)
        assert (i.effect, i.family, i.element) == (effect.name, effect.family, place.name)
        assert i.label == f"{effect.name} at {place.name}"
        assert i.graph.check() == (), i.label
        assert stack.graph.check() == ()
        assert derive(i.graph).output_names == derive(stack.graph).output_names
        problem = Problem(i.graph, stack.data)
        known = {*compile_model(i.graph).parameter_names, *problem.delays}
        assert i.strengths
        assert set(i.strengths) <= known
        assert i.starts
        for s in i.starts:
            assert set(s) <= known, i.label
            assert all(np.isfinite(v) for v in s.values())
        problem = Problem(i.graph, stack.data, starts=dict(i.starts[0]))
        y = evaluate(problem, start_point(problem), derivatives=False).y
        assert np.isfinite(y).all(), i.label
        nothing = Problem(
            i.graph, stack.data, starts={**i.starts[0], **_absent(effect, i.strengths, stack)}
        )
        none = evaluate(nothing, start_point(nothing), derivatives=False).y
        off = np.linalg.norm(none - quiet, axis=0) / np.linalg.norm(quiet, axis=0)
        assert off.max() < 2e-2, (i.label, off)


def _absent(effect: Effect, strengths: tuple[str, ...], stack: Scene) -> dict[str, float]:
    """Values at which the effect does nothing: zero, but the limits of a saturation far away."""
    if effect.name == "saturation":
        span = float(np.ptp(stack.data.commands["V_in"]))
        return dict(zip(strengths, (-10 * span, 10 * span), strict=True))
    tiny = {"creep": 1e-5, "low_pass": 1e-7, "sensor_lag": 1e-7}
    return dict.fromkeys(strengths, tiny.get(effect.name, 0.0))


def test_past_of_a_port() -> None:
    p = Past(np.array([-1.0, 3.0]), np.array([0.0, 4.0]))
    assert (p.centre, p.half, p.swing) == (1.0, 2.0, 2.0)
    still = Past(np.zeros(3), np.zeros(3))
    assert still.half == still.swing == still.rms == 1.0


def test_scene_knows_every_port(stack: Scene) -> None:
    wanted = {e.name for e in stack.graph.of_type(C, R, Source, Sensor)}
    assert set(stack.past) == wanted
    for p in stack.past.values():
        assert np.isfinite(p.argument).all()
