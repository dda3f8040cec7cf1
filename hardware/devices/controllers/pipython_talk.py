"""The same conversation by PI's own PIPython, with its faults wrapped.

What PIPython 2.11 does, and what is made of it here:

- A late answer meets the next question: ``ValueError`` from the formatting of its own message. Here
  both sides get back in step, then `OutOfStep` (a `ProtocolFault`) is raised.
- A closed socket is reported as time-out -7. Here the link is tried; `LinkLost` if it is gone.
- Its ``PISocket.flush`` never returns on a closed socket, ``close`` raises on one and leaves it
  open, connecting has no time-out. The first is never called, the second is completed; the third
  does not concern the default, which lets PIPython speak over our own transport.
- An error within ``ReadGCSCommand`` leaves its error check switched off. Here it is restored.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, final

from hardware.contracts import Transport
from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.controllers.gcs_step import InStep, OutOfStep
from hardware.devices.controllers.gcs_talk import CODEPAGE, checked_identity
from hardware.devices.controllers.pipython_gateway import GatewayWire, TransportGateway
from hardware.errors import DriverMissing, HardwareError, LinkLost, TimedOut

__all__ = ["PIPythonTalk"]

_T = TypeVar("_T")
_COM_TIMEOUT = -7
_UNEXPECTED = -1004


@final
class PIPythonTalk:
    """A conversation by PIPython.

    Parameters
    ----------
    gateway : Transport or callable
        A transport of ours; or what makes one of PIPython's connected gateways, for example
        ``lambda: PISocket(host)`` or one of its USB or DLL gateways.
    timeout : float
        Longest silence in an answer (s, real time).
    patience : float, optional
        Longest time to get back in step (s); by default three time-outs.
    address : str
        For messages, where the gateway is PIPython's.
    """

    def __init__(
        self,
        gateway: Transport | Callable[[], Any],
        timeout: float = 1.0,
        patience: float | None = None,
        address: str = "",
    ) -> None:
        if isinstance(gateway, Transport):
            self._make: Callable[[], Any] = TransportGateway(gateway).connected_self
            self._address = gateway.address
        else:
            self._make = gateway
            self._address = address or "PIPython gateway"
        self._timeout = timeout
        self._patience = 3.0 * timeout if patience is None else patience
        self._device: Any = None
        self._gateway: Any = None
        self._step: InStep | None = None

    @classmethod
    def by_pisocket(
        cls, host: str, port: int = 50000, timeout: float = 1.0, patience: float | None = None
    ) -> PIPythonTalk:
        """Return a conversation by PIPython's own socket; connecting may take minutes to fail."""

        def connected() -> Any:
            try:
                from pipython.pidevice.interfaces.pisocket import PISocket
            except ImportError as error:
                raise _missing(f"PISocket {host}:{port}") from error
            gateway = PISocket(host, port, autoconnect=False)
            try:
                gateway.ConnectTCPIP(host, port)
            except OSError:
                _close_socket(gateway)
                raise
            return gateway

        return cls(connected, timeout, patience, f"PISocket {host}:{port}")

    @property
    def address(self) -> str:
        """With whom."""
        return self._address

    def open(self) -> str:
        """Connect; return the answer to ``*IDN?``."""
        if self._device is not None:
            self.close()
        try:
            from pipython.pidevice import GCS2Device
        except ImportError as error:
            raise _missing(self._address) from error
        try:
            self._gateway = self._make()
            self._gateway.settimeout(int(1e3 * self._timeout))
            self._device = GCS2Device(gateway=self._gateway)
        except OSError as error:
            self.close()
            raise LinkLost(f"{self._address}: cannot connect ({error}); check cable") from error
        wire = GatewayWire(self._gateway, self._address, self.close)
        self._step = InStep(wire, self._timeout, self._patience)
        wire.drain()
        try:
            answer = self._wrapped("*IDN?", lambda: self._unchecked("*IDN?"))
            identity = checked_identity(answer.encode(CODEPAGE, "replace"), self._address)
            self._wrapped("ERR?", lambda: self._unchecked("ERR?"))
        except HardwareError:
            self.close()
            raise
        self._step.identity = answer.encode(CODEPAGE, "replace").strip()
        return identity

    def send(self, command: str) -> None:
        """Send a command and ask for its error."""
        self._run(command, lambda: self._device.send(command))

    def ask(self, query: str) -> str:
        """Return the answer to a question; lines without their ends, joined by LF."""
        answer = str(self._run(query, lambda: self._device.read(query)))
        return "\n".join(line.strip("\r ") for line in answer.rstrip("\n").split("\n"))

    def code(self, number: int, answered: bool = True) -> str:
        """Send one of the single characters (5, 7, 9, 24), which act at once."""
        if answered:
            return str(self._run(f"#{number}", lambda: self._device.read(chr(number)))).strip()
        self._run(f"#{number}", lambda: self._gateway.send(chr(number)))
        return ""

    def close(self) -> None:
        """Hang up; never raises and never hangs."""
        gateway, self._gateway, self._device = self._gateway, None, None
        if gateway is None:
            return
        try:
            gateway.close()
        except Exception:  # whatever it raises, the link is to be closed
            pass
        _close_socket(gateway)

    def _unchecked(self, query: str) -> str:
        device = self._device
        try:
            return str(device.ReadGCSCommand(query))
        finally:
            device.errcheck = True

    def _run(self, command: str, exchange: Callable[[], _T]) -> _T:
        if self._device is None or self._step is None:
            raise LinkLost(f"{self._address}: not open; call open() first")
        return self._step.run(command, lambda: self._wrapped(command, exchange))

    def _wrapped(self, command: str, exchange: Callable[[], _T]) -> _T:
        """Do it, and turn what PIPython raises into our errors."""
        from pipython import GCSError

        try:
            return exchange()
        except GCSError as error:
            raise self._translated(error, command) from error
        except BlockingIOError as error:
            raise TimedOut(f"{self._address}: {command[:40]!r} not taken by the link") from error
        except OSError as error:
            self.close()
            raise LinkLost(f"{self._address}: link lost ({error})") from error
        except (ValueError, TypeError, IndexError, KeyError) as error:
            raise OutOfStep(
                f"{self._address}: PIPython got an answer to {command[:40]!r} that it cannot read "
                f"({type(error).__name__}: {error})"
            ) from error

    def _translated(self, error: Any, command: str) -> HardwareError:
        number = int(error.val)
        if number == _COM_TIMEOUT:
            return TimedOut(
                f"{self._address}: no whole answer to {command[:40]!r} within {self._timeout:g} s"
            )
        if number == _UNEXPECTED:
            return OutOfStep(f"{self._address}: {error}")
        if number < 0:
            self.close()
            return LinkLost(f"{self._address}: PIPython lost the link ({error})")
        return device_error(number, command, self._address)


def _close_socket(gateway: Any) -> None:
    """Close what PISocket leaves open when it fails."""
    socket = getattr(gateway, "_socket", None)
    if socket is not None:
        socket.close()


def _missing(address: str) -> DriverMissing:
    return DriverMissing(f"{address}: needs PIPython; pip install 'bondsight[bench]'")
