"""Talking GCS 2: commands that are checked, questions that are answered, over any transport."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar, final

from hardware.contracts import Transport
from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.transport import back_in_step
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut

_CODEPAGE = "cp1252"
_MOST = 1 << 23
_T = TypeVar("_T")


class OutOfStep(ProtocolFault):
    """An answer that belongs to another question, or to none."""


@final
class GcsTalk:
    """A conversation with a GCS controller; after every call the two are in step, or it is over.

    Lines end with LF; in an answer of several lines all but the last have a space before it. Every
    command and every answer is followed by ``ERR?``. After an answer that came late, in part or as
    nonsense the link is drained and the identity asked for until it fits; if it does not within
    `patience`, the link is given up.

    All methods raise `LinkLost` (the conversation is over), `TimedOut` (this call failed, the next
    one is fine), `LimitViolation`, `Overrun` or `ProtocolFault` (the controller refused, with its
    number as `partial`, or said nonsense).

    Parameters
    ----------
    transport : Transport
        TCP, serial, or a gateway of PIPython.
    timeout : float
        Longest wait for a line of an answer (s, real time).
    patience : float, optional
        Longest time to get back in step (s); by default three time-outs.
    """

    def __init__(
        self, transport: Transport, timeout: float = 1.0, patience: float | None = None
    ) -> None:
        self._transport = transport
        self._timeout = timeout
        self._patience = 3.0 * timeout if patience is None else patience
        self._lock = threading.RLock()
        self._identity = b""

    @property
    def address(self) -> str:
        """With whom."""
        return self._transport.address

    def open(self) -> str:
        """Connect; return the answer to ``*IDN?``. After an error the link is closed."""
        self._transport.open()
        self._transport.drain()
        try:
            self._write("*IDN?")
            line = self._transport.read_until(b"\n", self._timeout)
            identity = _checked_identity(line, self.address)
            self._identity = line.strip()
            # an old error must not be laid to the next command
            self._in_step("ERR?", lambda: self._number("ERR?"))
        except HardwareError:
            self.close()
            raise
        return identity

    def send(self, command: str) -> None:
        """Send a command and ask for its error."""

        def exchange() -> tuple[str, int]:
            self._write(command)
            return "", self._number(command)

        self._checked(command, exchange)

    def ask(self, query: str) -> str:
        """Return the answer to a question; lines without their ends, joined by LF."""

        def exchange() -> tuple[str, int]:
            self._write(query)
            return self._answer(), self._number(query)

        return self._checked(query, exchange)

    def code(self, number: int, answered: bool = True) -> str:
        """Send one of the single characters (5, 7, 9, 24), which act at once."""
        name = f"#{number}"

        def exchange() -> tuple[str, int]:
            self._transport.write(bytes((number,)))
            return (self._answer(), self._number(name)) if answered else ("", 0)

        return self._checked(name, exchange)

    def close(self) -> None:
        """Hang up; never raises and never hangs."""
        self._transport.close()

    def _checked(self, command: str, exchange: Callable[[], tuple[str, int]]) -> str:
        """Return the answer of an exchange, or raise the error that the controller tells."""

        def fresh() -> tuple[str, int]:
            self._transport.drain()
            return exchange()

        answer, number = self._in_step(command, fresh)
        if number:
            raise device_error(number, command, self.address)
        return answer

    def _in_step(self, command: str, exchange: Callable[[], _T]) -> _T:
        """Return what `exchange` does, undisturbed by other threads; errors leave us in step."""
        with self._lock:
            try:
                return exchange()
            except (TimedOut, ProtocolFault) as error:
                number = self._back(error, int(command.upper() == "*IDN?"))
                if number:
                    # no answer came because the controller had refused
                    raise device_error(number, command, self.address) from error
                raise

    def _back(self, error: HardwareError, owed: int) -> int:
        """Get back in step; the error number that the controller had kept."""
        return back_in_step(
            self._transport, error, lambda: self._write("*IDN?"), self._is_identity,
            self._patience, b"\n", self._kept, self.close, owed,
        )  # fmt: skip

    def _is_identity(self, answer: bytes) -> bool:
        return answer.strip() == self._identity

    def _kept(self) -> int:
        self._write("ERR?")
        return int(self._transport.read_until(b"\n", self._timeout))

    def _write(self, line: str) -> None:
        self._transport.write(f"{line}\n".encode(_CODEPAGE))

    def _answer(self) -> str:
        lines: list[bytes] = []
        size = 0
        while not lines or lines[-1].endswith(b" \n"):
            try:
                lines.append(self._transport.read_until(b"\n", self._timeout))
            except (TimedOut, LinkLost) as error:
                raise error.carrying(b"".join(lines) + (error.partial or b"")) from None
            size += len(lines[-1])
            if size > _MOST:
                raise OutOfStep(f"{self.address}: an answer of more than {_MOST} bytes")
        return "\n".join(line.decode(_CODEPAGE, "replace").strip("\r\n ") for line in lines)

    def _number(self, command: str) -> int:
        """Return the number answered to ``ERR?``; anything else belongs to another question."""
        self._write("ERR?")
        answer = self._answer()
        try:
            return int(answer)
        except ValueError:
            raise OutOfStep(
                f"{self.address}: {answer[:40]!r} is no answer to ERR? after {command[:40]!r}",
                answer,
            ) from None


def _checked_identity(line: bytes, address: str) -> str:
    """Return the answer to ``*IDN?`` if it can be one: maker, model, serial number, firmware."""
    identity = line.decode(_CODEPAGE, "replace").strip()
    if identity.count(",") < 2:
        raise ProtocolFault(
            f"{address}: {identity[:60]!r} is no answer to *IDN?; is it a GCS controller, and do "
            "the settings of the line fit?",
            line,
        )
    return identity
