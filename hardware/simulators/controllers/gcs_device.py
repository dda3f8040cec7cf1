"""A GCS 2 controller: takes bytes, gives answers, obeys or remembers an error number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import final

import numpy as np

from hardware.simulators.controllers.gcs_axis import Axis
from hardware.simulators.controllers.gcs_generator import Generator
from hardware.simulators.controllers.gcs_model import GcsModel, Refusal
from hardware.simulators.controllers.gcs_recorder import OPTIONS, DataRecorder
from hardware.simulators.controllers.watchdog import Watch
from hardware.simulators.rig import DeviceClock, Rig

__all__ = ["GcsDevice"]

_LONGEST = 1 << 14
_HALT, _MOVING, _READY, _GENERATOR = 24, 5, 7, 9
_CODES = (_HALT, _MOVING, _READY, _GENERATOR)

Arguments = Sequence[str]


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
        self.axis = Axis(rig, model)
        self.generator = Generator(rig, clock, model, self.axis.write)
        self.recorder = DataRecorder(rig, clock, model)
        self.commands: list[str] = []
        """Everything that was understood as a command, in its order."""
        self._error = 0
        self._bytes = bytearray()
        self._watch = (
            Watch(rig, model.watchdog, lambda: self.axis.volts, self.axis.write, self._halt)
            if model.watchdog
            else None
        )
        self._acts = self._table_of_commands()
        self._asks = self._table_of_queries()

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
        with self._rig.lock:
            self.commands.append(line)
            if self._watch:
                self._watch.pat()
            try:
                lines = self._answer(line)
            except Refusal as refusal:
                self._error = refusal.number
                return
            except ValueError:
                self._error = 1
                return
        if lines is not None:
            yield (" \n".join(lines) + "\n").encode("cp1252")

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

    def _table_of_commands(self) -> dict[str, Callable[[Arguments], None]]:
        g, r = self.generator, self.recorder
        return {
            "SVO": lambda a: self.axis.close_loop(bool(int(self._of_axis(a)))),
            "SVA": lambda a: self.axis.command(float(self._of_axis(self._idle(a)))),
            "SVR": lambda a: self.axis.command(
                self.axis.commanded + float(self._of_axis(self._idle(a)))
            ),
            "MOV": lambda a: self.axis.move(float(self._of_axis(self._idle(a)))),
            "HLT": self._stop,
            "STP": self._stop,
            "WAV": self._wave,
            "WCL": self._clear_tables,
            "WSL": lambda a: setattr(g, "table", _pairs(a)[1]),
            "WGC": lambda a: setattr(g, "cycles", _pairs(a)[1]),
            "WTR": self._wave_rate,
            "WOS": lambda a: setattr(g, "offset", float(a[1])),
            "WGO": self._go,
            "TWC": lambda a: g.points.clear(),
            "TWS": self._trigger_points,
            "CTO": self._trigger_mode,
            "DRC": self._record_what,
            "DRT": self._record_when,
            "RTR": lambda a: setattr(r, "divider", _positive(a[0])),
        }

    def _table_of_queries(self) -> dict[str, Callable[[Arguments], list[str]]]:
        m, g, r = self._model, self.generator, self.recorder
        low, high = m.travel
        return {
            "*IDN?": lambda a: [m.identity],
            "CSV?": lambda a: ["2.0"],
            "VER?": lambda a: [f"FW: {m.identity.split(',')[-1]}"],
            "SAI?": lambda a: [m.axis],
            "CST?": lambda a: self._axis_value(a, m.stage),
            "SVO?": lambda a: self._axis_value(a, f"{int(self.axis.servo)}"),
            "SVA?": lambda a: self._axis_value(a, f"{self.axis.commanded:.6f}"),
            "MOV?": lambda a: self._axis_value(a, f"{self.axis.target:.6f}"),
            "POS?": lambda a: self._axis_value(a, f"{self.axis.position():.6f}"),
            "ONT?": lambda a: self._axis_value(a, f"{int(self.axis.on_target())}"),
            "TMN?": lambda a: self._axis_value(a, f"{low:.6f}"),
            "TMX?": lambda a: self._axis_value(a, f"{high:.6f}"),
            "VOL?": lambda a: self._channel_value(a, f"{self.axis.voltage():.6f}"),
            "VMI?": lambda a: self._channel_value(a, f"{m.lowest:.6f}"),
            "VMA?": lambda a: self._channel_value(a, f"{m.highest:.6f}"),
            "WAV?": lambda a: [f"{t} 1={v.size:.6f}" for t, v in g.tables.items()] or ["1 1=0"],
            "WMS?": lambda a: [f"1={m.points}"],
            "WSL?": lambda a: [f"1={g.table}"],
            "WGC?": lambda a: [f"1={g.cycles}"],
            "WTR?": lambda a: [f"1={g.divider} 0"],
            "WGO?": lambda a: [f"1={int(g.running)}"],
            "GWD?": self._wave_data,
            "DRC?": lambda a: [f"{t}={s} {o}" for t, (s, o) in r.options.items()],
            "DRT?": lambda a: [f"{t}={r.trigger} 0" for t in r.options],
            "DRL?": lambda a: [f"{t}={r.recorded()}" for t in self._asked_tables(a)],
            "DRR?": self._recorded,
            "RTR?": lambda a: [str(r.divider)],
            "TNR?": lambda a: [str(m.tables)],
            "HDR?": lambda a: ["#RecordOptions"] + [f"{k}={t}" for k, t in OPTIONS.items()],
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

    def _wave(self, a: Arguments) -> None:
        if self.generator.running and int(a[0]) == self.generator.table:
            raise Refusal(73)
        kind = a[2].upper()
        if kind == "PNT":
            values = [float(v) for v in a[5:]]
            if len(values) != int(a[4]):
                raise Refusal(404)
        elif kind == "SIN_P":
            length, height, level, period, start, centre = map(float, a[3:9])
            # the public form knows a centre; here only the symmetric one
            if length != period or abs(2.0 * centre - period) > 1.0:
                raise Refusal(405)
            k = np.arange(int(length)) - start
            values = list(level + 0.5 * height * (1.0 - np.cos(2.0 * np.pi * k / period)))
        else:
            raise Refusal(402)
        self.generator.append(int(a[0]), a[1].upper(), values)

    def _clear_tables(self, a: Arguments) -> None:
        for table in a:
            self.generator.tables.pop(int(table), None)

    def _wave_rate(self, a: Arguments) -> None:
        if self.generator.running:
            raise Refusal(73)
        self.generator.divider = _positive(a[1])

    def _go(self, a: Arguments) -> None:
        if len(a) != 2 or a[0] != "1":
            raise Refusal(400)
        mode = int(a[1], 0)
        if mode == 0:
            self.generator.stop()
        elif mode != 1:
            raise Refusal(406)
        elif self.axis.servo:
            raise Refusal(303)
        else:
            self.recorder.start()
            self.generator.start()

    def _trigger_points(self, a: Arguments) -> None:
        for k in range(0, len(a), 3):
            line, point, switch = (int(v) for v in a[k : k + 3])
            self.generator.points.setdefault(line, {})[point] = switch

    def _trigger_mode(self, a: Arguments) -> None:
        for k in range(0, len(a), 3):
            line, parameter, value = int(a[k]), int(a[k + 1]), float(a[k + 2])
            if parameter != 3 or value not in (0.0, 4.0):
                raise Refusal(17)
            self.generator.modes[line] = int(value)

    def _record_what(self, a: Arguments) -> None:
        for k in range(0, len(a), 3):
            table, option = int(a[k]), int(a[k + 2])
            if table not in self.recorder.options:
                raise Refusal(57)
            if option not in OPTIONS:
                raise Refusal(58)
            self.recorder.options[table] = (a[k + 1], option)
        self.recorder.forget()

    def _record_when(self, a: Arguments) -> None:
        trigger = int(a[1])
        if trigger not in (0, 4):
            raise Refusal(17)
        self.recorder.trigger = trigger
        if trigger == 4:
            self.recorder.start()

    def _asked_tables(self, a: Arguments) -> list[int]:
        tables = [int(t) for t in a] or list(self.recorder.options)
        if any(t not in self.recorder.options for t in tables):
            raise Refusal(57)
        return tables

    def _recorded(self, a: Arguments) -> list[str]:
        first, count = int(a[0]), int(a[1])
        tables = [int(t) for t in a[2:]] or [
            t for t, (_, option) in self.recorder.options.items() if option
        ]
        self._asked_tables([str(t) for t in tables])
        if first < 1 or first - 1 + count > self.recorder.recorded():
            raise Refusal(77)
        names = [
            f"{OPTIONS[self.recorder.options[t][1]]}{self.recorder.options[t][0]}" for t in tables
        ]
        values = self.recorder.columns(tables, first - 1, count)
        return _array(self._model.identity, self.recorder.period, names, values)

    def _wave_data(self, a: Arguments) -> list[str]:
        first, count, table = int(a[0]), int(a[1]), int(a[2])
        wave = self.generator.tables.get(table)
        if wave is None:
            raise Refusal(401)
        values = wave[first - 1 : first - 1 + count, None]
        period = self._model.servo_time * self.generator.divider
        return _array(self._model.identity, period, [f"Wave table {table}"], values)

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


def _pairs(a: Arguments) -> tuple[int, int]:
    if len(a) != 2 or a[0] != "1":
        raise Refusal(400)
    return int(a[0]), int(a[1])


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise Refusal(17)
    return value


def _array(
    identity: str, period: float, names: list[str], values: np.ndarray[tuple[int, int], np.dtype]
) -> list[str]:
    """Lines of a GCS array."""
    header = [
        f"# REM {identity}",
        "#",
        "# VERSION = 1",
        "# TYPE = 1",
        "# SEPARATOR = 32",
        f"# DIM = {values.shape[1]}",
        f"# SAMPLE_TIME = {period:.9g}",
        f"# NDATA = {values.shape[0]}",
        "#",
        *(f"# NAME{k} = {name}" for k, name in enumerate(names)),
        "#",
        "# END_HEADER",
    ]
    return header + [" ".join(f"{v:.6f}" for v in row) for row in values]
