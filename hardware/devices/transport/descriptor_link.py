"""What TCP and a POSIX serial line share: a non-blocking descriptor that is waited for."""

from __future__ import annotations

import select
import time
from abc import ABC, abstractmethod
from typing import Self

from hardware.devices.transport.buffer import MOST, ReceiveBuffer
from hardware.errors import HardwareError, LinkLost, TimedOut

__all__ = ["DescriptorLink"]

_PIECE = 1 << 16


class DescriptorLink(ABC):
    """A link over one non-blocking descriptor.

    Time-outs are those of the operating system, in real time: a line of bytes knows nothing of a
    virtual bench. For one thread.

    Parameters
    ----------
    write_timeout : float
        Longest wait for the other side to take bytes (s).
    most : int
        Bytes buffered without a terminator.
    """

    def __init__(self, write_timeout: float = 1.0, most: int = MOST) -> None:
        self._write_timeout = write_timeout
        self._most = most
        self._buffer = ReceiveBuffer(most, self.address)
        self._open = False

    @property
    @abstractmethod
    def address(self) -> str:
        """Where it leads, for messages."""

    @abstractmethod
    def _connect(self) -> None:
        """Open the descriptor; OSError if nobody is there."""

    @abstractmethod
    def _descriptor(self) -> int: ...

    @abstractmethod
    def _send(self, data: memoryview) -> int:
        """Send some of it without waiting; number of bytes taken."""

    @abstractmethod
    def _receive(self, most: int) -> bytes:
        """Receive what is there without waiting; b"" if the other side is gone."""

    @abstractmethod
    def _release(self) -> None:
        """Close the descriptor without waiting for anything."""

    def open(self) -> None:
        """Connect; nothing if it is open.

        Raises
        ------
        LinkLost
            If nobody is there.
        """
        if self._open:
            return
        try:
            self._connect()
        except OSError as error:
            self._drop()
            raise LinkLost(
                f"{self.address}: cannot connect ({_reason(error)}); check cable, power, address "
                "and that no other program holds it"
            ) from error
        self._open = True
        self._buffer = ReceiveBuffer(self._most, self.address)

    def close(self) -> None:
        """Disconnect; never raises, never hangs, any number of times."""
        self._drop()
        self._buffer.clear()

    def write(self, data: bytes) -> None:
        """Send all of it.

        Raises
        ------
        TimedOut
            If the other side takes no more; `partial` is the number of bytes sent.
        LinkLost
            If it is gone.
        """
        self._require_open()
        rest = memoryview(data)
        deadline = time.monotonic() + self._write_timeout
        while rest:
            if not self._wait(write=True, seconds=deadline - time.monotonic()):
                raise TimedOut(
                    f"{self.address}: {len(rest)} of {len(data)} bytes not taken within "
                    f"{self._write_timeout:g} s; the device is stuck or holds the line (XOFF)",
                    len(data) - len(rest),
                )
            try:
                rest = rest[self._send(rest) :]
            except (BlockingIOError, InterruptedError):
                continue
            except OSError as error:
                raise self._lost(_reason(error)) from error

    def read_until(self, ends: bytes | tuple[bytes, ...], timeout: float) -> bytes:
        """Return bytes up to and with one of the terminators.

        Raises
        ------
        TimedOut
            With the bytes so far as `partial`; they stay in the buffer.
        LinkLost
            If the other side is gone; `partial` as above.
        ProtocolFault
            If the device sends more than the buffer holds without a terminator.
        """
        wanted = (ends,) if isinstance(ends, bytes) else ends
        deadline = time.monotonic() + timeout
        while (answer := self._buffer.take(wanted)) is None:
            self._require_open()
            if not self._wait(write=False, seconds=deadline - time.monotonic()):
                so_far = self._buffer.waiting
                raise TimedOut(
                    f"{self.address}: no {' or '.join(map(repr, wanted))} within {timeout:g} s "
                    f"({len(so_far)} bytes came: {so_far[:40]!r})",
                    so_far,
                )
            self._buffer.add(self._piece())
        return answer

    def drain(self) -> bytes:
        """Return and forget everything that waits, without waiting; a lost link has nothing."""
        taken = bytearray(self._buffer.clear())
        # a device that never stops sending must not keep us here
        while self._open and len(taken) < self._most and self._wait(write=False, seconds=0.0):
            try:
                taken += self._piece()
            except LinkLost:
                break
        return bytes(taken)

    def __enter__(self) -> Self:
        """Connect."""
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect."""
        self.close()

    def _piece(self) -> bytes:
        try:
            data = self._receive(_PIECE)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError as error:
            raise self._lost(_reason(error)) from error
        if not data:
            raise self._lost("the other side has closed it")
        return data

    def _lost(self, why: str) -> HardwareError:
        so_far = self._buffer.clear()
        self._drop()
        return LinkLost(f"{self.address}: link lost ({why}); {len(so_far)} bytes had come", so_far)

    def _require_open(self) -> None:
        if not self._open:
            raise LinkLost(f"{self.address}: not open; call open() first", self._buffer.waiting)

    def _drop(self) -> None:
        self._open = False
        try:
            self._release()
        except (OSError, ValueError):
            pass  # closing is the last resort; there is nothing left to do

    def _wait(self, write: bool, seconds: float) -> bool:
        """Wait until bytes can be moved, or something is wrong and the move will tell."""
        descriptor = self._descriptor()
        seconds = max(seconds, 0.0)
        if hasattr(select, "poll"):
            watch = select.poll()
            watch.register(descriptor, select.POLLOUT if write else select.POLLIN)
            # poll counts whole ms and would otherwise give up too early
            return bool(watch.poll(int(seconds * 1e3 + 0.999)))
        read, written, _ = select.select(
            [] if write else [descriptor], [descriptor] if write else [], [], seconds
        )
        return bool(read or written)


def _reason(error: OSError) -> str:
    return error.strerror or str(error) or type(error).__name__
