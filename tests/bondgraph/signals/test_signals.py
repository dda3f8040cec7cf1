"""Recordings: reading, refusing, writing, splitting."""

from __future__ import annotations

import hashlib
import pickle
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bondgraph.signals.recording import Channel, Recording, Split, default_split
from bondgraph.signals.split import interleaved, stretches, whole
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput


def put(folder: Path, text: str | bytes, name: str = "a.csv") -> Path:
    file = folder / name
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return file


def refused(file: Path, **options: object) -> str:
    """Return the line of the refusal; it must name the file and be one line."""
    with pytest.raises(BondsightError) as info:
        Recording.read(file, **options)  # type: ignore[arg-type]
    text = str(info.value)
    assert "\n" not in text
    assert file.name in text
    return text


# --- reading --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("t_s,x[um],F_N\n0,1,2\n0.5,3,4\n1,5,6\n", "plain"),
        ("\ufefft_s,x[um],F_N\r\n0,1,2\r\n0.5,3,4\r\n1,5,6\r\n", "BOM, CRLF"),
        ("# made by hand\n\nt,x (um),F[N]\n0,1,2\n0.5,3,4\n1,5,6\n\n", "comment, blanks"),
        ("time[ms];x_um;F_N\n0;1,0;2\n500;3,0;4\n1000;5,0;6\n", "decimal commas"),
        ("Time_s\tx_um\tF_kN\n0\t1\t2e-3\n0.5\t3\t4e-3\n1\t5\t6e-3\n", "tabs"),
        ("fs_hz,x_um,F_N\n2,1,2\n2,3,4\n2,5,6\n", "rate"),
        ("fs[Hz],x_um,F_N\n2,1,2\n2,3,4\n2,5,6\n", "rate in brackets"),
        ('"t_s","x_um","F_N"\n0, 1 ,2\n0.5,3,4\n1,5,6', "quotes, spaces, no last newline"),
    ],
)
def test_header_forms(tmp_path: Path, text: str, name: str) -> None:
    file = put(tmp_path, text)
    r = Recording.read(file)
    assert r.time == pytest.approx([0.0, 0.5, 1.0]), name
    assert r["x"] == pytest.approx([1e-6, 3e-6, 5e-6])
    assert r["F"] == pytest.approx([2.0, 4.0, 6.0])
    assert dict(r.units) == {"x": "m", "F": "N"}
    assert r.sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    assert (r.name, r.source, r.n, r.fs) == ("a", "a.csv", 3, 2.0)
    assert bool(r.notes) == ("decimal" in name)


def test_latin1_micro_sign(tmp_path: Path) -> None:
    r = Recording.read(put(tmp_path, "t_s,x[\u00b5m]\n0,1\n1,2\n".encode("latin-1")))
    assert r["x"][1] == pytest.approx(2e-6)


@pytest.mark.parametrize(
    "target", ["displacement_um", "displacement", "displacement[um]", "displacement_um[um]"]
)
def test_map(tmp_path: Path, target: str) -> None:
    text = "t_s,displacement_um,comment\n0,1,start\n1,2,\n"
    r = Recording.read(put(tmp_path, text), {"x": target})
    assert list(r.channels) == ["x"]
    assert r["x"] == pytest.approx([1e-6, 2e-6])


def test_map_gives_a_unit_and_the_time(tmp_path: Path) -> None:
    file = put(tmp_path, "stamp_ms,pos\n0,1\n10,2\n")
    r = Recording.read(file, {"x": "pos[mm]", "t": "stamp"})
    assert r.dt == pytest.approx(0.01)
    assert r["x"][1] == pytest.approx(2e-3)
    assert Recording.read(file, {"x": "pos[mm]"}, fs=5.0).fs == pytest.approx(5.0)


def test_short_constant_and_single(tmp_path: Path) -> None:
    r = Recording.read(put(tmp_path, "t_s,x_m\n0,1\n1,1\n2,1\n"))
    assert r.n == 3
    one = Recording.read(put(tmp_path, "t_s,x_m\n0,1\n"))
    assert one.n == 1
    assert "1 samples" in repr(one)
    assert one._repr_html_()
    with pytest.raises(UnusableInput, match="one sample has no time step"):
        _ = one.dt


def test_temperature_difference_is_noted(tmp_path: Path) -> None:
    r = Recording.read(put(tmp_path, "t_s,T_degC\n0,20\n1,21\n"))
    assert r.units["T"] == "K"
    assert "273.15" in r.notes[0]


def test_mild_jitter_is_resampled_and_said(tmp_path: Path) -> None:
    t = np.arange(50) * 0.1
    t[1:-1:2] += 0.005
    rows = "".join(f"{v!r},{2 * v!r}\n" for v in t.tolist())
    r = Recording.read(put(tmp_path, "t_s,x_m\n" + rows))
    assert np.ptp(np.diff(r.time)) < 1e-12
    assert r["x"] == pytest.approx(2 * r.time, abs=1e-12)
    assert "resampled" in r.notes[0]


def test_npz(tmp_path: Path) -> None:
    file = tmp_path / "b.npz"
    np.savez(file, x_um=np.arange(4, dtype=np.float32), fs_hz=10.0, other=np.zeros((2, 2)))
    r = Recording.read(file, {"x": "x"})
    assert r.fs == pytest.approx(10.0)
    assert r["x"][3] == pytest.approx(3e-6)
    np.savez(file, x_um=np.arange(4), t_ms=np.arange(4))
    assert Recording.read(file).dt == pytest.approx(1e-3)
    np.savez(file, a_u_N=np.ones(4), a_fs_hz=4.0, b_u_N=np.ones(6), b_fs_hz=8.0)
    assert Recording.read(file, {"u": "b_u"}).fs == pytest.approx(8.0)
    assert "differ in length" in refused(file, fs=1.0)


def test_durations_are_seconds_whatever_the_header_says() -> None:
    stamps = np.arange(4) * np.timedelta64(2, "ms")
    for header in ("t", "t_ms", "time[us]"):
        r = Recording.from_arrays("d", {header: stamps, "x[m]": np.arange(4.0)})
        assert r.time == pytest.approx(2e-3 * np.arange(4)), header


def test_mat(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    file = tmp_path / "c.mat"
    io.savemat(file, {"V1": np.arange(5.0), "note": "text", "t": np.arange(5.0)})
    r = Recording.read(file, {"u": "V1[mV]"})
    assert r["u"][4] == pytest.approx(4e-3)
    assert r.fs == 1.0


# --- refusals -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "empty"),
        ("\n\n", "no header line"),
        ("t_s,x_m\n", "no row of numbers"),
        ("x_m\n1\n", "no time column"),
        ("t_s\n1\n", "no column holds a channel"),
        ("0,1\n1,2\n", "row 1: numbers where"),
        ("# t_s,x_m\n0,1\n", "row 2: numbers where"),
        ("t_s,x\n0,1\n", "column 'x': no unit"),
        ("t_s,x[foo]\n0,1\n", "'foo' is not a known unit"),
        ("t_s,M_N_m\n0,1\n", "ambiguous"),
        ("t_s,temperature_C\n0,1\n", "coulomb"),
        ("t_s,x_m,x_m\n0,1,2\n", "two columns are called 'x_m'"),
        ("t_s,x_m,x_um\n0,1,2\n", "would both be channel 'x'"),
        ("t_s,t_ms,x_m\n0,1,2\n", "could all be the time"),
        ("t_s,x_m\n0,1\n1,abc\n", "row 3, column 'x_m': 'abc' is not a number"),
        ("t_s,x_m\n0,1\n1,1_0\n", "row 3, column 'x_m': '1_0' is not a number"),
        ("t_s,x_m\n0,1\n1\n", "row 3: 1 cells, the header has 2"),
        ("t_s,x_m\n0,0,1,5\n", "decimal commas"),
        ("t_s;x_m\n0;1,5\n1;2.5\n", "row 3, column 'x_m': points and commas"),
        ("t_s,x_m\n0,1\n1,nan\n2,inf\n3,\n", "3 of 4 values are NaN, infinite or empty"),
        ("t_s,x_m\n0,1\n\n1,nan\n", "first in row 4"),
        (
            "t_s,x_m\n0,1\n\n1,n/a\n2,1\n3,NA\n",
            "2 of 4 values are NaN, infinite or empty or text, the first in row 4 ('n/a')",
        ),
        ("t_s,x_m\n0,1\n1,2\n1,3\n", "row 4: the time stamp 1 s repeats"),
        ("t_s,x_m\n0,1\n2,2\n1,3\n", "row 4: the time stamp 1 s is earlier"),
        ("t_s,x_m\n0,1\n1,2\n2,2\n4,3\n", "row 5: uneven time"),
        ("fs_hz,x_m\n1,1\n2,2\n", "the rate changes"),
        ("fs_hz,x_m\n-1,1\n-1,2\n", "must be positive"),
        ("t_s,x_m\n0," + "9" * 400 + "\n", "infinite"),
        ("t_s,x_m\n0,\x00\n", "binary"),
        (b"\xff\xfet\0_\0s\0", "UTF-16"),
        (b"PK\x03\x04rest", "binary"),
        ('t_s,x_m\n0,"' + "1" * 140_000, "not a table of numbers"),
    ],
)
def test_refusal(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert expected in refused(put(tmp_path, text))


def test_refused_files(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "none.csv")
    assert "not a file" in refused(tmp_path)
    assert "not read" in refused(put(tmp_path, "x", "a.xlsx"))
    assert "not readable" in refused(put(tmp_path, "x", "a.npz"))
    file = tmp_path / "o.npz"
    np.savez(file, x_m=np.array([None, 1], dtype=object), fs_hz=1.0)
    assert "not readable" in refused(file)
    np.savez(file, x_m=np.zeros((2, 2)), fs_hz=1.0)
    assert "shape (2, 2)" in refused(file)
    np.savez(file, x_m=np.zeros(2, dtype=complex), fs_hz=1.0)
    assert "complex128" in refused(file)
    np.savez(file, x_m=np.zeros(0), fs_hz=1.0)
    assert "no sample" in refused(file)


def test_refused_maps(tmp_path: Path) -> None:
    file = put(tmp_path, "t_s,displacement_um,p_a,p_a_N,p_a_m\n0,1,2,3,4\n")
    with pytest.raises(UnknownName, match="Did you mean 'displacement_um'"):
        Recording.read(file, {"x": "displacment_um"})
    assert "make the units agree" in refused(file, map={"x": "displacement[mm]"})
    assert "no unit" in refused(file, map={"x": "p_a"})
    assert "not in a unit of time" in refused(file, map={"x": "displacement", "t": "p_a_N"})
    assert "means the time base" in refused(file, map={"fs_hz": "displacement"})


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(body=st.binary(max_size=200))
def test_any_bytes_give_a_recording_or_one_line(tmp_path: Path, body: bytes) -> None:
    for head in (b"", b"t_s,x_m\n", b"t_s;x_m\n0;1\n"):
        try:
            Recording.read(put(tmp_path, head + body))
        except BondsightError as error:
            assert "\n" not in str(error)  # noqa: PT017


# --- values ---------------------------------------------------------------------------------


def demo(n: int = 400) -> Recording:
    t = np.arange(n) / 100.0
    return Recording.from_arrays("demo", {"t_s": t, "x[mm]": np.sin(t), "u[V]": np.cos(t)})


def test_everything_is_frozen() -> None:
    values = np.zeros(3)
    r = Recording("r", np.arange(3.0), {"x": values}, {"x": "m"})
    values[0] = 9.0
    assert r["x"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        r["x"][0] = 1.0
    with pytest.raises(TypeError):
        r.channels["y"] = values  # type: ignore[index]
    with pytest.raises(AttributeError):
        r.name = "s"  # type: ignore[misc]
    again = pickle.loads(pickle.dumps(r))
    assert np.array_equal(again["x"], r["x"])
    assert not again["x"].flags.writeable


@pytest.mark.parametrize(
    ("time", "channels", "units", "expected"),
    [
        ([], {"x": []}, {"x": "m"}, "N >= 1"),
        ([0, 1], {}, {}, "no channel"),
        ([0, 1], {"x": [1]}, {"x": "m"}, "shape"),
        ([0, 0], {"x": [1, 2]}, {"x": "m"}, "increase"),
        ([0, 1], {"x": [1, np.nan]}, {"x": "m"}, "sample 1"),
        ([0, 1], {"x": [1, 2]}, {}, "has no unit"),
        ([0, 1], {"x": [1, 2]}, {"x": "mm"}, "not SI"),
        ([0, 1], {"a,b": [1, 2]}, {"a,b": "m"}, "cannot name a channel"),
        ([0, 1], {"time": [1, 2]}, {"time": "m"}, "time base"),
    ],
)
def test_bad_values(time: object, channels: object, units: object, expected: str) -> None:
    with pytest.raises(UnusableInput, match=expected):
        Recording("r", time, channels, units)  # type: ignore[arg-type]


def test_channel_and_select() -> None:
    r = demo()
    x = r.channel("x")
    assert isinstance(x, Channel)
    assert (x.unit, x.values.shape) == ("m", (400,))
    assert np.array_equal(np.asarray(x), r["x"])
    assert r.select({"y": "x"}).units == {"y": "m"}
    assert list(r.select({"y": "x", "*": "*"}).channels) == [
        "y",
        *(n for n in r.channels if n != "x"),
    ]
    assert list(r.select({"*": "*", "y": "x"}).channels)[-1] == "y"
    coarse = replace(r, meta={**r.meta, "resolution": {"x": 1e-9, "z": 1.0}, "noise": {"x": 3.0}})
    assert coarse.select({"y": "x"}).meta["noise"] == {"y": 3.0}
    assert coarse.select({"y": "x"}).meta["resolution"] == {"y": 1e-9}
    # the low-pass takes a part of a noise away; a channel that is not filtered keeps it
    assert coarse.slice(0, 40).decimate(2).meta["noise"] == {}
    assert coarse.slice(0, 40).decimate(2, unfiltered=["x"]).meta["noise"] == {"x": 3.0}
    assert coarse.slice(0, 9).decimate(2).meta["resolution"] == {"x": 1e-9, "z": 1.0}
    with pytest.raises(UnknownName, match=r"no channel 'X' in recording demo\. Did you mean 'x'"):
        r.channel("X")


def test_slice() -> None:
    part = demo().slice(10, 20)
    assert part.n == 10
    assert part.time[0] == pytest.approx(0.1)
    with pytest.raises(UnusableInput, match="empty"):
        demo().slice(10, 10)


def test_decimate_keeps_slow_and_removes_fast() -> None:
    t = np.arange(4000) / 1000.0
    slow, fast = np.sin(2 * np.pi * 5 * t), np.sin(2 * np.pi * 190 * t)
    r = Recording.from_arrays("d", {"t_s": t, "a[m]": slow, "b[m]": fast, "c[m]": fast})
    d = r.decimate(10, unfiltered=["c"])
    inner = slice(20, -20)
    assert d.n == 400
    assert d.fs == pytest.approx(100.0)
    assert np.max(np.abs(d["a"][inner] - slow[::10][inner])) < 1e-3
    assert np.max(np.abs(d["b"][inner])) < 1e-2
    assert np.array_equal(d["c"], fast[::10])
    assert "decimated by 10" in d.notes[-1]
    assert r.decimate(1) is r
    line = Recording.from_arrays("l", {"t_s": t, "a[m]": 3 * t + 1}).decimate(7)
    assert line["a"] == pytest.approx(3 * line.time + 1, abs=1e-9)


@pytest.mark.parametrize("factor", [0, -1, 1.5, 200])
def test_decimate_refuses(factor: float) -> None:
    with pytest.raises(UnusableInput, match="decimate by"):
        demo().decimate(factor)  # type: ignore[arg-type]


values = st.floats(allow_nan=False, allow_infinity=False, width=64)


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    x=st.lists(values, min_size=1, max_size=30),
    dt=st.floats(1e-6, 1e3),
    unit=st.sampled_from(["m", "N*s/m", "1", "C/m^2", "rad/s", "Hz"]),
    name=st.from_regex(r"[A-Za-z][A-Za-z0-9_ .]{0,8}[a-z0-9]", fullmatch=True),
)
def test_write_read_round_trip(
    tmp_path: Path, x: list[float], dt: float, unit: str, name: str
) -> None:
    try:
        r = Recording(
            "r", np.arange(len(x), dtype=np.float64) * dt, {name: np.array(x)}, {name: unit}
        )
    except UnusableInput as error:
        assert "time base" in str(error)  # noqa: PT017
        return
    back = Recording.read(r.write_csv(tmp_path / "r.csv"))
    assert np.array_equal(back.time, r.time)
    assert np.array_equal(back[name], r[name])
    assert back.units == r.units


def test_write_is_all_or_nothing(tmp_path: Path) -> None:
    file = demo().write_csv(tmp_path / "x.csv")
    assert [p.name for p in tmp_path.iterdir()] == ["x.csv"]
    assert file.read_text().startswith("t_s,x[m],u[V]\n")
    with pytest.raises(UnusableInput, match="cannot be written"):
        demo().write_csv(tmp_path / "missing" / "x.csv")


def test_shown() -> None:
    r = demo()
    assert repr(r) == "Recording('demo', 400 samples, 100 Hz: x [m], u [V])"
    assert "&lt;b&gt;" in Recording("<b>", [0.0], {"x": [1.0]}, {"x": "m"})._repr_html_()  # type: ignore[arg-type, dict-item]
    assert repr(r.channel("x")) == "Channel(x [m], 400 samples)"


def test_pandas_round_trip() -> None:
    pytest.importorskip("pandas")
    r = demo()
    frame = r.to_pandas()
    back = Recording.from_pandas(frame)
    assert np.array_equal(back["x"], r["x"])
    assert np.array_equal(back.time, r.time)


def test_absent_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for module, method in (("pandas", "to_pandas"), ("xarray", "to_xarray")):
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(UnusableInput, match=rf"{method} needs {module}.*pip install"):
            getattr(demo(), method)()


def test_xarray() -> None:
    pytest.importorskip("xarray")
    assert demo().to_xarray()["x"].attrs["units"] == "m"


# --- split ----------------------------------------------------------------------------------


def with_drive(u: NDArray[np.float64]) -> Recording:
    return Recording.from_arrays("d", {"u[V]": u}, fs=1.0)


@pytest.mark.parametrize(("n", "cut"), [(1, 1), (2, 1), (3, 2), (9, 6), (100, 67)])
def test_last_third(n: int, cut: int) -> None:
    r = with_drive(np.arange(n, dtype=float))
    split = default_split(r)
    assert (split.train, split.test) == (slice(0, cut), slice(cut, n))
    assert split.rest is None
    assert "held out" in split.rule


@pytest.mark.parametrize("period", [20.0, 33.3, 127.0])
def test_periodic_drive_is_cut_on_whole_periods(period: float) -> None:
    t = np.arange(1000)
    split = default_split(with_drive(np.sin(2 * np.pi * t / period + 0.4)), drive="u")
    train, test = whole(split.train), whole(split.test)
    held = (test.stop - test.start) / period
    kept = (train.stop - train.start) / period
    assert test.stop == 1000
    assert abs(held - round(held)) * period <= 1.0
    assert abs(kept - round(kept)) * period <= 1.5
    assert "whole periods" in split.rule


def test_repeated_random_drive() -> None:
    u = np.tile(np.random.default_rng(1).normal(size=97), 6)
    split = default_split(with_drive(u), drive="u")
    assert (split.train, split.test) == (slice(0, 4 * 97), slice(4 * 97, 6 * 97))


def test_noisy_periodic_drive_and_rest() -> None:
    rng = np.random.default_rng(2)
    u = np.concatenate([np.zeros(300), np.sin(2 * np.pi * (np.arange(1050) / 100) + 1.0)])
    split = default_split(with_drive(u + 1e-3 * rng.normal(size=u.size)), drive="u")
    assert split.rest is not None
    assert abs(split.rest.stop - 300) <= 2
    train, test = whole(split.train), whole(split.test)
    assert split.score_from == train.start >= 300
    assert abs((test.stop - test.start) - 300) <= 1


@pytest.mark.parametrize("kind", ["noise", "constant", "ramp", "chirp", "growing"])
def test_aperiodic_drive(kind: str) -> None:
    t = np.linspace(0.0, 1.0, 900)
    noise = np.random.default_rng(3).normal(size=900)
    u = {
        "noise": noise,
        "constant": np.ones(900),
        "ramp": t,
        "chirp": np.sin(2 * np.pi * (2 * t + 30 * t**2)),
        "growing": np.cumsum(noise),
    }[kind]
    split = default_split(with_drive(u), drive=u)
    assert (split.train, split.test, split.rest) == (slice(0, 600), slice(600, 900), None)


@pytest.mark.parametrize("kind", ["hardly two periods", "a step at the end"])
def test_something_is_always_held_out(kind: str) -> None:
    n = np.arange(100)
    u = np.sin(2 * np.pi * n / 50.4) if kind == "hardly two periods" else 1.0 * (n == 99)
    split = default_split(with_drive(u), drive=u)
    assert (split.train, split.test, split.rest) == (slice(0, 67), slice(67, 100), None)


@given(st.integers(1, 60), st.floats(0.01, 0.99), st.integers(0, 30), st.integers(0, 5))
def test_split_parts_never_overlap(n: int, fraction: float, rest: int, seed: int) -> None:
    u = np.random.default_rng(seed).integers(0, 2, n).astype(float)
    u[:rest] = 0.0
    split = default_split(with_drive(u), fraction, drive="u")
    train, test = whole(split.train), whole(split.test)
    assert 0 <= train.start == split.score_from
    assert train.start < train.stop == test.start <= test.stop == n
    assert (split.rest.stop if split.rest else 0) <= train.start


def test_split_refuses() -> None:
    with pytest.raises(UnusableInput, match="between 0 and 1"):
        default_split(demo(), 1.0)
    with pytest.raises(UnusableInput, match="shape"):
        default_split(demo(), drive=np.zeros(3))
    assert Split(slice(0, 1), slice(1, 2), "r") == Split(slice(0, 1), slice(1, 2), "r")


# --- stretches ------------------------------------------------------------------------------


@given(st.integers(0, 50), st.integers(30, 4000), st.integers(3, 40), st.integers(2, 5))
def test_interleaved_stretches_cover_all_once(first: int, n: int, blocks: int, every: int) -> None:
    split = interleaved(first, first + n, blocks, every)
    count = np.zeros(first + n, int)
    for s in (*stretches(split.train), *stretches(split.test)):
        count[s] += 1
    assert not count[:first].any()
    assert (count[first:] == 1).all()
    if n >= 10 * blocks >= 10 * every:
        held = sum(s.stop - s.start for s in stretches(split.test))
        assert abs(held - n / every) <= 2 * n / blocks
    # both parts reach over the whole record
    if blocks >= 3 * every and n >= blocks:
        assert whole(split.test).stop - whole(split.test).start > 0.5 * n


def test_stretches_of_a_plain_split() -> None:
    split = interleaved(0, 90)
    assert stretches(slice(2, 5)) == (slice(2, 5),)
    assert whole(slice(2, 5)) == slice(2, 5)
    assert whole(()) == slice(0, 0)
    assert split.test == tuple(slice(9 * i + 6, 9 * i + 9) for i in range(10))
    assert "every third of 30 equal stretches" in split.rule
