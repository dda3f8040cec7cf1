"""The EMPS recording: closed loop, dry friction; published M = 95.1, F_v = 203.5, F_c = 20.4."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from actuators.models.textbook import mass_with_viscous_friction
from bondgraph import BondGraph, Parameter, Recording
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Split
from identification import datasets as data
from identification.estimation import NO_NUISANCES, Estimation, FitStatus, Study, estimate

pytestmark = pytest.mark.recordings

PUBLISHED = {"M": 95.1, "F_v": 203.5, "F_c_F_v": 20.4}


@pytest.fixture(scope="module")
def record() -> tuple[Recording, Split]:
    if not data.available("emps"):
        pytest.skip(f"emps: set {data.FOLDER_VARIABLE} to the folder of the recordings")
    return data.load("emps")


def study(dry: bool, record: tuple[Recording, Split], *process_noise: str, **more: Any) -> Study:
    # the controller's output is held between samples
    usual = {"hold": "hold", "nuisances": NO_NUISANCES, "splits": record[1]}
    return Study(carriage(dry), record[0], process_noise=process_noise, **{**usual, **more})


def carriage(dry: bool) -> BondGraph:
    g = mass_with_viscous_friction(100.0, 200.0)
    offset = Parameter("offset_F", 0.0, "N", positive=False, lower=-50.0, upper=50.0, scale=5.0)
    g = g.with_element("F", offset="offset_F").with_parameters([offset])
    return g.with_element("F_v", law=Coulomb(15.0)) if dry else g


def fitted(record: tuple[Recording, Split], *process_noise: str) -> Estimation:
    return estimate(study(True, record, *process_noise), method="prediction_error")


@pytest.mark.long
def test_published_parameters_in_closed_loop(record: tuple[Recording, Split]) -> None:
    found = fitted(record, "M")
    assert found.status is FitStatus.CONVERGED
    for name, value in PUBLISHED.items():
        assert found.values[name] == pytest.approx(value, rel=0.03)
        low, high = found.estimate_of(name).ci95
        assert low < value < high
    assert found.filtered is not None
    data = found.problem().data
    error = (data.readings - found.filtered.reading[0])[data.mask("test")]
    assert np.sqrt(np.mean(error**2)) < 2e-7
    assert any("jumps" in n for n in found.notes)


@pytest.mark.long
def test_output_errors_are_further_off(record: tuple[Recording, Split]) -> None:
    with_noise, without = fitted(record, "M"), fitted(record)
    off = [
        np.max([abs(f.values[n] / v - 1) for n, v in PUBLISHED.items()])
        for f in (with_noise, without)
    ]
    assert off[0] < off[1]
    assert with_noise.filtered is not None
    assert without.filtered is not None
    assert with_noise.filtered.log_likelihood > without.filtered.log_likelihood + 1e4
