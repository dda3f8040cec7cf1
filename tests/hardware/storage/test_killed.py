"""A writer that is killed with SIGKILL at any moment: all it had acknowledged is there."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.storage import Provenance, open_journal, recover
from tests.hardware.storage.samples import expected_x

WRITER = """
import sys
from hardware.storage import Journal, StreamOrigin, journal_header
from hardware.contracts import Identity
from tests.hardware.storage.samples import chunk
origin = StreamOrigin("interferometer", Identity("SIOS"), 16000.0)
size = int(sys.argv[2])
journal = Journal.create(sys.argv[1], journal_header("run", [origin]), sync=0.01)
n = 0
while True:
    journal.append(chunk(first=n, n=size))
    n += size
    # one write of a whole line
    sys.stdout.write(f"{n}\\n")
    sys.stdout.flush()
"""

FINISHER = """
import os, sys
import numpy as np
from bondgraph.signals.recording import Recording
from hardware.contracts import Identity
from hardware.storage import *
from tests.hardware.storage.samples import chunk
target = sys.argv[1]
journal_path, archive = new_files(target)
origin = StreamOrigin("interferometer", Identity("SIOS"), 16000.0)
journal = Journal.create(journal_path, journal_header("run", [origin]), sync=None)
journal.append(chunk(n=200_000))
sys.stdout.write("0\\n"); sys.stdout.flush()
r = Recording("run", np.arange(200_000) / 16e3, {"x": np.sin(0.1 * np.arange(200_000))}, {"x": "m"})
p = Provenance.for_recording(r, (origin,), {}, output_end="parked")
finish(journal, archive, r, p)
sys.stdout.write("1\\n"); sys.stdout.flush()
"""


def killed(program: str, arguments: Sequence[object], delay: float) -> list[int]:
    """Run until the first line and so long after it, kill, and return the whole lines."""
    run = subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert run.stdout is not None
        first = run.stdout.readline()
        assert first
        time.sleep(delay)
        run.send_signal(signal.SIGKILL)
        # not communicate: it would leave out what readline had read ahead
        rest = run.stdout.read()
    finally:
        run.kill()
        run.wait()
        if run.stdout is not None:
            run.stdout.close()
    lines = (first + rest).split("\n")[:-1]
    return [int(line) for line in lines]


def check_writer(folder: Path, k: int, size: int, delay: float) -> None:
    path = folder / f"{k}.journal"
    acknowledged = killed(WRITER, [path, size], delay)[-1]
    found = open_journal(path)
    data = found.read("interferometer")
    assert data.n >= acknowledged
    # at most the one that was under way
    assert data.n <= acknowledged + 2 * size
    assert np.array_equal(data.numbers, np.arange(data.n))
    assert np.array_equal(data.channels["x"], expected_x(data.numbers))
    assert not found.closed
    assert not found.live
    (saved,) = recover(path)
    back = Recording.open(saved)
    assert back.n == data.n
    assert Provenance.of(back).output_end == "unknown"


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize(("k", "size"), [(0, 16), (1, 5000)])
def test_a_killed_writer_loses_nothing(tmp_path: Path, k: int, size: int) -> None:
    check_writer(tmp_path, k, size, random.Random(k).uniform(0.0, 0.03))


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_many_killed_writers_lose_nothing(tmp_path: Path) -> None:
    draw = random.Random(7)
    for k in range(100):
        check_writer(tmp_path, k, draw.choice([1, 16, 320, 5000, 32768]), draw.uniform(0.0, 0.05))


def check_finisher(folder: Path, delay: float) -> bool:
    target = folder / "run.npz"
    lines = killed(FINISHER, [target], delay)
    data = open_journal(folder / "run.journal").read("interferometer")
    assert data.n == 200_000
    assert target.exists() or lines == [0]
    if target.exists():
        whole = Recording.open(target)
        assert whole.n == 200_000
        assert Provenance.of(whole).output_end == "parked"
        with pytest.raises(UnusableInput, match="came to its end"):
            recover(folder / "run.journal")
    else:
        (saved,) = recover(folder / "run.journal")
        assert Recording.open(saved).n == 200_000
    return target.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_killed_at_the_end(tmp_path: Path) -> None:
    check_finisher(tmp_path, 0.01)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_killed_at_every_moment_of_the_end(tmp_path: Path) -> None:
    complete = []
    for k in range(20):
        folder = tmp_path / str(k)
        folder.mkdir()
        complete.append(check_finisher(folder, 0.003 * k))
    assert set(complete) == {True, False}
