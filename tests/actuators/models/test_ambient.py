"""Temperatures of the thermal models are above ambient, wherever a recording counts them from."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.models.plants.oven import oven
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from bondsight.cli.main import main
from identification.estimation.estimate import estimate
from identification.study.study import Study

TIME = np.arange(1200) * 5.0
POWER = np.repeat(np.random.default_rng(1).choice([0.0, 20.0, 40.0], 12), 100)
TRUE = {"C_1": 380.0, "R_12": 0.22, "C_2": 1600.0, "R_out": 0.45}


def test_without_heat_a_model_is_at_ambient() -> None:
    still = simulate(oven(), TIME, {"P": 0.0 * TIME}, TRUE)
    assert np.abs(still["T_2"]).max() == 0.0


@pytest.mark.parametrize(("unit", "room"), [("K", 0.0), ("degC", 22.0), ("K", 295.15)])
def test_a_constant_ambient_is_the_offset_of_the_readings(unit: str, room: float) -> None:
    rng = np.random.default_rng(2)
    warm = simulate(oven(), TIME, {"P": POWER}, TRUE)
    read = {n: warm[n] + room + 0.02 * rng.standard_normal(TIME.size) for n in ("T_1", "T_2")}
    run = {"t[s]": TIME, "P[W]": POWER, **{f"{n}[{unit}]": v for n, v in read.items()}}
    found = estimate(Study(oven(), Recording.from_arrays("run", run)))
    for name, value in TRUE.items():
        assert found.values[name] == pytest.approx(value, rel=0.01)
    offsets = {n.name: n.value for n in found.nuisances if n.name.startswith("offset")}
    assert offsets == pytest.approx({"offset T_1": room, "offset T_2": room}, abs=0.1)


def test_the_models_say_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "oven", "thermal_lag"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "temperatures are above the room's" in said
    assert "a constant room is the offset of the readings" in said
    assert "y is above ambient" in said
