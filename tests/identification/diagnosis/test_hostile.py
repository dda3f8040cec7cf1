"""Recordings that are mixed up: told as such, never as physics; and models that cannot be run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from actuators.models.plants import plant_model
from bondgraph import BondGraph
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from hardware.simulators.generator import draw
from hardware.simulators.generator.making import record
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import verdict

Channels = dict[str, Array]
SAMPLES = 600
OPTIONS = DiagnosisOptions(jobs=1, keep=2, more=0, effects=1)


@pytest.fixture(scope="module")
def plain() -> tuple[BondGraph, Channels]:
    """Two masses of a chain driven by a multisine, nothing concealed."""
    case = next(
        c
        for c in draw("development", 3, 120)
        if c.plant == "chain" and c.cell == "control" and c.control_kind == "plain"
    )
    made, _ = record(case)
    kept = {"F": made["F"], **{n: made[n] for n in case.sensors}}
    channels = {n: np.asarray(v, float)[:SAMPLES] for n, v in kept.items()}
    channels["time"] = np.asarray(made["time"], float)[:SAMPLES]
    return plant_model("chain", case.sensors), channels


def diagnosed(graph: BondGraph, channels: Channels) -> Diagnosis:
    step = float(channels["time"][1] - channels["time"][0])
    units = {"F": "N"}
    named = {f"{n}[{units.get(n, 'm')}]": v for n, v in channels.items() if n != "time"}
    return diagnose(graph, Recording.from_arrays("hostile", named, fs=1.0 / step), options=OPTIONS)


def exchanged(c: Channels) -> Channels:
    a, b = [n for n in c if n.startswith("x_")][:2]
    return {**c, a: c[b], b: c[a]}


def turned(c: Channels) -> Channels:
    last = [n for n in c if n.startswith("x_")][-1]
    return {**c, last: -c[last]}


def thousandfold(c: Channels) -> Channels:
    first = next(n for n in c if n.startswith("x_"))
    return {**c, first: 1000.0 * c[first]}


@pytest.mark.parametrize(
    ("mistake", "word"),
    [
        (exchanged, "exchanged"),
        # quicker ones of both: test_other_quantity, test_forgotten_units
        pytest.param(turned, "wrong sign", marks=pytest.mark.long),
        pytest.param(thousandfold, "times too large", marks=pytest.mark.long),
    ],
)
def test_a_mixed_up_recording_is_told_as_such(
    plain: tuple[BondGraph, Channels], mistake: Callable[[Channels], Channels], word: str
) -> None:
    graph, channels = plain
    d = diagnosed(graph, mistake(channels))
    assert d.kind == "unknown_physics"
    assert word in d.advice[0]
    v = verdict(d)
    assert [f["effect"] for f in v["findings"]] == ["unknown"]
    assert v["findings"][0]["location"]["element"] == ""


def test_the_same_recording_unharmed_is_explained(plain: tuple[BondGraph, Channels]) -> None:
    assert diagnosed(*plain).kind in ("explained", "parameters_only")


@pytest.mark.parametrize("which", [0, -1])
def test_a_reading_that_stands_still_is_told(plain: tuple[BondGraph, Channels], which: int) -> None:
    graph, channels = plain
    name = [n for n in channels if n.startswith("x_")][which]
    d = diagnosed(graph, {**channels, name: np.full(SAMPLES, 1e-3)})
    assert d.kind == "insufficient_data"
    assert f"the reading {name} is constant" in d.advice[0]


@pytest.mark.long
def test_a_recording_of_another_system_gets_no_name(plain: tuple[BondGraph, Channels]) -> None:
    graph, channels = plain
    rng = np.random.default_rng(2)
    foreign = {
        n: v if n in ("F", "time") else np.cumsum(rng.standard_normal(SAMPLES)) * 1e-4
        for n, v in channels.items()
    }
    assert diagnosed(graph, foreign).kind != "missing_physics"


def test_three_samples_are_too_few(plain: tuple[BondGraph, Channels]) -> None:
    graph, channels = plain
    d = diagnosed(graph, {n: v[:3] for n, v in channels.items()})
    assert d.kind == "insufficient_data"
    assert "too few" in d.advice[0]


def test_a_gap_in_a_reading_is_refused_in_one_line(plain: tuple[BondGraph, Channels]) -> None:
    graph, channels = plain
    first = next(n for n in channels if n.startswith("x_"))
    holes = channels[first].copy()
    holes[100:120] = np.nan
    with pytest.raises(BondsightError, match=first) as refused:
        diagnosed(graph, {**channels, first: holes})
    assert "\n" not in str(refused.value)
