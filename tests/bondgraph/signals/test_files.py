"""Readers of HDF5, MATLAB, TDMS and Parquet files: files of other software, good and bad."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bondgraph.signals.files import checks
from bondgraph.signals.files.mat_file import check_unpacked
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput

T = np.arange(50) / 100.0
X = np.sin(7.0 * T)


def refused(file: Path, **options: Any) -> str:
    """Return the line of the refusal; it must name the file and be one line."""
    with pytest.raises(BondsightError) as info:
        Recording.read(file, **options)
    text = str(info.value)
    assert "\n" not in text
    assert file.name in text
    return text


# --- HDF5 -----------------------------------------------------------------------------------


@pytest.fixture
def hdf5(tmp_path: Path) -> Path:
    """Two groups at two rates, units in attributes and in names."""
    h5py = pytest.importorskip("h5py")
    file = tmp_path / "a.h5"
    with h5py.File(file, "w") as f:
        f["fast/time"] = T * 1000.0
        f["fast/time"].attrs["units"] = "ms"
        f["fast/deep/x"] = 1e6 * X
        f["fast/deep/x"].attrs["unit"] = np.bytes_(b"um")
        f["fast/F_kN"] = X[:, None]
        f["slow/u[V]"] = X[::2].astype(np.float32)
        f["slow"].attrs["fs"] = 50.0
        f["slow"].create_dataset("label", data="text")
        f["picture"] = np.zeros((4, 5))
    return file


def test_hdf5_groups_and_units(hdf5: Path) -> None:
    r = Recording.read(hdf5, {"x": "fast/deep/x", "F": "F_kN"})
    assert r["x"] == pytest.approx(X)
    assert r["F"] == pytest.approx(1e3 * X)
    assert dict(r.units) == {"x": "m", "F": "N"}
    assert r.time == pytest.approx(T)
    slow = Recording.read(hdf5, {"u": "u"})
    assert slow.fs == pytest.approx(50.0)
    assert slow["u"] == pytest.approx(X[::2], rel=1e-6)
    assert Recording.read(hdf5, {"u": "slow/u[V]"}, fs=10.0).fs == pytest.approx(10.0)
    assert Recording.read(hdf5, {"x": "x[um]"})["x"] == pytest.approx(X)


def test_a_map_may_ask_for_all_the_others(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "some.h5", "w") as f:
        for name, values in (("stamp_s", [0.0, 1.0, 2.0]), ("a[um]", [1.0, 2.0, 4.0]),
                             ("b[V]", [5.0, 6.0, 7.0])):  # fmt: skip
            f.create_dataset(name, data=values)
    r = Recording.read(tmp_path / "some.h5", {"t": "stamp_s", "x": "a", "*": "*"})
    assert (list(r.channels), r.fs) == (["x", "b"], 1.0)
    assert r["x"] == pytest.approx([1e-6, 2e-6, 4e-6])


def test_hdf5_without_a_map_takes_all_of_one_time_base(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    file = tmp_path / "b.hdf5"
    table = np.zeros(50, dtype=[("F_N", "f4"), ("x_mm", "f8")])
    table["x_mm"] = 1e3 * X
    with h5py.File(file, "w") as f:
        f["run/t_s"] = T
        f["run/x_m"] = X
        f["run/table"] = table
    r = Recording.read(file)
    assert list(r.channels) == ["run/table/F", "run/table/x", "run/x"]
    assert r["run/table/x"] == pytest.approx(X)


def test_hdf5_refusals(hdf5: Path, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    text = refused(hdf5)
    assert "3 time bases" in text
    assert "slow/u[V] (25 samples every 0.02 s from 0 s)" in text
    assert "map={'x': " in text
    assert "time bases" in refused(hdf5, map={"x": "deep/x", "u": "u"})
    assert "make the units agree" in refused(hdf5, map={"x": "fast/deep/x[mm]"})
    assert "is text" in refused(hdf5, map={"x": "slow/label"})
    assert "shape (4, 5)" in refused(hdf5, map={"x": "picture[m]"}, fs=1.0)
    with pytest.raises(UnknownName, match="Did you mean 'fast/deep/x'"):
        Recording.read(hdf5, {"x": "fast/deep/xx"})
    file = tmp_path / "c.h5"
    with h5py.File(file, "w") as f:
        f["a/x_um"] = X
        f["a/x_um"].attrs["unit"] = "mm"
        f["b/x"] = X
        f["c/t_s"] = f["c/time_s"] = T
        f["c/y_m"] = X
    assert "make the units agree" in refused(file, map={"x": "a/x_um"}, fs=1.0)
    assert "fits a/x_um, b/x" in refused(file, map={"x": "x"}, fs=1.0)
    assert "no unit" in refused(file, map={"x": "b/x"}, fs=1.0)
    with h5py.File(file, "a") as f:
        f["a/phase_A"] = X
        f["a/phase_A"].attrs["unit"] = "V"
    assert dict(Recording.read(file, {"u": "phase_A"}, fs=1.0).units) == {"u": "V"}
    assert "could all be the time" in refused(file, map={"y": "c/y_m"})
    assert Recording.read(file, {"y": "c/y_m", "t": "c/time_s"}).fs == pytest.approx(100.0)
    assert "no time column" in refused(file, map={"x": "b/x[m]"})


def test_hdf5_reads_nothing_outside_of_itself(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    secret, other = tmp_path / "secret.bin", tmp_path / "other.h5"
    secret.write_bytes(b"\1" * 80)
    with h5py.File(other, "w") as f:
        f["x_m"] = X
    file = tmp_path / "d.h5"
    with h5py.File(file, "w") as f:
        f.create_dataset("raw_m", shape=(10,), dtype="f8", external=[(str(secret), 0, 80)])
        f["linked"] = h5py.ExternalLink("other.h5", "/x_m")
        layout = h5py.VirtualLayout(shape=(50,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(other), "x_m", shape=(50,))
        f.create_virtual_dataset("virtual_m", layout)
    assert "stored outside of this file" in refused(file, map={"x": "raw_m"}, fs=1.0)
    assert "stored outside of this file" in refused(file, map={"x": "virtual_m"}, fs=1.0)
    with h5py.File(file, "a") as f:
        f["y_m"] = X
    assert "no array 'linked'" in refused(file, map={"x": "linked"}, fs=1.0)
    assert list(Recording.read(file, fs=1.0).channels) == ["y"]


# --- MATLAB ---------------------------------------------------------------------------------


def matlab73(file: Path) -> Path:
    """Write what MATLAB's save -v7.3 writes: a user block, rows of columns, classes, references."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(file, "w", userblock_size=512) as f:
        for name, values, kind in (
            ("t", T[None, :], b"double"),
            ("data/x", X[None, :], b"double"),
            ("data/n", np.array([[3.0]]), b"double"),
            ("note", np.array([[104, 105]], dtype="u2"), b"char"),
            ("on", (X > 0)[None, :].astype("u1"), b"logical"),
        ):
            f[name] = values
            f[name].attrs["MATLAB_class"] = np.bytes_(kind)
        f["data"].attrs["MATLAB_class"] = np.bytes_(b"struct")
        f["#refs#/a"] = X
        f.create_dataset("parts", (1, 1), dtype=h5py.ref_dtype)[0, 0] = f["#refs#/a"].ref
        f["parts"].attrs["MATLAB_class"] = np.bytes_(b"cell")
        f["none"] = np.array([0, 0], dtype="u8")
        f["none"].attrs["MATLAB_empty"] = np.uint8(1)
        f["z"] = np.zeros((1, 50), dtype=[("real", "f8"), ("imag", "f8")])
    with open(file, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: test".ljust(116) + b" " * 8 + b"\x00\x02IM")
    return file


def matlab5(file: Path) -> Path:
    matlab = pytest.importorskip("scipy.io")
    parts = np.array([X, "text"], dtype=object)
    matlab.savemat(
        file,
        {
            "t": T[:, None], "data": {"x": X, "n": 3.0, "inner": {"y": X[None, :]}}, "note": "hi",
            "on": X > 0, "parts": parts, "z": X + 1j, "many": np.zeros(3, dtype=[("a", "O")]),
        },
        do_compression=True,
    )  # fmt: skip
    return file


@pytest.mark.parametrize("write", [matlab5, matlab73])
def test_matlab(tmp_path: Path, write: Any) -> None:
    file = write(tmp_path / "a.mat")
    for target in ("data.x[mm]", "data/x[mm]", "x[mm]"):
        r = Recording.read(file, {"x": target, "on": "on[1]"})
        assert r["x"] == pytest.approx(1e-3 * X), target
        assert np.array_equal(r["on"], X > 0)
        assert r.time == pytest.approx(T)
    assert "'parts' is a cell array" in refused(file, map={"x": "parts"})
    assert "'z' is complex" in refused(file, map={"x": "z"})
    assert "'note' is text" in refused(file, map={"x": "note"})
    with pytest.raises(UnknownName, match=r"no array 'data\.q'.*Known: .*data\.x"):
        Recording.read(file, {"x": "data.q"})


def test_matlab_nested_and_broken(tmp_path: Path) -> None:
    file = matlab5(tmp_path / "a.mat")
    assert Recording.read(file, {"y": "data.inner.y[V]"})["y"] == pytest.approx(X)
    assert "array of structures" in refused(file, map={"x": "many"})
    body = file.read_bytes()
    for cut in (100, 129, len(body) // 2, len(body) - 7):
        file.write_bytes(body[:cut])
        refused(file, map={"y": "data.inner.y[V]"})
    seven = matlab73(tmp_path / "b.mat")
    body = seven.read_bytes()
    seven.write_bytes(body[: len(body) // 2])
    assert "not readable as HDF5" in refused(seven, map={"x": "data.x"})


def test_matlab_bomb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    matlab = pytest.importorskip("scipy.io")
    file = tmp_path / "a.mat"
    matlab.savemat(file, {"x": np.zeros(400_000)}, do_compression=True)
    assert file.stat().st_size < 20_000
    monkeypatch.setattr(checks, "MAX_BYTES", 1_000_000)
    assert "unpacks to" in refused(file, map={"x": "x[m]"}, fs=1.0)
    monkeypatch.setattr(checks, "MAX_BYTES", 4_000_000)
    check_unpacked(file)


# --- TDMS -----------------------------------------------------------------------------------


def tdms(file: Path, **properties: dict[str, Any]) -> Path:
    """Write channels `bench/NAME`; the length is 50 unless `n` says otherwise."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(file)) as writer:
        channels = []
        for name, p in properties.items():
            n = p.pop("n", 50)
            values = p.pop("values", X[:n])
            channels.append(nptdms.ChannelObject("bench", name, values, properties=p))
        writer.write_segment(channels)
    return file


def test_tdms(tmp_path: Path) -> None:
    file = tdms(
        tmp_path / "a.tdms",
        x={"unit_string": "um", "wf_increment": 0.01, "wf_start_offset": 2.0},
        u={"NI_UnitDescription": "V", "wf_increment": 0.01, "wf_start_offset": 2.0},
    )
    r = Recording.read(file)
    assert dict(r.units) == {"bench/x": "m", "bench/u": "V"}
    assert r["bench/x"] == pytest.approx(1e-6 * X)
    assert r.time == pytest.approx(2.0 + T)
    assert list(Recording.read(file, {"x": "x", "*": ""}).channels) == ["x"]


def test_tdms_with_one_property_or_none(tmp_path: Path) -> None:
    only = tdms(tmp_path / "a.tdms", x={"unit_string": "m", "wf_increment": 0.01})
    assert Recording.read(only).time == pytest.approx(T)
    none = tdms(tmp_path / "b.tdms", x={"unit_string": "m"})
    assert "no time column" in refused(none)
    assert Recording.read(none, fs=100.0).fs == pytest.approx(100.0)
    stamps = np.datetime64("2026-05-01T12:00:00", "us") + (T * 1e6).astype("timedelta64[us]")
    clock = tdms(tmp_path / "c.tdms", Time={"values": stamps}, x_m={})
    r = Recording.read(clock)
    assert r.time == pytest.approx(T, abs=1e-9)
    assert "2026-05-01T12:00:00" in r.notes[0]


def test_a_time_that_a_given_rate_stands_for_is_said(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("t[s],x[m]\n" + "".join(f"{0.002 * k:.3f},{k}\n" for k in range(50)))
    made = Recording.read(file, fs=1000.0)
    assert made.fs == pytest.approx(1000.0)
    assert "the time in 't[s]' is not used: the rate is given, 1000 Hz" in made.notes
    assert not Recording.read(file).notes


def test_tdms_refusals(tmp_path: Path) -> None:
    p = {"unit_string": "m", "wf_increment": 0.01}
    file = tdms(tmp_path / "a.tdms", x=dict(p), y={**p, "n": 30}, z={**p, "wf_increment": 0.1})
    text = refused(file)
    assert "3 time bases" in text
    assert "bench/y (30 samples every 0.01 s from 0 s)" in text
    assert Recording.read(file, {"z": "z"}).fs == pytest.approx(10.0)
    words = tdms(tmp_path / "b.tdms", w={"values": ["a", "b"]})
    assert "no channel of numbers" in refused(words)
    fake = tmp_path / "c.tdms"
    fake.write_bytes(b"t_s,x_m\n0,1\n")
    assert "no TDMS file" in refused(fake)
    body = file.read_bytes()
    for cut in (4, 20, 60, len(body) // 2):
        fake.write_bytes(body[:cut])
        refused(fake)


def test_tdms_cut_in_the_last_segment(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    file = tmp_path / "a.tdms"
    p = {"unit_string": "m", "wf_increment": 0.01}
    with nptdms.TdmsWriter(str(file)) as writer:
        for _ in range(2):
            writer.write_segment([nptdms.ChannelObject("bench", "x", X, properties=p)])
    file.write_bytes(file.read_bytes()[:-80])
    r = Recording.read(file)
    assert 50 <= r.n < 100
    assert r["bench/x"][:50] == pytest.approx(X)
    assert "cut off" in r.notes[-1]


# --- Parquet --------------------------------------------------------------------------------


def parquet(file: Path, columns: dict[str, Any], units: dict[str, str] | None = None) -> Path:
    arrow = pytest.importorskip("pyarrow")
    writer = pytest.importorskip("pyarrow.parquet")
    fields = []
    for name, values in columns.items():
        unit = (units or {}).get(name)
        kept = {"unit": unit} if unit else None
        fields.append(arrow.field(name, arrow.array(values).type, metadata=kept))
    table = arrow.table([arrow.array(v) for v in columns.values()], schema=arrow.schema(fields))
    writer.write_table(table, file)
    return file


def test_parquet(tmp_path: Path) -> None:
    file = parquet(
        tmp_path / "a.parquet",
        {"time": T, "x": 1e6 * X, "F_N": X.astype(np.float32), "name": ["a"] * 50},
        {"x": "um"},
    )
    r = Recording.read(file)
    assert dict(r.units) == {"x": "m", "F": "N"}
    assert r["x"] == pytest.approx(X)
    assert r.time == pytest.approx(T)
    stamps = np.datetime64("2026-05-01", "ns") + (T * 1e9).astype("timedelta64[ns]")
    clock = parquet(tmp_path / "b.pq", {"time": stamps, "x_m": X})
    assert Recording.read(clock).time == pytest.approx(T, abs=1e-9)


def test_parquet_refusals(tmp_path: Path) -> None:
    file = parquet(tmp_path / "a.parquet", {"t_s": T, "x_m": [None, *X[1:]], "w": ["a"] * 50})
    text = refused(file)
    assert "1 of 50 values are NaN, infinite or empty, the first in sample 0" in text
    assert "sample 1 to sample 49" in text
    assert "a column of string" in refused(file, map={"x": "w"})
    body = file.read_bytes()
    file.write_bytes(body[:-9])
    assert "cut off" in refused(file)
    file.write_bytes(b"PAR1" + body[8:60] + b"\1\0\0\0PAR1")
    assert "not readable as Parquet" in refused(file)
    file.write_bytes(b"a,b\n1,2\n")
    assert "no Parquet file" in refused(file)


# --- all ------------------------------------------------------------------------------------


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damage_is_a_recording_or_one_line(tmp_path: Path, data: st.DataObject) -> None:
    numpy_archive = io.BytesIO()
    np.savez(numpy_archive, t_s=T, x_m=X)
    made: dict[str, Any] = {
        "h5": lambda f: matlab73(f),
        "mat": lambda f: matlab5(f),
        "tdms": lambda f: tdms(f, x={"unit_string": "m", "wf_increment": 0.01}),
        "parquet": lambda f: parquet(f, {"t_s": T, "x_m": X}),
        "npz": lambda f: f.write_bytes(numpy_archive.getvalue()),
    }
    ending = data.draw(st.sampled_from(sorted(made)))
    file = tmp_path / f"a.{ending}"
    made[ending](file)
    body = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    file.write_bytes(bytes(body)[: data.draw(st.integers(1, len(body)))])
    mapping = {"x": "data.x[m]"} if ending == "mat" else None
    try:
        Recording.read(file, mapping, fs=1.0)
    except BondsightError as error:
        assert "\n" not in str(error)  # noqa: PT017


def test_npz_bombs_pickles_and_doubles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, x_m=X, t_s=T)
    with zipfile.ZipFile(file, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr("x_m.npy", archive.read("x_m.npy"))
    assert "two arrays are called 'x_m.npy'" in refused(file)
    np.savez_compressed(file, x_m=np.zeros(300_000), fs_hz=1.0)
    assert file.stat().st_size < 10_000
    monkeypatch.setattr(checks, "MAX_BYTES", 1_000_000)
    assert "unpacks to" in refused(file)


@pytest.mark.parametrize(
    ("bad", "expected"),
    [
        (range(120, 181), "61 of 999 .* first in sample 120 up to sample 180 without a gap"),
        (
            [5, 7, 8, 9, 700],
            "5 of 999 .* sample 5 .3 bursts, the longest from sample 7 to sample 9",
        ),
        (
            [5],
            "1 of 999 values .* sample 5; remove or fill them, or keep .* sample 6 to sample 998",
        ),
        (range(999), "999 of 999 values .* without a gap; remove or fill them$"),
        ([0, 998], "the longest part without any, sample 1 to sample 997$"),
    ],
)
def test_bursts_are_told(bad: Any, expected: str) -> None:
    x = np.zeros(999)
    x[list(bad)] = np.nan
    with pytest.raises(UnusableInput, match=expected):
        Recording.from_arrays("r", {"x[m]": x}, fs=1.0)


def test_constant_time() -> None:
    with pytest.raises(UnusableInput, match=r"all 4 time stamps are 2 s; give the sampling rate"):
        Recording.from_arrays("r", {"t_s": np.full(4, 2.0), "x[m]": np.zeros(4)})


@pytest.mark.parametrize(
    ("ending", "module"),
    [(".h5", "h5py"), (".mat", "h5py"), (".tdms", "nptdms"), (".parquet", "pyarrow.parquet")],
)
def test_absent_packages_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, module: str
) -> None:
    file = tmp_path / f"a{ending}"
    body = {".tdms": b"TDSm", ".parquet": b"PAR1....PAR1"}.get(ending, b"\x89HDF\r\n\x1a\n")
    file.write_bytes(body)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UnusableInput, match=rf"needs {module}.*pip install 'bondsight\[files\]'"):
        Recording.read(file)


def test_no_reader_is_imported_before_its_file() -> None:
    code = (
        "import sys, bondgraph.signals.recording; "
        "print([m for m in ('h5py','nptdms','pyarrow','pandas','xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_map_says_the_unit_of_a_stored_time(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    np.savez(file, clock=np.arange(5.0), x_m=np.arange(5.0))
    assert Recording.read(file, {"t": "clock[ms]"}).dt == pytest.approx(1e-3)
    h5py = pytest.importorskip("h5py")
    stored = tmp_path / "a.h5"
    with h5py.File(stored, "w") as f:
        f["clock"], f["x_m"] = np.arange(5.0), np.arange(5.0)
    assert Recording.read(stored, {"t": "clock[ms]"}).dt == pytest.approx(1e-3)
    assert Recording.read(stored, {"t": "clock"}).dt == pytest.approx(1.0)
