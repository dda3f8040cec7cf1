"""Every fault of a bench, injected over the wire: nothing is lost or joined without a word."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from bondsight.cli.main import main
from hardware.contracts import Flag
from hardware.devices.interferometer import Block, Triggered
from hardware.errors import BeamLost, HardwareError, LimitViolation, LinkLost, Overrun
from hardware.live import Gathering
from hardware.recorder import Taken, TakePlan, TakeProgress, record
from hardware.recorder.marking import slip
from hardware.storage import JournalFailed, Provenance, flags_of, open_journal, recover
from hardware.synchrony import ClockWiring

Make = Callable[..., Any]
Wave = np.ndarray[Any, np.dtype[np.float64]]
SENSOR = "interferometer"
RATE = 10e3


def plan_of(volts: Wave, way: Any = "clock", **options: Any) -> TakePlan:
    return TakePlan(volts, RATE, "swing", way, **options)


def inject(server: Any, fault: str) -> None:
    assert server.control.answer(f"FAULT {SENSOR} {fault}").startswith("OK")


def streaming(station: Any, rate: float = 16e3) -> None:
    """Let the sensor stream at a rate of its own instead of filling a block."""
    settings = station.settings
    station.settings = replace(settings, interferometer=replace(settings.interferometer, rate=rate))


def carried(taken: Taken, flag: Flag) -> Any:
    return np.asarray(flags_of(taken.recording, SENSOR) & np.uint16(flag)) != 0


def told(taken: Taken, text: str) -> bool:
    return any(text in sentence for sentence in taken.sentences)


# ---- the beam, its laser, its air


def test_fading_light_is_told_while_it_fades(bench: Make, swing: Wave, target: Path) -> None:
    server, station = bench()
    inject(server, "fade_from=160 fade_samples=800")
    view = Gathering("swing", station.clock, {SENSOR: 640})
    warned: list[int] = []

    def look(step: TakeProgress) -> None:
        for chunk in step.chunks:
            view.take(chunk)
        if any("LEVEL_LOW" in w for w in view.state().warnings):
            warned.append(step.written)

    plan = plan_of(np.tile(swing, 2), "none")
    with pytest.raises(BeamLost):
        record(station.station(plan), plan, target, watch=look)
    data = open_journal(target.with_suffix(".journal")).read(SENSOR)
    dim = int(np.flatnonzero(data.flags & Flag.LEVEL_LOW)[0])
    lost = int(np.flatnonzero(data.flags & Flag.BEAM_LOST)[0])
    # flagged when half of the light is gone, the counter gives up at an eighth
    assert dim == pytest.approx(561, abs=5)
    assert lost - dim > 250
    # on the screen at least one report before the error
    assert warned
    assert warned[0] / RATE < lost / 16e3
    assert server.rig.volts == 0.0


def test_dim_light_alone_is_flagged_in_the_recording(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    inject(server, "fade_from=0 fade_samples=500")
    plan = plan_of(swing)
    taken = record(station.station(plan), plan, target)
    low = carried(taken, Flag.LEVEL_LOW)
    assert low[252:].all()
    assert not low[:248].any()
    assert not carried(taken, Flag.BEAM_LOST).any()
    assert told(taken, "flagged LEVEL_LOW")


@pytest.mark.parametrize(
    ("fault", "flag", "first"),
    [
        ("laser_unstable_at=200", Flag.LASER_UNSTABLE, 200),
        ("temperature=60", Flag.AIR_STALE, 0),
        ("stale_air=1", Flag.AIR_STALE, 0),
    ],
)
def test_laser_and_air_mark_the_samples(
    bench: Make, swing: Wave, target: Path, fault: str, flag: Flag, first: int
) -> None:
    server, station = bench()
    inject(server, fault)
    plan = plan_of(swing[: 2 * first or 200])
    taken = record(station.station(plan), plan, target)
    marked = carried(taken, flag)
    assert marked[first:].all()
    assert not marked[:first].any()
    assert told(taken, f"flagged {flag.name}, the first is {first}")
    if flag is Flag.AIR_STALE:
        air = Provenance.of(taken.recording).air
        assert air is not None
        assert air.measured == ("stale" in fault)


# ---- overruns


def test_samples_lost_from_a_block_leave_a_gap_where_they_were(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    inject(server, "overrun_at=150 overrun_samples=30")
    plan = plan_of(swing)
    taken = record(station.station(plan), plan, target)
    raw = open_journal(taken.journal)
    data = raw.read(SENSOR)
    np.testing.assert_array_equal(data.numbers, np.delete(np.arange(400), np.s_[150:180]))
    assert data.flags[150] & Flag.LOST_BEFORE
    (message,) = [n.content["message"] for n in raw.notes if n.content.get("event") == "overrun"]
    assert "30 samples lost, the first is 150" in message
    assert told(taken, "30 samples were lost, the first is 150")
    assert told(taken, "the longest stretch without a gap was kept, 220 of 370")
    # what was kept still belongs together
    assert taken.recording.n == 220
    np.testing.assert_allclose(taken.recording["V"], swing[180:], atol=20.0 * 20.0 / 2**14)
    edges = np.array(server.rig.trigger_edges)[-swing.size :]
    true = server.rig.seen(edges[180:]).x
    assert np.std(taken.recording["x"] - true) < 20e-9
    assert carried(taken, Flag.LOST_BEFORE)[0]


def test_an_overrun_in_a_running_stream_is_no_silent_join(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    inject(server, "overrun_at=250 overrun_samples=60")
    plan = plan_of(swing, "none")
    steps: list[TakeProgress] = []
    taken = record(station.station(plan), plan, target, watch=steps.append)
    data = open_journal(taken.journal).read(SENSOR)
    assert data.lost == 60
    assert data.flags[np.searchsorted(data.numbers, 310)] & Flag.LOST_BEFORE
    assert told(taken, "60 samples were lost, the first is 250")
    assert told(taken, "the longest stretch without a gap was kept")
    # 310 / 16 kHz is where the stretch behind the gap begins, and it is the longer one
    assert taken.recording.n == pytest.approx(400 - 310 / 1.6, abs=3)
    assert steps[-1].written == swing.size
    chunks = [c for s in steps for c in s.chunks if c.stream == SENSOR]
    assert sum(c.n for c in chunks) == data.n
    assert server.rig.volts == 0.0


def test_motion_across_lost_samples_is_no_lost_fringe(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    inject(server, "overrun_at=450 overrun_samples=100")
    plan = plan_of(swing, "start")
    taken = record(station.station(plan), plan, target)
    assert told(taken, "100 samples were lost, the first is 450")
    assert not told(taken, "whole fringes")
    assert not carried(taken, Flag.MISCOUNT).any()


def test_losses_that_nobody_can_place_end_the_take(bench: Make, swing: Wave, target: Path) -> None:
    server, station = bench()
    # the last samples of the block: behind them is none that could tell the gap
    inject(server, "overrun_at=380 overrun_samples=20")
    plan = plan_of(swing)
    with pytest.raises(Overrun, match="values were lost"):
        record(station.station(plan), plan, target)
    assert server.rig.volts == 0.0
    assert open_journal(target.with_suffix(".journal")).read(SENSOR).n == 380


def test_what_no_block_holds_is_streamed_or_refused_before_it_moves(bench: Make) -> None:
    server, station = bench()
    long = 10.0 - 10.0 * np.cos(np.linspace(0.0, 6.0, 32_769))
    (sensor,) = station.station(plan_of(long)).sensors
    assert isinstance(sensor, Triggered)
    (sensor,) = station.station(plan_of(long[1:])).sensors
    assert isinstance(sensor, Block)
    with pytest.raises(UnusableInput, match=r"32769 samples .* 20000 Hz"):
        station.station(TakePlan(long, 20e3, "fast", "clock"))
    assert not server.devices["card"].front.log
    assert not any(r.startswith("BLOCK ") for r in server.devices[SENSOR].front.requests)


@pytest.mark.long
def test_a_clocked_take_longer_than_any_block_is_whole(bench: Make, target: Path) -> None:
    _, station = bench()
    plan = plan_of(10.0 - 10.0 * np.cos(np.linspace(0.0, 6.0, 40_000)))
    taken = record(station.station(plan), plan, target)
    assert taken.recording.n == 40_000
    assert not flags_of(taken.recording, SENSOR).any()


def test_a_started_stream_ends_with_the_wave(
    bench: Make, swing: Wave, target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server, station = bench()
    monkeypatch.setattr("hardware.station.opening.MEMORY", 256)
    streaming(station)
    plan = plan_of(swing, "start")
    taken = record(station.station(plan), plan, target)
    assert taken.recording.n >= 398
    assert open_journal(taken.journal).read(SENSOR).n == np.ceil(404 * 1.6)
    assert server.rig.volts == 0.0


# ---- triggers and clocks


@pytest.mark.parametrize("late", [pytest.param(-1, marks=pytest.mark.long), 1])
def test_a_trigger_one_sample_off_lies_within_what_is_stated(
    bench: Make, swing: Wave, target: Path, late: int
) -> None:
    server, station = bench()
    inject(server, f"late_samples={late}")
    plan = plan_of(swing, "start")
    taken = record(station.station(plan), plan, target)
    clocks = Provenance.of(taken.recording).alignment
    true = late / 40e3
    assert clocks.delay is not None
    assert clocks.delay_uncertainty is not None
    assert abs(true - clocks.delay) < 1.96 * clocks.delay_uncertainty
    # that is more than the budget of 2 us: said, and carried by every sample
    assert carried(taken, Flag.UNSYNCHRONISED).all()
    assert told(taken, "2 us allowed")
    assert told(taken, "flagged UNSYNCHRONISED")


@pytest.mark.parametrize("edges", [1, 2])
def test_an_edge_too_many_on_the_sample_clock_is_seen(
    bench: Make, swing: Wave, target: Path, edges: int
) -> None:
    server, station = bench()
    plan = plan_of(swing)
    said: list[str] = []

    def disturb(step: TakeProgress) -> None:
        if step.phase == "play" and step.written < swing.size and not said:
            said.extend(server.control.answer("EDGE") for _ in range(edges))

    taken = record(station.station(plan), plan, target, watch=disturb)
    doubtful = carried(taken, Flag.UNSYNCHRONISED)
    assert not doubtful[:197].any()
    assert doubtful[201:].all()
    assert told(taken, f"{edges} periods too early")
    assert told(taken, "edges were too many")


def test_a_second_start_changes_nothing(bench: Make, swing: Wave, target: Path) -> None:
    server, station = bench()
    plan = plan_of(swing, "start")

    def disturb(step: TakeProgress) -> None:
        if step.phase == "play":
            server.control.answer("EDGE")

    taken = record(station.station(plan), plan, target, watch=disturb)
    data = open_journal(taken.journal).read(SENSOR)
    true = server.rig.seen(server.rig.trigger_edges[0] + data.numbers / 40e3).x
    x = data.channels["x"]
    assert np.std(x - true) < 20e-9
    assert len(server.rig.trigger_edges) > 1


def test_slips_are_told_from_stalls() -> None:
    rng = np.random.default_rng(7)
    true = np.arange(5000) / RATE
    noted = true + 3e-6 * rng.standard_normal(5000)
    taken = 4.2 + true * (1.0 + 200e-6)  # another clock, fast by 200 ppm
    assert slip(noted, taken, RATE) is None
    stalled = np.where(np.arange(5000) > 700, true + 5e-3, true)  # the program slept: both see it
    assert slip(stalled, 4.2 + stalled, RATE) is None
    hiccup = noted.copy()
    hiccup[[50, 900, 4000]] += 2e-3  # noted late, written in time
    assert slip(hiccup, taken, RATE) is None
    for at in (1, 40, 4990):
        missed = np.delete(np.append(taken, taken[-1] + 1.0 / RATE), at)
        found = slip(noted, missed, RATE)
        assert found is not None
        assert abs(found[0] - at) <= 2
        assert found[1] == pytest.approx(1.0, abs=0.3)
        doubled = np.insert(taken, at, taken[at] - 0.3 / RATE)[:-1]
        found = slip(noted, doubled, RATE)
        assert found is not None
        assert abs(found[0] - at) <= 2
        assert found[1] < -0.6


def test_scatter_beyond_the_budget_is_marked(bench: Make, tmp_path: Path) -> None:
    """The same wave, wiring and budget: only the sensor that jitters is out of it."""
    t = np.arange(800) / RATE
    volts = 40.0 + 20.0 * np.sin(2 * np.pi * 50 * t) + 10.0 * np.sin(2 * np.pi * 137 * t + 1.0)
    for name, jitter in (("steady", 0.0), ("jittering", 30e-6)):
        _, station = bench(interferometer={"ppm": 40.0, "jitter": jitter, "seed": 3})
        plan = plan_of(volts, "start", skew_budget=6e-6)
        wiring = ClockWiring(delay_error=1e-6, lag=20e-6, lag_error=2e-6)
        taken = record(station.station(plan), plan, tmp_path / name, wiring=wiring)
        assert carried(taken, Flag.UNSYNCHRONISED).all() == bool(jitter)
        assert carried(taken, Flag.UNSYNCHRONISED).any() == bool(jitter)
        assert told(taken, "single instants of the sensor scatter by") == bool(jitter)
        assert told(taken, "6 us allowed") == bool(jitter)


def test_what_cannot_be_aligned_stays_recoverable(bench: Make, target: Path) -> None:
    _, station = bench()
    plan = plan_of(np.full(300, 30.0), "start")
    with pytest.raises(UnusableInput, match=r"drive is constant.*take\.journal.*--recover"):
        record(station.station(plan), plan, target)
    assert len(recover(target.with_suffix(".journal"))) == 2


# ---- the cable


@pytest.mark.parametrize("way", ["clock", "none"])
def test_a_cable_pulled_in_the_middle_of_a_transfer(
    bench: Make, swing: Wave, target: Path, way: str
) -> None:
    server, station = bench()

    def pull(step: TakeProgress) -> None:
        if step.phase == "play" and step.written >= 200:
            inject(server, "cut_after_bytes=3000")

    plan = plan_of(swing, way, patience=0.5)
    begin = server.rig.now
    with pytest.raises(LinkLost) as caught:
        record(station.station(plan), plan, target, watch=pull)
    assert any("take.journal" in n for n in caught.value.__notes__)
    assert server.rig.volts == 0.0
    assert server.rig.now - begin < 3.0
    raw = open_journal(target.with_suffix(".journal"))
    data = raw.read(SENSOR)
    assert data.n >= 60
    np.testing.assert_array_equal(data.numbers, np.arange(data.n))
    assert raw.notes[-1].content["output_end"] == "parked"
    # nothing is read from a counter whose link was lost, before its next zero
    with pytest.raises(HardwareError):
        station.interferometer.read()
    assert recover(target.with_suffix(".journal"))


# ---- voltages that must never arrive


BAD: dict[str, tuple[Wave, float, str]] = {
    "nan": (np.array([0.0, 1.0, np.nan, 1.0]), RATE, "finite"),
    "infinite": (np.array([0.0, 1.0, np.inf, 1.0]), RATE, "finite"),
    "over-voltage": (np.linspace(0.0, 150.0, 4000), RATE, "100"),
    "slew": (np.array([0.0, 0.0, 99.0, 99.0]), RATE, "V/s"),
    "2 kHz, 100 V": (50.0 - 50.0 * np.cos(2 * np.pi * 2e3 * np.arange(4000) / 2e6), 2e6, "V/s"),
}


def untouched(server: Any) -> bool:
    e = server.extremes
    return not server.devices["card"].front.log and e.highest == e.lowest == e.largest_step == 0.0


def test_no_unsafe_wave_moves_anything(bench: Make, target: Path) -> None:
    server, station = bench()

    def attempt(kind: str) -> None:
        plan = TakePlan(BAD[kind][0], BAD[kind][1], kind, "none")
        record(station.station(plan), plan, target)

    for kind, (_, _, says) in BAD.items():
        with pytest.raises((LimitViolation, UnusableInput), match=says):
            attempt(kind)
        assert untouched(server), kind
    assert not list(target.parent.iterdir())


def test_the_command_refuses_an_unsafe_file_in_one_line(
    bench: Make, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    server, station = bench()
    s = station.settings
    (tmp_path / "station.toml").write_text(
        '[envelope]\npreset = "P-840.1-unipolar"\ni_max = 0.05\n'
        f'[clock]\nbench = "{s.clock.bench}"\n'
        f'[output]\nkind = "mf634"\naddress = "{s.output.address}"\ntrigger = 0\nclock = 0\n'
        "[amplifier]\ngain = 20.0\n"
    )
    out = tmp_path / "out"
    charging = 30.0 - 20.0 * np.cos(2 * np.pi * 500 * np.arange(400) / 100e3)  # 0.12 A
    for kind, (volts, rate, says) in {**BAD, "current": (charging, 100e3, " mA into")}.items():
        wave = tmp_path / f"{kind}.csv"
        wave.write_text("V [V]\n" + "\n".join(map(repr, volts.tolist())) + "\n")
        arguments = ["acquire", str(tmp_path / "station.toml"), "--signal", str(wave),
                     "--rate", str(rate), "--synchronise", "none", "--quiet",
                     "--out", str(out)]  # fmt: skip
        assert main(arguments) == 2, kind
        error = capfd.readouterr().err
        assert error.startswith("bondsight: "), kind
        assert error.count("\n") == 1, kind
        assert says in error, kind
        assert untouched(server), kind
    assert not list(out.glob("*"))


def test_all_outputs_are_at_zero_before_any_is_connected(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    plan = plan_of(swing[:100])
    record(station.station(plan), plan, target)
    registers = server.devices["card"].front.registers
    control = registers.CONTROL["MF634"]
    write16, write32, enable = 1, 3, 1 << 26
    log = list(server.devices["card"].front.log)
    on = [
        k for k, a in enumerate(log)
        if a.kind == write32 and (a.bar, a.offset) == control and a.value & enable
    ]  # fmt: skip
    written: dict[int, int] = {}
    for access in log[: on[0]]:
        if access.kind == write16 and access.bar == 2 and 0x20 <= access.offset < 0x30:
            written[(access.offset - 0x20) // 2] = access.value
    assert written == dict.fromkeys(range(8), 0x2000)
    assert server.extremes.highest < 60.0


# ---- the disk


@pytest.fixture
def little_disk() -> Iterator[int]:
    """Let no file of this process grow beyond some bytes."""
    room = 16_000
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    yield room
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_parks_the_output_and_keeps_what_fitted(
    bench: Make, swing: Wave, target: Path, little_disk: int
) -> None:
    server, station = bench()
    plan = plan_of(swing, "none")
    with pytest.raises(JournalFailed, match="bytes stored before are intact"):
        record(station.station(plan), plan, target)
    assert server.rig.volts == 0.0
    assert station.output.provenance()["state"] == "parked"
    raw = open_journal(target.with_suffix(".journal"))
    assert raw.read("output").n == 200
    assert not target.with_suffix(".npz").exists()
