"""Registers at the other end of a TCP connection: those of a simulated card.

A request is the number of accesses (16 bits) and 8 bytes for each: kind, BAR, offset (16 bits),
value (32 bits); the answer is the number again and one 32 bit word for each. To a second program
that drives the card the answer is 0xFFFF and the port of the first one. All little-endian.
"""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Sequence
from typing import final

from hardware.devices.daq.registers import Access, Registers
from hardware.errors import LinkLost, ProtocolFault, TimedOut

_HEAD = struct.Struct("<H")
_ACCESS = struct.Struct("<BBHI")
_PORT = struct.Struct("<I")
_REFUSED = 0xFFFF
_REFUSED_HEAD = _HEAD.pack(_REFUSED)


@final
class SocketRegisters(Registers):
    """Registers by TCP.

    Parameters
    ----------
    address : str
        ``"host:port"``.
    timeout : float
        Longest wait for an answer (s).

    Raises
    ------
    LinkLost
        Nobody is there.
    """

    def __init__(self, address: str, timeout: float = 1.0) -> None:
        self._where = address
        self._timeout = timeout
        self._lock = threading.Lock()
        self._interrupted = False
        self._socket: socket.socket | None = self._connected()

    @property
    def address(self) -> str:
        """Where they are, for messages."""
        return f"registers at {self._where}"

    def batch(self, accesses: Sequence[Access]) -> list[int]:
        """Do several in one message; return what was read, 0 for a write.

        Raises
        ------
        TimedOut
            No answer; the link is closed, because what would come later belongs to nothing.
        LinkLost
            The other side is gone, or another program drives the card.
        """
        count = len(accesses)
        if count >= _REFUSED:
            raise ProtocolFault(f"{self.address}: {count} accesses in one message; send fewer")
        request = _HEAD.pack(count) + b"".join([_ACCESS.pack(*a) for a in accesses])
        with self._lock:
            answer = self._exchange(request, 2 + 4 * count)
        head = _HEAD.unpack_from(answer)[0]
        if head == _REFUSED:
            self.close()
            port = _PORT.unpack_from(answer, 2)[0]
            raise LinkLost(
                f"{self.address}: another program drives this card (connected from port {port}); "
                "end it first; the link is closed"
            )
        if head != count:
            self.close()
            raise ProtocolFault(f"{self.address}: answer to another request; the link is closed")
        return list(struct.unpack_from(f"<{count}I", answer, 2))

    def close(self) -> None:
        """Disconnect."""
        self._interrupted = False
        self._drop()

    def _drop(self) -> None:
        link, self._socket = self._socket, None
        if link is not None:
            link.close()

    def _connected(self) -> socket.socket:
        host, _, port = self._where.rpartition(":")
        try:
            link = socket.create_connection((host, int(port)), timeout=self._timeout)
        except (OSError, ValueError) as error:
            raise LinkLost(
                f"{self.address}: no connection ({error}); is `bondsight bench serve` running?"
            ) from error
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return link

    def _exchange(self, request: bytes, length: int) -> bytes:
        if self._interrupted:
            # Ctrl-C in the middle of an exchange: its rest must not be taken for this answer
            self._interrupted = False
            self._socket = self._connected()
        link = self._socket
        if link is None:
            raise LinkLost(f"{self.address}: the link is closed; open it again")
        try:
            link.sendall(request)
            answer = b""
            while len(answer) < length:
                piece = link.recv(length - len(answer))
                if not piece:
                    raise ConnectionResetError("closed by the other side")
                answer += piece
                if answer[:2] == _REFUSED_HEAD:
                    length = _HEAD.size + _PORT.size
            return answer
        except TimeoutError as error:
            self.close()
            raise TimedOut(
                f"{self.address}: no answer within {self._timeout:g} s; the link is closed"
            ) from error
        except OSError as error:
            self.close()
            raise LinkLost(f"{self.address}: link lost ({error})") from error
        except BaseException:
            self._drop()
            self._interrupted = True
            raise
