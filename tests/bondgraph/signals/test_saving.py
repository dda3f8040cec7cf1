"""Recordings saved and reopened, and through pandas and xarray: every bit, and the origin."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import SCHEMA
from bondgraph.support.archive import write_archive
from bondgraph.support.errors import UnusableInput

numbers = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(min_size=1, max_size=6).filter(lambda n: not n.startswith("$"))
units = st.sampled_from(["m", "N*s/m", "1", "C/m^2", "rad/s", "Hz", "V"])
metas = st.dictionaries(
    st.sampled_from(["citation", "origin", "rig"]),
    st.text(max_size=5) | st.integers() | st.tuples(numbers, st.none()),
)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Any recording that can be made, uneven times too."""
    n = draw(st.integers(1, 12))
    time = sorted(draw(st.sets(numbers, min_size=n, max_size=n)))
    channels = draw(
        st.dictionaries(names, st.lists(numbers, min_size=n, max_size=n), min_size=1, max_size=3)
    )
    given_units = {k: draw(units) for k in channels}
    meta = {**draw(metas), "notes": tuple(draw(st.lists(st.text(max_size=9), max_size=2)))}
    sha = draw(st.sampled_from(["", "0" * 64]))
    arrays = {k: np.array(v) for k, v in channels.items()}
    try:
        return Recording(
            draw(st.text(max_size=6)), np.array(time), arrays, given_units,
             draw(st.text(max_size=5)), sha, meta,
        )  # fmt: skip
    except UnusableInput:
        # names that no header could carry, times that do not increase
        return Recording("plain", np.arange(n) / 7.0, {"x": np.zeros(n)}, {"x": "m"}, meta=meta)


def assert_same(a: Recording, b: Recording) -> None:
    assert (a.name, a.source, a.sha256) == (b.name, b.source, b.sha256)
    assert dict(a.meta) == dict(b.meta)
    assert list(a.channels) == list(b.channels)
    assert dict(a.units) == dict(b.units)
    assert a.time.tobytes() == b.time.tobytes()
    for name in a.channels:
        assert a[name].tobytes() == b[name].tobytes()


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(recordings())
def test_reopened_identically(tmp_path: Path, recording: Recording) -> None:
    file = recording.save(tmp_path / "r.npz")
    back = Recording.open(file)
    assert_same(recording, back)
    assert not back.time.flags.writeable
    body = file.read_bytes()
    back.save(file)
    assert file.read_bytes() == body
    assert_same(Recording.read(file), recording)


def test_a_channel_that_the_file_cannot_name_is_refused(tmp_path: Path) -> None:
    recording = Recording("run", np.zeros(1), {"$x": np.zeros(1)}, {"$x": "m"})
    with pytest.raises(UnusableInput, match="does not begin with"):
        recording.save(tmp_path / "r.npz")
    assert not (tmp_path / "r.npz").exists()


def demo() -> Recording:
    t = np.arange(40) / 100.0
    r = Recording.from_arrays("demo", {"t_s": t, "x[mm]": np.sin(t), "a_m[V]": np.cos(t)})
    return Recording("demo", r.time, r.channels, r.units, "demo.csv", "a" * 64, {"notes": ("n",)})


def test_a_read_file_keeps_its_origin(tmp_path: Path) -> None:
    source = tmp_path / "bench.csv"
    source.write_text("t_s,T_degC\n0,20\n1,21\n")
    read = Recording.read(source)
    back = Recording.open(read.save(tmp_path / "bench.npz"))
    assert (back.source, back.sha256) == ("bench.csv", read.sha256)
    assert "273.15" in back.notes[0]


def test_read_opens_saved_ones(tmp_path: Path) -> None:
    file = demo().save(tmp_path / "demo.npz")
    assert Recording.read(file, name="other").name == "other"
    assert list(Recording.read(file, {"y": "x", "*": ""}).channels) == ["y"]
    assert "y" in Recording.read(file, {"y": "x"}).channels
    assert len(Recording.read(file, {"y": "x"}).channels) == len(demo().channels)
    with pytest.raises(UnusableInput, match="has its own time"):
        Recording.read(file, fs=1.0)


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match=r"saved as \.npz; write_csv"):
        demo().save(tmp_path / "a.csv")
    array = Recording("r", [0.0], {"x": [1.0]}, {"x": "m"}, meta={"raw": np.zeros(2)})  # type: ignore[arg-type, dict-item]
    with pytest.raises(UnusableInput, match=r"\['raw'\]: is an array"):
        array.save(tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []
    file = tmp_path / "a.npz"
    newer = SCHEMA.replace("/1", "/7")
    write_archive(file, newer, {}, {})
    for opener in (Recording.open, Recording.read):
        with pytest.raises(UnusableInput, match=f"saved as {newer}.*update Bondsight"):
            opener(file)
    write_archive(file, "bondsight-fit/1", {}, {})
    with pytest.raises(UnusableInput, match="holds 'bondsight-fit', not 'bondsight-recording'"):
        Recording.open(file)
    for broken in ({}, {"name": "a", "units": {}, "source": "", "sha256": "", "meta": {}}):
        write_archive(file, SCHEMA, broken, {"time": np.zeros(1), "x": np.zeros(1)})
        with pytest.raises(UnusableInput, match="it has no"):
            Recording.open(file)


# --- pandas and xarray ----------------------------------------------------------------------


def test_pandas_round_trip() -> None:
    pandas = pytest.importorskip("pandas")
    r = demo()
    back = Recording.from_pandas(r.to_pandas(), "demo")
    assert back.time.tobytes() == r.time.tobytes()
    for name in r.channels:
        assert back[name].tobytes() == r[name].tobytes()
    assert dict(back.units) == dict(r.units)
    frame = pandas.DataFrame(
        {"x_m": [1.0, 2.0]}, index=pandas.date_range("2026-01-01", periods=2, name="time")
    )
    assert Recording.from_pandas(frame).dt == pytest.approx(86_400.0)


def test_xarray_round_trip() -> None:
    pytest.importorskip("xarray")
    assert_same(Recording.from_xarray(demo().to_xarray()), demo())


def test_xarray_of_others() -> None:
    xarray = pytest.importorskip("xarray")
    ms = xarray.Dataset(
        {"x": ("time", [1.0, 2.0, 3.0], {"unit": "um"}), "F_kN": ("time", [1.0, 2.0, 3.0])},
        coords={"time": ("time", [0.0, 10.0, 20.0], {"units": "ms"})},
    )
    r = Recording.from_xarray(ms, "mine")
    assert r.name == "mine"
    assert r.fs == pytest.approx(100.0)
    assert r["x"] == pytest.approx([1e-6, 2e-6, 3e-6])
    assert r["F"] == pytest.approx([1e3, 2e3, 3e3])
    stamps = np.array(["2026-01-01T00:00:00", "2026-01-01T00:00:00.5"], dtype="datetime64[ns]")
    one = xarray.DataArray([1.0, 2.0], coords={"time": stamps}, dims="time", attrs={"units": "V"})
    assert Recording.from_xarray(one, map={"u": "x"}).time == pytest.approx([0.0, 0.5])
    assert Recording.from_xarray(one.rename("w")).units["w"] == "V"
    bare = xarray.Dataset({"x": ("n", [1.0, 2.0], {"units": "m"})})
    assert Recording.from_xarray(bare, fs=5.0).fs == pytest.approx(5.0)
    with pytest.raises(UnusableInput, match="no time column"):
        Recording.from_xarray(bare)
    flat = xarray.Dataset({"x": (("time", "place"), np.zeros((2, 3)))})
    with pytest.raises(UnusableInput, match=r"single dimension \(x \('time', 'place'\)\)"):
        Recording.from_xarray(flat)


def test_xarray_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    data: Any = object()
    with pytest.raises(UnusableInput, match="from_xarray needs xarray"):
        Recording.from_xarray(data)
