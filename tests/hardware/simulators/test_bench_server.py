"""The whole bench: composed, in a process of its own, sealed, and when its program is killed."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hardware.simulators.bench_server import (
    BenchConfig,
    BenchServer,
    PlantConfig,
    SealedEnvelope,
    Stand,
    load_config,
    pacing,
    serve,
    stand_of,
)
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.control import BenchClock, ask
from hardware.simulators.device_clock import DeviceClock
from hardware.simulators.plants import plain_stack
from hardware.simulators.seal import SealBrokenError
from tests.patience import HANGS

ROOT = Path(__file__).resolve().parents[3]
LINEAR = {"plant": "stack", "effects": [], "parameters": {"C_a": 1.3e-6}}


def quick(config: PlantConfig) -> Stand:
    """Make a linear stack without the search for a strength."""
    return Stand(plain_stack(), LINEAR, 1e-9, 0.0)


def soon(condition: Callable[[], bool], seconds: float = HANGS) -> None:
    """Wait for another thread or process."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(5e-3)


QUICK = PlantConfig(name="quick")
PLANTS = {"quick": quick}


def test_all_fronts_stand_before_one_bench() -> None:
    """Interferometer and card; faults reach them by name; stopping twice is nothing."""
    server = BenchServer(BenchConfig(plant=QUICK, faults=("card looks=3",)), plants=PLANTS)
    with server:
        assert set(server.addresses) == {"control", "interferometer", "card"}
        assert server.devices["card"].front.faults.looks == 3  # type: ignore[attr-defined]
        clock = BenchClock(server.addresses["control"])
        assert clock.ask("FAULT") == "card interferometer"
        clock.ask("FAULT interferometer beam_loss_at=100 fringes=-2 no_trigger=1")
        faults = server.devices["interferometer"].front.faults  # type: ignore[attr-defined]
        assert (faults.beam_loss_at, faults.fringes, faults.no_trigger) == (100, -2, True)
        clock.ask("FAULT interferometer beam_loss_at=none")
        assert faults.beam_loss_at is None
        for wrong in ("interferometer nothing=1", "card cut=half", "controller delay=1"):
            with pytest.raises(ValueError, match="virtual bench: "):
                clock.ask(f"FAULT {wrong}")
        clock.close()
    server.stop()
    assert server.report()[0].startswith("0.000 s of the bench; voltage at the actuator 0.000")


@pytest.mark.parametrize("front", ["gcs", "ascii"])
def test_a_digital_controller_instead_of_the_card(front: str) -> None:
    """Its answers can be spoilt by name."""
    config = BenchConfig(plant=QUICK, fronts=("interferometer", front), watchdog=0.5)
    with BenchServer(config, plants=PLANTS) as server:
        assert front in server.addresses
        ask(server.addresses["control"], "FAULT controller delay=0.01 chunk=1 count=2")
        queue = server.devices[front].front.faults  # type: ignore[attr-defined]
        assert [queue.take().chunk for _ in range(3)] == [1, 1, 0]


@pytest.mark.parametrize(("front", "say"), [("gcs", b"SVA 1 80\n"), ("ascii", b"set,80\r")])
def test_a_controllers_own_watchdog_gets_its_time(front: str, say: bytes) -> None:
    """Time stands still on a virtual bench without a program; the bench lets it pass."""
    config = BenchConfig(plant=QUICK, fronts=(front,), watchdog=0.2)
    with BenchServer(config, plants=PLANTS) as server:
        clock = BenchClock(server.addresses["control"])
        clock.sleep(0.01)
        device = server.devices[front].front.device  # type: ignore[attr-defined]
        list(device.feed(say))
        clock.sleep(0.1)
        assert server.rig.volts == 80.0
        clock.close()
        soon(lambda: bool(server.departures) and server.rig.volts == 0.0)
        assert server.extremes.largest_step <= 80.0


def test_the_watchdog_goes_through_the_card() -> None:
    """Its registers say 0 V afterwards, so that the next program starts from the truth."""
    config = BenchConfig(plant=QUICK, watchdog=0.1)
    with BenchServer(config, plants=PLANTS) as server:
        card = server.devices["card"].front.registers  # type: ignore[attr-defined]
        clock = BenchClock(server.addresses["control"])
        clock.sleep(0.01)
        card.write16(2, 0x20, 0x2000)
        card.write32(3, 0x68, 1 << 26)
        assert server.rig.volts == 0.0
        card.write16(2, 0x20, 0x2000 + 2048)
        assert server.rig.volts == pytest.approx(50.0)
        clock.close()
        soon(lambda: server.rig.volts == 0.0 and bool(server.departures))
        assert card.terminals[0] == 0.0
        assert card.log[-1].value == 0x2000


def test_a_fault_of_the_configuration_that_does_not_exist_leaves_nothing_open() -> None:
    """One line; threads and ports are gone."""
    server = BenchServer(BenchConfig(plant=QUICK, faults=("card foo=1",)), plants=PLANTS)
    before = threading.active_count()
    with pytest.raises(ValueError, match="bench: fault 'card foo=1': card has no fault 'foo'"):
        server.start()
    soon(lambda: threading.active_count() <= before)


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ({"plant": {"effekt": "creep"}}, "bench.plant: unknown entry 'effekt'; known: name, seed"),
        ({"speed": "fast"}, "bench.speed: float is needed, not 'fast'"),
        ({"speed": -1}, "bench: speed = -1.0 must be finite and >= 0"),
        ({"fronts": ["laser"]}, "bench: unknown front 'laser'; known: interferometer, card"),
        ({"fronts": ["card", "gcs"]}, "bench: card and gcs would both hold the terminals"),
        ({"plant": {"sealed": True, "seed": 3}}, "bench: a sealed plant takes no seed"),
        ({"plant": {"sealed": 1}}, "bench.plant.sealed: bool is needed, not 1"),
        ({"plant": {"vibration": [[50.0]]}}, "bench.plant.vibration[0]: 2 values are needed"),
        ({"plant": {"press": [4.0]}}, "bench: press = [4.0] must be [N, s]"),
        ({"plant": {"press": [4.0, 2.0], "name": "m661"}}, "is for plant 'stack'"),
        ({"card": 3}, "bench.card: a table is needed, not 3"),
        ({"plant": {"seed": True}}, "bench.plant.seed: int is needed, not True"),
    ],
)
def test_a_wrong_configuration_is_refused_in_one_line(data: Any, line: str) -> None:
    """What, where, why."""
    with pytest.raises(ValueError, match=re.escape(line)) as refused:
        config_from(data)
    assert "\n" not in str(refused.value)


def test_configurations_come_from_files(tmp_path: Path) -> None:
    """TOML and JSON; errors name the file."""
    toml = tmp_path / "bench.toml"
    toml.write_text(
        'watchdog = 0.2\nfronts = ["card"]\n[plant]\neffect = "creep"\nvibration = [[50, 1e-9]]\n'
        "[interferometer]\nppm = 37.1\noffset = 3.2e-4\n"
    )
    config = load_config(toml)
    assert config.plant.vibration == ((50.0, 1e-9),)
    assert config.interferometer == DeviceClock(ppm=37.1, offset=3.2e-4)
    assert config.interferometer.ppm == 37.1
    (tmp_path / "bench.json").write_text('{"watchdog": 0.2}')
    assert load_config(tmp_path / "bench.json").watchdog == 0.2
    toml.write_text("watchdog = = 2\n")
    for path in (toml, tmp_path / "none.toml"):
        with pytest.raises(ValueError, match=path.name) as refused:
            load_config(path)
        assert "\n" not in str(refused.value)


def test_unknown_plants_and_effects_are_refused() -> None:
    """One line that names what is known."""
    for plant, word in (
        (PlantConfig(name="rocket"), "known: quick, stack"),
        (PlantConfig(effect="magic", seed=1), "no effect 'magic'"),
        (PlantConfig(effect="creeep", seed=1), "did you mean creep"),
        (PlantConfig(effect="creep", place="C_nl", seed=1), "did you mean C_a; known: C_a, k"),
        (PlantConfig(effect="dead_zone", place="V_in", seed=1), "no place of dead_zone 'V_in'"),
        (PlantConfig(effect="creep", strength="huge", seed=1), "known: medium, strong, weak"),
    ):
        with pytest.raises(ValueError, match=word):
            stand_of(BenchConfig(plant=plant), PLANTS)


def test_the_envelope_is_that_of_the_sealed_bench(tmp_path: Path) -> None:
    """Its file opens to the same truth; salts differ; its words tell nothing."""
    envelope = SealedEnvelope.closed(LINEAR)
    assert "salt" not in repr(envelope)
    assert "stack" not in repr(envelope)
    assert len(envelope.hash) == 64
    envelope.save(tmp_path / "truth.json")
    assert SealedEnvelope.load(tmp_path / "truth.json").truth() == LINEAR
    assert envelope.truth() == LINEAR
    assert SealedEnvelope.closed(LINEAR).hash != envelope.hash


def test_tampering_is_found() -> None:
    """Changed payload, salt or hash do not open."""
    sealed = SealedEnvelope.closed(LINEAR)
    content = json.loads(sealed.payload)
    content["effects"] = [{"effect": "creep"}]
    forged = json.dumps(content, sort_keys=True, separators=(",", ":"))
    for bad in (
        replace(sealed, payload=forged),
        replace(sealed, salt="00" * 32),
        replace(sealed, hash="0" * 64),
    ):
        with pytest.raises(SealBrokenError, match="does not match"):
            bad.truth()


def test_same_seed_same_bytes_through_the_server() -> None:
    """Everything random is seeded, whatever threads do."""

    def run() -> bytes:
        config = BenchConfig(
            plant=PlantConfig(name="quick", noise_i=1e-4, noise_seed=3, vibration=((50.0, 2e-9),))
        )
        with BenchServer(config, plants=PLANTS) as server:
            clock = BenchClock(server.addresses["control"], jitter=1e-6, seed=1)
            for k in range(20):
                server.rig.drive(5.0 * k)
                clock.sleep(1e-3)
            clock.close()
            seen = server.rig.seen(np.linspace(0.0, server.rig.now, 300))
            return seen.x.tobytes() + seen.i.tobytes()

    assert run() == run()


def test_a_bench_in_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time passes by itself, as fast as the computer's; WAIT ends no sooner."""
    read: list[float] = []

    def perf_counter() -> float:
        read.append(time.perf_counter())
        return read[-1]

    monkeypatch.setattr(pacing, "time", SimpleNamespace(perf_counter=perf_counter))
    with BenchServer(BenchConfig(plant=QUICK, speed=10.0), plants=PLANTS) as server:
        clock = BenchClock(server.addresses["control"])
        assert float(clock.ask("RATE")) == 10.0
        done: list[float] = []
        server.rig.at(server.rig.now + 0.1, lambda: done.append(server.rig.now))
        begin = clock.now()
        clock.sleep(0.3)
        end = clock.now()
        assert end - begin >= 0.3
        # nothing but the clock it was given let the time pass
        assert end <= 10.0 * (read[-1] - read[0]) + 1e-9
        assert len(done) == 1
        clock.close()


def test_serve_tells_what_a_person_needs(tmp_path: Path) -> None:
    """Addresses, environment, command line, hash; the truth only at the end and only if asked."""
    out, stop, ready = io.StringIO(), threading.Event(), tmp_path / "ready.json"
    config = BenchConfig(plant=PlantConfig(name="quick", sealed=True))
    options: dict[str, Any] = {
        "plants": PLANTS,
        "output": out,
        "ready_file": ready,
        "envelope_file": tmp_path / "truth.json",
        "reveal_request": tmp_path / "open",
        "stop": stop,
        "started": lambda addresses: [f"drive {addresses['control']}"],
    }
    thread = threading.Thread(target=serve, args=(config,), kwargs=options)
    thread.start()
    soon(ready.exists)
    told = json.loads(ready.read_text())
    text = out.getvalue()
    for needed in (*told["addresses"].values(), told["hash"], "drive 127", "no watchdog"):
        assert needed in text
    assert "C_a" not in text
    with pytest.raises(ValueError, match=f"sealed {told['hash']}"):
        ask(told["addresses"]["control"], "TRUTH?")
    assert not (tmp_path / "truth.json").exists()
    (tmp_path / "open").touch()
    thread.join(HANGS)
    assert not thread.is_alive()
    assert "C_a" in out.getvalue()
    assert "voltage at the actuator 0.000 to 0.000 V" in out.getvalue()
    assert SealedEnvelope.load(tmp_path / "truth.json").hash == told["hash"]
    assert not ready.exists()


ORPHAN = """
import os, sys
from hardware.simulators.bench_server import BenchConfig, PlantConfig, Stand, serve
from tests.hardware.simulators.test_bench_server import QUICK, PLANTS
parent = os.getpid()
child = os.fork()
if child == 0:
    sys.exit(serve(BenchConfig(plant=QUICK), plants=PLANTS, ready_file=sys.argv[1], parent=parent))
os.waitpid(child, 0)
"""


@pytest.mark.skipif(os.name != "posix", reason="a parent's end is told on POSIX")
def test_a_bench_ends_with_the_program_that_started_it(tmp_path: Path) -> None:
    """SIGKILL of the parent leaves no process behind, and no file that says it is ready."""
    ready = tmp_path / "ready.json"
    parent = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, str(ready)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    try:
        soon(lambda: ready.exists() or parent.poll() is not None)
        told = json.loads(ready.read_text())
        assert ask(told["addresses"]["control"], "NOW") == "0.0"
        assert told["pid"] != parent.pid
    finally:
        parent.kill()
        parent.communicate(timeout=HANGS)  # until its output ends: the bench had it open too
    assert not ready.exists()
    with pytest.raises(ConnectionError):
        ask(told["addresses"]["control"], "NOW")


SERVER = """
import sys
from hardware.simulators.bench_server import BenchConfig, PlantConfig, Stand, serve
from hardware.simulators.plants import plain_stack
serve(
    BenchConfig(plant=PlantConfig(name="quick"), watchdog=float(sys.argv[2])),
    plants={"quick": lambda c: Stand(plain_stack(), {"plant": "stack"})},
    ready_file=sys.argv[1],
)
"""

CLIENT = """
import json, socket, struct, sys, time
from hardware.simulators.control import BenchClock
told = json.load(open(sys.argv[1]))["addresses"]
clock = BenchClock(told["control"])
host, _, port = told["card"].rpartition(":")
card = socket.create_connection((host, int(port)))

def put(*accesses):
    data = b"".join(struct.pack("<BBHI", *a) for a in accesses)
    card.sendall(struct.pack("<H", len(accesses)) + data)
    card.recv(2 + 4 * len(accesses))

put((1, 2, 0x20, 0x2000), (3, 3, 0x68, 1 << 26))
for k in range(1, 101):
    clock.sleep(1e-3)
    put((1, 2, 0x20, 0x2000 + round(k / 20.0 / (20.0 / 16384.0))))
print("ready", flush=True)
time.sleep(60.0)
"""


@pytest.fixture(params=[0.2, 0.0], ids=["watchdog", "none"])
def bench_process(request: Any, tmp_path: Path) -> Iterator[tuple[Any, Path, float]]:
    """Start a bench in a process of its own."""
    ready = tmp_path / "ready.json"
    arguments = [str(ready), str(request.param)]
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER, *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    try:
        soon(ready.exists, 30.0)
        yield process, ready, request.param
    finally:
        process.kill()
        process.communicate()


def test_a_killed_program_and_its_voltage(bench_process: Any) -> None:
    """SIGKILL in the middle: back at 0 V with a watchdog, left at 100 V and said so without."""
    process, ready, watchdog = bench_process
    program = subprocess.Popen(
        [sys.executable, "-c", CLIENT, str(ready)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert program.stdout is not None
    assert program.stdout.readline() == "ready\n"
    address = json.loads(ready.read_text())["addresses"]["control"]
    program.send_signal(signal.SIGKILL)
    program.communicate()
    volts = 100.0
    if watchdog:
        soon(lambda: float(ask(address, "VOLTS")) == 0.0)
        volts = 0.0
    else:
        time.sleep(0.3)  # the bench has to notice that the program is gone; it does nothing then
    lowest, highest, step = map(float, ask(address, "EXTREMES").split())
    assert float(ask(address, "VOLTS")) == pytest.approx(volts, abs=0.02)
    assert lowest == 0.0
    assert highest == pytest.approx(100.0, abs=0.02)
    assert step < 2.1
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=HANGS)
    assert process.returncode == 0
    told = "the watchdog brought it to 0 V" if watchdog else "no watchdog: the voltage stays"
    assert told in out
    assert ("the output is left at 100" in out) == (watchdog == 0.0)
    assert not ready.exists()
