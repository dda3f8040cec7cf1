"""``bondsight acquire`` in a process of its own that is killed, interrupted or has no disk left."""

from __future__ import annotations

import resource
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondsight.cli.main import main
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.storage import Provenance, open_journal
from tests.patience import HANGS

RATE = 10e3
WAVE = np.linspace(0.0, 50.0, 601)[:-1]
"""V; the voltage tells how far the program is."""
REPORT = 200
"""Samples of the output between two records of the journal."""
STATION = """
[envelope]
preset = "P-840.1-unipolar"
gentle = 1000.0
[clock]
bench = "{control}"
[output]
kind = "mf634"
address = "{card}"
[amplifier]
gain = 20.0
voltage_monitor = 0.05
[interferometer]
connection = "net:{interferometer}"
library = "{library}"
dead_path = 0.1
"""


class Program:
    """The command before a bench in the threads of the test."""

    def __init__(self, library: str, folder: Path, **config: Any) -> None:
        config.setdefault("plant", {"effect": "none", "seed": 5})
        self.server = BenchServer(config_from(config))
        self.folder = folder
        station = folder / "station.toml"
        station.write_text(STATION.format(library=library, **self.server.start()))
        wave = folder / "wave.csv"
        wave.write_text("V [V]\n" + "\n".join(f"{v:.6f}" for v in WAVE) + "\n")
        self._arguments = [
            "acquire", str(station), "--signal", str(wave), "--rate", str(RATE), "--synchronise",
            "none", "--out", str(folder), "--name", "take", "--quiet",
        ]  # fmt: skip
        self.child: subprocess.Popen[str] | None = None

    @property
    def journal(self) -> Path:
        return self.folder / "take.journal"

    def start(self, prepare: Callable[[], None] | None = None) -> subprocess.Popen[str]:
        self.child = subprocess.Popen(
            [sys.executable, "-m", "bondsight", *self._arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=prepare,
        )  # fmt: skip
        return self.child

    def when(self, reached: Callable[[float], bool], action: Callable[[], None]) -> None:
        """Do something once, as soon as the voltage at the actuator fulfils a condition."""
        rig = self.server.rig

        def look() -> None:
            if reached(rig.volts):
                action()
            else:
                rig.at(rig.now + 1e-3, look)

        rig.at(rig.now + 1e-3, look)

    def send(self, number: signal.Signals) -> None:
        assert self.child is not None
        self.child.send_signal(number)
        if number == signal.SIGKILL:
            # the bench stands still meanwhile, so the program gets no further
            self.child.wait(HANGS)

    def end(self) -> tuple[int, str, str]:
        assert self.child is not None
        out, error = self.child.communicate(timeout=HANGS)
        return self.child.returncode, out, error

    def close(self) -> None:
        if self.child is not None and self.child.poll() is None:
            self.child.kill()
            self.child.communicate()
        self.server.stop()


@pytest.fixture
def program(library: str, tmp_path: Path) -> Iterator[Callable[..., Program]]:
    made: list[Program] = []

    def make(**config: Any) -> Program:
        made.append(Program(library, tmp_path, **config))
        return made[-1]

    yield make
    for one in made:
        one.close()


def left(program: Program) -> None:
    """Wait until the bench has seen that the program is gone."""
    end = time.monotonic() + HANGS
    while not program.server.departures and time.monotonic() < end:
        time.sleep(0.005)
    assert program.server.departures


@pytest.mark.parametrize("watchdog", [0.0, pytest.param(0.2, marks=pytest.mark.long)])
def test_a_killed_program_loses_nothing_that_had_arrived(
    program: Callable[..., Program],
    watchdog: float,
    capfd: pytest.CaptureFixture[str],
) -> None:
    bench = program(watchdog=watchdog)
    bench.start()
    bench.when(lambda volts: volts > 40.0, lambda: bench.send(signal.SIGKILL))
    assert bench.end()[0] == -signal.SIGKILL
    left(bench)
    rig = bench.server.rig
    if watchdog:
        with rig.lock:
            assert rig.volts == 0.0
    else:
        assert rig.volts == pytest.approx(40.0, abs=1.0)  # nobody can bring it down
    raw = open_journal(bench.journal)
    assert not raw.closed
    n = raw.read("output").n
    sent = int(np.count_nonzero(WAVE <= 40.0))
    assert sent - REPORT <= n <= sent
    np.testing.assert_allclose(raw.read("output").channels["V"], WAVE[:n], atol=0.05)
    x = raw.read("interferometer").channels["x"]
    assert x.size >= n / RATE * 16e3 - 40
    assert main(["acquire", "--recover", str(bench.journal)]) == 0
    told = [line.split() for line in capfd.readouterr().out.splitlines()]
    found = [Path(words[1]) for words in told if words[0] == "recording:"]
    assert {f.name for f in found} == {"take-output.npz", "take-interferometer.npz"}
    for file in found:
        recovered = Recording.open(file)
        about = Provenance.of(recovered)
        assert about.output_end == "unknown"
        assert any("state at the end is unknown" in w for w in about.warnings)
        assert recovered.n == raw.read(file.stem.removeprefix("take-")).n


@pytest.mark.parametrize(
    "again",
    [pytest.param("never", marks=pytest.mark.long),
     pytest.param("at once", marks=pytest.mark.long), "late"],
)  # fmt: skip
def test_ctrl_c_brings_the_output_down(program: Callable[..., Program], again: str) -> None:
    bench = program()
    bench.start()

    def a_second_time() -> None:
        if again == "late":
            time.sleep(0.06)  # not a bounce of the first one
        bench.send(signal.SIGINT)

    def first() -> None:
        bench.send(signal.SIGINT)
        if again != "never":
            bench.when(lambda volts: volts < 30.0, a_second_time)

    bench.when(lambda volts: volts > 40.0, first)
    code, _, error = bench.end()
    assert code == 130
    assert error.startswith("bondsight: stopped")
    assert error.count("\n") == 1
    assert f"; what had arrived is in {bench.journal}: bondsight acquire --recover " in error
    assert shlex.split(error)[-1] == str(bench.journal)
    assert bench.server.rig.volts == 0.0
    # down by the gentle ramp and not by a jump
    assert bench.server.extremes.largest_step < 5.0
    raw = open_journal(bench.journal)
    assert raw.closed
    assert raw.read("output").n >= int(np.count_nonzero(WAVE <= 40.0)) - REPORT
    assert [n.content.get("kind") for n in raw.notes].count("KeyboardInterrupt") == 1
    assert raw.notes[-1].content["output_end"] == "parked"


def test_sigterm_brings_the_output_down_and_says_so(program: Callable[..., Program]) -> None:
    bench = program()
    bench.start()
    bench.when(lambda volts: volts > 40.0, lambda: bench.send(signal.SIGTERM))
    code, _, error = bench.end()
    assert code == 128 + signal.SIGTERM
    assert error.startswith("bondsight: ended by SIGTERM; output parked at 0 V")
    assert error.count("\n") == 1
    assert shlex.split(error)[-1] == str(bench.journal)
    left(bench)
    assert bench.server.departures[-1].volts == 0.0
    assert open_journal(bench.journal).notes[-1].content["output_end"] == "parked"


@pytest.mark.long
def test_a_full_disk_ends_the_take_with_all_that_had_fitted(
    program: Callable[..., Program],
) -> None:
    bench = program()
    room = 20_000

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    bench.start(small)
    code, _, error = bench.end()
    assert code == 2
    assert error.startswith("bondsight: take.journal: File too large")
    assert error.count("\n") == 1
    assert bench.server.rig.volts == 0.0
    assert bench.server.extremes.largest_step < 5.0
    raw = open_journal(bench.journal)
    assert raw.read("output").n >= REPORT
    assert bench.journal.stat().st_size <= room
    assert not (bench.folder / "take.npz").exists()
