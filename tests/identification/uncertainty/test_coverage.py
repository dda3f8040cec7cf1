"""Coverage: counting, seeds, colours; and the commands that print it."""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
import pytest

from actuators.models.textbook import thermal_lag
from bondgraph.support.errors import UnknownName, UnusableInput
from bondsight.cli.identifiability import add_identifiability_command
from identification.uncertainty.cases import case_of
from identification.uncertainty.coverage import Count, Coverage, coverage, trial
from tests.proof.coverage.command import add_coverage_command
from tests.proof.coverage.demo import demo_cases


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    verbs = parser.add_subparsers()
    add_coverage_command(verbs)
    add_identifiability_command(verbs)
    options = parser.parse_args(words)
    return int(options.run(options))


def test_the_share_of_hits_has_an_interval() -> None:
    assert Count("fisher", "k", 0, 0, 1.0).interval == (0.0, 1.0)
    found = Count("fisher", "k", 190, 200, 1.0).interval
    assert found == pytest.approx((0.9104, 0.9726), abs=1e-3)


def small(colour: float = 0.0) -> Coverage:
    case = replace(case_of(thermal_lag(), samples=300), colour=colour)
    return coverage(case, 25, kinds=("fisher", "sandwich"))


@pytest.mark.long
def test_white_noise_is_covered_and_coloured_only_by_the_sandwich() -> None:
    white, coloured = small(), small(0.9)
    assert white.failed == 0
    assert white.overall("fisher") > 0.85
    assert coloured.overall("fisher") < 0.8
    assert coloured.overall("sandwich") > 0.85
    assert "nominal  actual" in str(white)


@pytest.mark.long
def test_result_does_not_depend_on_the_number_of_processes() -> None:
    case = case_of(thermal_lag(), samples=200)
    one = coverage(case, 3, kinds=("fisher",), jobs=1)
    two = coverage(case, 3, kinds=("fisher",), jobs=2)
    assert one == two
    later = coverage(case, 1, kinds=("fisher",), first=2)
    assert trial(case, 3, ("fisher",)) != trial(case, 2, ("fisher",))
    assert sum(c.hits for c in later.counts) <= sum(c.hits for c in one.counts)


def test_noise_has_the_level_and_colour_asked_for() -> None:
    case = demo_cases(samples=4000)[1]
    left = case.recording(0)["x"] - case.clean["x"]
    assert left.std() == pytest.approx(case.noise["x"], rel=0.1)
    assert np.corrcoef(left[1:], left[:-1])[0, 1] == pytest.approx(0.8, abs=0.04)
    other = demo_cases(samples=4000)[0]
    assert not np.allclose(other.recording(0)["x"] - other.clean["x"], left)


def test_hysteretic_case_runs_with_profiles() -> None:
    case = demo_cases(samples=300)[3]
    assert case.free == ("m", "d", "k", "h_1_k", "h_2_k")
    found = trial(case, 0)
    assert found is not None
    assert set(found) == {(k, n) for k in ("fisher", "sandwich", "profile") for n in case.free}


def test_bad_cases_are_refused() -> None:
    case = case_of(thermal_lag(), samples=100)
    with pytest.raises(UnusableInput, match="colour"):
        replace(case, colour=1.0)
    with pytest.raises(UnknownName, match="no parameter"):
        replace(case, free=("k",))
    with pytest.raises(UnknownName, match="kind of interval"):
        coverage(case, 1, kinds=("hope",))


def test_command_prints_nominal_and_actual(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("coverage", "thermal_lag", "--trials", "3", "--samples", "200", "--jobs", "1") == 0
    text = capsys.readouterr().out
    assert "thermal_lag: 3 trials" in text
    for kind in ("fisher", "sandwich", "profile"):
        assert f"{kind:10s} all" in text
    with pytest.raises(UnusableInput, match="--noise"):
        run("coverage", "--noise", "0")


def test_command_tells_what_a_model_determines(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("identifiability", "stack_bond_graph") == 0
    text = capsys.readouterr().out
    assert "4 of 6 numbers" in text
    assert "Df (flow) at loop: +2" in text
    with pytest.raises(UnusableInput, match="give --recording"):
        run("identifiability", "resonator", "--profiles")


@pytest.mark.recordings
def test_command_fits_a_recording(capsys: pytest.CaptureFixture[str]) -> None:
    from identification.datasets import available

    if not available("hair_dryer"):
        pytest.skip("the hair dryer recording is not here")
    assert run("identifiability", "thermal_lag", "--recording", "hair_dryer", "--jobs", "1") == 0
    text = capsys.readouterr().out
    assert "the data determine every parameter: K, R_th" in text
    assert "if the model were right" in text
