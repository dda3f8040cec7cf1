"""A map of columns says what differs; names that agree are found, from Python as from a shell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.datasets.opening import open_recording
from identification.diagnosis.search.asked import asked_of
from identification.study.study import Study

ROWS = [f"{0.01 * k:g},{k % 7},{0.1 * k:g},idle" for k in range(40)]


def carriage() -> BondGraph:
    with BondGraph("carriage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", stiffness=10.0, unit="N/m")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    return g


def table(folder: Path, header: str, rows: list[str] = ROWS) -> Path:
    file = folder / "run.csv"
    file.write_text("\n".join([header, *rows]), encoding="utf-8")
    return file


def test_only_what_differs_is_written(tmp_path: Path) -> None:
    file = table(tmp_path, "t_s,F[N],position_mm,state")
    read = Recording.read(file, map={"x": "position"})
    assert set(read.channels) == {"F", "x"}
    assert read["x"][10] == pytest.approx(1e-3)
    assert read.notes == ("without a unit, so left out: 'state'",)
    assert Study(carriage(), read).graph.name == "carriage"
    assert set(Recording.read(file, map={"x": "position", "*": ""}).channels) == {"x"}


def test_a_column_that_is_broken_leaves_the_others_out_and_says_why(tmp_path: Path) -> None:
    rows = [*ROWS[:5], "0.05,,0.5,idle", *ROWS[6:]]
    read = Recording.read(table(tmp_path, "t_s,F[N],x_mm,state", rows), map={"x": "x"})
    assert list(read.channels) == ["x"]
    with pytest.raises(BondsightError, match=r"no channel for input 'F'.* only the columns of the"):
        Study(carriage(), read)


def test_a_map_of_the_time_alone_keeps_the_reason(tmp_path: Path) -> None:
    rows = ["0,1", "0.1,", "0.2,3"]
    with pytest.raises(UnusableInput, match="NaN, infinite or empty"):
        Recording.read(table(tmp_path, "clock_s,x_m", rows), map={"t": "clock"})
    read = Recording.read(table(tmp_path, "clock_s,x_m", ["0,1", "0.1,2", "0.2,3"]), {"t": "clock"})
    assert list(read.channels) == ["x"]


def test_a_diagnosis_takes_the_map_of_the_shell(tmp_path: Path) -> None:
    file = table(tmp_path, "t_s,F[N],place_mm,state")
    (read,) = asked_of(carriage(), file, None, None, {}, {"x": "place_mm"}).recordings
    assert set(read.channels) == {"F", "x"}
    (same,) = asked_of(carriage(), Recording.read(file, {"place": "place"}), None, None, {},
                       {"x": "place"}).recordings  # fmt: skip
    assert np.array_equal(read["x"], same["x"])
    study = Study(carriage(), read)
    with pytest.raises(UnusableInput, match=r"beside a study.*Recording\.read\(path, map="):
        asked_of(study, None, None, None, {}, {"x": "place"})


def test_a_column_that_the_model_does_not_need_may_lack_a_unit(tmp_path: Path) -> None:
    read, _, _ = open_recording(str(table(tmp_path, "t_s,F[N],x_mm,state")), carriage())
    assert set(read.channels) == {"F", "x"}
    assert "left out: 'state'" in read.notes[0]
    with pytest.raises(UnusableInput, match="'x': no unit"):
        open_recording(str(table(tmp_path, "t_s,F[N],x,state")), carriage())


@pytest.mark.parametrize("wrong", ["x=place", ["x"], {"x": 3}])
def test_what_is_no_map_is_told(wrong: Any, tmp_path: Path) -> None:
    file = table(tmp_path, "t_s,F[N],place_mm,state")
    for read in (Recording.read, lambda f, m: asked_of(carriage(), f, None, None, {}, m)):
        with pytest.raises(UnusableInput, match=r"such as map=\{'x': 'displacement\[um\]'\}"):
            read(file, wrong)


def test_the_beginning_of_a_column_is_near_enough(tmp_path: Path) -> None:
    file = table(tmp_path, "t_s,F[N],place_mm,state")
    with pytest.raises(BondsightError, match="Did you mean 'place_mm'"):
        Recording.read(file, {"x": "pla"})
