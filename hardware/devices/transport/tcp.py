"""TCP."""

from __future__ import annotations

import socket
from typing import final

from hardware.devices.transport.buffer import MOST
from hardware.devices.transport.descriptor_link import DescriptorLink

__all__ = ["TcpTransport"]


@final
class TcpTransport(DescriptorLink):
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
        link.setblocking(False)
        # small commands must not wait for each other
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            patience = max(int(1e3 * self._write_timeout), 1)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, patience)

    def _descriptor(self) -> int:
        return -1 if self._socket is None else self._socket.fileno()

    def _send(self, data: memoryview) -> int:
        if self._socket is None:
            raise BrokenPipeError("not connected")
        return self._socket.send(data)

    def _receive(self, most: int) -> bytes:
        return b"" if self._socket is None else self._socket.recv(most)

    def _release(self) -> None:
        link, self._socket = self._socket, None
        if link is not None:
            link.close()
