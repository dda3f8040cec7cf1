"""The general dynamics gives what the exact one gives, and fits what the exact one cannot run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import MTF
from bondgraph.graph.modulation import displacement
from bondgraph.laws import StopSum
from bondgraph.signals.recording import Recording
from bondgraph.simulation.dynamics import ExactDynamics, GeneralDynamics, dynamics_of
from identification.estimation import FitStatus, Study, estimate
from identification.estimation.levenberg_marquardt import minimise
from identification.estimation.single_record import fit
from identification.study.joint import JointPoint, JointProblem, stack_of
from identification.validation import judge
from tests.identification.estimation.plants import TRUTH, misses, record, spring, study
from tests.settled import simulate
from tests.spring import spring as plain_spring


def general(graph: BondGraph) -> GeneralDynamics:
    return GeneralDynamics(program_of(equations(graph)), graph.parameters)


def both(n_sub: int = 8) -> tuple[JointProblem, JointProblem]:
    """Return one problem with each dynamics."""
    stack = study(record(400), n_sub=n_sub).stack()
    (p,) = stack.problems
    other = replace(p, built=general(p.graph))
    return stack_of([replace(p, built=dynamics_of(p.graph))]), stack_of([other])


def test_plain_graph_takes_the_exact_engine() -> None:
    assert isinstance(dynamics_of(spring()), ExactDynamics)
    assert isinstance(dynamics_of(drum()), GeneralDynamics)


def test_engines_agree_on_names_rest_and_inputs() -> None:
    exact, other = dynamics_of(spring()), general(spring())
    assert set(exact.parameter_names) == set(other.parameter_names)
    assert set(exact.state_names) == set(other.state_names)
    assert exact.n_x == other.n_x == 2
    assert not other.names.memory
    order = [other.state_names.index(n) for n in exact.state_names]
    u = np.array([3.0])
    values = {"m": 0.5, "d": 1.5, "k": 150.0}
    rests = [e.rest(e.vector(values), u) for e in (exact, other)]
    assert rests[0] == pytest.approx(rests[1][order], abs=1e-9)
    with pytest.raises(Exception, match="Did you mean"):
        other.vector({"kk": 1.0})


def test_a_law_with_memory_is_relaxed_at_the_rest_of_either_engine() -> None:
    """A sum of stops that had to come there from zero would carry a part of the force."""
    graph = plain_spring(law=StopSum((0.005,), height=100.0))
    exact, other = dynamics_of(graph), general(graph)
    u = np.array([2.0])
    place = [
        float(e.rest(e.vector({}), u)[[n.startswith("q_") for n in e.state_names]][0])
        for e in (exact, other)
    ]
    assert place == pytest.approx([0.01, 0.01], rel=1e-9)


def test_engines_give_the_same_readings_and_derivatives() -> None:
    exact, other = both(16)
    results = []
    for stack in (exact, other):
        begin = stack.start()
        theta = begin.theta + 0.05 * np.cos(np.arange(stack.n))
        results.append(stack.evaluate(JointPoint(theta, begin.states))[0])
    a, b = results
    spread = np.ptp(a.y)
    assert np.abs(a.y - b.y).max() < 2e-3 * spread
    columns = [exact.names.index(n) for n in other.names]
    size = np.linalg.norm(a.jacobian, axis=0)[columns]
    assert (np.linalg.norm(a.jacobian[:, columns] - b.jacobian, axis=0) < 1e-2 * size).all()


def test_engines_end_at_the_same_values() -> None:
    ends = []
    for stack in both(16):
        made = minimise(stack, stack.start(), max_iterations=30, tolerance=1e-8)
        assert made.status is FitStatus.CONVERGED
        theta = dict(zip(stack.names, made.point.theta, strict=True))
        ends.append(
            {f.parameter.name: f.value(theta[f.parameter.name]) for f in stack.problems[0].free}
        )
    exact, other = ends
    for n in TRUTH:
        assert other[n] == pytest.approx(exact[n], rel=2e-3)
        assert other[n] == pytest.approx(TRUTH[n], rel=0.02)


def drum() -> BondGraph:
    """A mass on a spring, and a second one that a lever of its own displacement pulls."""
    with BondGraph("drum") as g:
        body, inner = One("body"), One("inner")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m")
        body >> MTF("lever", ratio=20.0 * displacement("k")) >> inner
        inner >> C("c", stiffness=30.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def test_derivatives_of_a_modulated_model_match_differences() -> None:
    stack = Study(drum(), record(200), n_sub=2).stack()
    begin = stack.start()
    assert isinstance(stack.problems[0].dynamics, GeneralDynamics)
    theta = begin.theta + 0.05 * np.cos(1 + np.arange(stack.n))
    point = JointPoint(theta, tuple(s + 1e-3 for s in begin.states))
    found = stack.evaluate(point)[0]
    for j in range(stack.n):
        if stack.names[j].startswith("delay"):
            continue
        ends = []
        for sign in (1, -1):
            moved = theta.copy()
            moved[j] += sign * 1e-5
            e = stack.evaluate(JointPoint(moved, point.states), derivatives=False)[0]
            ends.append(e.residual)
        numeric = (ends[0] - ends[1]) / 2e-5
        assert np.linalg.norm(-found.jacobian[:, j] - numeric) < 1e-4 * np.linalg.norm(numeric)


def test_modulated_model_is_fitted() -> None:
    t = np.arange(700) * 0.01
    start = {"p_m": 0.0, "q_k": 0.0, "q_c": 0.0}
    u = 30 * np.sin(2 * np.pi * 0.9 * t) + 20 * np.sin(2 * np.pi * 3.1 * t + 1)
    x = np.asarray(simulate(drum(), t, {"F": u}, x0=start, accuracy=1e-6)["x"])
    x = x + 1e-4 * np.random.default_rng(0).standard_normal(700)
    made = Recording.from_arrays("drum", {"F[N]": u, "x[m]": x}, fs=100.0)
    off = drum().with_values({"m": 0.6, "c": 20.0, "k": 240.0})
    found = estimate(Study(off, made))
    assert found.status is FitStatus.CONVERGED
    assert max(misses(found, {**TRUTH, "c": 30.0}).values()) < 3.5
    assert found.rmse("test")["x"] == pytest.approx(1e-4, rel=0.2)
    alone = fit(found.problem(0))
    judged = judge(alone)
    assert judged.channels[0].test.chi2 == pytest.approx(alone.chi2("test"), rel=1e-12)
    counted = len(alone.estimates) + len(alone.nuisances) + len(found.problem(0).free_states)
    assert judged.material.n_free == counted
