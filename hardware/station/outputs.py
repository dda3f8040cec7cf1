"""The output of a bench, opened from its settings: cards, NI, GCS controllers."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Clock, RawOutput
from hardware.devices.amplifier import (
    Amplifier,
    AnalogueAmplifier,
    EndedWave,
    Monitors,
    UltrasonicDriver,
    UltrasonicLimits,
)
from hardware.devices.controllers import GatewayTransport, GcsController, GcsTalk, GcsWave
from hardware.devices.daq import (
    MF624,
    MF634,
    Card,
    CardChannel,
    CardInputs,
    CardWiring,
    CompiledWave,
    MappedRegisters,
    NiChannel,
    NiTerminals,
    NiWave,
    PciRegisters,
    Registers,
    SampleClock,
    SocketRegisters,
    SoftwareTimedWave,
    UioRegisters,
)
from hardware.devices.transport import TcpTransport
from hardware.envelope import RawWave
from hardware.recorder.plan import Synchronisation
from hardware.station.settings import AmplifierSettings, OutputSettings

BUSY = 10.0
"""Longest wait for registers behind a socket (s): a virtual bench shares its computer."""


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """An output before it is guarded, and how its waveform is made for a way to synchronise."""

    raw: RawOutput
    wave: Callable[[Synchronisation], RawWave]
    gains: dict[str, Any] = field(default_factory=dict)
    card: Card | None = None


def open_output(
    settings: OutputSettings,
    amplifier: AmplifierSettings,
    ultrasonic: UltrasonicLimits | None,
    clock: Clock,
    opened: contextlib.ExitStack,
) -> Driven:
    """Open the output that the settings name; closing goes on the stack."""
    if settings.kind in ("mf624", "mf634"):
        return _card(settings, amplifier, ultrasonic, clock, opened)
    if settings.kind == "ni":
        return _ni(settings, _amplifier(amplifier), amplifier, clock, opened)
    return _gcs(settings, clock, opened)


def _amplifier(s: AmplifierSettings) -> Amplifier:
    """Return the amplifier; limits of the voltage are the envelope's business."""
    reach = sorted((s.offset - 10.0 * s.gain, s.offset + 10.0 * s.gain))
    return Amplifier(
        s.gain, s.offset, reach[0], reach[1],
        monitors=Monitors(s.voltage_monitor, s.current_monitor), name=s.name,
    )  # fmt: skip


def _monitor_inputs(s: AmplifierSettings) -> tuple[int, ...]:
    inputs = []
    if s.voltage_monitor is not None:
        inputs.append(s.voltage_input)
    if s.current_monitor is not None:
        inputs.append(s.current_input)
    return tuple(inputs)


def _registers(settings: OutputSettings, opened: contextlib.ExitStack) -> Registers:
    layout = (MF624 if settings.kind == "mf624" else MF634).layout
    if ":" in settings.address:
        found: Any = SocketRegisters(settings.address, BUSY)
    elif settings.kind == "mf624":
        found = UioRegisters(layout.device, layout.bars, int(settings.address or 0))
    else:
        found = PciRegisters(layout.device, layout.bars, int(settings.address or 0))
    opened.callback(found.close)
    registers: Registers = found
    return registers


def _card(
    settings: OutputSettings,
    wired: AmplifierSettings,
    ultrasonic: UltrasonicLimits | None,
    clock: Clock,
    opened: contextlib.ExitStack,
) -> Driven:
    registers = _registers(settings, opened)
    card = (MF624 if settings.kind == "mf624" else MF634)(registers, clock)
    inputs = _monitor_inputs(wired)
    channel = CardChannel(card, settings.channel)
    board = None if ultrasonic is None else UltrasonicDriver(channel, ultrasonic, card)
    raw = board or AnalogueAmplifier(
        channel, _amplifier(wired), CardInputs(card, inputs) if inputs else None, clock=clock
    )

    def wave(way: Synchronisation) -> RawWave:
        pulse = way == "clock"
        wired_so = CardWiring(
            settings.channel, inputs, settings.trigger if way == "start" else None,
            settings.clock if pulse else None, SampleClock.PULSE if pulse else SampleClock.NONE,
        )  # fmt: skip
        # a real card is paced by compiled code, whose instants do not wait for Python
        player = CompiledWave if isinstance(registers, MappedRegisters) else SoftwareTimedWave
        made: RawWave = player(card, raw.amplifier, wired_so)
        return made if board is None else EndedWave(made, board)

    return Driven(raw, wave, _gains(raw.amplifier), card)


def _gains(amplifier: Amplifier) -> dict[str, Any]:
    return {
        "V": {"gain": amplifier.gain, "offset": -amplifier.offset / amplifier.gain,
              "raw_unit": "V", "calibration": f"{amplifier.name}: {amplifier.source}"}
    }  # fmt: skip


def _ni(
    settings: OutputSettings,
    amplifier: Amplifier,
    wired: AmplifierSettings,
    clock: Clock,
    opened: contextlib.ExitStack,
) -> Driven:
    device = settings.address or "Dev1"
    channel = NiChannel(f"{device}/ao{settings.channel}")
    raw = AnalogueAmplifier(channel, amplifier, clock=clock)
    opened.callback(raw.close)
    inputs = tuple(f"{device}/ai{k}" for k in _monitor_inputs(wired))
    pins = {"trigger": settings.trigger, "clock": settings.clock}
    lines = {k: "" if v is None else f"/{device}/PFI{v}" for k, v in pins.items()}

    def wave(way: Synchronisation) -> RawWave:
        return NiWave(
            channel, raw.amplifier,
            NiTerminals(
                inputs, lines["clock"] if way == "clock" else "",
                lines["trigger"] if way == "start" else "",
            ),
            clock=clock,
        )  # fmt: skip

    return Driven(raw, wave, _gains(amplifier))


def _gcs(settings: OutputSettings, clock: Clock, opened: contextlib.ExitStack) -> Driven:
    host, _, port = settings.address.rpartition(":")
    if not host or not port.isdigit():
        raise UnusableInput(
            f"output: address {settings.address!r} of a GCS controller must be HOST:PORT"
        )
    by = GatewayTransport.by_pisocket if settings.kind == "pipython" else TcpTransport
    raw = GcsController(GcsTalk(by(host, int(port))), clock=clock)
    opened.callback(raw.close)

    def wave(way: Synchronisation) -> RawWave:
        if way == "clock":
            raise UnusableInput(
                "output: a GCS wave generator gives no edge for every sample here; choose 'start'"
            )
        return GcsWave(raw, (settings.trigger or 1) if way == "start" else None)

    return Driven(raw, wave)
