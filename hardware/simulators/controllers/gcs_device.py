"""A GCS 2 controller: takes bytes, gives answers, obeys or remembers an error number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

from hardware.simulators.controllers.command_log import CommandLog, standing_still
from hardware.simulators.controllers.gcs_axis import SimulatedAxis
from hardware.simulators.controllers.gcs_generator import Generator
from hardware.simulators.controllers.gcs_model import Acts, Arguments, Asks, GcsModel, Refusal
from hardware.simulators.controllers.gcs_record_commands import RecordCommands
from hardware.simulators.controllers.gcs_recorder import DataRecorder
from hardware.simulators.controllers.gcs_wave_commands import WaveCommands
from hardware.simulators.controllers.watchdog import ArmedWatchdog
from hardware.simulators.rig import DeviceClock, Rig

_LONGEST = 1 << 14
_HALT, _MOVING, _READY, _GENERATOR = 24, 5, 7, 9
_CODES = (_HALT, _MOVING, _READY, _GENERATOR)


@final
class GcsDevice:
    """The controller behind the wire.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock
        Its own clock, for generator and recorder.
    model : GcsModel
        What it is.
    """

    terminator = b"\n"

    def __init__(self, rig: Rig, clock: DeviceClock, model: GcsModel) -> None:
        self._rig = rig
        self._model = model
        self.axis = SimulatedAxis(rig, model)
        self.generator = Generator(rig, clock, model, self.axis.write)
        self.recorder = DataRecorder(rig, clock, model)
        self.commands = CommandLog()
        """Everything that was understood as a command, in its order."""
        self._error = 0
        self._bytes = bytearray()
        self._watch = (
            ArmedWatchdog(rig, model.watchdog, lambda: self.axis.volts, self.axis.write, self._halt)
            if model.watchdog
            else None
        )
        wave = WaveCommands(model, self.generator, self.axis, self.recorder)
        record = RecordCommands(model, self.recorder)
        self._acts: Acts = {**self._axis_acts(), **wave.acts(), **record.acts()}
        self._asks: Asks = {**self._axis_asks(), **wave.asks(), **record.asks()}

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes and give the answers to the commands that they complete."""
        for byte in data:
            if byte in _CODES and not self._bytes:
                yield from self._obey(chr(byte))
            elif byte == 0x0A:
                line = self._bytes.decode("cp1252", "replace").strip()
                self._bytes.clear()
                if line:
                    yield from self._obey(line)
            else:
                self._bytes.append(byte)
                if len(self._bytes) > _LONGEST:
                    self._bytes.clear()
                    self._error = 3

    def _obey(self, line: str) -> Iterator[bytes]:
        lines = standing_still(self._rig, lambda: self._understand(line))
        if lines is not None:
            yield (" \n".join(lines) + "\n").encode("cp1252")

    def _understand(self, line: str) -> list[str] | None:
        self.commands.add(line)
        if self._watch:
            self._watch.pat()
        try:
            return self._answer(line)
        except Refusal as refusal:
            self._error = refusal.number
        except (ValueError, IndexError):
            self._error = 1
        return None

    def _answer(self, line: str) -> list[str] | None:
        if len(line) == 1 and ord(line) in _CODES:
            return self._code(ord(line))
        name, *arguments = line.split()
        name = name.upper()
        if name == "ERR?":
            number, self._error = self._error, 0
            return [str(number)]
        if len(arguments) > self._model.arguments:
            raise Refusal(24)
        if name in self._asks:
            return self._asks[name](arguments)
        if name in self._acts:
            self._acts[name](arguments)
            return None
        raise Refusal(2)

    def _code(self, code: int) -> list[str] | None:
        if code == _HALT:
            self._stop([])
            return None
        if code == _READY:
            return ["\xb1"]
        if code == _GENERATOR:
            return [f"{int(self.generator.running):X}"]
        return [f"{int(self.axis.servo and not self.axis.on_target()):X}"]

    def _axis_acts(self) -> Acts:
        axis = self.axis
        return {
            "SVO": lambda a: axis.close_loop(bool(int(self._of_axis(a)))),
            "SVA": lambda a: axis.command(float(self._of_axis(self._idle(a)))),
            "SVR": lambda a: axis.command(axis.commanded + float(self._of_axis(self._idle(a)))),
            "MOV": lambda a: axis.move(float(self._of_axis(self._idle(a)))),
            "HLT": self._stop,
            "STP": self._stop,
        }

    def _axis_asks(self) -> Asks:
        m, axis = self._model, self.axis
        low, high = m.travel
        return {
            "*IDN?": lambda a: [m.identity],
            "CSV?": lambda a: ["2.0"],
            "VER?": lambda a: [f"FW: {m.identity.split(',')[-1]}"],
            "SAI?": lambda a: [m.axis],
            "CST?": lambda a: self._axis_value(a, m.stage),
            "SVO?": lambda a: self._axis_value(a, f"{int(axis.servo)}"),
            "SVA?": lambda a: self._axis_value(a, f"{axis.commanded:.6f}"),
            "MOV?": lambda a: self._axis_value(a, f"{axis.target:.6f}"),
            "POS?": lambda a: self._axis_value(a, f"{axis.position():.6f}"),
            "ONT?": lambda a: self._axis_value(a, f"{int(axis.on_target())}"),
            "TMN?": lambda a: self._axis_value(a, f"{low:.6f}"),
            "TMX?": lambda a: self._axis_value(a, f"{high:.6f}"),
            "VOL?": lambda a: self._channel_value(a, f"{axis.voltage():.6f}"),
            "VMI?": lambda a: self._channel_value(a, f"{m.lowest:.6f}"),
            "VMA?": lambda a: self._channel_value(a, f"{m.highest:.6f}"),
            "SPA?": self._parameter,
            "HLP?": lambda a: [f"{name} - see the public list" for name in self._names()],
        }

    def _names(self) -> list[str]:
        return sorted([*self._asks, *self._acts, "ERR?", *(f"#{c}" for c in _CODES)])

    def _of_axis(self, arguments: Arguments) -> str:
        if len(arguments) != 2:
            raise Refusal(24)
        if arguments[0] != self._model.axis:
            raise Refusal(15)
        return arguments[1]

    def _idle(self, arguments: Arguments) -> Arguments:
        if self.generator.running:
            raise Refusal(73)
        return arguments

    def _axis_value(self, arguments: Arguments, value: str) -> list[str]:
        if any(a != self._model.axis for a in arguments):
            raise Refusal(15)
        return [f"{self._model.axis}={value}"]

    def _channel_value(self, arguments: Arguments, value: str) -> list[str]:
        if any(a != "1" for a in arguments):
            raise Refusal(23)
        return [f"1={value}"]

    def _halt(self) -> None:
        self.generator.stop()
        self.axis.close_loop(False)

    def _stop(self, arguments: Arguments) -> None:
        self._halt()
        self._error = 10

    def _parameter(self, a: Arguments) -> list[str]:
        known = {
            0x0E000200: self._model.servo_time,
            0x16000200: float(self._model.points),
            0x16000000: float(self.recorder.divider),
        }
        number = int(a[1], 0)
        if number not in known:
            raise Refusal(54)
        return [f"{a[0]} 0x{number:X}={known[number]:.9g}"]
