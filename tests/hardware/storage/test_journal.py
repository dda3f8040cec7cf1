"""Writing and reading journals: what is given back, what is refused, what is taken back."""

from __future__ import annotations

import errno
import os
import struct
import subprocess
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput
from hardware.contracts import Chunk, Flag
from hardware.errors import HardwareError
from hardware.storage import Journal, JournalFailed, StreamGap, open_journal
from tests.hardware.storage.samples import chunk, expected_x, written
from tests.patience import HANGS


def test_everything_comes_back(tmp_path: Path) -> None:
    header = {"name": "run", "limits": (0.0, 100.0), "never": float("inf"), "n": None}
    path = tmp_path / "a.journal"
    journal = Journal.create(path, header, sync=None)
    journal.append(chunk(n=8, flag=Flag.LEVEL_LOW))
    journal.note({"event": "trigger", "at": 0.25})
    journal.append(chunk("output", n=3))
    journal.append(chunk(first=8, n=5))
    journal.close()
    found = open_journal(path)
    assert (found.header, found.closed, found.live, found.cut) == (header, True, False, "")
    assert found.size == path.stat().st_size == journal.size
    assert list(found.streams) == ["interferometer", "output"]
    data = found.read("interferometer")
    assert np.array_equal(data.numbers, np.arange(13))
    assert np.array_equal(data.channels["x"], expected_x(range(13)))
    assert dict(data.layout.units) == {"x": "um", "instant": "s"}
    assert np.array_equal(np.flatnonzero(data.flags), [4])
    assert data.flags[4] == Flag.LEVEL_LOW
    assert (data.gaps, data.lost, data.repeated) == ((), 0, 0)
    assert found.notes[0].content == {"event": "trigger", "at": 0.25}
    assert found.notes[0].samples == {"interferometer": 8}
    with pytest.raises(UnknownName, match="output"):
        found.read("outptu")


def test_bits_that_arithmetic_would_change_come_back(tmp_path: Path) -> None:
    values = np.array([np.nan, -0.0, np.inf, 5e-324, np.nextafter(1.0, 2.0)])
    written(tmp_path / "a.journal", [Chunk("s", 0, {"x": values}, {"x": "m"})])
    back = open_journal(tmp_path / "a.journal").read("s").channels["x"]
    assert back.tobytes() == values.tobytes()


def test_gaps_are_found_and_not_closed(tmp_path: Path) -> None:
    parts = [chunk(first=2, n=4), chunk(first=9, n=1), chunk(first=10, n=2), chunk(first=40, n=1)]
    written(tmp_path / "a.journal", parts)
    data = open_journal(tmp_path / "a.journal").read("interferometer")
    assert data.gaps == (StreamGap(0, 1), StreamGap(6, 8), StreamGap(12, 39))
    assert data.lost == sum(g.n for g in data.gaps) == 33
    assert np.array_equal(data.numbers, [2, 3, 4, 5, 9, 10, 11, 40])
    assert np.array_equal(data.channels["x"], expected_x(data.numbers))


def test_of_samples_that_come_twice_the_first_counts(tmp_path: Path) -> None:
    again = Chunk(
        "interferometer", 4, {"x": np.full(8, 9.0), "instant": np.zeros(8)},
        {"x": "um", "instant": "s"},
    )  # fmt: skip
    written(tmp_path / "a.journal", [chunk(n=8), again])
    data = open_journal(tmp_path / "a.journal").read("interferometer")
    assert data.repeated == 4
    assert np.array_equal(data.numbers, np.arange(12))
    assert np.array_equal(data.channels["x"], [*expected_x(range(8)), 9, 9, 9, 9])


def test_channels_in_another_order_are_the_same_stream(tmp_path: Path) -> None:
    swapped = Chunk(
        "interferometer", 8, {"instant": np.ones(2), "x": np.zeros(2)}, {"instant": "s", "x": "um"}
    )
    written(tmp_path / "a.journal", [chunk(n=8), swapped])
    data = open_journal(tmp_path / "a.journal").read("interferometer")
    assert np.array_equal(data.channels["instant"][8:], [1, 1])


def test_refusals_leave_the_journal_intact(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    journal = Journal.create(path, {}, sync=None)
    journal.append(chunk(n=8))
    other = Chunk("interferometer", 8, {"x": np.zeros(1)}, {"x": "m"})
    with pytest.raises(JournalFailed, match=r"interferometer began with x \[um\]") as caught:
        journal.append(other)
    assert caught.value.partial is other
    with pytest.raises(JournalFailed, match="count from 0"):
        journal.append(chunk(first=-1))
    with pytest.raises(UnusableInput, match="array"):
        journal.note({"x": np.zeros(3)})
    journal.append(chunk(first=8, n=2))
    journal.close()
    journal.close()
    with pytest.raises(JournalFailed, match="closed"):
        journal.append(chunk(first=10))
    assert open_journal(path).read("interferometer").n == 10


def test_there_is_one_writer_of_a_new_file(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    with Journal.create(path, {}, sync=None) as journal:
        with pytest.raises(JournalFailed, match="another program is writing it"):
            Journal.create(path, {})
        journal.append(chunk(n=3))
        seen = open_journal(path)
        assert (seen.live, seen.closed, seen.cut) == (True, False, "")
        assert seen.read("interferometer").n == 3
    before = path.read_bytes()
    with pytest.raises(JournalFailed, match="never overwritten"):
        Journal.create(path, {})
    assert path.read_bytes() == before
    assert not open_journal(path).live
    assert issubclass(JournalFailed, HardwareError)


def test_what_cannot_be_made_says_why(tmp_path: Path) -> None:
    with pytest.raises(JournalFailed, match="No such file"):
        Journal.create(tmp_path / "no" / "a.journal", {})
    with pytest.raises(UnusableInput, match="sync"):
        Journal.create(tmp_path / "a.journal", {}, sync=0.0)
    with pytest.raises(UnusableInput, match="store numbers"):
        Journal.create(tmp_path / "a.journal", {"x": object()})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(JournalFailed, match="Permission denied"):
            Journal.create(tmp_path / "a.journal", {})
    finally:
        tmp_path.chmod(0o700)


FULL = """
import resource, signal, sys
from hardware.storage import Journal, JournalFailed, open_journal
from tests.hardware.storage.samples import chunk
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
journal = Journal.create(sys.argv[1], {}, sync=None)
n = 0
try:
    while True:
        journal.append(chunk(first=n, n=16))
        n += 16
except JournalFailed as error:
    print(error)
    assert error.partial.first == n
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
found = open_journal(sys.argv[1])
assert found.cut == "" and found.read("interferometer").n == n > 16, found
journal.append(chunk("s", 0, 0))
print("small ones fit")
"""


def test_a_full_disk_takes_back_what_did_not_fit(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    path = tmp_path / "a.journal"
    run = subprocess.run(
        [sys.executable, "-c", FULL, str(path)], capture_output=True, text=True, timeout=HANGS
    )
    assert run.returncode == 0, run.stderr
    assert "File too large; the" in run.stdout
    assert "intact" in run.stdout
    assert run.stdout.rstrip().endswith("small ones fit")
    assert open_journal(path).cut == ""


def test_a_short_write_and_a_signal_are_taken_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.journal"
    journal = Journal.create(path, {}, sync=None)
    journal.append(chunk(n=4))
    real = os.write

    def part_then(error: BaseException) -> Callable[[int, memoryview], int]:
        left = [1]

        def write(handle: int, data: memoryview) -> int:
            if left[0]:
                left[0] -= 1
                return real(handle, bytes(data[:50]))
            raise error

        return write

    for error in (OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()):
        monkeypatch.setattr(os, "write", part_then(error))
        with pytest.raises((JournalFailed, KeyboardInterrupt)):
            journal.append(chunk("other", n=4))
        monkeypatch.setattr(os, "write", real)
    journal.append(chunk("other", n=2))
    journal.close()
    found = open_journal(path)
    assert found.cut == ""
    assert found.closed
    assert [found.read(s).n for s in ("interferometer", "other")] == [4, 2]


def test_a_signal_after_the_write_keeps_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.journal"
    journal = Journal.create(path, {}, sync=None)
    real = os.write

    def write(handle: int, data: memoryview) -> int:
        real(handle, data)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "write", write)
    with pytest.raises(KeyboardInterrupt):
        journal.append(chunk(n=4))
    monkeypatch.setattr(os, "write", real)
    journal.append(chunk(first=4, n=4))
    journal.close()
    found = open_journal(path)
    assert (found.cut, found.closed) == ("", True)
    assert found.read("interferometer").n == 8


def test_the_disk_is_told_to_write_and_its_error_comes_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []

    def failing(handle: int) -> None:
        calls.append(handle)
        raise OSError(errno.EIO, "Input/output error")

    journal = Journal.create(tmp_path / "a.journal", {}, sync=0.005)
    monkeypatch.setattr(os, "fsync", failing)
    deadline = time.monotonic() + HANGS
    while not calls and time.monotonic() < deadline:
        time.sleep(0.005)
    time.sleep(0.005)
    with pytest.raises(JournalFailed, match="Input/output error"):
        journal.append(chunk())
    monkeypatch.undo()
    time.sleep(0.01)
    assert journal._syncing is not None
    journal._syncing._error = None
    journal.append(chunk())
    journal.close()
    assert open_journal(tmp_path / "a.journal").read("interferometer").n == 8


def test_the_form_is_what_is_written_down(tmp_path: Path) -> None:
    """A reader of ten lines from the docstring of `frames` alone."""
    path = tmp_path / "a.journal"
    written(path, [chunk(n=3, flag=Flag.LATE)])
    data = path.read_bytes()
    assert data[:16] == b"\x89BSJOURNAL/1\r\n\x1a\n"
    place, kinds = 16, list[int]()
    while place < len(data):
        mark, kind, number, size, crc = struct.unpack_from("<4sIQQI", data, place)
        assert (mark, number) == (b"\xb5BSR", len(kinds))
        assert zlib.crc32(data[place : place + 28]) == struct.unpack_from("<I", data, place + 28)[0]
        payload = data[place + 32 : place + 32 + size]
        assert zlib.crc32(payload) == crc
        if kind == 3:
            assert struct.unpack_from("<IIqQ", payload) == (0, 0, 0, 3)
            assert struct.unpack_from("<3H", payload, 24) == (0, Flag.LATE, 0)
            assert struct.unpack_from("<3d", payload, 30) == tuple(expected_x(range(3)))
        kinds.append(kind)
        place += 32 + size
    assert kinds == [1, 2, 3, 5]


def test_a_file_that_changes_after_opening(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    written(path, [chunk(n=4)])
    found = open_journal(path)
    data = bytearray(path.read_bytes())
    data[-100] ^= 1
    path.write_bytes(data)
    with pytest.raises(BondsightError, match="changed"):
        found.read("interferometer")
