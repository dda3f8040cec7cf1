"""The adapters under the real Bluesky: its protocols, its RunEngine, its documents."""

from __future__ import annotations

import ast
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hardware.contracts import Flag
from hardware.ecosystem import BlockPlan, BlueskyBlock, BlueskyDisplacement, BlueskyVoltage
from hardware.errors import BeamLost, LimitViolation
from tests.hardware.ecosystem.bench import GAIN, Bench
from tests.patience import HANGS

# Bluesky and what it imports may deprecate what they like
pytestmark = pytest.mark.filterwarnings("default")

protocols = pytest.importorskip("bluesky.protocols")
plans = pytest.importorskip("bluesky.plans")
stubs = pytest.importorskip("bluesky.plan_stubs")
engines = pytest.importorskip("bluesky.run_engine")

N = 32768


class Documents:
    """What the engine emitted."""

    def __init__(self) -> None:
        self.all: list[tuple[str, dict[str, Any]]] = []

    def __call__(self, name: str, document: dict[str, Any]) -> None:
        self.all.append((name, document))

    def of(self, name: str) -> list[dict[str, Any]]:
        return [d for k, d in self.all if k == name]

    def events(self) -> list[dict[str, Any]]:
        return self.of("event")


@pytest.fixture(scope="module")
def engine() -> Any:
    return engines.RunEngine({}, context_managers=[])


@pytest.fixture
def bench() -> Bench:
    return Bench()


def _block(bench: Bench, **more: Any) -> BlueskyBlock:
    return BlueskyBlock(bench.make, {"x": "m"}, wave=bench.wave, clock=bench.clock, **more)


def test_protocols_are_satisfied(bench: Bench) -> None:
    voltage = BlueskyVoltage(bench.output, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor)
    block = _block(bench)
    for thing, names in (
        (
            voltage,
            "Readable Movable Locatable Checkable Stoppable Pausable Stageable Configurable "
            "HasName HasParent HasHints NamedMovable",
        ),
        (displacement, "Readable Triggerable Stageable HasName HasParent HasHints"),
        (
            block,
            "Preparable Flyable EventPageCollectable Collectable Readable Triggerable Stageable "
            "Stoppable Pausable Configurable HasName HasParent",
        ),
        (block.complete(), "Status"),
    ):
        for name in names.split():
            assert isinstance(thing, getattr(protocols, name)), (thing, name)
    assert not isinstance(block, protocols.EventCollectable)


def test_our_side_never_imports_bluesky() -> None:
    import hardware.ecosystem

    folder = Path(hardware.ecosystem.__file__).parent
    for file in folder.glob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        named = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
        named |= {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        roots = {n.split(".")[0] for n in named}
        assert not roots & {"bluesky", "event_model", "ophyd"}, file.name
        if not file.name.startswith("with_"):
            assert not roots & {"pymeasure", "qcodes"}, file.name


def test_count_and_list_scan(engine: Any, bench: Bench) -> None:
    seen = Documents()
    voltage = BlueskyVoltage(bench.output, readback=True, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor)
    engine(plans.count([displacement], num=3), seen)
    assert len(seen.events()) == 3
    seen.all.clear()
    volts = [0.0, 25.0, 100.0, 50.0]
    engine(plans.list_scan([displacement], voltage, volts), seen)
    events = [e["data"] for e in seen.events()]
    assert [e["voltage"] for e in events] == volts
    assert [e["voltage_readback"] for e in events] == volts
    assert [e["displacement"] for e in events] == pytest.approx(GAIN * np.array(volts), abs=1e-15)
    keys = seen.of("descriptor")[0]["data_keys"]
    assert keys["voltage"]["units"] == "V"
    assert keys["voltage"]["limits"]["control"] == {"low": 0.0, "high": 100.0}
    assert keys["displacement"]["units"] == "m"
    assert keys["displacement"]["source"] == "none rig sensor 8"
    configuration = seen.of("descriptor")[0]["configuration"]["voltage"]["data"]
    assert "0 .. 100 V" in configuration["voltage_envelope"]
    assert not configuration["voltage_has_watchdog"]
    # unstaged: parked, and never a jump on the way
    assert bench.rig.volts == 0.0
    assert bench.rig.extremes.largest_step < 1.0


def test_limits_are_refused_before_motion(engine: Any, bench: Bench) -> None:
    check_limits = pytest.importorskip("bluesky.simulators").check_limits
    voltage = BlueskyVoltage(bench.output, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor)
    with pytest.raises(LimitViolation, match="above v_max"):
        check_limits(plans.list_scan([displacement], voltage, [10.0, 120.0]))
    assert bench.raw.history == []
    seen = Documents()
    with pytest.raises(LimitViolation):
        engine(plans.list_scan([displacement], voltage, [10.0, float("nan")]), seen)
    assert len(seen.events()) == 1
    assert seen.of("stop")[0]["exit_status"] == "fail"
    assert bench.rig.volts == 0.0
    assert bench.rig.extremes.highest == 10.0


def test_lost_beam_fails_the_run_and_parks(engine: Any, bench: Bench) -> None:
    voltage = BlueskyVoltage(bench.output, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor, zero_on_stage=False)
    bench.sensor.flags = Flag.BEAM_LOST
    seen = Documents()
    with pytest.raises(Exception, match="failed") as caught:
        engine(plans.list_scan([displacement], voltage, [10.0, 20.0]), seen)
    assert isinstance(caught.value.__cause__, BeamLost)
    assert seen.events() == []
    assert bench.rig.volts == 0.0


def _fly(block: BlueskyBlock, plan: BlockPlan) -> Any:
    yield from stubs.prepare(block, plan, wait=True)
    yield from plans.fly([block])


def test_a_block_is_one_event(engine: Any, bench: Bench) -> None:
    bench.output.power_up()
    block = _block(bench)
    wave = 50.0 * (1.0 - np.cos(2.0 * np.pi * 2.0 * np.arange(4000) / 1000.0))
    seen = Documents()
    engine(_fly(block, BlockPlan(N, 8192.0, wave, 1000.0)), seen)
    pages = seen.of("event_page")
    assert Counter(name for name, _ in seen.all) == Counter(
        start=1, descriptor=2, event_page=2, stop=1
    )
    assert [len(p["seq_num"]) for p in pages] == [1, 1]
    x = pages[0]["data"]["block_x"][0]
    assert x.shape == (N,)
    assert not pages[0]["data"]["block_flags"][0].any()
    played = pages[1]["data"]["block_output_V"][0]
    assert np.array_equal(played, wave)
    # each is held for a millisecond; the plant has steps of 0.1 ms
    held = GAIN * wave[np.minimum(np.arange(N) / 8.192, 3999.0).astype(int)]
    assert np.abs(x - held).max() < 1.1 * GAIN * np.abs(np.diff(wave)).max()
    assert x.max() == pytest.approx(GAIN * 100.0, rel=1e-3)
    descriptors = {d["name"]: d["data_keys"] for d in seen.of("descriptor")}
    assert descriptors["block"]["block_x"]["units"] == "m"
    assert descriptors["block"]["block_x"]["shape"] == [N]
    assert descriptors["block_output"]["block_output_V"]["units"] == "V"


def test_a_counted_block_is_one_event_and_not_rows(engine: Any, bench: Bench) -> None:
    block = _block(bench, plan=BlockPlan(N, 1e6))
    seen = Documents()
    engine(plans.count([block], num=10), seen)
    assert len(seen.events()) == 10
    assert all(e["data"]["block_x"].shape == (N,) for e in seen.events())
    assert Counter(name for name, _ in seen.all) == Counter(start=1, descriptor=1, event=10, stop=1)


def test_declared_stream(engine: Any, bench: Bench) -> None:
    block = _block(bench, plan=BlockPlan(500, 1e4), flat=True)

    def plan() -> Any:
        yield from stubs.open_run()
        yield from stubs.declare_stream(block, name="raw", collect=True)
        for _ in range(2):
            yield from stubs.kickoff(block, wait=True)
            yield from stubs.complete(block, wait=True)
            yield from stubs.collect(block, name="raw")
        yield from stubs.close_run()

    seen = Documents()
    engine(plan(), seen)
    assert [p["seq_num"] for p in seen.of("event_page")] == [[1], [2]]
    assert seen.of("descriptor")[0]["name"] == "raw"


def test_pause_parks_and_resume_goes_on(engine: Any, bench: Bench) -> None:
    voltage = BlueskyVoltage(bench.output, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor, zero_on_stage=False)
    seen = Documents()
    bench.output.power_up()

    def plan() -> Any:
        yield from stubs.open_run()
        for volts in (10.0, 20.0, 30.0):
            yield from stubs.checkpoint()
            yield from stubs.mv(voltage, volts)
            if volts == 20.0:
                yield from stubs.pause()
            yield from stubs.trigger_and_read([displacement, voltage])
        yield from stubs.close_run()

    with pytest.raises(engines.RunEngineInterrupted):
        engine(plan(), seen)
    assert engine.state == "paused"
    assert bench.rig.volts == 0.0
    assert bench.rig.extremes.highest == 20.0
    engine.resume()
    assert engine.state == "idle"
    # the move to 20 V was repeated after the pause
    events = [e["data"] for e in seen.events()]
    assert [e["voltage"] for e in events] == [10.0, 20.0, 30.0]
    assert [e["displacement"] for e in events] == pytest.approx(GAIN * np.array([10, 20, 30]))
    # the plan did not stage; the engine stops what has moved
    assert bench.rig.volts == 0.0


def test_abort_in_the_middle_of_a_ramp_parks(
    engine: Any, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    voltage = BlueskyVoltage(bench.output, rate=50.0, clock=bench.clock)
    displacement = BlueskyDisplacement(bench.sensor)
    seen = Documents()

    reached, stopped = threading.Event(), threading.Event()
    sleep, stop = bench.clock.sleep, voltage.stop

    def sleeping(seconds: float) -> None:
        sleep(seconds)
        if bench.rig.volts >= 20.0 and not stopped.is_set():
            # the ramp waits there for the way down to begin, however late that is
            reached.set()
            stopped.wait(HANGS)
            late = time.monotonic() + HANGS
            while bench.rig.volts >= 20.0 and time.monotonic() < late:
                time.sleep(0.001)

    def stopping(*arguments: Any, **options: Any) -> Any:
        stopped.set()
        return stop(*arguments, **options)

    monkeypatch.setattr(bench.clock, "sleep", sleeping)
    monkeypatch.setattr(voltage, "stop", stopping)

    def interrupt() -> None:
        reached.wait(HANGS)
        engine.request_pause(defer=False)

    helper = threading.Thread(target=interrupt)
    helper.start()
    with pytest.raises(engines.RunEngineInterrupted):
        engine(plans.list_scan([displacement], voltage, [80.0]), seen)
    helper.join()
    engine.abort()
    assert 20.0 <= bench.rig.extremes.highest < 80.0
    assert seen.of("stop")[0]["exit_status"] == "abort"
    assert bench.rig.volts == 0.0
