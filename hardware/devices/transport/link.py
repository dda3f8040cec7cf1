"""What all links share: a buffer, time-outs, and being lost once and for all."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import Self

from hardware.contracts import Transport
from hardware.devices.transport.buffer import MOST, ReceiveBuffer
from hardware.errors import DriverMissing, LinkLost, TimedOut

_CLOSED = "not open; call open() first"


class Link(Transport, ABC):
    """A transport by four steps that move bytes; any error of theirs loses the link.

    Time-outs are those of the operating system, in real time: a line of bytes knows nothing of a
    virtual bench. For one thread.

    Parameters
    ----------
    write_timeout : float
        Longest wait for the other side to take bytes (s).
    most : int
        Bytes buffered without a terminator; `ProtocolFault` if a device sends more.
    """

    def __init__(self, write_timeout: float = 1.0, most: int = MOST) -> None:
        self._write_timeout = write_timeout
        self._most = most
        self._buffer = ReceiveBuffer(most, self.address)
        self._open = False
        self._why = _CLOSED

    @abstractmethod
    def _connect(self) -> None:
        """Connect; an error if nobody is there."""

    @abstractmethod
    def _put(self, data: memoryview, seconds: float) -> int:
        """Send some of it; the number of bytes taken, 0 if the time is over: that is final."""

    @abstractmethod
    def _get(self, seconds: float) -> bytes:
        """Return what came; b"" if nothing within the time; an error if the other side is gone."""

    @abstractmethod
    def _release(self) -> None:
        """Disconnect without waiting for anything; what it raises is nobody's business."""

    def open(self) -> None:
        """Connect; nothing if it is open."""
        if self._open:
            return
        try:
            self._connect()
        except ImportError as error:
            raise DriverMissing(
                f"{self.address}: needs {error.name}; pip install 'bondsight[bench]'"
            ) from error
        except Exception as error:
            self._drop()
            raise LinkLost(
                f"{self.address}: cannot connect ({_reason(error)}); check cable, power, address "
                "and that no other program holds it"
            ) from error
        self._open = True
        self._why = _CLOSED
        self._buffer = ReceiveBuffer(self._most, self.address)

    def close(self) -> None:
        """Disconnect; never raises, never hangs, any number of times."""
        self._drop()
        self._buffer.clear()

    def write(self, data: bytes) -> None:
        """Send all of it, no byte twice.

        The `partial` of a time-out is the number of bytes surely sent. Where the driver does not
        tell how many were taken in time, those of the piece it had may have gone out too.
        """
        rest = memoryview(data)
        deadline = time.monotonic() + self._write_timeout
        while rest:
            left = deadline - time.monotonic()
            taken = self._sent(rest, max(left, 0.0))
            if not taken:
                # what timed out may be on the wire in part: it must not be sent again
                raise TimedOut(
                    f"{self.address}: {len(rest)} of {len(data)} bytes not taken within "
                    f"{self._write_timeout:g} s; the device is stuck or holds the line (XOFF)",
                    len(data) - len(rest),
                )
            rest = rest[taken:]

    def read_until(self, ends: bytes | tuple[bytes, ...], timeout: float) -> bytes:
        """Return bytes up to and with one of the terminators."""
        wanted = (ends,) if isinstance(ends, bytes) else ends
        deadline = time.monotonic() + timeout
        while (answer := self._buffer.take(wanted)) is None:
            left = deadline - time.monotonic()
            data = self._come(max(left, 0.0))
            if not data and left <= 0.0:
                so_far = self._buffer.waiting
                raise TimedOut(
                    f"{self.address}: no {' or '.join(map(repr, wanted))} within {timeout:g} s "
                    f"({len(so_far)} bytes came: {so_far[:40]!r})",
                    so_far,
                )
            self._buffer.add(data)
        return answer

    def drain(self) -> bytes:
        """Return and forget everything that waits, without waiting."""
        taken = bytearray(self._buffer.clear())
        # a lost link has nothing, and its next use says why; a device that never stops sending
        # must not keep us here
        with suppress(LinkLost):
            while self._open and len(taken) < self._most and (data := self._come(0.0)):
                taken += data
        return bytes(taken)

    def __enter__(self) -> Self:
        """Connect."""
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect."""
        self.close()

    def _sent(self, data: memoryview, seconds: float) -> int:
        self._require_open()
        try:
            return self._put(data, seconds)
        except Exception as error:  # of any kind, by driver, system and moment
            raise self._lost(error) from error

    def _come(self, seconds: float) -> bytes:
        self._require_open()
        try:
            return self._get(seconds)
        except Exception as error:  # of any kind, by driver, system and moment
            raise self._lost(error) from error

    def _require_open(self) -> None:
        if not self._open:
            raise LinkLost(f"{self.address}: {self._why}", self._buffer.waiting)

    def _lost(self, error: Exception) -> LinkLost:
        so_far = self._buffer.clear()
        self._drop()
        why = _reason(error)
        # whoever uses it next learns why, also where nobody was told now (`drain`)
        self._why = f"link lost ({why}); call open() again"
        return LinkLost(f"{self.address}: link lost ({why}); {len(so_far)} bytes had come", so_far)

    def _drop(self) -> None:
        self._open = False
        with suppress(Exception):  # closing is the last resort; there is nothing left to do
            self._release()


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
