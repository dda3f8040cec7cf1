"""The measurement of fits: equal problems for all tools, and lines that say what was measured."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation import estimate
from tests.benchmarks.fit import bench_fit, exponent, stack_study, worst_miss
from tests.benchmarks.fit_peers import NOISE, TRUTH, by_casadi, by_scipy, by_us, duffing_record


def test_exponent_of_a_power() -> None:
    assert exponent([1, 10, 100], [2, 2e2, 2e4]) == pytest.approx(2.0)


@pytest.mark.long
def test_all_tools_find_the_same_minimum() -> None:
    recording = duffing_record(300)
    ours, casadi, scipy = by_us(recording, 1), by_casadi(recording, 1), by_scipy(recording)
    for peer in (casadi, scipy):
        assert peer.rms == pytest.approx(ours.rms, rel=1e-3)
        for name in TRUTH:
            assert peer.values[name] == pytest.approx(ours.values[name], rel=1e-3)
    assert ours.rms == pytest.approx(NOISE, rel=0.2)
    assert min(ours.wall, casadi.wall, scipy.wall) > 0


@pytest.mark.long
def test_the_stack_with_operators_is_found() -> None:
    study, truth = stack_study(4096, 3)
    made = estimate(study)
    assert set(truth) == {e.name for e in made.estimates} & set(truth)
    assert worst_miss(made, truth) < 5
    assert made.cost == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_lines_name_the_machine_the_limits_and_what_is_missing() -> None:
    lines: list[str] = []
    bench_fit(lines.append, samples=1024, operators=2, peer_samples=120, largest=1e-6, repeats=1)
    text = "\n".join(lines)
    for words in ("machine:", "cores", "limit 10 s", "SciPy", "CasADi", "opty: not measured"):
        assert words in text
    for growing in ("samples", "free parameters", "operators", "records", "starts"):
        assert growing in text
    assert np.all([len(x) > 20 for x in lines])
