"""Between PIPython and us: our transports as its gateways, its gateways as lines."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from typing import Any, final

from hardware.contracts import Transport
from hardware.devices.controllers.gcs_talk import CODEPAGE
from hardware.errors import LinkLost, TimedOut

__all__ = ["GatewayWire", "TransportGateway"]

_LOOK = 0.002


@final
class TransportGateway:
    """A gateway as PIPython wants it, over a transport of ours."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._milliseconds = 1000
        self.connected = False
        self.connectionid = 0

    def connected_self(self) -> TransportGateway:
        """Connect."""
        self._transport.open()
        self.connected = True
        return self

    @property
    def timeout(self) -> int:
        """Time-out (ms)."""
        return self._milliseconds

    def settimeout(self, value: int) -> None:
        """Set the time-out (ms)."""
        self._milliseconds = value

    def send(self, msg: str) -> None:
        """Send."""
        self._transport.write(msg.encode(CODEPAGE))

    def read(self) -> str:
        """Return what is there; waits for a moment, since PIPython asks in a tight loop."""
        try:
            data = self._transport.read_until(b"\n", _LOOK)
        except TimedOut:
            data = self._transport.drain()
        return data.decode(CODEPAGE, "ignore")

    def flush(self) -> None:
        """Forget what waits."""
        self._transport.drain()

    def close(self) -> None:
        """Disconnect."""
        self.connected = False
        self._transport.close()

    def unload(self) -> None:
        """Disconnect."""
        self.close()


@final
class GatewayWire:
    """Lines over a gateway of PIPython, for getting back in step."""

    def __init__(self, gateway: Any, address: str, close: Callable[[], None]) -> None:
        self._gateway = gateway
        self._address = address
        self._close = close
        self._waiting = b""

    @property
    def address(self) -> str:
        """Where it leads."""
        return self._address

    def send_line(self, line: str) -> None:
        """Send a line."""
        try:
            self._gateway.send(f"{line}\n")
        except OSError as error:
            self._close()
            raise LinkLost(f"{self._address}: link lost ({error})") from error

    def line(self, seconds: float) -> bytes | None:
        """Return the next line; None if none comes in time."""
        deadline = time.monotonic() + seconds
        while b"\n" not in self._waiting:
            piece = self._read()
            if not piece:
                if time.monotonic() >= deadline:
                    return None
                # the answers of the wire are in real time, also on a virtual bench
                time.sleep(_LOOK / 4.0)
            self._waiting += piece.encode(CODEPAGE, "replace")
        line, _, self._waiting = self._waiting.partition(b"\n")
        return line + b"\n"

    def _read(self) -> str:
        try:
            return str(self._gateway.read())
        except OSError as error:
            self._close()
            raise LinkLost(f"{self._address}: link lost ({error})") from error

    def drain(self) -> None:
        """Forget what waits; its own flush would not come back from a closed socket."""
        self._waiting = b""
        for _ in range(1000):
            if not self._read():
                break
        if _hung_up(getattr(self._gateway, "_socket", None)):
            self._close()
            raise LinkLost(f"{self._address}: link lost (the other side has closed it)")

    def close(self) -> None:
        """Close it."""
        self._close()


def _hung_up(link: Any) -> bool:
    """Whether a socket was closed by the other side; PIPython takes that for silence."""
    if not isinstance(link, socket.socket):
        return False
    try:
        return link.recv(1, socket.MSG_PEEK) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True
