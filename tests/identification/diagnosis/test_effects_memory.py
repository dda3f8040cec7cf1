"""Memory, transduction and what comes from outside: what each effect of these families keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import GY, TF, C, Element, I, One, R, Se, Valued, Zero
from bondgraph.graph.sensors import Df, Dq
from bondgraph.laws import Law
from bondgraph.signals.recording import Split
from bondgraph.simulation.lure import exact_form
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.memory.creep import Creep, lagged
from identification.diagnosis.catalogue.memory.hysteresis import Hysteresis
from identification.diagnosis.catalogue.outside.external_disturbance import (
    ExternalDisturbance,
    change_points,
    spectral_peaks,
)
from identification.diagnosis.catalogue.outside.generic import generic_columns
from identification.diagnosis.catalogue.outside.time_varying_parameter import TimeVaryingParameter
from identification.diagnosis.catalogue.outside.unnamed_curve import UnnamedCurve
from identification.diagnosis.catalogue.transduction.nonlinear_ratio import NonlinearRatio
from identification.diagnosis.catalogue.transduction.position_periodic_force import (
    PositionPeriodicForce,
)
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.screening.port_response import Probes, probes
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point
from tests.settled import simulate

N, DT = 400, 2e-3
EFFECTS: tuple[Effect, ...] = (
    Hysteresis(),
    Creep(),
    NonlinearRatio(),
    PositionPeriodicForce(),
    ExternalDisturbance(),
    TimeVaryingParameter(),
    UnnamedCurve(),
)
BY_NAME = {e.name: e for e in EFFECTS}
# effect, element, which of its signatures, error allowed of the first-order change (a law acts
# from the first step on, a probe from the first sample: what does not begin at zero differs)
CASES = (
    ("hysteresis", "c", 0, 0.02),
    ("hysteresis", "V", 0, 0.02),
    ("hysteresis", "x", 0, 0.02),
    ("creep", "c", 2, 0.05),
    ("nonlinear_ratio", "K", 0, 0.15),
    ("nonlinear_ratio", "K", 1, 0.15),
    ("nonlinear_ratio", "n", 0, 0.15),
    ("position_periodic_force", "m", 4, 0.03),
    ("external_disturbance", "m", 0, 0.05),
    ("external_disturbance", "m", -12, 0.02),
    ("external_disturbance", "C_1", 0, 0.1),
    ("external_disturbance", "C_1", 16, 0.02),
    ("time_varying_parameter", "c", 0, 0.02),
    ("time_varying_parameter", "d", 0, 0.02),
    ("time_varying_parameter", "c", 5, 0.02),
    ("time_varying_parameter", "d", 7, 0.02),
    ("time_varying_parameter", "c", -1, 0.02),
    ("time_varying_parameter", "d", -17, 0.02),
    ("unknown", "c", 0, 0.02),
    ("unknown", "V", 0, 0.05),
)


def drive() -> BondGraph:
    """A filtered motor pulls a mass through a drum and a belt."""
    with BondGraph("drive") as g:
        supply, node, loop = One("supply"), Zero("node"), One("loop")
        shaft, belt, load = One("shaft"), Zero("belt"), One("load")
        Se("V", unit="V") >> supply >> R("R_1", 2.0, unit="ohm")
        supply >> node >> C("C_1", 2e-3, unit="F")
        node >> loop >> I("L", 5e-3, unit="H")
        loop >> R("R_2", 1.0, unit="ohm")
        loop >> GY("K", 0.5, unit="N*m/A") >> shaft >> I("J", 4e-2, unit="kg*m2")
        shaft >> R("b", 5e-3, unit="N*m*s")
        shaft >> TF("n", 5.0, unit="m") >> belt >> C("k", stiffness=20.0, unit="N/m")
        belt >> load >> I("m", 0.4, unit="kg")
        load >> R("d", 4.0, unit="N*s/m")
        load >> C("c", stiffness=150.0, unit="N/m")
        load >> Dq("x", unit="m")
        shaft >> Df("w", unit="rad/s")
        loop >> Df("i", unit="A")
    return g


@dataclass(frozen=True)
class Bench:
    scene: FittedModel
    probes: Probes
    nominal: Fit

    def readings(self, graph: BondGraph, starts: dict[str, float]) -> Array:
        """Readings over their spread, from the nominal values and initial state."""
        f = self.nominal
        states = dict(zip(f.problem.dynamics.state_names, f.point.states.T, strict=True))
        known = {n: v for n, v in f.values.items() if n in self.scene.graph.parameters}
        problem = Problem(graph, self.scene.data, starts={**known, **starts}, known_states=states)
        y = evaluate(problem, start_point(problem), derivatives=False).y
        return np.asarray(y / self.scale)

    @property
    def scale(self) -> Array:
        return np.asarray(self.scene.data.readings.std(axis=0))


@pytest.fixture(scope="module")
def bench() -> Bench:
    g, t = drive(), DT * np.arange(N)
    u = 8 * np.sin(2 * np.pi * 2 * t) + 5 * np.sin(2 * np.pi * 5.3 * t)
    run = simulate(g, t, {"V": u})
    y = np.stack([np.asarray(run[n]) for n in ("x", "w", "i")], axis=1)
    floor = 1e-4 * y.std(axis=0)
    hum = 10 * np.sin(2 * np.pi * 7.1 * t)[:, None]  # what spectral peaks are to find
    y = y + floor * (hum + np.random.default_rng(0).standard_normal(y.shape))
    split = Split(slice(0, 300), slice(300, N), "the last quarter")
    data = Data("drive", t, {"V": u}, y, ("x", "w", "i"), floor, split)
    nominal = fit(Problem(g, data), max_iterations=3)
    return Bench(scene(nominal), probes(nominal), nominal)


def weak(b: Bench, name: str, element: str, which: int) -> tuple[Signature, Array, Insertion]:
    """One signature, weights that move the readings by a thousandth, and the insertion."""
    effect, e = BY_NAME[name], b.scene.graph[element]
    signature = effect.signatures(b.scene, e)[which]
    response = b.probes.respond(element, signature.columns, signature.flow) / b.scale[:, None]
    weights = 1e-3 / np.maximum(np.abs(response).max(axis=(0, 1)), 1e-30)
    inserted = effect.insert(b.scene, e, Hint(signature.shape or {}, weights))
    return signature, weights, inserted


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(("name", "element", "which", "allowed"), CASES)
def test_insertion_and_its_first_order(
    bench: Bench, name: str, element: str, which: int, allowed: float
) -> None:
    signature, weights, i = weak(bench, name, element, which)
    assert i.graph.check() == ()
    assert (i.effect, i.element) == (name, element)
    exact = exact_form(i.graph) is not None
    assert exact == (name != "nonlinear_ratio")
    assert set(i.strengths) <= set(i.graph.parameters)
    assert all(set(s) <= set(i.graph.parameters) for s in i.starts)
    nothing = 1e-5 if name == "creep" else 0.0
    shape = dict(i.starts[0])
    without = bench.readings(i.graph, {**shape, **dict.fromkeys(i.strengths, nothing)})
    nominal = bench.readings(bench.scene.graph, {})
    # the general dynamics takes steps of another order
    assert np.abs(without - nominal).max() < (1e-4 if exact else 0.05)
    strong = dict(zip(i.strengths, map(float, weights), strict=True))
    change = bench.readings(i.graph, {**shape, **strong}) - without
    response = bench.probes.respond(element, signature.columns, signature.flow)
    response = response / bench.scale[:, None]
    expected = response @ weights
    assert np.linalg.norm(change - expected) < allowed * np.linalg.norm(expected)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_words_and_places(effect: Effect, bench: Bench) -> None:
    words = (effect.sentence, effect.looks, effect.separated_by, effect.source, effect.law)
    assert all(words)
    assert not effect.sentence.endswith(".")
    assert effect.name not in effect.confused_with
    places = effect.places(bench.scene.graph)
    assert places
    assert any(effect.home(p) for p in places)
    for place in places:
        i = effect.insert(bench.scene, place)
        assert i.graph.check() == (), i.label
        for s in effect.signatures(bench.scene, place):
            assert s.columns.shape[0] == N
            assert np.isfinite(s.columns).all()


def _law(element: Element) -> Law:
    assert isinstance(element, Valued)
    assert element.law is not None
    return element.law


def test_kernels_do_not_depend_on_the_recording(bench: Bench) -> None:
    """Twice the range gives other numbers but the same equations."""
    wide = {
        n: PortHistory(2 * p.argument, 2 * p.output, p.dt, p.moved)
        for n, p in bench.scene.past.items()
    }
    other = FittedModel(
        bench.scene.graph, bench.scene.data, bench.scene.nominal, bench.scene.residual, wide
    )
    for name in ("hysteresis", "unknown", "time_varying_parameter", "external_disturbance"):
        effect = BY_NAME[name]
        place = "C_1" if name == "external_disturbance" else "c"
        laws = [_law(effect.insert(s, s.graph[place]).graph[place]) for s in (bench.scene, other)]
        assert laws[0].structure == laws[1].structure
        if name in ("hysteresis", "unknown"):
            numbers = [[p.value for p in law.parameters("c")] for law in laws]
            assert numbers[0] != numbers[1]


def test_lag_is_exact_for_a_ramp() -> None:
    t, tau = 0.01 * np.arange(300), 0.3
    np.testing.assert_allclose(
        lagged(2 * t, tau, 0.01), 2 * (t - tau * (1 - np.exp(-t / tau))), atol=1e-12
    )


def test_lines_and_changes_are_found() -> None:
    t = 1e-3 * np.arange(2000)
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((2000, 2))
    humming = noise + 2 * np.sin(2 * np.pi * 31.3 * t)[:, None]
    assert spectral_peaks(humming, 1e-3, 1)[0] == pytest.approx(31.3, abs=0.1)
    stepped = noise + 3.0 * (t > 0.7)[:, None]
    assert min(abs(k - 700) for k in change_points(stepped)) <= 3
    burst = 0.3 * noise
    burst[1200:] += 5 * np.exp(-(t[:800, None]) / 0.05) * np.sin(2 * np.pi * 60 * t[:800, None])
    assert min(abs(k - 1200) for k in change_points(burst)) <= 8


def test_generic_groups_span_what_they_say() -> None:
    t = 2e-3 * np.arange(3000)
    x = np.sin(2 * np.pi * t) + 0.3 * np.sin(2 * np.pi * 2.7 * t)
    past = PortHistory(x, x, 2e-3)
    groups = generic_columns(past)
    assert " ".join(groups) == (
        "linear odd even rate rate_odd rate_even sign reversal memory slow product time"
    )
    assert all(g.shape[0] == 3000 and np.isfinite(g).all() for g in groups.values())

    def explained(w: Array, names: tuple[str, ...]) -> float:
        a = np.concatenate([groups[n] for n in names], axis=1)
        left = w - a @ np.linalg.lstsq(a, w, rcond=None)[0]
        return 1 - float(left @ left) / float(w @ w)

    assert explained((past.argument - past.centre) ** 3, ("linear", "odd", "even")) > 0.999
    assert explained(np.sign(past.rate), ("reversal",)) > 0.9
    assert explained(np.sign(past.rate), ("linear", "odd", "even")) < 0.2
    assert explained(x * t, ("linear", "time")) > 0.999
