"""Controllers with an ASCII dialect: piezosystem jena NV200 and d-Drive, Thorlabs MDT69x.

Written from what public programs for these devices send and expect; never compared with a device.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import partial
from typing import final

import numpy as np

from hardware.simulators.controllers.command_log import CommandLog, standing_still
from hardware.simulators.controllers.watchdog import ArmedWatchdog, CommandWatchdog
from hardware.simulators.rig import Rig

_LONGEST = 1 << 12


class AsciiDevice(ABC):
    """One open-loop channel behind a line of text.

    Parameters
    ----------
    rig : Rig
        The bench.
    lowest, highest : float
        Voltages that it gives (V).
    watchdog : CommandWatchdog, optional
        None as in the public documents.
    """

    terminator = b""
    line_ends: bytes = b"\n"

    def __init__(
        self, rig: Rig, lowest: float, highest: float, watchdog: CommandWatchdog | None = None
    ) -> None:
        self._rig = rig
        self._lowest = lowest
        self._highest = highest
        self._bytes = bytearray()
        self.volts = 0.0
        self.commands = CommandLog()
        self._watch = (
            ArmedWatchdog(rig, watchdog, lambda: self.volts, self._write, lambda: None)
            if watchdog
            else None
        )

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes and give the answers to the lines that they complete."""
        for byte in data:
            if byte not in self.line_ends:
                self._bytes.append(byte)
                if len(self._bytes) > _LONGEST:
                    self._bytes.clear()
                continue
            line = self._bytes.decode("ascii", "replace").strip()
            self._bytes.clear()
            if line:
                yield standing_still(self._rig, partial(self._hear, line))

    def _hear(self, line: str) -> bytes:
        self.commands.add(line)
        if self._watch:
            self._watch.pat()
        return self._obey(line)

    @abstractmethod
    def _obey(self, line: str) -> bytes:
        """Answer to one line, with its frame."""

    def _write(self, volts: float) -> None:
        self.volts = volts
        self._rig.drive(volts)

    def _within(self, volts: float) -> bool:
        return bool(np.isfinite(volts)) and self._lowest <= volts <= self._highest


class _Jena(AsciiDevice):
    """Frame of piezosystem jena: XOFF, text, CR LF, XON; nothing but XOFF XON to a command."""

    terminator = b"\r\n\x11"
    line_ends = b"\r\n"

    def __init__(self, rig: Rig, watchdog: CommandWatchdog | None = None) -> None:
        super().__init__(rig, -20.0, 130.0, watchdog)
        self._closed = 0

    def _set(self, name: str, value: str) -> str | None:
        """Obey what both devices know; None if it is something else."""
        if name == "cl":
            self._closed = int(value)
            return ""
        if name != "set":
            return None
        if not self._within(float(value)):
            return "error,4"
        self._write(float(value))
        return ""

    def _frame(self, text: str) -> bytes:
        return b"\x13" + text.encode("ascii") + b"\r\n\x11" if text else b"\x13\x11"

    def _obey(self, line: str) -> bytes:
        name, *arguments = line.split(",")
        try:
            return self._frame(self._reply(name, arguments))
        except ValueError:
            return self._frame("error,1")

    @abstractmethod
    def _reply(self, name: str, arguments: list[str]) -> str: ...


@final
class Nv200(_Jena):
    """NV200/D, one channel, without a sensor: `meas` gives the voltage."""

    def __init__(self, rig: Rig, watchdog: CommandWatchdog | None = None) -> None:
        super().__init__(rig, watchdog)
        self._source = 0

    def _reply(self, name: str, arguments: list[str]) -> str:
        if arguments and (done := self._set(name, arguments[0])) is not None:
            return done
        if name == "modsrc" and arguments:
            self._source = int(arguments[0])
            return ""
        if arguments:
            return "error,5"
        values: dict[str, Callable[[], str]] = {
            "set": lambda: f"{self.volts:.3f}",
            "meas": lambda: f"{self.volts:.3f}",
            "cl": lambda: str(self._closed),
            "modsrc": lambda: str(self._source),
            "desc": lambda: "SIMSTACK",
            "acserno": lambda: "4711",
            "avmin": lambda: f"{self._lowest:.3f}",
            "avmax": lambda: f"{self._highest:.3f}",
        }
        return f"{name},{values[name]()}" if name in values else "error,2"


@final
class DDrive(_Jena):
    """D-Drive with one channel, number 0."""

    def _reply(self, name: str, arguments: list[str]) -> str:
        if not arguments:
            return "error,3"
        if arguments[0] != "0":
            return "error,4"
        if len(arguments) == 2 and (done := self._set(name, arguments[1])) is not None:
            return done
        values: dict[str, Callable[[], str]] = {
            "set": lambda: f"{self.volts:.3f}",
            "mess": lambda: f"{self.volts:.3f}",
            "cl": lambda: str(self._closed),
            "acdescr": lambda: "SIMSTACK",
        }
        return f"{name},0,{values[name]()}" if name in values else "error,2"


@final
class Mdt69x(AsciiDevice):
    """MDT69xB: echo and prompt; limits by a switch of 75, 100 or 150 V."""

    terminator = b">"
    line_ends = b"\r\n"

    def __init__(
        self, rig: Rig, limit: float = 150.0, watchdog: CommandWatchdog | None = None
    ) -> None:
        super().__init__(rig, 0.0, limit, watchdog)
        self._echo = True

    def _obey(self, line: str) -> bytes:
        echo = line + "\r" if self._echo else ""
        return (echo + self._reply(line.lower()) + ">").encode("ascii")

    def _reply(self, line: str) -> str:
        if line.startswith("xvoltage="):
            try:
                volts = float(line[9:])
            except ValueError:
                return "CMD_ARG_INVALID\r"
            if not self._within(volts):
                return "CMD_ARG_RANGE_ERR\r"
            self._write(volts)
            return ""
        if line.startswith("echo="):
            self._echo = line[5:].strip() == "1"
            return ""
        values: dict[str, Callable[[], str]] = {
            "id?": lambda: (
                "Model MDT694B Piezo Control Module\r"
                f"Firmware Version: 1.10\rVoltage Range: {self._highest:.0f}V\r"
                "Serial#: SIM4711\r"
            ),
            "xvoltage?": lambda: f"[ {self.volts:.2f}]\r",
            "vlimit?": lambda: f"[ {self._highest:.0f}.00]\r",
            "xmin?": lambda: f"[ {self._lowest:.2f}]\r",
            "xmax?": lambda: f"[ {self._highest:.2f}]\r",
        }
        return values[line]() if line in values else "CMD_NOT_DEFINED\r"


ASCII_DEVICES: dict[str, Callable[[Rig], AsciiDevice]] = {
    "nv200": Nv200,
    "d-drive": DDrive,
    "mdt69x": Mdt69x,
}
"""Devices by name."""
