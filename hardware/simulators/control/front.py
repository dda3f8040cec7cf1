"""The line protocol by which programs and experimenters handle the bench itself.

Every line gets one line: ``OK ...`` or ``ERR reason``. A client that lets time pass or triggers is
a program, whose end the watchdog sees; others only look.

=====================  ============================================================
``NOW``                true time (s)
``WAIT s``             lets time pass; answers the true time then
``EDGE``               an edge on the trigger line; answers its instant
``VOLTS``              voltage at the terminals
``EXTREMES``           lowest and highest voltage and largest step so far
``FAULT name k=v ...`` injects a fault; ``FAULT`` alone lists the names
``RATE``               0 on virtual time, else how much faster than the wall clock
``TRUTH?``             refused: what is sealed is opened after the diagnosis
``BYE``                nothing; for a polite end
=====================  ============================================================
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

from hardware.simulators.control.lines import LineServer
from hardware.simulators.control.watchdog import ConnectionWatchdog
from hardware.simulators.rig import Rig

Fault = Callable[[Mapping[str, float | str]], None]
"""What injects a fault; raises ValueError for arguments it does not know."""

_LONGEST_WAIT = 3600.0


@dataclass(frozen=True, slots=True)
class Departure:
    """The last program went away.

    Parameters
    ----------
    instant : float
        True time (s).
    volts : float
        Voltage at the terminals then (V).
    returned : bool
        Whether a watchdog brought it back to 0 V; without one it stays.
    """

    instant: float
    volts: float
    returned: bool

    def __str__(self) -> str:
        """One line for a person."""
        what = f"{self.instant:.6f} s: the last program is gone with {self.volts:g} V on the stack"
        if self.volts == 0.0:
            return what
        return what + (
            "; the watchdog brought it to 0 V"
            if self.returned
            else "; no watchdog: the voltage stays until somebody switches it off"
        )


def _of_a_program(line: str) -> bool:
    return line.upper().startswith(("WAIT", "EDGE"))


@final
class ControlFront:
    """Serves the line protocol.

    Parameters
    ----------
    rig : Rig
        The bench.
    faults : mapping, optional
        What injects each fault.
    watchdog : ConnectionWatchdog, optional
        Of the output; None if it has none.
    drive : callable, optional
        Sets the voltage of the device that is watched (V); the terminals by default.
    sealed : str
        Hash of the sealed truth, if there is one.
    rate : float
        How much faster than the wall clock a paced bench runs.
    port : int
        0 takes a free one.
    """

    def __init__(
        self,
        rig: Rig,
        faults: Mapping[str, Fault] | None = None,
        *,
        watchdog: ConnectionWatchdog | None = None,
        drive: Callable[[float], None] | None = None,
        sealed: str = "",
        rate: float = 1.0,
        port: int = 0,
    ) -> None:
        self._rig = rig
        self._faults = dict(faults or {})
        self._watchdog = watchdog
        self._drive = drive
        self._sealed = sealed
        self._rate = rate
        self._lines = LineServer(self.answer, self._left, _of_a_program, port)
        self._departures: deque[Departure] = deque(maxlen=256)
        self._simple: dict[str, Callable[[], str]] = {
            "NOW": lambda: f"{self._rig.now!r}",
            "VOLTS": lambda: f"{self._rig.volts!r}",
            "EXTREMES": self._extremes,
            "EDGE": self._edge,
            "RATE": lambda: f"{self._rate if self._rig.paced else 0.0!r}",
            "BYE": lambda: "bye",
        }

    @property
    def departures(self) -> tuple[Departure, ...]:
        """When the last program went away, the latest 256 times."""
        return tuple(self._departures)

    def start(self) -> str:
        """Listen; returns ``host:port``."""
        return self._lines.start()

    def stop(self) -> None:
        """End all connections."""
        self._lines.stop()

    def answer(self, line: str) -> str:
        """Answer one line."""
        word, _, rest = line.partition(" ")
        try:
            return "OK " + self._answer(word.upper(), rest.split())
        except ValueError as error:
            return f"ERR {error}".replace("\n", " ")

    def _answer(self, word: str, rest: list[str]) -> str:
        if word in self._simple:
            if rest:
                raise ValueError(f"{word} takes no argument")
            return self._simple[word]()
        if word == "WAIT":
            return self._wait(rest)
        if word == "FAULT":
            return self._fault(rest)
        if word == "TRUTH?":
            what = f"sealed {self._sealed}" if self._sealed else "nothing is sealed here"
            raise ValueError(f"{what}; the truth is told when the bench ends, not before")
        known = ", ".join([*self._simple, "WAIT", "FAULT"])
        raise ValueError(f"unknown command {word[:40]!r}; known: {known}")

    def _wait(self, rest: list[str]) -> str:
        try:
            (seconds,) = map(float, rest)
        except ValueError:
            raise ValueError("WAIT takes one number of seconds") from None
        if not (math.isfinite(seconds) and 0.0 <= seconds <= _LONGEST_WAIT):
            raise ValueError(f"WAIT takes 0 to {_LONGEST_WAIT:g} s, not {rest[0][:40]}")
        if not self._rig.paced:
            self._rig.wait(seconds)
            return f"{self._rig.now!r}"
        end = self._rig.now + seconds
        while (left := end - self._rig.now) > 0.0:
            time.sleep(left / self._rate)
        return f"{self._rig.now!r}"

    def _extremes(self) -> str:
        e = self._rig.extremes
        return f"{e.lowest!r} {e.highest!r} {e.largest_step!r}"

    def _edge(self) -> str:
        with self._rig.lock:
            self._rig.trigger()
            return f"{self._rig.trigger_edges_from(-1)[0]!r}"

    def _fault(self, rest: list[str]) -> str:
        if not rest:
            return " ".join(sorted(self._faults)) or "none"
        name, *pairs = rest
        if name not in self._faults:
            known = ", ".join(sorted(self._faults)) or "none"
            raise ValueError(f"unknown fault {name[:40]!r}; known: {known}")
        values: dict[str, float | str] = {}
        for pair in pairs:
            key, equals, text = pair.partition("=")
            if not (key and equals and text):
                raise ValueError(f"fault {name}: {pair[:40]!r} is no key=value")
            try:
                values[key] = float(text)
            except ValueError:
                values[key] = text
        self._faults[name](values)
        return f"{name} at {self._rig.now!r}"

    def _left(self, others: int) -> None:
        """Do what the device does when the last program is gone."""
        if others:
            return
        rig = self._rig
        with rig.lock:
            instant, volts = rig.now, rig.volts
            self._departures.append(Departure(instant, volts, self._watchdog is not None))
            if self._watchdog is not None and volts != 0.0:
                self._watchdog.expire(rig, lambda: self._lines.programs == 0, self._drive)
