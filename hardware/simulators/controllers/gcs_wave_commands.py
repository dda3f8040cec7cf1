"""GCS commands and questions about the wave generator and its trigger output."""

from __future__ import annotations

from typing import final

import numpy as np

from hardware.simulators.controllers.gcs_array import gcs_array
from hardware.simulators.controllers.gcs_axis import SimulatedAxis
from hardware.simulators.controllers.gcs_generator import Generator
from hardware.simulators.controllers.gcs_model import Acts, Arguments, Asks, GcsModel, Refusal
from hardware.simulators.controllers.gcs_recorder import DataRecorder


@final
class WaveCommands:
    """The generator behind its mnemonics.

    Parameters
    ----------
    model : GcsModel
        Sizes and limits.
    generator : Generator
        What is commanded.
    axis : SimulatedAxis
        Whose loop has to be open.
    recorder : DataRecorder
        Starts with the generator.
    """

    def __init__(
        self, model: GcsModel, generator: Generator, axis: SimulatedAxis, recorder: DataRecorder
    ) -> None:
        self._model = model
        self._generator = generator
        self._axis = axis
        self._recorder = recorder

    def acts(self) -> Acts:
        """Commands by mnemonic."""
        g = self._generator
        return {
            "WAV": self._wave,
            "WCL": self._clear,
            "WSL": lambda a: setattr(g, "table", _of_first(a)),
            "WGC": lambda a: setattr(g, "cycles", _of_first(a)),
            "WTR": self._rate,
            "WOS": lambda a: setattr(g, "offset", float(a[1])),
            "WGO": self._go,
            "TWC": lambda a: g.points.clear(),
            "TWS": self._trigger_points,
            "CTO": self._trigger_mode,
        }

    def asks(self) -> Asks:
        """Questions by mnemonic."""
        g = self._generator
        return {
            "WAV?": lambda a: [f"{t} 1={v.size:.6f}" for t, v in g.tables.items()] or ["1 1=0"],
            "WMS?": lambda a: [f"1={self._model.points}"],
            "WSL?": lambda a: [f"1={g.table}"],
            "WGC?": lambda a: [f"1={g.cycles}"],
            "WTR?": lambda a: [f"1={g.divider} 0"],
            "WGO?": lambda a: [f"1={int(g.running)}"],
            "GWD?": self._data,
        }

    def _wave(self, a: Arguments) -> None:
        if self._generator.running and int(a[0]) == self._generator.table:
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
        if not np.all(np.isfinite(values)):
            raise Refusal(25)
        self._generator.append(int(a[0]), a[1].upper(), values)

    def _clear(self, a: Arguments) -> None:
        for table in a:
            self._generator.tables.pop(int(table), None)

    def _rate(self, a: Arguments) -> None:
        if self._generator.running:
            raise Refusal(73)
        divider = int(a[1])
        if divider < 1:
            raise Refusal(17)
        self._generator.divider = divider

    def _go(self, a: Arguments) -> None:
        mode = _of_first(a)
        if mode == 0:
            self._generator.stop()
        elif mode != 1:
            raise Refusal(406)
        elif self._axis.servo:
            raise Refusal(303)
        else:
            self._generator.start()
            self._recorder.start()

    def _trigger_points(self, a: Arguments) -> None:
        for k in range(0, len(a), 3):
            line, point, switch = (int(v) for v in a[k : k + 3])
            self._generator.points.setdefault(line, {})[point] = switch

    def _trigger_mode(self, a: Arguments) -> None:
        for k in range(0, len(a), 3):
            line, parameter, value = int(a[k]), int(a[k + 1]), float(a[k + 2])
            if parameter != 3 or value not in (0.0, 4.0):
                raise Refusal(17)
            self._generator.modes[line] = int(value)

    def _data(self, a: Arguments) -> list[str]:
        first, count, table = int(a[0]), int(a[1]), int(a[2])
        wave = self._generator.tables.get(table)
        if wave is None:
            raise Refusal(401)
        values = wave[first - 1 : first - 1 + count, None]
        period = self._model.servo_time * self._generator.divider
        return gcs_array(self._model.identity, period, [f"Wave table {table}"], values)


def _of_first(a: Arguments) -> int:
    """Value for the only generator."""
    if len(a) != 2 or a[0] != "1":
        raise Refusal(400)
    return int(a[1], 0)
