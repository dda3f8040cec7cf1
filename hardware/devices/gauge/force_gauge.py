"""A force gauge on a serial line that answers ``D`` with one reading (Imada DS2 and its kin).

The stack actuator thesis (section 8.2.1) read a DS2-5N so, 100 times a second. The form of the
answer (sign, digits, unit, mode, judgement, CR) is what is commonly told of these gauges; it was
tried on the simulated one only.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from types import MappingProxyType
from typing import final

import numpy as np

from bondgraph.support.errors import UnusableInput, real_number
from hardware.contracts import Chunk, Clock, Flag, Identity, Transport
from hardware.errors import HardwareError, ProtocolFault, TimedOut

UNITS = MappingProxyType({"N": 1.0, "K": 9.80665, "P": 4.4482216152605})
"""N of one newton, kilogram-force, pound-force."""
ANSWER = 0.5
"""Longest wait for an answer (s, real time)."""
_END = b"\r"
_READING = re.compile(r"\s*([+-]?\d{1,6}(?:\.\d{1,6})?)\s*([NKP])\s*([A-Z]?)([A-Z]?)\s*")
_TRIES = 3


@final
class ForceGauge:
    """An `Acquisition` of channel ``F`` (N), asked once a reading.

    Parameters
    ----------
    transport : Transport
        Line to the gauge; opened here, closed by `close`.
    clock : Clock
        Time of the program, which dates every reading.
    rate : float
        Readings a second at most (Hz).

    Raises
    ------
    LinkLost
        Nobody is there.
    """

    stream = "gauge"
    done = True
    """Asked reading by reading, nothing is ever outstanding: no take waits for it."""

    def __init__(self, transport: Transport, clock: Clock, rate: float = 100.0) -> None:
        if real_number("gauge: rate", rate) <= 0.0:
            raise UnusableInput(f"gauge: a rate of {rate:g} Hz; give more than 0")
        self._transport, self._clock, self.rate = transport, clock, rate
        self.identity = Identity("", f"force gauge at {transport.address}")
        self._count = 0
        self._next = float("-inf")
        transport.open()

    def kickoff(self) -> None:
        """Ask for a first reading, which tells whether it is there and in which unit."""
        self._count = 0
        self._reading()
        self._next = float("-inf")

    def poll(self) -> Sequence[Chunk]:
        """Return one reading if it is time for one.

        Raises
        ------
        TimedOut, LinkLost, ProtocolFault
            No answer, no gauge, or three answers in a row that are no readings.
        """
        now = self._clock.now()
        if now < self._next - 1e-6:
            return []
        self._next = max(self._next, now) + 1.0 / self.rate
        force, flag = self._reading()
        columns = {"F": np.array([force]), "instant": np.array([self._clock.now()])}
        self._count += 1
        return [
            Chunk(
                self.stream, self._count - 1, columns, {"F": "N", "instant": "s"},
                np.array([flag], np.uint16),
            )
        ]  # fmt: skip

    def finish(self) -> Sequence[Chunk]:
        """Nothing is left."""
        return []

    def abort(self) -> None:
        """Forget an answer that is on its way; never raises."""
        try:
            self._transport.drain()
        except HardwareError:
            return

    def close(self) -> None:
        """Let go of the line."""
        self._transport.close()

    def _reading(self) -> tuple[float, Flag]:
        line = b""
        for _ in range(_TRIES):
            # an answer that came too late must not be taken for this one
            self._transport.drain()
            self._transport.write(b"D" + _END)
            try:
                line = self._transport.read_until(_END, ANSWER)
            except TimedOut as error:
                line = bytes(error.partial or b"")
                continue
            found = _READING.fullmatch(line.rstrip(_END).decode("ascii", "replace"))
            if found is not None:
                value, unit, _, judgement = found.groups()
                flag = Flag.SATURATED if judgement == "E" else Flag.GOOD
                return float(value) * UNITS[unit], flag
        if line:
            raise ProtocolFault(
                f"gauge {self._transport.address}: {line[:20]!r} is no reading such as +1.234NTO; "
                "check baud rate and that it is a gauge that answers D"
            )
        raise TimedOut(
            f"gauge {self._transport.address}: no answer to {_TRIES} requests of {ANSWER:g} s; is "
            "it on, and is the line wired?"
        )
