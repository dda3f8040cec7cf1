"""``bondsight regulate`` and ``bondsight calibrate`` on a virtual bench."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph import Recording
from bondsight.cli.main import main
from hardware.optics import Ellipse
from hardware.simulators.bench_server import MACHINES, BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.station import read_settings
from hardware.station.settings import toml_text
from hardware.station.virtual import station_table, stub_library

Serve = Callable[..., tuple[Any, Path]]


@pytest.fixture
def serve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Serve]:
    """Return what starts a bench and writes its station file."""
    # a busy machine may be slow
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS_TIMEOUT", "60")
    if shutil.which("gcc") is None:
        pytest.skip("no gcc: the stub of the interferometer's library is C code")
    started: list[BenchServer] = []

    def start(**table: Any) -> tuple[BenchServer, Path]:
        config = config_from({"plant": {"effect": "none", "seed": 5}, **table})
        server = BenchServer(config, plants=MACHINES)
        addresses = server.start()
        started.append(server)
        file = tmp_path / f"station{len(started)}.toml"
        file.write_text(toml_text(station_table(addresses, config, stub_library())))
        return server, file

    yield start
    for server in started:
        server.stop()


def lines(capfd: pytest.CaptureFixture[str]) -> tuple[str, str]:
    said = capfd.readouterr()
    return said.out, said.err


def test_a_controller_file_and_a_target_file_make_a_recording(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    server, station = serve()
    (tmp_path / "pi.toml").write_text(
        'kind = "inverse"\nrate = 500\nintegral = 150\nfeedforward = false\ngain = 50e-9\n'
    )
    t = np.arange(0.0, 0.4, 1e-3)
    x = 1e6 * 1e-6 * (1.0 - np.cos(2.0 * np.pi * 2.5 * t))
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(t.tolist(), x.tolist(), strict=True))
    (tmp_path / "target.csv").write_text(f"t [s],x [um]\n{rows}\n")
    arguments = ["regulate", str(station), "--controller", str(tmp_path / "pi.toml"), "--target",
                 str(tmp_path / "target.csv"), "--out", str(tmp_path), "--quiet"]  # fmt: skip
    assert main(arguments) == 0
    out, _ = lines(capfd)
    assert "% of the reference's range" in out
    assert "limit: a cycle takes this host and transport" in out
    r = Recording.open(tmp_path / "loop.npz")
    assert r.fs == pytest.approx(500.0)
    assert np.asarray(r["x_ref"]).max() == pytest.approx(2e-6, rel=1e-3)
    assert np.std(np.asarray(r["x"]) - np.asarray(r["x_ref"])) < 0.06 * 2e-6
    assert server.rig.volts == 0.0
    # measurements are not overwritten
    assert main(arguments) == 2
    assert "exists" in lines(capfd)[1]


BAD = {
    "no controller": (["--controller", "stak"], "Did you mean 'stack'"),
    "no target": (["--target", "sinus:1"], "give sine:HZ:LOW"),
    "too fast": (["--rate", "20000"], "update_period) allows 5 kHz"),
    "unstable": (["--controller", "{wild}"], "not stable"),
    "no such key": (["--controller", "{odd}"], "proportionl"),
    "no such kind": (["--controller", "{kind}"], "did you mean 'inverse'"),
    "no inverse": (["--controller", "{dahl}"], "has no inverse"),
    "start above": (["--start", "300"], "--start 300: lies outside of the envelope's 0 .. 100 V"),
    "start below": (["--start=-1"], "--start -1: lies outside"),
    "no start": (["--start", "nan"], "start"),
    "ultrasonic": (["--controller", "m661"], "has no [ultrasonic] driver"),
    "stage": (["--controller", "{stage}"], "has no [ultrasonic] driver"),
    "no sensor": (["--controller", "lock"], "no reading 'lag'"),
    "out of reach": (["--target", "sine:1:0:9e-6:1"], "the operator reaches"),
    "endless": (["--target", "sine:1:0:1e-6:1e9"], "ticks; give 2 to"),
}


def test_bad_input_is_one_line_and_moves_nothing(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    server, station = serve()
    files = {
        "wild": 'kind = "inverse"\nintegral = 1e5\ngain = 1e-8\n',
        "odd": 'kind = "inverse"\nproportionl = 1\n',
        "kind": 'kind = "inverze"\n',
        "stage": 'kind = "stage"\ncrossover = 20\n',
        "dahl": 'kind = "inverse"\n[operator]\nkind = "dahl"\nstiffness = 1.0\ncoulomb = 1.0\n',
    }
    for name, text in files.items():
        (tmp_path / f"{name}.toml").write_text(text)
    named = {name: str(tmp_path / f"{name}.toml") for name in files}
    for what, (options, says) in BAD.items():
        words = ["regulate", str(station), "--out", str(tmp_path / "out"), "--quiet"]
        assert main([*words, *(o.format(**named) for o in options)]) == 2, what
        out, error = lines(capfd)
        assert error.count("\n") == 1, (what, error)
        assert says in error, (what, error)
        assert "Traceback" not in out + error
        assert not server.devices["card"].front.log, what
    assert not list((tmp_path / "out").glob("*"))


def test_a_clock_that_the_device_cannot_take_moves_nothing(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    server, station = serve(clocked="fast")
    text = station.read_text()
    (tmp_path / "fast.toml").write_text(
        text.replace("[interferometer]", "[interferometer]\nrate = 1.2e6")
    )
    (tmp_path / "block.toml").write_text(text.replace('"fast"', '"block"'))
    common = ["--out", str(tmp_path / "out"), "--quiet"]
    acquire = ["acquire", "--samples", "256", *common]
    for words, says in (
        (["regulate", str(tmp_path / "fast.toml"), *common], "streams at 16000 Hz at most"),
        ([*acquire, str(tmp_path / "block.toml")], "edges as a clock"),
        ([*acquire, str(tmp_path / "fast.toml"), "--synchronise", "start"], "whole Hz up to 1e+06"),
    ):
        assert main(words) == 2
        error = lines(capfd)[1]
        assert error.count("\n") == 1
        assert says in error
        assert server.extremes.highest == server.extremes.lowest == 0.0, error
        assert not server.devices["card"].front.log, error


def test_the_circle_of_the_reference_mirror_is_the_true_ellipse(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shape = {"offset_cosine": 0.04, "offset_sine": -0.03, "ratio": 1.07, "phase": 0.07}
    server, station = serve(quadrature=shape)
    words = ["calibrate", "interferometer", str(station), "--seconds", "0.2", "--out"]
    assert main([*words, str(tmp_path)]) == 0
    out, _ = lines(capfd)
    assert "thin and closed" in out
    assert (tmp_path / "calibration.png").stat().st_size > 5000
    line = next(s for s in out.splitlines() if s.startswith("station:"))
    told = line.partition("[interferometer] ")[2]
    text = station.read_text().replace("[interferometer]", f"[interferometer]\n{told}")
    (tmp_path / "calibrated.toml").write_text(text)
    optics = read_settings(tmp_path / "calibrated.toml").interferometer
    assert optics is not None
    e = optics.ellipse
    assert isinstance(e, Ellipse)
    assert (e.offset_1 / e.radius, e.ratio, e.skew) == pytest.approx((0.04, 1.07, 0.07), abs=1e-3)
    # nothing was driven, and the mirror stands still again
    assert not server.devices["card"].front.log
    assert not server.devices["interferometer"].front.device.counter.settings.mirror
    # the same from the journal, and a mirror that has aged
    assert main([*words[:2], str(tmp_path / "calibration.journal"), "--out", str(tmp_path),
                 "--name", "again"]) == 0  # fmt: skip
    assert "thin and closed" in lines(capfd)[0]
    server.control.answer("FAULT interferometer mirror_stroke=1.2e-7")
    assert main([*words, str(tmp_path), "--name", "aged"]) == 0
    assert "RG-10" in lines(capfd)[0]


def test_forces_are_averaged_from_a_staircase(
    serve: Serve, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    _, station = serve(
        plant={"name": "m661-gauge", "seed": 1}, driver="ultrasonic", fronts=["card", "gauge"]
    )
    out = ["--out", str(tmp_path)]
    words = ["regulate", str(station), "--controller", "force", "--target", "steps:0.8:1:4:8"]
    assert main([*words, *out, "--quiet"]) == 0
    lines(capfd)
    assert main(["calibrate", "force", str(tmp_path / "loop.npz"), "--settle", "0.3"]) == 0
    table = [s.split() for s in lines(capfd)[0].splitlines()[1:4]]
    volts, force = np.array([[float(v) for v in row[:2]] for row in table]).T
    np.testing.assert_array_equal(volts, [1.0, 4.0, 8.0])
    # inside the dead zone nothing, beyond 6 V all of it
    assert force == pytest.approx([0.0, 0.75, 1.0], abs=0.1)
    assert main(["calibrate", "froce"]) == 2
    assert "Did you mean 'force'" in lines(capfd)[1]
