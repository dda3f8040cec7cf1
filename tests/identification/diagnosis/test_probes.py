"""A latent signal at a port against the model with a weak law in that port."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bondgraph import MTF, TF, BondGraph, C, De, Df, Dq, I, MSe, One, R, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Source
from bondgraph.graph.modulation import displacement, effort
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Split
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.screening.port_response import Probes, probes
from identification.diagnosis.search.base import Base, base_of
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point
from tests.settled import simulate

Array = Any
N, DT = 500, 0.01


def machine(lever: TF | None = None, cubic: float = 0.0) -> BondGraph:
    with BondGraph("machine") as g:
        arm, body = One("arm"), One("body")
        Se("F", unit="N") >> arm >> I("m_1", 0.4, unit="kg")
        arm >> R("d_1", 1.5, unit="N*s/m")
        law = Polynomial(0.0, 0.05, 1.0, (3,)) if cubic else None
        arm >> C("k_1", stiffness=90.0, unit="N/m", law=law)
        arm >> (lever or TF("T", ratio=0.6)) >> body
        body >> R("d_2", 0.8, unit="N*s/m")
        body >> C("k_2", stiffness=60.0, unit="N/m")
        arm >> Dq("x", unit="m")
        body >> Df("v", unit="m/s")
    if not cubic:
        return g
    return g.with_values({p.name: cubic for p in law.parameters("k_1")}) if law else g


def modulated() -> BondGraph:
    return machine(MTF("T", ratio=0.6 * (1 + 2.0 * displacement("k_1"))))


def behind_a_buffer() -> BondGraph:
    """A source gives the effort of a resistor to a second circuit, without back action."""
    with BondGraph("two_circuits") as g:
        first, second = One("first"), One("second")
        Se("F", unit="V") >> first >> R("R_s", 2.0, unit="ohm")
        first >> R("R_d", 3.0, unit="ohm")
        MSe("buffer", value=effort("R_d"), unit="V") >> second
        second >> R("R_2", 1.0, unit="ohm")
        plug = Zero("plug")
        second >> plug >> C("C_2", 0.05, unit="F")
        plug >> De("y", unit="V")
    return g


NOMINAL: dict[str, Callable[[], BondGraph]] = {
    "linear": machine,
    "a law in a port": lambda: machine(cubic=3.0),
    "a modulated lever": modulated,
    "behind a buffer": behind_a_buffer,
}


@cache
def prepared(name: str) -> tuple[Base, FittedModel, Probes]:
    graph = NOMINAL[name]()
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 4 * np.sin(5.1 * t) * np.minimum(t, 1) + 3 * np.sin(13.0 * t) * np.minimum(t, 1)
    run = simulate(graph, t, {"F": u})
    names = tuple(s.name for s in graph.of_type(Sensor))
    y = np.stack([np.asarray(run[n]) for n in names], axis=1)
    floor = 1e-3 * y.std(axis=0)
    y = y + floor * np.random.default_rng(4).standard_normal(y.shape)
    data = Data("run", t, {"F": u}, y, names, floor, Split(slice(0, 400), slice(400, N), "part"))
    made = fit(Problem(graph, data, lags=False, offsets=False), max_iterations=3)
    return base_of(made), scene(made), probes(made)


def response(base: Base, graph: BondGraph, values: dict[str, float]) -> Array:
    """Readings of another graph from the fitted values and states."""
    starts = {**base.template.starts, **values}
    problem = replace(base.template, graph=graph, starts=starts)
    return evaluate(problem, start_point(problem), derivatives=False).y


def with_law(graph: BondGraph, name: str, law: Polynomial) -> BondGraph:
    if isinstance(graph[name], Source):
        return graph.with_element(name, drive=Drive(law=law))
    return graph.with_element(name, law=law)


def bend(past: PortHistory) -> Polynomial:
    return Polynomial(past.centre, past.half, past.swing, (2,))


def off(found: Array, wanted: Array) -> float:
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


PORTS = ("k_2", "d_1", "F", "x")
CASES = [(name, port) for name in NOMINAL if name != "behind a buffer" for port in PORTS]
CASES += [("behind a buffer", port) for port in ("R_s", "R_d", "R_2", "C_2")]


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(("name", "port"), CASES)
def test_response_is_the_derivative_by_a_weak_law(name: str, port: str) -> None:
    base, seen, probe = prepared(name)
    law = bend(seen.past[port])
    (weight,) = (p.name for p in law.parameters(port))
    graph, small = with_law(seen.graph, port, law), 1e-4 * seen.past[port].swing
    up, down = (response(base, graph, {weight: s * small}) for s in (1.0, -1.0))
    column = law.deviation(NUMPY, seen.past[port].argument, (), [1.0])
    found = probe.respond(port, np.asarray(column)[:, None])[:, :, 0]
    assert off(found, (up - down) / (2 * small)) < 2e-2


@pytest.mark.parametrize("name", ["linear", "a law in a port"])
def test_both_sides_of_a_lever(name: str) -> None:
    base, seen, probe = prepared(name)
    effect, lever = by_name("nonlinear_ratio"), seen.graph["T"]
    (s,) = effect.signatures(seen, lever)
    for k in range(s.columns.shape[1]):
        ends = []
        for small in (1e-4, -1e-4):
            weights = small * np.eye(s.columns.shape[1])[k]
            i = effect.insert(seen, lever, Hint(s.shape or {}, weights))
            ends.append(response(base, i.graph, dict(i.starts[0])))
        assert s.flow is not None
        found = probe.respond("T", s.columns[:, [k]], s.flow[:, [k]])[:, :, 0]
        assert off(found, (ends[0] - ends[1]) / 2e-4) < 2e-2


def test_responses_superpose() -> None:
    _, seen, probe = prepared("linear")
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((N, 2))
    both = probe.respond("k_2", columns)
    one = probe.respond("k_2", columns.sum(axis=1, keepdims=True))
    np.testing.assert_allclose(both.sum(axis=2), one[:, :, 0], atol=1e-9 * np.abs(one).max())
    reading = probe.respond("v", columns)
    assert np.array_equal(reading[:, 1], columns)
    assert not reading[:, 0].any()
    assert probe.knows("k_2")
    assert not probe.knows("nothing")
    assert {"k_1", "k_2", "d_1", "d_2", "m_1", "T"} == set(probe.ports)
    assert set(seen.past) == {"k_1", "k_2", "d_1", "d_2", "m_1", "T", "F", "x", "v"}


@pytest.mark.parametrize("name", ["linear", "a modulated lever"])
def test_every_past_obeys_the_law_of_its_element(name: str) -> None:
    """Elements of one junction share a flow; all of them have their past."""
    _, seen, _ = prepared(name)
    past, values = seen.past, seen.nominal.values
    for n in ("k_1", "k_2", "d_1", "d_2"):
        assert off(past[n].output, values[n] * past[n].argument) < 1e-6, n
    assert np.array_equal(past["d_1"].argument, past["m_1"].argument)
    assert off(past["v"].argument, past["d_2"].argument) < 1e-6
    for n in ("m_1", "d_1"):
        assert past[n].moved is not None
        way = past["k_1"].argument - past["k_1"].argument[0]
        assert off(past[n].moved, way) < 1e-2
