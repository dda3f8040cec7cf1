"""Cut, flipped, foreign: a damaged journal opens as far as it is whole, or says why not."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.storage import JournalFile, open_journal, recover
from hardware.storage.frames import MAGIC, FrameKind, head
from tests.hardware.storage.samples import chunk, expected_x, written


def opened(path: Path) -> JournalFile | None:
    """Open a journal; None if that is refused in one line."""
    refusal = ""
    try:
        return open_journal(path)
    except UnusableInput as error:
        refusal = str(error)
    assert refusal
    assert "\n" not in refusal
    return None


def test_cut_at_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    written(path, [chunk(n=4), chunk(first=4, n=3), chunk("output", n=2)], [{"event": "end"}])
    counts: list[int] = []
    for size in reversed(range(path.stat().st_size)):
        os.truncate(path, size)
        found = opened(path)
        if found is None:
            counts.append(-1)
            continue
        n = 0
        for stream in found.streams:
            part = found.read(stream)
            assert np.array_equal(part.channels["x"], expected_x(part.numbers))
            n += part.n
        assert not found.closed
        assert (found.size == size) == (found.cut == "")
        counts.append(n)
    assert counts == sorted(counts, reverse=True)
    assert set(counts) == {-1, 0, 4, 7, 9}


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_flipped_bits_are_never_accepted(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("flip")
    path = folder / "a.journal"
    written(path, [chunk(n=4), chunk(first=4, n=3), chunk("output", n=2)], [{"event": "end"}])
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole) - 1))
        whole[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(whole)
    found = opened(path)
    if found is None:
        return
    for part in (found.read(s) for s in found.streams):
        assert np.array_equal(part.channels["x"], expected_x(part.numbers))
        assert not np.any(part.flags)
    # flips may undo each other
    assert found.cut or found.closed


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=300), st.booleans())
def test_foreign_bytes(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, like_ours: bool
) -> None:
    path = tmp_path_factory.mktemp("foreign") / "a.journal"
    path.write_bytes((MAGIC if like_ours else b"") + data)
    with pytest.raises(UnusableInput):
        open_journal(path)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([1, 2, 3, 4, 5]),
    st.binary(max_size=60) | st.text('{}[]:,"$01na').map(str.encode),
)
def test_records_with_right_checksums_and_wrong_content(
    tmp_path_factory: pytest.TempPathFactory, kind: int, payload: bytes
) -> None:
    path = tmp_path_factory.mktemp("wrong") / "a.journal"
    journal = written(path, [chunk(n=4)], close=False)
    journal._shut()
    with open(path, "ab") as stream:
        stream.write(head(FrameKind(kind), 3, payload) + payload)
    found = open_journal(path)
    assert found.read("interferometer").n == 4
    assert found.cut or kind == 5


def test_a_damaged_record_is_stepped_over_on_request(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    parts = [chunk(n=4), chunk("output", n=2), chunk(first=4, n=300), chunk(first=304, n=3)]
    written(path, parts, [{"event": "end"}])
    whole = path.read_bytes()
    assert open_journal(path, beyond=True).cut == ""
    at = whole.index(expected_x(range(100, 101)).tobytes())
    path.write_bytes(whole[:at] + b"\x00\xff" + whole[at + 2 :])
    assert open_journal(path).read("interferometer").n == 4
    found = open_journal(path, beyond=True)
    data = found.read("interferometer")
    assert [(g.first, g.last) for g in data.gaps] == [(4, 303)]
    assert np.array_equal(data.channels["x"], expected_x(data.numbers))
    assert (found.closed, len(found.notes)) == (True, 1)
    assert "in 1 places" in found.cut
    # its very start
    path.write_bytes(bytes(200) + whole[200:])
    found = open_journal(path, beyond=True)
    assert found.header == {}
    assert dict(found.streams)
    assert "stepped over" in found.cut


@pytest.mark.parametrize("lost", [0, 1])
def test_a_stream_whose_names_are_lost_keeps_its_samples(lost: int, tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    parts = [chunk(n=4), chunk("output", n=2), chunk(first=4, n=300), chunk("output", 2, 5)]
    written(path, parts, [])
    before = open_journal(path)
    names = tuple(before.streams)
    whole = bytearray(path.read_bytes())
    whole[whole.index(b'"name":"' + names[lost].encode()) + 3] ^= 1
    path.write_bytes(whole)
    found = open_journal(path, beyond=True)
    assert f"what stream_{lost} and its channels were called" in found.cut
    assert set(found.streams) == {names[1 - lost], f"stream_{lost}"}
    data, kept = found.read(f"stream_{lost}"), before.read(names[lost])
    assert np.array_equal(data.numbers, kept.numbers)
    for nameless, own in zip(data.channels.values(), kept.channels.values(), strict=True):
        assert np.array_equal(nameless, own)
    (saved,) = recover(path, {f"stream_{lost}": 1000.0})
    assert Recording.read(saved).time.size == kept.n


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_beyond_damage_nothing_wrong_is_accepted(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("beyond") / "a.journal"
    written(path, [chunk(first=4 * k, n=4) for k in range(5)], [{"event": "end"}])
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole) - 1))
        if data.draw(st.booleans()):
            whole[at] ^= data.draw(st.integers(1, 255))
        else:
            del whole[at : at + data.draw(st.integers(1, 100))]
            whole = whole or bytearray(b"\0")
    path.write_bytes(whole)
    try:
        found = open_journal(path, beyond=True)
    except UnusableInput:
        return
    for part in (found.read(s) for s in found.streams):
        # names that are lost leave the samples, in their order
        assert np.array_equal(next(iter(part.channels.values())), expected_x(part.numbers))
        assert part.repeated == 0
    kept = opened(path)
    if kept is not None and kept.streams:
        assert found.read("interferometer").n >= kept.read("interferometer").n
