"""The NI adapter against a double of nidaqmx. It never ran on NI's driver."""

from __future__ import annotations

import inspect
import sys

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, RawOutput
from hardware.devices.amplifier import Amplifier, AnalogueAmplifier, Monitors
from hardware.devices.daq import NiAcquisition, NiChannel, NiTerminals, NiTimedInputs, NiWave
from hardware.errors import (
    DriverMissing,
    HardwareError,
    LimitViolation,
    LinkLost,
    Overrun,
    ProtocolFault,
    TimedOut,
)
from tests.hardware.devices.daq import ni_double
from tests.hardware.devices.daq.ni_double import Bench, Signal

STACK = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    return ni_double.install(monkeypatch)


def wave_on(bench: Bench, terminals: NiTerminals | None = None) -> NiWave:
    return NiWave(NiChannel("Dev1/ao0"), STACK, terminals, clock=bench)


def position(wave: NiWave) -> int | None:
    return wave.position


def test_without_the_package_one_line_tells_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    with pytest.raises(DriverMissing, match="pip install nidaqmx"):
        NiChannel("Dev1/ao0").write(1.0)
    assert NiChannel("Dev1/ao0").identity.maker == "NI"


def test_without_the_driver_too(bench: Bench) -> None:
    bench.fail["Task"] = ni_double.DaqNotFoundError("no libnidaqmx")
    with pytest.raises(DriverMissing, match="installdriver"):
        NiChannel("Dev1/ao0").power_up()


def test_single_values_through_the_amplifier(bench: Bench) -> None:
    output = AnalogueAmplifier(NiChannel("Dev1/ao0"), STACK, clock=bench)
    assert isinstance(output, RawOutput)
    assert not output.has_watchdog
    output.power_up()
    output.write(60.0)
    assert bench.outputs == {"Dev1/ao0": 3.0}
    assert output.identity.serial == "001A2B3C"
    before = len(bench.calls)
    for volts in (101.0, float("nan")):
        with pytest.raises(LimitViolation):
            output.write(volts)
    with pytest.raises(LimitViolation, match="Dev1/ao0"):
        NiChannel("Dev1/ao0").write(float("inf"))
    assert len(bench.calls) == before
    output.close()
    assert bench.outputs == {"Dev1/ao0": 3.0}
    assert not bench.open


def test_a_waveform_runs_on_the_cards_clock_with_inputs_armed_before_it(bench: Bench) -> None:
    channel = NiChannel("Dev1/ao0")
    channel.write(0.0)
    terminals = NiTerminals(("Dev1/ai0", "Dev1/ai1"), "/Dev1/PFI0", "/Dev1/PFI1", "/Dev1/PFI2")
    wave = NiWave(channel, STACK, terminals, clock=bench)
    volts = np.linspace(0.0, 100.0, 1000)
    wave.load(volts, 10e3)
    bench.calls.clear()
    reports = list(wave.play())
    assert bench.calls[0] == ("close", "ao")
    assert ("timing", "ao", 10e3, "", 1000) in bench.calls
    assert ("timing", "ai", 10e3, "/Dev1/ao/SampleClock", 1000) in bench.calls
    assert ("export", Signal.SAMPLE_CLOCK, "/Dev1/PFI0") in bench.calls
    assert ("export", Signal.START_TRIGGER, "/Dev1/PFI1") in bench.calls
    assert ("trigger", "/Dev1/PFI2") in bench.calls
    assert ("write", False) in bench.calls
    starts = [c for c in bench.calls if c[0] == "start"]
    assert starts == [("start", "ai"), ("start", "ao")]
    sent = np.concatenate([c.channels["V"] for r in reports for c in r.chunks])
    shown = np.concatenate([c.channels["V_mon"] for r in reports for c in r.chunks])
    assert np.array_equal(sent, volts)
    assert np.allclose(shown[1:], volts[:-1])
    assert reports[-1].samples == wave.position == 1000
    assert len(reports) in (5, 6)
    assert not bench.open
    assert all(t.closed for t in bench.tasks)
    channel.write(1.0)
    assert bench.outputs["Dev1/ao0"] == 1.0


def test_abort_tells_how_far_the_card_has_got(bench: Bench) -> None:
    wave = wave_on(bench)
    wave.load(np.linspace(0.0, 100.0, 1000), 1000.0)
    playing = wave.play()
    next(playing)
    bench.sleep(0.1)
    # also while nobody iterates
    assert position(wave) == 121
    wave.abort()
    assert wave.position == 121
    assert bench.outputs["Dev1/ao0"] == pytest.approx(5.0 * 120 / 999)
    assert list(playing) == []
    wave.abort()
    assert wave.position == 121


def test_what_is_put_out_while_the_card_stops_counts_too(bench: Bench) -> None:
    wave = wave_on(bench)
    wave.load(np.linspace(0.0, 100.0, 1000), 1000.0)
    bench.stopping = 0.03
    playing = wave.play()
    next(playing)
    wave.abort()
    assert bench.outputs["Dev1/ao0"] == pytest.approx(5.0 * 50 / 999)
    assert position(wave) == 51

    bench.forgets = True
    playing = wave.play()
    next(playing)
    playing.close()  # type: ignore[attr-defined]
    assert position(wave) is None

    assert list(wave.play())[-1].samples == 1000
    assert position(wave) == 1000
    wave.play()
    wave.abort()
    assert position(wave) == 0


def test_an_abort_that_was_interrupted_is_not_forgotten(bench: Bench) -> None:
    wave = wave_on(bench)
    wave.load(np.linspace(0.0, 100.0, 1000), 1000.0)
    playing = wave.play()
    next(playing)
    bench.fail["stop"] = KeyboardInterrupt()  # type: ignore[assignment]
    with pytest.raises(KeyboardInterrupt):
        wave.abort()
    bench.sleep(0.1)
    del bench.fail["stop"]
    wave.abort()
    assert position(wave) == 121
    assert not bench.open
    bench.sleep(0.1)
    assert bench.outputs["Dev1/ao0"] == pytest.approx(5.0 * 120 / 999)
    assert list(playing) == []


def test_loading_during_a_wave_changes_nothing_of_it(bench: Bench) -> None:
    wave = wave_on(bench)
    volts = np.linspace(0.0, 100.0, 1000)
    wave.load(volts, 10e3)
    playing = wave.play()
    reports = [next(playing)]
    wave.load(np.zeros(2000), 1e3)
    reports += playing
    shown = np.concatenate([c.channels["V"] for r in reports for c in r.chunks])
    assert shown.tolist() == volts.tolist()
    assert (reports[-1].total, wave.position) == (1000, 1000)


def test_a_trigger_that_never_comes_times_out_and_lets_the_card_go(bench: Bench) -> None:
    bench.triggered = False
    wave = wave_on(bench, NiTerminals(("Dev1/ai0", "Dev1/ai1"), trigger="/Dev1/PFI2"))
    wave.load(np.zeros(100), 1000.0)
    with pytest.raises(TimedOut, match="start trigger"):
        list(wave.play())
    assert not bench.open
    assert 5.0 < bench.time < 5.1


@pytest.mark.parametrize(
    ("code", "kind"),
    [(-200324, LinkLost), (-200284, TimedOut), (-200279, Overrun), (-200077, ProtocolFault)],
)
def test_errors_of_the_driver_become_those_of_the_bench(
    bench: Bench, code: int, kind: type[HardwareError]
) -> None:
    wave = wave_on(bench, NiTerminals(("Dev1/ai0", "Dev1/ai1")))
    wave.load(np.zeros(1000), 1000.0)
    playing = wave.play()
    next(playing)
    bench.fail["available"] = ni_double.DaqError("something\nlong", code)
    with pytest.raises(kind, match=str(code)) as caught:
        next(playing)
    assert "\n" not in str(caught.value)
    assert not bench.open


def test_a_channel_in_use_is_told(bench: Bench) -> None:
    other = NiChannel("Dev1/ao0")
    other.power_up()
    with pytest.raises(ProtocolFault, match="reserved"):
        NiChannel("Dev1/ao0").power_up()


def test_an_acquisition_hands_out_every_sample_once(bench: Bench) -> None:
    inputs = NiTimedInputs(("Dev1/ai0", "Dev1/ai1"), trigger="/Dev1/PFI0")
    acquisition = NiAcquisition(inputs, ("a", "b"), 1000.0, 500)
    assert isinstance(acquisition, Acquisition)
    acquisition.kickoff()
    chunks = list(acquisition.poll())
    while not acquisition.done:
        bench.sleep(0.05)
        chunks += acquisition.poll()
    chunks += acquisition.finish()
    assert [c.first for c in chunks] == [0, *np.cumsum([c.n for c in chunks])[:-1]]
    assert sum(c.n for c in chunks) == 500
    joined = np.concatenate([c.channels["b"] for c in chunks])
    assert np.array_equal(joined[1:], 2.0 * np.arange(499))
    acquisition.abort()
    assert acquisition.poll() == ()


def test_misuse_is_one_line(bench: Bench) -> None:
    wave = wave_on(bench)
    with pytest.raises(ProtocolFault, match="load"):
        wave.play()
    for volts in (np.zeros(1), np.zeros((2, 2))):
        with pytest.raises(UnusableInput):
            wave.load(volts, 1000.0)
    with pytest.raises(LimitViolation):
        wave.load(np.array([0.0, np.nan]), 1000.0)
    with pytest.raises(UnusableInput, match="name one input for each"):
        wave_on(bench, NiTerminals(("Dev1/ai0",)))
    narrow = NiWave(NiChannel("Dev1/ao0", 0.0, 2.0), STACK, clock=bench)
    with pytest.raises(UnusableInput, match="it gives"):
        narrow.load(np.array([0.0, 50.0]), 1000.0)
    with pytest.raises(ProtocolFault, match="names for"):
        NiAcquisition(NiTimedInputs(("Dev1/ai0",)), ("a", "b"), 1.0, 1)
    assert bench.calls == []


def test_the_double_has_the_signatures_of_the_package() -> None:
    nidaqmx = pytest.importorskip("nidaqmx", reason="nidaqmx is optional and needs NI's driver")
    from nidaqmx import stream_readers
    from nidaqmx.task import collections as groups
    from nidaqmx.task import triggering

    double = ni_double.make(Bench())
    ours = double.Task
    pairs = (
        (ours.add_ao_voltage_chan, groups.AOChannelCollection.add_ao_voltage_chan),
        (ours.add_ai_voltage_chan, groups.AIChannelCollection.add_ai_voltage_chan),
        (ours.cfg_samp_clk_timing, nidaqmx.task.Timing.cfg_samp_clk_timing),
        (ours.cfg_dig_edge_start_trig, triggering.StartTrigger.cfg_dig_edge_start_trig),
        (ours.export_signal, nidaqmx.task.ExportSignals.export_signal),
        (ours.write, nidaqmx.Task.write),
        (
            double.stream_readers.AnalogMultiChannelReader.read_many_sample,
            stream_readers.AnalogMultiChannelReader.read_many_sample,
        ),
    )
    for mine, theirs in pairs:
        offered = inspect.signature(theirs).parameters
        for name in inspect.signature(mine).parameters:
            assert name in offered, (mine.__name__, name)
    for name in ("start", "stop", "close", "is_task_done"):
        assert callable(getattr(nidaqmx.Task, name))
    for code in ni_double.Signal, ni_double.Edge, ni_double.AcquisitionType:
        real = getattr(nidaqmx.constants, code.__name__)
        assert {m.name: m.value for m in code}.items() <= {m.name: m.value for m in real}.items()
