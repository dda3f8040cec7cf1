"""Bytes that have arrived and wait for their terminator; never more than a fixed number."""

from __future__ import annotations

from typing import final

from hardware.errors import ProtocolFault

MOST = 1 << 20
"""Bytes buffered by default."""

_SHOWN = 64


@final
class ReceiveBuffer:
    """Bytes in their order.

    Parameters
    ----------
    most : int
        Bytes held; a device that sends more without a terminator is at fault.
    address : str
        Where they come from, for messages.
    """

    def __init__(self, most: int = MOST, address: str = "link") -> None:
        self._most = most
        self._address = address
        self._bytes = bytearray()
        self._searched = 0

    @property
    def waiting(self) -> bytes:
        """What waits, without taking it."""
        return bytes(self._bytes)

    def add(self, data: bytes) -> None:
        """Append what arrived.

        Raises
        ------
        ProtocolFault
            If more waits than allowed; all of it is forgotten but a beginning, in `partial`.
        """
        self._bytes += data
        if len(self._bytes) > self._most:
            start = bytes(self._bytes[:_SHOWN])
            count = len(self._bytes)
            self.clear()
            raise ProtocolFault(
                f"{self._address}: {count} bytes without an expected terminator, starting "
                f"{start!r}; check baud rate and protocol",
                start,
            )

    def take(self, ends: tuple[bytes, ...]) -> bytes | None:
        """Take bytes up to and with the first of the terminators; None if there is none yet."""
        found = [
            (at, at + len(end))
            for end in ends
            if (at := self._bytes.find(end, max(self._searched - len(end) + 1, 0))) >= 0
        ]
        if not found:
            self._searched = len(self._bytes)
            return None
        stop = min(found)[1]
        taken = bytes(self._bytes[:stop])
        del self._bytes[:stop]
        self._searched = 0
        return taken

    def clear(self) -> bytes:
        """Take everything."""
        taken = bytes(self._bytes)
        self._bytes.clear()
        self._searched = 0
        return taken
