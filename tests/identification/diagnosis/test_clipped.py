"""Readings that are cut at an end of their range, and those that only look so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from bondgraph.simulation.simulate import simulate
from identification import diagnose
from identification.diagnosis.screening.clipped import clipped, cut_samples
from identification.diagnosis.verdict.text import headline
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem

N, STEP, NOISE = 1500, 2e-3, 2e-5


def slide() -> BondGraph:
    with BondGraph("slide") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.7, unit="kg")
        body >> R("d", 5.0, unit="N*s/m")
        body >> C("k", stiffness=1800.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


TIME = STEP * np.arange(N, dtype=float)
RNG = np.random.default_rng(4)
FORCE = np.repeat(RNG.normal(size=N // 10), 10) * 12.0
CLEAN = simulate(slide(), TIME, {"F": FORCE})["x"]
READ = CLEAN + NOISE * RNG.normal(size=N)
LIMIT = 1.3 * float(READ.std())


def fitted(x: Any) -> Fit:
    split, floor = interleaved(0, N), np.array([NOISE])
    data = Data("swung", TIME, {"F": FORCE}, x[:, None], ("x",), floor, split, "hold")
    return fit(Problem(slide(), data), max_iterations=8)


@pytest.mark.parametrize(
    ("low", "high", "ends"),
    [(-LIMIT, LIMIT, (-LIMIT, LIMIT)), (-np.inf, LIMIT, (LIMIT,)), (-LIMIT, np.inf, (-LIMIT,))],
)
def test_a_reading_cut_after_its_noise_is_told(low: float, high: float, ends: Any) -> None:
    x = np.clip(READ, low, high)
    (found,) = clipped(fitted(x))
    assert found.channels == ("x",)
    assert found.ends == pytest.approx(ends)
    assert found.share == pytest.approx(np.mean(x != READ), abs=0.01)


def test_what_is_not_cut_is_not_told() -> None:
    assert clipped(fitted(READ)) == ()
    # a contact that holds the mass leaves the sensor its noise
    held = np.clip(CLEAN, -LIMIT, LIMIT) + NOISE * RNG.normal(size=N)
    assert clipped(fitted(held)) == ()
    # numbers coarser than the noise stand still anywhere
    coarse = np.round(np.clip(CLEAN, -LIMIT, LIMIT) / (4 * NOISE)) * 4 * NOISE
    assert clipped(fitted(coarse)) == ()
    # one outlier that repeats itself once is no end of a range
    spoilt = READ.copy()
    spoilt[700:704] = READ.max() + 1e-3
    assert clipped(fitted(spoilt)) == ()


def test_a_limit_that_the_model_knows_is_none_to_tell() -> None:
    found = fitted(READ)
    assert found.chi2("test") < 1.5
    assert clipped(found) == ()


def test_short_runs_do_not_count() -> None:
    assert cut_samples(np.array([1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 1], bool)) == 0
    assert cut_samples(np.zeros(9, bool)) == 0


def test_a_diagnosis_of_a_cut_reading_says_so_and_tells_no_physics() -> None:
    x = np.clip(READ, -LIMIT, LIMIT)
    record = Recording("cut", TIME, {"F": FORCE, "x": x}, {"F": "N", "x": "m"})
    found = diagnose(slide(), record)
    assert [m.kind for m in found.mistakes] == ["clipped"]
    assert "x is clipped" in headline(found)
    assert "wider range" in found.advice[0]
    assert found.kind == "unknown_physics"
    assert found.findings[0].chosen is None
