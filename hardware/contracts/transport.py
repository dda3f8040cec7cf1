"""A link that carries bytes."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class Transport(Protocol):
    """Bytes over TCP, a serial line or a pseudo-terminal."""

    @property
    def address(self) -> str:
        """Where it leads, for messages."""
        ...

    def open(self) -> None:
        """Connect; `LinkLost` if nobody is there."""
        ...

    def close(self) -> None:
        """Disconnect; never raises, never hangs, any number of times."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of it, or raise `LinkLost` or `TimedOut`."""
        ...

    def read_until(self, ends: bytes | tuple[bytes, ...], timeout: float) -> bytes:
        """Return bytes up to and with one of the terminators.

        Raises
        ------
        TimedOut
            With the bytes so far as `partial`; they stay in the buffer.
        LinkLost
            If the other side is gone.
        """
        ...

    def drain(self) -> bytes:
        """Return and forget everything that waits, without waiting."""
        ...
