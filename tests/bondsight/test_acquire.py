"""``bondsight acquire`` and ``bondsight bench serve``, as a person types them."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, C, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError
from bondsight.cli.acquire import _held, _source
from bondsight.cli.acquire_signal import waveform
from bondsight.cli.bench_serve import station_writer
from bondsight.cli.main import main
from hardware.envelope import P840_1_UNIPOLAR, check_wave
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.storage import Provenance, open_journal
from tests.patience import HANGS

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="the stub library is C code")


@needs_gcc
def test_a_simulated_take_ends_with_its_seal(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["acquire", "--simulated", "--effect", "creep", "--seed", "3", "--samples", "500",
                 "--out", str(tmp_path), "--name", "short"]  # fmt: skip
    assert main(arguments) == 0
    out = capfd.readouterr().out
    assert "truth sealed: sha256 " in out
    assert "seal opened:" in out
    assert "creep at" in out
    assert "output parked at 0 V" in out
    recording = Recording.open(tmp_path / "short.npz")
    assert recording.n == 500
    assert Provenance.of(recording).output_end == "parked"
    # measurements are not overwritten
    assert main(arguments) == 2
    assert "exists" in capfd.readouterr().err


@needs_gcc
def test_with_json_words_are_on_standard_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["acquire", "--simulated", "--effect", "none", "--seed", "3", "--samples", "300",
                 "--out", str(tmp_path), "--json"]  # fmt: skip
    assert main(arguments) == 0
    out, error = capfd.readouterr()
    assert out == ""
    for said in ("truth sealed", "envelope:", "signal:", "output:", "recording:", "raw data:"):
        assert said in error


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "give a station file, or --simulated"),
        (["--simulated", "--effect", "creeep"], "creeep"),
        (["--simulated", "--diagnose", "no_such_model"], "no_such_model"),
        (["--simulated", "--signal", "sine"], "sine:HZ"),
        (["--simulated", "--signal", "hold:3"], "write hold:SECONDS:VOLTS"),
        (["--simulated", "--signal", "sine:9999"], "stay below half"),
        (["--simulated", "--samples", "10"], "too few"),
        (["--simulated", "--signal", "ramp"], "write ramp:SECONDS"),
        (["--simulated", "--signal", "ramp:1:5"], "write ramp:SECONDS"),
        (["--simulated", "--signal", "ramp:1e9"], "1e+13 samples"),
        *(
            (["--simulated", "--signal", s, "--samples", "100000000"], "give at most 2e+07")
            for s in ("session", "sine:1", "triangle:1", "multisine:1:9")
        ),
        (["--simulated", "--signal", "ramp:1:80:20"], "20 V is not above 80 V"),
        (["--simulated", "--signal", "triangle:0"], "stay below half"),
        (["--simulated", "--signal", "staircase:0:1"], "whole number"),
        (["--simulated", "--signal", "multisine:90:10"], "multisine"),
        (["--simulated", "--signal", "reversals:2.5:100"], "whole number"),
        (["--simulated", "--signal", "reversals:3:nan"], "nan"),
        (["--simulated", "--rate", "0"], "positive number"),
        (["--simulated", "--rate", "nan"], "positive number"),
        *((["--simulated", "--erase", v], f"--erase {v}: is outside of") for v in ("nan", "inf")),
        (["--simulated", "--erase=-5"], "--erase -5: is outside of"),
        (["--simulated", "--signal", "demagnetise:-5"], "--signal demagnetise:-5: is outside"),
        *((["--simulated", "--patience", v], "--patience") for v in ("0", "nan")),
        (["--simulated", "--name", "../up"], "no plain file name"),
        (["--simulated", "--name", ""], "no plain file name"),
        (["--simulated", "--name", "a\nb"], "no plain file name"),
        (["--simulated", "--diagnose", "stack_with_payload", "--map", "x"], "NAME=COLUMN"),
        (["--simulated", "--diagnose", "stack_with_payload", "--map", "y=x"], "'y'"),
        (["--recover", "nothing.journal"], "nothing.journal"),
        (["nothing.toml"], "cannot be read"),
    ],
)
def test_bad_input_gets_one_line(
    arguments: list[str], says: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["acquire", *arguments, "--out", str(tmp_path)]) == 2
    out, error = capfd.readouterr()
    assert says in error
    assert error.count("\n") == 1
    assert "sealed" not in out, "refused before a bench is started"
    assert not list(tmp_path.iterdir())


@needs_gcc
def test_a_served_bench_writes_the_file_that_acquire_takes(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    server = subprocess.Popen(
        [sys.executable, "-m", "bondsight", "bench", "serve",
         "--effect", "none", "--seed", "2", "--station", str(station), "--reveal"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        end = time.monotonic() + HANGS
        while not station.exists() and time.monotonic() < end and server.poll() is None:
            time.sleep(0.02)
        arguments = ["acquire", str(station), "--samples", "300", "--out", str(tmp_path)]
        assert main([*arguments, "--synchronise", "start"]) == 0
    finally:
        server.send_signal(signal.SIGINT)
        said, _ = server.communicate(timeout=HANGS)
    assert "Ctrl-C ends the bench" in said
    assert "voltage at the actuator" in said
    assert "truth behind" in said
    assert Recording.open(tmp_path / "take.npz").n >= 298


@pytest.mark.parametrize(
    ("source", "measured", "maps", "hold"),
    [
        ("V_in", False, [], "hold"),
        ("V_in", False, ["V_in=V_mon"], None),
        ("V", False, [], "hold"),
        ("V", False, ["V = V_mon"], None),
        ("V", True, [], None),
        ("V", True, ["V=V"], "hold"),
    ],
)
def test_the_command_counts_as_held_whatever_the_source_is_called(
    source: str, measured: bool, maps: list[str], hold: str | None
) -> None:
    with BondGraph("plant") as graph:
        loop = One("loop")
        Se(source, unit="V", measured=measured) >> loop >> R("R", 50.0, unit="ohm")
        loop >> C("C", 1e-6, unit="F")
    assert _held(graph, [*maps, *_source(graph, maps)]) == hold


def test_signals_keep_to_the_envelope(tmp_path: Path) -> None:
    e = P840_1_UNIPOLAR
    for text in ("session", "sine:20", "sine:5:10:60", "demagnetise", "demagnetise:40",
                 "ramp:0.3", "triangle:4:10:70", "staircase:5:0.02", "multisine:5:500:20:80",
                 "reversals:4:900:0:60"):  # fmt: skip
        volts, _ = waveform(text, 10e3, 2048, e, 1)
        check_wave(e, volts, 10e3)
        assert np.ptp(volts) > 10.0
    session, _ = waveform("session", 10e3, 8192, e, 1)
    assert session.min() < 10.0
    assert session.max() > 90.0
    np.testing.assert_array_equal(session, waveform("session", 10e3, 8192, e, 1)[0])
    assert np.any(session != waveform("session", 10e3, 8192, e, 2)[0])
    np.testing.assert_array_equal(
        waveform("multisine:5:500:20:80", 10e3, 2048, e, 1)[0],
        waveform("multisine:5:500:20:80", 10e3, 2048, e, 1)[0],
    )
    file = tmp_path / "mine.csv"
    file.write_text("V[V]\n1\n2\n3\n")
    np.testing.assert_array_equal(waveform(str(file), 10.0, 99, e, 0)[0], [1.0, 2.0, 3.0])
    file.write_text("t[s],V[V]\n0,1\n0.002,2\n0.004,3\n")
    # the file's own time decides, and a rate that contradicts it is refused
    assert waveform(str(file), None, 99, e, 0)[1] == pytest.approx(500.0)
    with pytest.raises(BondsightError, match="was sampled at 500 Hz"):
        waveform(str(file), 10e3, 99, e, 0)
    file.write_text("V[V],x[V]\n1,2\n2,3\n")
    with pytest.raises(BondsightError, match="2 channels in V"):
        waveform(str(file), 10.0, 99, e, 0)


@pytest.mark.parametrize(
    ("text", "rate", "samples"),
    [("multisine:5:100", 1e3, 1000), ("sine:3000", 1e5, 3000), ("sine:300", 1e3, 1000),
     ("triangle:900", 1e4, 1000)],
)  # fmt: skip
def test_a_signal_without_a_size_is_as_large_as_its_steps_may_be(
    text: str, rate: float, samples: int
) -> None:
    e = P840_1_UNIPOLAR
    volts, _ = waveform(text, rate, samples, e, 0)
    check_wave(e, volts, 1.1 * rate)
    with pytest.raises(BondsightError, match="against slew"):
        check_wave(replace(e, v_min=-9.0, v_max=109.0), 1.01 * volts, 1.1 * rate)
    assert volts.min() == pytest.approx(0.0, abs=1e-9) or volts.mean() == pytest.approx(50.0)
    # a size that was asked for is not changed but refused, where it is played
    asked, _ = waveform(f"{text}:0:100", rate, samples, e, 0)
    assert np.ptp(asked) > np.ptp(volts)


def turning_points(volts: np.ndarray) -> list[float]:
    """Values at which a course of straight ways ends or turns."""
    way = np.sign(np.diff(volts))
    return [float(volts[0]), *volts[1:-1][way[1:] != way[:-1]].tolist(), float(volts[-1])]


def test_signals_of_the_thesis_and_of_memories_go_where_they_say() -> None:
    e = P840_1_UNIPOLAR
    held, _ = waveform("hold:0.5:20", 1e3, 99, e, 0)
    assert (held.size, np.ptp(held), held[0]) == (500, 0.0, 20.0)
    ramp, rate = waveform("ramp:10", 1e3, 99, e, 0)
    assert (ramp.size, rate, ramp[0], ramp[-1]) == (10_001, 1e3, 0.0, 100.0)
    np.testing.assert_allclose(np.diff(ramp), 0.01, atol=1e-12)
    triangle, _ = waveform("triangle:2:10:60", 1e3, 1001, e, 0)
    assert triangle.size == 1001
    assert turning_points(triangle) == pytest.approx([10.0, 60.0, 10.0, 60.0, 10.0])
    stairs, _ = waveform("staircase:4:0.1:20:60", 1e3, 99, e, 0)
    levels = stairs[99::100]
    assert levels == pytest.approx([20.0, 30.0, 40.0, 50.0, 60.0, 50.0, 40.0, 30.0, 20.0])
    turns, _ = waveform("reversals:3:200:0:90", 1e3, 99, e, 0)
    assert turning_points(turns) == pytest.approx([0, 90, 60, 90, 30, 90, 0, 90])
    lines, _ = waveform("multisine:20:40:30:70", 1e3, 1000, e, 3)
    spectrum = np.abs(np.fft.rfft(lines - 50.0))
    assert set(np.flatnonzero(spectrum > 1e-6 * spectrum.max())) == set(range(20, 41))


def served(tmp_path: Path, server: BenchServer) -> str:
    station_writer(tmp_path / "station.toml", server.config)(server.addresses)
    return str(tmp_path / "station.toml")


@needs_gcc
def test_a_take_is_described_in_a_file_and_repeated_from_its_journal(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    described = tmp_path / "loops.toml"
    described.write_text(
        'signal = "triangle:20:10:60"\nrate = 2000\nsamples = 400\nsynchronise = "start"\n'
        "patience = 3.5\n"
    )
    config = config_from({"plant": {"effect": "none", "seed": 5}})
    with BenchServer(config) as server:
        begin = ["acquire", served(tmp_path, server), "--out", str(tmp_path), "--quiet", "--take"]
        assert main([*begin, str(described), "--name", "a"]) == 0
        assert main([*begin, str(tmp_path / "a.journal"), "--name", "b"]) == 0
        assert main([*begin, str(described), "--name", "c", "--samples", "300"]) == 0
    first, second, third = (open_journal(tmp_path / f"{n}.journal") for n in "abc")
    assert first.header["command"] == second.header["command"]
    assert first.header["command"]["asked"]["patience"] == 3.5
    assert first.header["command"]["synchronisation"] == "start"
    commanded = [j.read("output").channels["V"] for j in (first, second, third)]
    np.testing.assert_array_equal(commanded[0], commanded[1])
    np.testing.assert_array_equal(commanded[0][:300], commanded[2])
    capfd.readouterr()
    # options before the file would be lost without a word
    with pytest.raises(SystemExit):
        main(["acquire", "--rate", "500", "--take", str(described), "station.toml"])
    assert "behind --take" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('signl = "sine:1"', "did you mean 'signal'"),
        ('signal = "sine:1', "is no TOML"),
        ("samples = -3", "samples"),
        ('synchronise = "clok"', "one of clock, start, none"),
        (None, "cannot be read"),
    ],
)
def test_a_take_file_that_cannot_be_used_gets_one_line(
    text: str | None, says: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "take.toml"
    if text is not None:
        file.write_text(text)
    assert main(["acquire", "--simulated", "--take", str(file)]) == 2
    error = capfd.readouterr().err
    assert says in error
    assert error.count("\n") == 1
