"""Takes over the wire: what is stored, what happens when something fails on the way."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.errors import BeamLost, HardwareError, LimitViolation, LinkLost, TimedOut
from hardware.recorder import TakePlan, TakeProgress, record
from hardware.storage import Provenance, flags_of, open_journal, open_raw, recover

Make = Callable[..., Any]
Wave = np.ndarray[Any, np.dtype[np.float64]]


def test_a_clocked_take_is_stored_with_all_that_is_known(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench(interferometer={"ppm": 80.0})
    plan = TakePlan(swing, 10e3, "swing", "clock")
    steps: list[TakeProgress] = []
    taken = record(station.station(plan), plan, target, watch=steps.append)
    again = Recording.open(taken.path)
    assert again.n == swing.size
    assert set(again.channels) == {"V", "V_mon", "x"}
    # what the converter made of the command, not what was asked for
    np.testing.assert_allclose(again["V"], swing, atol=20.0 * 20.0 / 2**14)
    p = Provenance.of(again)
    assert p.output_end == "parked"
    assert p.alignment.method == "shared clock"
    assert [s.stream for s in p.streams] == ["output", "interferometer"]
    assert p.streams[1].device.maker == "SIOS"
    assert p.streams[1].device.serial
    assert p.air is not None
    assert 1.0002 < p.air.index < 1.0003
    assert p.envelope["envelope"]["v_max"] == 100.0
    assert not flags_of(again).any()
    assert open_raw(taken.path).closed
    assert server.rig.volts == 0.0
    assert list(dict.fromkeys(s.phase for s in steps))[:3] == ["prepare", "arm", "play"]
    assert steps[-1].phase == "end"
    assert sum(c.n for s in steps for c in s.chunks) <= 2 * swing.size


def test_a_noise_that_is_known_stands_in_the_recording(
    bench: Make, swing: Wave, target: Path
) -> None:
    _, station = bench()
    plan = TakePlan(swing, 10e3, "swing", "clock")
    known = replace(station.station(plan), noise={"x": 2e-9, "y": 1.0})
    again = Recording.open(record(known, plan, target).path)
    assert again.meta["noise"] == {"x": 2e-9}
    assert any("noise of y" in n and "V_mon" in n for n in again.notes)


def test_the_displacement_is_that_of_the_actuator(bench: Make, swing: Wave, target: Path) -> None:
    server, station = bench()
    plan = TakePlan(swing, 10e3, "swing", "clock")
    taken = record(station.station(plan), plan, target)
    edges = np.array(server.rig.trigger_edges)[-swing.size :]
    true = server.rig.seen(edges).x
    x = taken.recording["x"]
    assert np.std(x - (true - true[0])) < 20e-9
    assert np.std(x) > 20 * np.std(x - (true - true[0]))


def test_two_clocks_are_told_apart_and_brought_together(
    bench: Make, swing: Wave, target: Path
) -> None:
    _, station = bench(interferometer={"ppm": 300.0})
    plan = TakePlan(np.tile(swing, 3), 10e3, "swing", "start")
    taken = record(station.station(plan), plan, target)
    clocks = Provenance.of(taken.recording).alignment
    assert clocks.ratio is not None
    assert clocks.ratio_uncertainty is not None
    # the sensor's samples come later than nominal: fewer a second of the output's clock
    assert abs(clocks.ratio - 1.0 / (1.0 + 300e-6)) < 5 * clocks.ratio_uncertainty + 2e-6
    assert clocks.ratio_uncertainty < 50e-6
    assert taken.recording.fs == pytest.approx(10e3)


def test_a_wave_beyond_the_envelope_moves_nothing(bench: Make, target: Path) -> None:
    server, station = bench()
    for volts in (np.array([0.0, 150.0]), np.array([0.0, 99.0]), np.full(50, -5.0)):
        plan = TakePlan(volts, 10e3, "wave", "clock")
        with pytest.raises(LimitViolation):
            record(station.station(plan), plan, target)
    assert server.extremes.highest == 0.0
    assert server.extremes.lowest == 0.0
    assert not list(target.parent.iterdir())


def test_a_lost_beam_is_flagged_and_the_output_parked(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    server.control.answer("FAULT interferometer beam_loss_at=150")
    plan = TakePlan(swing, 10e3, "swing", "clock")
    with pytest.raises(BeamLost) as caught:
        record(station.station(plan), plan, target)
    assert any("take.journal" in n for n in caught.value.__notes__)
    assert server.rig.volts == 0.0
    raw = open_journal(target.with_suffix(".journal"))
    data = raw.read("interferometer")
    assert (data.flags[150:] & Flag.BEAM_LOST).all()
    assert not (data.flags[:150] & Flag.BEAM_LOST).any()
    assert raw.read("output").n == swing.size
    assert not target.with_suffix(".npz").exists()
    assert recover(target.with_suffix(".journal"))


def test_a_trigger_that_never_comes_ends_in_time(bench: Make, swing: Wave, target: Path) -> None:
    server, station = bench()
    plan = TakePlan(swing, 10e3, "swing", "start", patience=0.3)

    def cut_the_line(step: TakeProgress) -> None:
        if step.phase == "arm":
            server.control.answer("FAULT interferometer no_trigger=1")

    with pytest.raises(TimedOut, match="the trigger did not come"):
        record(station.station(plan), plan, target, watch=cut_the_line)
    assert server.rig.volts == 0.0
    assert open_journal(target.with_suffix(".journal")).read("output").n == swing.size


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_whatever_stops_it_the_output_comes_down(
    bench: Make, swing: Wave, target: Path, error: type[BaseException]
) -> None:
    server, station = bench()
    plan = TakePlan(swing, 10e3, "swing", "clock")

    def interrupt(step: TakeProgress) -> None:
        if step.written > 150:
            raise error

    with pytest.raises(error):
        record(station.station(plan), plan, target, watch=interrupt)
    assert server.rig.volts == 0.0
    assert station.output.provenance()["state"] == "parked"
    assert open_journal(target.with_suffix(".journal")).read("output").n >= 150


def test_a_card_that_is_pulled_leaves_an_unknown_output(
    bench: Make, swing: Wave, target: Path
) -> None:
    server, station = bench()
    plan = TakePlan(swing, 10e3, "swing", "clock")

    def pull(step: TakeProgress) -> None:
        if step.written > 150:
            server.control.answer("FAULT card gone=1")

    with pytest.raises(HardwareError) as caught:
        record(station.station(plan), plan, target, watch=pull)
    assert isinstance(caught.value, LinkLost)
    assert station.output.provenance()["state"] == "unknown"
    raw = open_journal(target.with_suffix(".journal"))
    assert raw.read("output").n >= 150
    assert raw.notes[-1].content["output_end"] == "unknown"
    server.control.answer("FAULT card gone=0")
    station.output.power_up()
    assert server.rig.volts == 0.0


def test_measurements_are_not_overwritten(bench: Make, swing: Wave, target: Path) -> None:
    _, station = bench()
    plan = TakePlan(swing[:60], 10e3, "swing", "clock")
    record(station.station(plan), plan, target)
    with pytest.raises(UnusableInput, match="exists"):
        record(station.station(plan), plan, target)


def test_a_fringe_lost_without_a_word_is_flagged(bench: Make, target: Path) -> None:
    server, station = bench()
    # slow, so that 316 nm between two samples is no motion
    plan = TakePlan(30.0 + 20.0 * np.sin(np.linspace(0.0, 6.0, 400)), 10e3, "slow", "clock")
    server.control.answer("FAULT interferometer beam_loss_at=200 beam_bits=0")
    taken = record(station.station(plan), plan, target)
    flags = flags_of(taken.recording, "interferometer")
    assert (flags[200:] & Flag.MISCOUNT).all()
    assert not flags[:200].any()
    assert any("whole fringes" in s for s in taken.sentences)
    # the jump itself stays: nothing is repaired silently
    assert np.diff(taken.recording["x"])[199] == pytest.approx(316.4e-9, abs=60e-9)


STAIRS = np.repeat([0.0, 16.0, 32.0, 48.0, 64.0, 48.0, 32.0, 16.0, 0.0], 100)
"""Of 16 V each, which on this stack are three whole fringes."""


@pytest.mark.parametrize("way", ["clock", "start", "none"])
def test_a_commanded_step_is_no_lost_fringe(bench: Make, target: Path, way: Any) -> None:
    _, station = bench()
    plan = TakePlan(STAIRS, 1e3, "stairs", way)
    taken = record(station.station(plan), plan, target)
    assert not (flags_of(taken.recording, "interferometer") & Flag.MISCOUNT).any()
    assert not any("whole fringes" in s for s in taken.sentences)


def test_a_fringe_lost_between_the_steps_of_a_command_is_flagged(bench: Make, target: Path) -> None:
    server, station = bench()
    plan = TakePlan(STAIRS, 1e3, "stairs", "clock")
    server.control.answer("FAULT interferometer beam_loss_at=450 beam_bits=0")
    taken = record(station.station(plan), plan, target)
    flags = flags_of(taken.recording, "interferometer")
    assert (flags[450:] & Flag.MISCOUNT).all()
    assert not (flags[:450] & Flag.MISCOUNT).any()
    assert any("(+1 at sample 450)" in s or "(-1 at sample 450)" in s for s in taken.sentences)


def test_a_decay_before_the_take_makes_it_begin_at_the_same_length(
    bench: Make, target: Path
) -> None:
    # plays of 4 and 12 V remember from which side the start was reached
    server, station = bench(
        plant={"effect": "none", "seed": 5, "play_radii": [4.0, 12.0], "play_gains": [0.1, 0.1]}
    )
    k = np.arange(9)
    turns = 30.0 + 22.0 * (-1.0) ** k * (1.0 - k / 8.0)
    decay = np.concatenate([np.linspace(a, b, 40) for a, b in itertools.pairwise(turns)])
    wave = np.full(80, 30.0)
    ends = []
    for n, history in enumerate((0.0, 60.0)):
        station.output.power_up()
        station.output.ramp(history)
        plan = TakePlan(wave, 2e3, "still", "clock", erase=decay)
        record(station.station(plan), plan, target.with_name(f"take{n}"))
        ends.append(server.rig.seen(np.array([server.rig.trigger_edges[-1]])).x[0])
    assert abs(ends[1] - ends[0]) < 5e-9
    plan = TakePlan(wave, 2e3, "still", "clock", erase=decay + 60.0)
    with pytest.raises(LimitViolation):
        record(station.station(plan), plan, target)


@pytest.mark.parametrize("gain", [40.0, -20.0])
def test_an_amplifier_that_is_not_the_declared_one_is_found_at_a_small_step(
    bench: Make, swing: Wave, target: Path, gain: float
) -> None:
    server, station = bench(gain=gain)
    plan = TakePlan(swing, 10e3, "swing", "clock")
    with pytest.raises(HardwareError, match="gain"):
        record(station.station(plan), plan, target)
    # a probe of 2 V moved it, nothing more
    assert max(abs(server.extremes.lowest), server.extremes.highest) < 5.0
