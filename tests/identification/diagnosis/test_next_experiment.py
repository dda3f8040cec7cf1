"""The experiment that would tell two rivals apart: computed, and right when it is then made."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.laws import Coulomb, Polynomial
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.signals.recording import Split
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.explanation.candidate_inputs import candidate_inputs
from identification.diagnosis.explanation.next_experiment import next_experiments
from identification.estimation.levenberg_marquardt import minimise
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.joint import stack_of
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1500, 0.01, 1e-3
TIME = DT * np.arange(N)
NAMES = ("coulomb at d", "cubic at k")


def rubbing() -> BondGraph:
    return spring().with_element("d", law=Coulomb(0.1))


def stiffening() -> BondGraph:
    return spring().with_element("k", law=Polynomial(0.0, 0.1, 2.0, orders=(3,)))


def force() -> np.ndarray:
    rng = np.random.default_rng(0)
    tones = [np.sin(2 * np.pi * (f * TIME + rng.random())) for f in (1.1, 1.7, 2.3, 3.1)]
    return np.asarray(2.0 * np.sum(tones, axis=0))


def recorded(u: np.ndarray, seed: int) -> Data:
    x = np.asarray(simulate(rubbing(), TIME, {"F": u}, accuracy=1e-6)["x"])
    x = x + NOISE * np.random.default_rng(seed).standard_normal(N)
    split = Split(slice(0, N - 100), slice(N - 100, N), "the end")
    return Data("run", TIME, {"F": u}, x[:, None], ("x",), np.array([NOISE]), split)


@cache
def rivals() -> tuple[Fit, Fit]:
    data = recorded(force(), 1)
    return fit(Problem(rubbing(), data)), fit(Problem(stiffening(), data))


def misfit(problem: Problem, *further: Data) -> float:
    """Sum of squares of one model on all records together, with one set of values."""
    stack = stack_of((problem, *(Problem(problem.graph, d) for d in further)))
    made = minimise(stack, stack.start())
    return float(sum(e.residual @ e.residual for e in made.evaluations))


@pytest.mark.parametrize("kind", ["repeat", "hold"])
def test_the_expected_separation_is_what_the_experiment_gives(kind: str) -> None:
    found = {e.kind: e for e in next_experiments(rivals(), NAMES)}
    courses = candidate_inputs(rivals()[0].problem.data, {"F": "N"})
    made = recorded(next(c.commands["F"] for c in courses if c.kind == kind), 2)
    right, wrong = (misfit(f.problem, made) for f in rivals())
    assert 0.5 * np.sqrt(wrong - right) == pytest.approx(found[kind].expected_z, rel=0.25)


def test_ranking_and_words() -> None:
    found = next_experiments(rivals(), NAMES)
    z = [e.expected_z for e in found]
    assert z == sorted(z, reverse=True)
    assert len({e.words for e in found}) == len(found)
    assert all(e.expected_z >= e.now_z > 0 for e in found)
    best = found[0]
    assert best.expected_z > next(e.expected_z for e in found if e.kind == "repeat")
    assert best.rivals == NAMES
    assert best.sentence.startswith(best.words)
    assert "coulomb at d from cubic at k" in best.sentence
    assert any(e.kind == "sensor" and "f_v" in e.words for e in found)
    assert not any(e.kind == "sensor" for e in next_experiments(rivals(), NAMES, sensors=False))


def test_candidates_keep_the_envelope() -> None:
    data = rivals()[0].problem.data
    top = float(np.abs(data.commands["F"]).max())
    alone = candidate_inputs(data, {"F": "N"})
    assert {c.kind for c in alone} >= {"repeat", "weaker", "triangle", "hold", "sine", "sweep"}
    assert all(np.abs(c.commands["F"]).max() <= top * 1.0001 for c in alone)
    assert all(c.commands["F"].shape == (N,) for c in alone)
    assert not any(c.kind == "stronger" for c in alone)
    wide = candidate_inputs(data, {"F": "N"}, {"F": DriveLimits(-1.5 * top, 1.5 * top)})
    (stronger,) = (c for c in wide if c.kind == "stronger")
    assert np.abs(stronger.commands["F"]).max() <= 1.5 * top * 1.0001
    slow = candidate_inputs(data, {"F": "N"}, {"F": DriveLimits(-top, top, slew=5.0)})
    assert all(np.abs(np.diff(c.commands["F"])).max() <= 5.0 * DT for c in slow if c.kind != "hold")


def test_one_model_is_no_rivalry() -> None:
    with pytest.raises(UnusableInput, match="two or more rivals"):
        next_experiments(rivals()[:1], NAMES[:1])
    with pytest.raises(UnusableInput, match="one label for each"):
        next_experiments(rivals(), NAMES[:1])


def test_what_only_an_offset_sets_apart_no_input_tells() -> None:
    """The samples before the first window too: offsets of sensors are free there as well."""
    data = replace(recorded(force(), 1), begin=66)
    first = fit(Problem(rubbing(), data))
    lifted = rubbing().with_element("x", offset=1e3 * NOISE)
    other = replace(first, problem=replace(first.problem, graph=lifted, built=None))
    found = next_experiments((first, other), NAMES, sensors=False)
    assert max(e.expected_z for e in found) < 5.0
