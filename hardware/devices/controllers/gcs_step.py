"""Staying in step with a GCS controller: after every exchange the next answer is the right one."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol, TypeVar, final

from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.transport import resynchronise
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut

__all__ = ["InStep", "OutOfStep", "Wire"]

_T = TypeVar("_T")


class OutOfStep(ProtocolFault):
    """An answer that belongs to another question, or to none."""


class Wire(Protocol):
    """Lines to and from a controller, whoever carries them."""

    @property
    def address(self) -> str:
        """Where it leads."""
        ...

    def send_line(self, line: str) -> None:
        """Send a line; its end is added."""
        ...

    def line(self, seconds: float) -> bytes | None:
        """Return the next line with its end; None if none comes in time (s)."""
        ...

    def drain(self) -> None:
        """Forget what waits."""
        ...

    def close(self) -> None:
        """Close it; never raises and never hangs."""
        ...


@final
class InStep:
    """Exchanges after which both sides are in step, or the link is closed.

    Parameters
    ----------
    wire : Wire
        The link.
    timeout : float
        Longest wait for a line (s).
    patience : float
        Longest time to get back in step (s).
    """

    def __init__(self, wire: Wire, timeout: float, patience: float) -> None:
        self._wire = wire
        self._timeout = timeout
        self._patience = patience
        self._lock = threading.RLock()
        self.identity = b""
        """Answer to ``*IDN?``, by which the controller is known again."""

    def run(self, command: str, exchange: Callable[[], _T]) -> _T:
        """Return what `exchange` does, undisturbed by other threads; errors leave us in step.

        Raises
        ------
        TimedOut, ProtocolFault
            As `exchange` raises them, once both sides are in step again.
        LimitViolation, Overrun
            And the like, if no answer came because the controller had refused.
        LinkLost
            If the link is gone, or was closed because the sides do not find together.
        """
        with self._lock:
            try:
                return exchange()
            except (TimedOut, ProtocolFault) as error:
                if isinstance(error.partial, int):
                    raise  # the controller's own number: an answer in its place
                number = self._back(error, int(command.upper() == "*IDN?"))
                if number:
                    raise device_error(number, command, self._wire.address) from error
                raise

    def _back(self, error: HardwareError, owed: int) -> int:
        """Get back in step; the error number that the controller had kept."""
        wire = self._wire
        try:
            wire.drain()
            if resynchronise(
                ask=lambda: wire.send_line("*IDN?"),
                receive=wire.line,
                right=lambda answer: answer.strip() == self.identity,
                patience=self._patience,
                owed=owed,
            ):
                wire.send_line("ERR?")
                return int(wire.line(self._timeout) or b"silence")
        except (TimedOut, ProtocolFault, ValueError):
            pass
        except LinkLost as lost:
            raise lost.carrying(error.partial) from error
        wire.close()
        raise LinkLost(
            f"{wire.address}: out of step and the identity does not come within "
            f"{self._patience:g} s, so the link is closed (began with: {error}); check the device "
            "and open the link again",
            error.partial,
        ) from error
