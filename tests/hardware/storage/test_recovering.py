"""Recordings from journals whose acquisition never ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air, Chunk, Flag, Identity
from hardware.storage import (
    ClockAlignment,
    Journal,
    Provenance,
    StreamOrigin,
    flags_of,
    journal_header,
    open_journal,
    recover,
    recovered,
)
from tests.hardware.storage.samples import chunk, expected_x

SENSOR = StreamOrigin("interferometer", Identity("SIOS"), 16000.0)
OUTPUT = StreamOrigin("output", Identity("Humusoft"), 8000.0)
AIR = Air(293.15, 101325.0, 0.5, 1.000271)


def volts(first: int, n: int) -> Chunk:
    return Chunk("output", first, {"V": 0.1 * np.arange(float(first), first + n)}, {"V": "V"})


def clocked(first: int = 0, n: int = 8) -> Chunk:
    """As of a sensor that is clocked by the output: without instants of its own."""
    whole = chunk(first=first, n=n)
    return Chunk(whole.stream, first, {"x": whole.channels["x"]}, {"x": "um"})


def broken_off(
    path: Path,
    chunks: Sequence[Chunk],
    header: Mapping[str, Any] | None = None,
    notes: Sequence[Mapping[str, Any]] = (),
) -> Path:
    journal = Journal.create(
        path, journal_header("run", (SENSOR, OUTPUT)) if header is None else header, sync=None
    )
    for c in chunks:
        journal.append(c)
    for n in notes:
        journal.note(n)
    # as a kill leaves it
    journal._shut()
    return path


def test_each_stream_on_its_own_clock(tmp_path: Path) -> None:
    path = broken_off(
        tmp_path / "a.journal",
        [chunk(n=40, flag=Flag.LEVEL_LOW), volts(0, 20)],
        notes=[
            {"event": "air", "when": "start", **asdict(AIR)},
            {"event": "air", "when": "end"},
            {"event": "error", "kind": "LinkLost", "message": "the cable is gone", "flag": 1},
        ],
    )
    before = path.read_bytes()
    files = recover(path)
    assert [f.name for f in files] == ["a-interferometer.npz", "a-output.npz"]
    x, v = (Recording.open(f) for f in files)
    assert (x.n, x.units["x"], v.n) == (40, "m", 20)
    assert x.fs == pytest.approx(16000.0)
    assert v.fs == pytest.approx(8000.0)
    assert np.allclose(x["x"], 1e-6 * expected_x(range(40)))
    origin = Provenance.of(x)
    assert origin.air == AIR
    assert origin.output_end == "unknown"
    assert origin.streams[0].samples == 40
    assert any("ended without closing" in w for w in origin.warnings)
    assert any("the cable is gone" in w for w in x.notes)
    assert np.array_equal(np.flatnonzero(flags_of(x)), [20])
    assert path.read_bytes() == before
    # again: the same
    assert recover(path) == files


def test_one_clock_gives_one_recording(tmp_path: Path) -> None:
    streams = (SENSOR, StreamOrigin("output", Identity(), 16000.0))
    header = journal_header("run", streams, alignment=ClockAlignment("shared clock", 1.0))
    path = broken_off(
        tmp_path / "a.journal", [clocked(n=40), volts(0, 30), clocked(first=40)], header,
        [{"event": "output", "state": "driven"}, {"output_end": "parked"}],
    )  # fmt: skip
    (file,) = recover(path)
    assert file.name == "a.npz"
    r = Recording.open(file)
    assert r.n == 30
    assert list(r.channels) == ["x", "V"]
    assert np.allclose(r["V"], 0.1 * np.arange(30))
    assert Provenance.of(r).output_end == "parked"
    with pytest.raises(UnusableInput, match="came to its end"):
        recover(path)


def test_a_force_gauge_is_not_joined_with_the_output_by_its_numbers(tmp_path: Path) -> None:
    # at the rate of the output by its header, but read now and then
    streams = [StreamOrigin(s, Identity(), 16000.0) for s in ("output", "interferometer", "gauge")]
    header = journal_header("run", streams, alignment=ClockAlignment("shared clock", 1.0))
    n = 40
    at = np.arange(n) / 16000.0
    drive = Chunk("output", 0, {"V": at, "instant": at}, {"V": "V", "instant": "s"})
    read = at[::4]
    force = Chunk("gauge", 0, {"F": read, "instant": read}, {"F": "N", "instant": "s"})
    path = broken_off(tmp_path / "a.journal", [drive, clocked(n=n), force], header)
    both, gauge = (Recording.open(f) for f in recover(path))
    assert sorted(both.channels) == ["V", "instant", "x"]
    assert both.n == n
    assert sorted(gauge.channels) == ["F", "instant"]
    np.testing.assert_allclose(gauge["F"], gauge["instant"])


def test_a_stream_without_a_name_is_neither_joined_nor_parts_the_others(tmp_path: Path) -> None:
    streams = [StreamOrigin(s, Identity(), 16000.0) for s in ("output", "interferometer", "gauge")]
    header = journal_header("run", streams, alignment=ClockAlignment("shared clock", 1.0))
    n = 40
    at = np.arange(n) / 16000.0
    force = Chunk("gauge", 0, {"F": at[::4], "instant": at[::4]}, {"F": "N", "instant": "s"})
    path = broken_off(tmp_path / "a.journal", [volts(0, n), clocked(n=n), force], header)
    data = bytearray(path.read_bytes())
    # within the record that names the gauge
    data[data.index(b'"name":"gauge"') + 9] ^= 1
    path.write_bytes(data)
    found = dict(recovered(open_journal(path, beyond=True)))
    assert {k: (r.n, sorted(r.channels)) for k, r in found.items()} == {"": (n, ["V", "x"])}
    assert any("stream_2: left out, its rate is not known" in w for w in found[""].notes)
    found = dict(recovered(open_journal(path, beyond=True), {"stream_2": 16000.0}))
    assert {k: r.n for k, r in found.items()} == {"": n, "-stream_2": n // 4}


def test_nothing_is_joined_over_a_gap(tmp_path: Path) -> None:
    bad = np.arange(4.0)
    bad[2] = np.nan
    path = broken_off(
        tmp_path / "a.journal",
        [chunk(n=10), chunk(first=15, n=5), Chunk("output", 0, {"V": bad}, {"V": "V"})],
    )
    found = dict(recovered(open_journal(path)))
    assert {k: r.n for k, r in found.items()} == {
        "-interferometer": 10, "-interferometer-2": 5, "-output": 2, "-output-2": 1,
    }  # fmt: skip
    second = found["-interferometer-2"]
    assert second.time[0] == pytest.approx(15 / 16000.0)
    assert np.allclose(second["x"], 1e-6 * expected_x(range(15, 20)))
    assert any("5 samples are missing in 1 gaps" in n for n in second.notes)
    assert Provenance.of(second).streams[0].lost == 5
    assert found["-output-2"]["V"][0] == 3.0
    assert not np.any(flags_of(second))


def test_many_gaps_keep_the_longest(tmp_path: Path) -> None:
    chunks = [chunk(first=20 * k, n=4 + (k % 7)) for k in range(150)]
    found = recovered(open_journal(broken_off(tmp_path / "a.journal", chunks)))
    assert len(found) == 100
    assert any("the 100 longest" in n for n in found[0][1].notes)


def test_a_cut_journal_says_so(tmp_path: Path) -> None:
    path = broken_off(tmp_path / "a.journal", [chunk(n=10), chunk(first=10, n=10)])
    path.write_bytes(path.read_bytes()[:-7])
    (file,) = recover(path)
    r = Recording.open(file)
    assert r.n == 10
    assert any("ends within a record" in n for n in r.notes)


def test_damage_within_is_stepped_over(tmp_path: Path) -> None:
    path = broken_off(tmp_path / "a.journal", [chunk(n=10), chunk(first=10), chunk(first=18)])
    data = bytearray(path.read_bytes())
    at = data.index(expected_x([12.0]).tobytes())
    data[at] ^= 1
    path.write_bytes(data)
    a, b = (Recording.open(f) for f in recover(path))
    assert (a.n, b.n) == (10, 8)
    assert np.allclose(b["x"], 1e-6 * expected_x(range(18, 26)))
    assert any("stepped over" in n for n in b.notes)
    # the header too: then somebody must know the rate
    data[40] ^= 1
    other = tmp_path / "b.journal"
    other.write_bytes(data)
    with pytest.raises(UnusableInput, match="its rate is not known"):
        recover(other)
    assert len(recover(other, {"interferometer": 16000.0})) == 2
    other.write_bytes(b"foreign" * 9)
    with pytest.raises(UnusableInput, match="no journal"):
        recover(other)


def test_a_rate_that_nobody_wrote_down_is_asked_for(tmp_path: Path) -> None:
    path = broken_off(tmp_path / "a.journal", [chunk(n=10)], header={"streams": [{"odd": 1}]})
    with pytest.raises(UnusableInput, match="its rate is not known"):
        recover(path)
    (file,) = recover(path, {"interferometer": 100.0})
    assert Recording.open(file).fs == pytest.approx(100.0)


def test_what_holds_nothing_or_is_alive_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="no usable sample"):
        recover(broken_off(tmp_path / "a.journal", []))
    lost = Chunk("output", 0, {"V": np.full(3, np.nan)}, {"V": "V"})
    with pytest.raises(UnusableInput, match="no usable sample"):
        recover(broken_off(tmp_path / "b.journal", [lost]))
    with (
        Journal.create(tmp_path / "c.journal", {}, sync=None),
        pytest.raises(UnusableInput, match="still writing"),
    ):
        recover(tmp_path / "c.journal")
    with pytest.raises(UnusableInput, match="cannot be opened"):
        recover(tmp_path / "d.journal")


def test_a_block_that_was_cut_does_not_take_the_output_with_it(tmp_path: Path) -> None:
    origins = [StreamOrigin(s, Identity(), 100.0) for s in ("output", "sensor")]
    header = journal_header("cut", origins, alignment=ClockAlignment("shared clock", 1.0))
    file = tmp_path / "cut.journal"
    with Journal.create(file, header, sync=None) as journal:
        journal.append(Chunk("output", 0, {"V": np.arange(50.0)}, {"V": "V"}))
        whole = journal.size
        journal.append(Chunk("sensor", 0, {"x": np.arange(50.0)}, {"x": "m"}))
    # within the sensor's only chunk, behind the record that announces its stream
    content = file.read_bytes()
    file.write_bytes(content[: whole + (len(content) - whole) * 2 // 3])
    (path,) = recover(file)
    np.testing.assert_array_equal(Recording.open(path)["V"], np.arange(50.0))
