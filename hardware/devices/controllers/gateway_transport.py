"""PIPython's gateways (socket, serial, USB, DLL) as a transport of ours."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, final

from hardware.devices.transport import Link

_CODEPAGE = "cp1252"
_LOOK = 5e-4


@final
class GatewayTransport(Link):
    """A link by a gateway of PIPython.

    What its ``PISocket`` (2.11) does: a closed socket is taken for silence (here it is looked at,
    and the link is lost), ``flush`` never returns on one (never called), ``close`` raises on one
    and leaves it open (completed), and connecting has no time-out (here it has).

    Parameters
    ----------
    connect : callable
        What makes a connected gateway, for example ``lambda: PISerial(path, 115200)`` or one of
        the USB or DLL gateways.
    address : str
        For messages.
    write_timeout : float
        Longest wait for the other side to take bytes (s).
    """

    def __init__(
        self,
        connect: Callable[[], Any],
        address: str = "PIPython gateway",
        write_timeout: float = 1.0,
    ) -> None:
        self._make = connect
        self._address = address
        self._gateway: Any = None
        super().__init__(write_timeout)

    @classmethod
    def by_pisocket(
        cls,
        host: str,
        port: int = 50000,
        connect_timeout: float = 2.0,
        write_timeout: float = 1.0,
    ) -> GatewayTransport:
        """Return a link by PIPython's own socket."""

        def connected() -> Any:
            from pipython.pidevice.interfaces.pisocket import PISocket

            gateway = PISocket(host, port, autoconnect=False)
            link = socket.create_connection((host, port), connect_timeout)
            link.setblocking(False)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            gateway._socket = link
            return gateway

        return cls(connected, f"PISocket {host}:{port}", write_timeout)

    @property
    def address(self) -> str:
        """Where it leads, for messages."""
        return self._address

    def _connect(self) -> None:
        self._gateway = self._make()
        self._gateway.settimeout(int(1e3 * self._write_timeout))

    def _put(self, data: memoryview, seconds: float) -> int:
        deadline = time.monotonic() + seconds
        while True:
            with suppress(BlockingIOError):
                self._gateway.send(bytes(data).decode(_CODEPAGE))
                return len(data)
            if time.monotonic() >= deadline:
                return 0
            time.sleep(_LOOK)

    def _get(self, seconds: float) -> bytes:
        deadline = time.monotonic() + seconds
        while not (piece := str(self._gateway.read())):
            if _hung_up(getattr(self._gateway, "_socket", None)):
                raise ConnectionResetError("the other side has closed it")
            if time.monotonic() >= deadline:
                return b""
            # the answers of the wire are in real time, also on a virtual bench
            time.sleep(_LOOK)
        return piece.encode(_CODEPAGE, "replace")

    def _release(self) -> None:
        gateway, self._gateway = self._gateway, None
        with suppress(Exception):
            gateway.close()
        link = getattr(gateway, "_socket", None)
        if link is not None:
            link.close()


def _hung_up(link: Any) -> bool:
    """Whether a socket was closed by the other side."""
    if not isinstance(link, socket.socket):
        return False
    try:
        return link.recv(1, socket.MSG_PEEK) == b""
    except BlockingIOError:
        return False
