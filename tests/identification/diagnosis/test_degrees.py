"""Temperatures that were given in degC are shown in degC, with the numbers of the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Recording, Se, Sf, Zero
from bondgraph.signals.split import Split
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.advice import _beyond_training
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.localisation.recording.axes import axes_of
from identification.diagnosis.report.checked import _range
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.studio.content import content
from identification.diagnosis.verdict.folder import NEXT, write_verdict
from identification.estimation.single_record import fit
from identification.study.data import data_for
from identification.study.problem import Problem
from tests.settled import simulate

TIME = np.asarray(2.0 * np.arange(400), np.float64)


def plate() -> BondGraph:
    """A heated plate that loses heat to a room of which the temperature is recorded."""
    with BondGraph("plate") as g:
        body, wall = Zero("body"), One("wall")
        Sf("P", unit="W") >> body >> C("c", 90.0, unit="J/K")
        body >> wall >> R("r", 0.8, unit="K/W")
        wall >> Se("room", unit="K")
        body >> De("T", unit="K")
    return g


def diagnosed(unit: str) -> Diagnosis:
    power, room = 10.0 * (np.sin(TIME / 90) > 0), 22.0 + 3.0 * np.sin(TIME / 200)
    read = simulate(plate(), TIME, {"P": power, "room": room})["T"]
    read = read + 0.02 * np.random.default_rng(0).standard_normal(TIME.size)
    run = Recording.from_arrays(
        "run", {"t[s]": TIME, "P[W]": power, f"room[{unit}]": room, f"T[{unit}]": read}
    )
    split = Split(slice(0, 100), slice(100, TIME.size), "first part")
    nominal = fit(Problem(plate(), data_for(plate(), run, split, {"T": 0.02})), max_iterations=3)
    return Diagnosis(
        "unknown_physics", "plate", run, plate(), nominal.problem.data, nominal=nominal,
        scene=scene(nominal),
    )  # fmt: skip


@pytest.mark.parametrize("unit", ["degC", "K"])
def test_a_channel_is_shown_in_the_unit_of_its_file(unit: str, tmp_path: Path) -> None:
    d = diagnosed(unit)
    (reading,) = content(d)["readings"]
    assert reading["label"] == f"T ({unit})"
    assert d.plot()[0, 0].get_ylabel() == f"T, {unit}"
    assert f"room 19.7 … 25.0 {unit}" in " ".join(_range(d))
    assert f" {unit} in the held-out part" in _beyond_training(d)
    assert d.scene is not None
    level, rate, *_ = axes_of(d.graph, "T", d.scene.past["T"], d.recording.read_in)
    assert (level.unit, rate.unit) == (unit, "K/s")
    wave = Experiment(
        "a wave", "tone", 9.0, 1.0, TIME.size, 3.0, ("a", "b"), {"room": np.sin(TIME), "P": TIME}
    )
    write_verdict(replace(d, experiments=(wave,)), tmp_path)
    head = (tmp_path / NEXT).read_text().splitlines()[0]
    assert Recording.read(tmp_path / NEXT).read_in["room"] == unit, head
    if unit == "degC":
        assert any("K above 0 degC" in n for n in d.recording.notes)
