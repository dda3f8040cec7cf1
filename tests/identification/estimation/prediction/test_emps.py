"""The EMPS recording: closed loop, dry friction; published M = 95.1, F_v = 203.5, F_c = 20.4."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.models.textbook import mass_with_viscous_friction
from bondgraph import BondGraph, Parameter
from bondgraph.laws import Coulomb
from identification import datasets as data
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.prediction import (
    PredictionModel,
    deficient_equations,
    fit_prediction,
)
from identification.study.problem import Data, data_for

pytestmark = pytest.mark.recordings

PUBLISHED = {"M": 95.1, "F_v": 203.5, "F_c_F_v": 20.4}


@pytest.fixture(scope="module")
def record() -> Data:
    if not data.available("emps"):
        pytest.skip(f"emps: set {data.FOLDER_VARIABLE} to the folder of the recordings")
    recording, split = data.load("emps")
    # the controller's output is held between samples
    return data_for(carriage(False), recording, split, {"x": 1e-6}, "hold")


def carriage(dry: bool) -> BondGraph:
    g = mass_with_viscous_friction(100.0, 200.0)
    offset = Parameter("offset_F", 0.0, "N", positive=False, lower=-50.0, upper=50.0, scale=5.0)
    g = g.with_element("F", offset="offset_F").with_parameters([offset])
    return g.with_element("F_v", law=Coulomb(15.0)) if dry else g


@pytest.mark.long
def test_published_parameters_in_closed_loop(record: Data) -> None:
    found = fit_prediction(PredictionModel(carriage(True), (record,), ("M",)))
    assert found.status is FitStatus.CONVERGED
    for name, value in PUBLISHED.items():
        assert found.values[name] == pytest.approx(value, rel=0.03)
        low, high = found[name].ci95
        assert low < value < high
    assert found.rmse("test")["x"] < 2e-7
    assert any("jumps" in r for r in found.remarks)


@pytest.mark.long
def test_output_errors_are_further_off(record: Data) -> None:
    dry = PredictionModel(carriage(True), (record,))
    with_noise = fit_prediction(PredictionModel(carriage(True), (record,), ("M",)))
    without = fit_prediction(dry)
    off = [
        np.max([abs(f.values[n] / v - 1) for n, v in PUBLISHED.items()])
        for f in (with_noise, without)
    ]
    assert off[0] < off[1]
    assert with_noise.log_likelihood > without.log_likelihood + 1e4


def test_the_deficient_equation_of_the_viscous_model(record: Data) -> None:
    short = data_for(carriage(False), *data.load("emps"), {"x": 1e-6}, "hold").thinned(4)
    report = deficient_equations(PredictionModel(carriage(False), (short,), noise={"x": 1e-6}))
    assert report.places[0].place == "p_M"
    assert "p_M is deficient" in str(report)
