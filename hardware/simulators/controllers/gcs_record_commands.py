"""GCS commands and questions about the data recorder."""

from __future__ import annotations

from typing import final

from hardware.simulators.controllers.gcs_array import gcs_array
from hardware.simulators.controllers.gcs_model import Acts, Arguments, Asks, GcsModel, Refusal
from hardware.simulators.controllers.gcs_recorder import OPTIONS, DataRecorder

_AT_ONCE = 4


@final
class RecordCommands:
    """The recorder behind its mnemonics.

    Parameters
    ----------
    model : GcsModel
        Sizes.
    recorder : DataRecorder
        What is commanded.
    """

    def __init__(self, model: GcsModel, recorder: DataRecorder) -> None:
        self._model = model
        self._recorder = recorder

    def acts(self) -> Acts:
        """Commands by mnemonic."""
        return {"DRC": self._what, "DRT": self._when, "RTR": self._rate}

    def asks(self) -> Asks:
        """Questions by mnemonic."""
        r = self._recorder
        return {
            "DRC?": lambda a: [f"{t}={s} {o}" for t, (s, o) in r.options.items()],
            "DRT?": lambda a: [f"{t}={r.trigger} 0" for t in r.options],
            "DRL?": lambda a: [f"{t}={r.recorded()}" for t in self._tables(a)],
            "DRR?": self._data,
            "RTR?": lambda a: [str(r.divider)],
            "TNR?": lambda a: [str(self._model.tables)],
            "HDR?": lambda a: ["#RecordOptions"] + [f"{k}={t}" for k, t in OPTIONS.items()],
        }

    def _what(self, a: Arguments) -> None:
        chosen = {}
        for k in range(0, len(a), 3):
            table, option = int(a[k]), int(a[k + 2])
            if table not in self._recorder.options:
                raise Refusal(57)
            if option not in OPTIONS:
                raise Refusal(58)
            chosen[table] = (a[k + 1], option)
        self._recorder.options.update(chosen)
        self._recorder.forget()

    def _when(self, a: Arguments) -> None:
        trigger = int(a[1])
        if trigger not in (0, _AT_ONCE):
            raise Refusal(17)
        self._recorder.trigger = trigger
        if trigger == _AT_ONCE:
            self._recorder.start()

    def _rate(self, a: Arguments) -> None:
        divider = int(a[0])
        if divider < 1:
            raise Refusal(17)
        self._recorder.divider = divider

    def _tables(self, a: Arguments) -> list[int]:
        tables = [int(t) for t in a] or list(self._recorder.options)
        if any(t not in self._recorder.options for t in tables):
            raise Refusal(57)
        return tables

    def _data(self, a: Arguments) -> list[str]:
        r = self._recorder
        first, count = int(a[0]), int(a[1])
        used = [str(t) for t, (_, option) in r.options.items() if option]
        tables = self._tables(a[2:] or used)
        if first < 1 or first - 1 + count > r.recorded():
            raise Refusal(77)
        names = [f"{OPTIONS[r.options[t][1]]}{r.options[t][0]}" for t in tables]
        values = r.columns(tables, first - 1, count)
        return gcs_array(self._model.identity, r.period, names, values)
