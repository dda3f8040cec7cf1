"""The benchmark of the diagnosis: its plant, its cases, its arithmetic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.benchmarks import diagnosis as bench_diagnosis
from tests.benchmarks.diagnosis import Case, Cost, cases, chain, exponent, record
from tests.settled import simulate


@pytest.mark.parametrize(("masses", "sensors"), [(2, 1), (4, 3), (8, 3)])
def test_the_model_is_sound_and_reads_what_is_recorded(masses: int, sensors: int) -> None:
    graph = chain(masses, sensors)
    assert graph.check() == ()
    recording = record(Case(samples=60, masses=masses, sensors=sensors))
    read = [n for n in recording.channels if n != "F"]
    assert len(read) == sensors
    assert set(recording.channels) <= set(graph.elements)


def test_more_sensors_than_masses_are_refused() -> None:
    with pytest.raises(ValueError, match="3 sensors"):
        chain(2, 3)


def test_without_what_is_concealed_the_plant_is_the_model() -> None:
    values = {"g_1": 1500.0, "k_2": 1500.0, "d_2": 1.5}
    values |= {"m_1": 0.5, "m_2": 0.5, "b_1": 2.0, "b_2": 2.0}

    def gap(concealed: str) -> float:
        recording = record(Case(samples=400, masses=2, sensors=2, concealed=concealed))
        run = simulate(chain(2, 2), recording.time, {"F": recording["F"]}, values)
        return float(np.std(recording["x_2"] - run["x_2"]))

    assert gap("nothing") < 2e-5
    for concealed in bench_diagnosis.CONCEALED:
        if concealed != "nothing":
            assert gap(concealed) > 2e-4, concealed


def test_where_the_time_went() -> None:
    said = [
        (0.5, "fitting the model as it is"),
        (2.0, "screening every effect at every port"),
        (5.0, "fitting backlash at k"),
        (6.0, "fitting end_stop at k"),
        (9.0, "done"),
    ]
    stages = bench_diagnosis._stages(said, 9.0)
    assert stages == {
        "reading the recording": 0.5,
        "fitting the model as it is": 1.5,
        "screening every effect at every port": 3.0,
        bench_diagnosis.SEARCH: 1.0,
        "deciding": 3.0,
    }


def test_the_whole_measurement_is_the_one_with_a_limit() -> None:
    whole, families = cases()
    assert whole == Case(20_000, 4, 3, 1.0, 2)
    assert [c.samples for c in families["samples"]] == [2500, 5000, 10_000, 20_000]
    assert [c.masses for c in families["masses"]] == [2, 4, 8]
    assert [c.sensors for c in families["sensors"]] == [1, 2, 3]
    left = [
        len(DiagnosisOptions(without=bench_diagnosis._left_out(c.catalogue)).catalogue)
        for c in families["catalogue"]
    ]
    assert left[-1] == len(CATALOGUE)
    assert left[0] == pytest.approx(0.25 * len(CATALOGUE), abs=2)
    assert left[1] == pytest.approx(0.5 * len(CATALOGUE), abs=2)


def test_exponent_of_a_power() -> None:
    found = {float(n): Cost(3e-4 * n**1.5, 0.0, 0, 0, "") for n in (10, 20, 80)}
    assert exponent(found) == pytest.approx(1.5)


def test_a_failure_is_a_row_and_not_a_crash() -> None:
    made = bench_diagnosis.cost(replace(Case(), samples=50, masses=2, sensors=3))
    assert np.isnan(made.seconds)
    assert "3 sensors" in made.answer
