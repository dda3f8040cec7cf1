"""TCP."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import TypeVar, final

from hardware.devices.transport.buffer import MOST
from hardware.devices.transport.link import Link

_PIECE = 1 << 16
_T = TypeVar("_T")


@final
class TcpTransport(Link):
    """A TCP connection.

    A cable pulled without a goodbye is noticed within `write_timeout` of the next bytes sent where
    the operating system can tell (Linux), else as a time-out of the answer.

    Parameters
    ----------
    host : str
        Name or number.
    port : int
        Port; PI's controllers listen on 50000.
    connect_timeout : float
        Longest wait for the connection (s).
    write_timeout : float
        Longest wait for the other side to take bytes (s).
    most : int
        Bytes buffered without a terminator.
    """

    def __init__(
        self,
        host: str,
        port: int = 50000,
        connect_timeout: float = 2.0,
        write_timeout: float = 1.0,
        most: int = MOST,
    ) -> None:
        self._host = host
        self._port = port
        self._connect_timeout = connect_timeout
        self._socket: socket.socket | None = None
        super().__init__(write_timeout, most)

    @property
    def address(self) -> str:
        """Host and port."""
        return f"tcp {self._host}:{self._port}"

    def _connect(self) -> None:
        link = socket.create_connection((self._host, self._port), self._connect_timeout)
        self._socket = link
        # small commands must not wait for each other
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            patience = max(int(1e3 * self._write_timeout), 1)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, patience)

    def _put(self, data: memoryview, seconds: float) -> int:
        return self._within(seconds, lambda link: link.send(data)) or 0

    def _get(self, seconds: float) -> bytes:
        data = self._within(seconds, lambda link: link.recv(_PIECE))
        if data == b"":
            raise ConnectionResetError("the other side has closed it")
        return data or b""

    def _within(self, seconds: float, move: Callable[[socket.socket], _T]) -> _T | None:
        """Return what comes of it; None if nothing does within the time."""
        if self._socket is None:
            raise BrokenPipeError("not connected")
        self._socket.settimeout(seconds)
        try:
            return move(self._socket)
        except BlockingIOError:
            return None
        except TimeoutError as error:
            if error.errno is not None:
                raise  # that of the connection (TCP_USER_TIMEOUT), not the one asked for
            return None

    def _release(self) -> None:
        link, self._socket = self._socket, None
        if link is not None:
            link.close()
