"""What instruments write: preambles, units in a line of their own, dates, gaps, missing values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph import Recording, UnusableInput
from bondgraph.support.errors import nearest
from bondsight.cli.main import main

LABVIEW = (
    "LabVIEW Measurement\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\n\n"
    "Channels\t2\nSamples\t3\t3\n***End_of_Header***\n"
    "t[s]\tF[N]\tx[um]\tComment\n0,000\t1,5\t2\n0,001\t2,5\t3\n0,002\t3,5\t4\n"
)
SCOPE = (
    "Device: rig 3\nModel,TBS1052B\nRecord Length,3\nSample Interval,0.001\n\n"
    "Time,Force,Place\n(ms),(N),(um)\n\n0,1,2\n1,2,3\n2,3,4\n"
)
DATES = (
    "t_s,x[um]\n2024-03-01T12:00:00.000,1\n2024-03-01T12:00:00.010,2\n2024-03-01T12:00:00.020,3\n"
)


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "run.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_stands_above_the_names_is_passed_over(tmp_path: Path) -> None:
    r = Recording.read(write(tmp_path, LABVIEW), map={"F": "F", "x": "x"})
    assert r["F"].tolist() == [1.5, 2.5, 3.5]
    assert r.dt == pytest.approx(1e-3)


def test_units_may_stand_below_the_names(tmp_path: Path) -> None:
    r = Recording.read(write(tmp_path, SCOPE))
    assert r.units == {"Force": "N", "Place": "m"}
    assert r["Place"] == pytest.approx([2e-6, 3e-6, 4e-6])
    assert r.dt == pytest.approx(1e-3)


def test_errors_below_a_preamble_still_count_its_lines(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match=r"row 10.*'a' is not a number"):
        Recording.read(write(tmp_path, SCOPE.replace("1,2,3", "1,a,3")))


def test_a_wrong_cell_makes_no_names_of_its_row(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match=r"row 2.*'one' is not a number"):
        Recording.read(
            write(tmp_path, "t_s,x[um]\nnought,one\n0.1,2\n0.2,3\n"), map={"x": "x"}, fs=10
        )


def test_dates_are_seconds_since_the_first(tmp_path: Path) -> None:
    r = Recording.read(write(tmp_path, DATES))
    assert r.time == pytest.approx([0.0, 0.01, 0.02], abs=1e-12)
    assert "time counts from 2024-03-01T12:00:00+00:00" in r.notes


@pytest.mark.parametrize("name", ["timestamp", "Date Time", "time_stamp", "timestamp [ms]"])
def test_a_time_stamp_is_the_time_where_no_column_is_called_so(tmp_path: Path, name: str) -> None:
    stamps = (
        ["0", "10", "20"] if "ms" in name else [f"2024-03-01T12:00:00.{i:03d}" for i in (0, 10, 20)]
    )
    rows = "".join(f"{s},{i}\n" for i, s in enumerate(stamps))
    r = Recording.read(write(tmp_path, f"{name},x[um]\n{rows}"))
    assert r.time == pytest.approx([0.0, 0.01, 0.02], abs=1e-12)
    assert list(r.channels) == ["x"]


def test_beside_a_time_a_stamp_is_no_channel(tmp_path: Path) -> None:
    r = Recording.read(write(tmp_path, "time,timestamp,x[um]\n0,7,1\n1,8,2\n2,9,3\n"))
    assert r.time == pytest.approx([0.0, 1.0, 2.0])
    assert list(r.channels) == ["x"]


def test_rows_are_those_that_errors_number(tmp_path: Path) -> None:
    text = "t_s,x[um]\n" + "".join(f"{i / 10},{'nan' if i == 2 else i}\n" for i in range(8))
    path = write(tmp_path, text)
    with pytest.raises(UnusableInput, match=r"rows=\(5, 9\).*row 5 to row 9"):
        Recording.read(path)
    r = Recording.read(path, rows=(5, 9))
    assert 1e6 * r["x"] == pytest.approx([3, 4, 5, 6, 7])
    assert Recording.read(path, rows=(7, None)).n == 3
    with pytest.raises(UnusableInput, match="no row from 20 to 30; there are row 2 to row 9"):
        Recording.read(path, rows=(20, 30))


def test_uneven_stamps_are_put_on_a_grid_that_is_asked_for(tmp_path: Path) -> None:
    t = np.array([0.0, 0.1, 0.2, 0.5, 0.6, 0.7])
    path = write(tmp_path, "t_s,x[m]\n" + "".join(f"{a:.1f},{3 * a:.1f}\n" for a in t))
    with pytest.raises(UnusableInput, match=r"resample=10.*rows=.*fs="):
        Recording.read(path)
    r = Recording.read(path, resample=10.0)
    assert r["x"] == pytest.approx(3 * np.arange(8) / 10)
    with pytest.raises(UnusableInput, match="fold"):
        Recording.read(path, resample=1.0)
    with pytest.raises(UnusableInput, match=r"onto 1e\+12 Hz .* recorded 10 Hz .*resample=10\)"):
        Recording.read(path, resample=1e12)
    assert Recording.read(path, resample=100.0).n > 5 * r.n


def table(path: Path, t: np.ndarray, x: np.ndarray) -> Path:
    rows = (f"{a:.2f},{b},{2 * a:.2f}\n" for a, b in zip(t, x, strict=True))
    return write(path, "t_s,x[m],F[N]\n" + "".join(rows))


def test_lines_are_drawn_across_missing_samples_that_are_few(tmp_path: Path) -> None:
    t = 0.1 * np.arange(12)
    x = 3.0 * t
    x[4] = np.nan
    path = table(tmp_path, np.delete(t, 8), np.delete(x, 8))  # one value and one row are missing
    with pytest.raises(UnusableInput, match=r"row 6; remove or fill them.*\(fill=1\)"):
        Recording.read(path)
    r = Recording.read(path, fill=1)
    assert r.time == pytest.approx(t)
    assert r["x"] == pytest.approx(3.0 * t)
    assert r["F"] == pytest.approx(2.0 * t)
    (note,) = r.notes
    assert "at most 1 in a row: 2 of 'x[m]', 1 of 'F[N]'; the first beside row 6" in note
    # without a column of time a row that is left out cannot be seen
    assert Recording.read(path, fs=10.0, fill=1).n == 11
    with pytest.raises(UnusableInput, match=r"fill = 1\.5"):
        Recording.read(path, fill=1.5)  # type: ignore[arg-type]


def test_a_row_that_is_left_out_is_offered_to_be_filled(tmp_path: Path) -> None:
    t = np.delete(0.1 * np.arange(12), [5, 6])
    path = table(tmp_path, t, t)
    with pytest.raises(UnusableInput, match=r"uneven.*\(fill=2\).*resample=10.*rows=.*fs="):
        Recording.read(path)
    with pytest.raises(UnusableInput, match="uneven"):
        Recording.read(path, fill=1)
    assert Recording.read(path, fill=2).n == 12


@pytest.mark.parametrize("bad", [(0,), (11,), (3, 4)])
def test_ends_and_longer_gaps_are_not_filled(bad: tuple[int, ...], tmp_path: Path) -> None:
    t = 0.1 * np.arange(12)
    x = t.copy()
    x[list(bad)] = np.nan
    with pytest.raises(UnusableInput, match="NaN, infinite or empty"):
        Recording.read(table(tmp_path, t, x), fill=1)
    x[list(bad)] = np.inf
    with pytest.raises(UnusableInput, match="NaN, infinite or empty") as refused:
        Recording.read(table(tmp_path, t, x), fill=2)
    assert "fill=" not in str(refused.value)


@pytest.mark.parametrize("fill", [None, "a", np.nan, np.inf, True, -1, 1.5, [1]])
def test_a_fill_that_is_no_number_of_samples_is_refused(fill: Any) -> None:
    with pytest.raises(UnusableInput, match="fill = "):
        Recording.from_arrays("r", {"t_s": [0.0, 0.1], "x[m]": [1.0, 2.0]}, fill=fill)


@pytest.mark.parametrize("column", ["t_s", "fs_hz", "both"])
def test_filling_is_not_offered_where_it_does_not_help(column: str) -> None:
    t, x = 0.1 * np.arange(12), np.arange(12.0)
    base = np.full(12, 10.0) if column == "fs_hz" else t
    base[7] = np.nan
    if column == "both":
        x[4] = np.nan
    arrays = {"x[m]": x, "fs_hz" if column == "fs_hz" else "t_s": base}
    for fill in (0, 1):
        with pytest.raises(UnusableInput, match="NaN, infinite or empty") as refused:
            Recording.from_arrays("r", arrays, fill=fill)
        assert "fill=" not in str(refused.value)
    with pytest.raises(UnusableInput, match="NaN, infinite or empty") as refused:
        Recording("r", np.arange(3.0), {"x": np.array([1.0, np.nan, 2.0])}, {"x": "m"})
    assert "fill=" not in str(refused.value)


@pytest.mark.parametrize("stand_in", [-9999.0, 9999.0, -999.0, 1e30, 65535.0])
def test_numbers_that_stand_for_no_value_are_told_with_their_rows(
    stand_in: float, tmp_path: Path
) -> None:
    t = 0.1 * np.arange(100)
    x = np.sin(t)
    spoilt = x.copy()
    spoilt[[20, 60, 61]] = stand_in
    path = table(tmp_path, t, spoilt)
    with pytest.raises(UnusableInput) as refused:
        Recording.read(path)
    said = str(refused.value)
    assert f"column 'x[m]': {stand_in:.9g} in rows 22, 62, 63, far outside all other" in said
    assert "(fill=2)" in said
    assert "\n" not in said
    assert Recording.read(path, fill=2)["x"] == pytest.approx(x, abs=0.02)
    with pytest.raises(UnusableInput, match=r"2 of 100 values .* row 62 \('"):
        Recording.read(path, fill=1)


@pytest.mark.parametrize(
    "x",
    [
        np.linspace(0.0, 9999.0, 100),  # counts that reach it
        np.where(np.arange(100) == 50, 9999.0, 0.0),  # an impulse of a round height
        np.where(np.arange(100) < 50, 0.1 * (np.arange(100) % 7), 9999.0),  # too many for a gap
    ],
)
def test_the_same_numbers_may_be_measured(x: np.ndarray, tmp_path: Path) -> None:
    path = table(tmp_path, 0.1 * np.arange(100), x)
    assert Recording.read(path)["x"] == pytest.approx(x)


def test_a_single_value_far_outside_all_others_is_noted(tmp_path: Path) -> None:
    t = 0.1 * np.arange(200)
    x = np.sin(t)
    x[20] = 123.0
    r = Recording.read(table(tmp_path, t, x))
    assert r["x"][20] == 123.0
    (note,) = r.notes
    assert "'x[m]' in row 22 (123)" in note
    x[20] = 5.0
    assert not Recording.read(table(tmp_path, t, x)).notes


def test_the_command_names_it_before_anything_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.py"
    model.write_text(MODEL)
    x = np.cos(0.1 * np.arange(200))
    x[20] = 123.0
    path = table(tmp_path, 0.1 * np.arange(200), x)
    main(["diagnose", str(path), "--model", str(model), "--time", "0.001", "--quiet"])
    assert "in row 22 (123): if the sensor" in capsys.readouterr().err


MODEL = """
from bondgraph import BondGraph, Dq, I, One, Se

def model():
    with BondGraph("cart") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> Dq("x", unit="m")
    return g
"""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--map", "zz=F"], "no source or sensor 'zz'"),
        (["--fs", "fast"], "'fast' is no positive number"),
        (["--rows", "7"], "not FIRST:LAST"),
        (["--without", "stribek"], "stribeck_friction"),
    ],
)
def test_bad_words_are_answered(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, model = write(tmp_path, "t_s,F[N],x[m]\n0,1,2\n1,2,3\n"), tmp_path / "m.py"
    model.write_text(MODEL)
    try:
        code = main(["diagnose", str(path), "--model", str(model), *words])
    except SystemExit as stop:
        code = int(str(stop.code))
    assert code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_part_of_a_long_name_is_recognised() -> None:
    assert nearest("stribek", ["backlash", "stribeck_friction"]) == ("stribeck_friction",)


def test_a_map_says_the_unit_of_the_time(tmp_path: Path) -> None:
    text = "Zeit;F[N]\n" + "\n".join(f"{2 * k};{k % 5}" for k in range(20))
    file = write(tmp_path, text)
    with pytest.raises(UnusableInput, match=r"such as map=\{'t': 'Zeit\[s\]'\}"):
        Recording.read(file)
    assert Recording.read(file, map={"t": "Zeit[ms]"}).dt == pytest.approx(2e-3)
    assert Recording.read(file, map={"t": "Zeit"}).dt == pytest.approx(2.0)
    with pytest.raises(UnusableInput, match="not in a unit of time"):
        Recording.read(file, map={"t": "Zeit[mm]"})
    stated = write(tmp_path, text.replace("Zeit", "t_ms"))
    assert Recording.read(stated, map={"t": "t[ms]"}).dt == pytest.approx(2e-3)
    with pytest.raises(UnusableInput, match="make the units agree"):
        Recording.read(stated, map={"t": "t[s]"})


def test_decimal_commas_between_commas_are_told(tmp_path: Path) -> None:
    rows = "\n".join(f"{k},{k},5,{k},25" for k in range(5))
    with pytest.raises(UnusableInput, match="5 cells, the header has 3; decimal commas need ';'"):
        Recording.read(write(tmp_path, f"t_s,F[N],x[m]\n{rows}"))


@pytest.mark.parametrize("cell", ["#N/A", "NA", "null", "-"])
def test_what_programs_write_for_no_value_is_missing(cell: str, tmp_path: Path) -> None:
    rows = [f"0.{k};{k}" for k in range(8)]
    rows[3] = f"0.3;{cell}"
    file = write(tmp_path, "t_s;x[m]\n" + "\n".join(rows))
    with pytest.raises(UnusableInput, match=r"1 of 8 values are NaN.*fill=1"):
        Recording.read(file)
    assert Recording.read(file, fill=1)["x"][3] == pytest.approx(3.0)
