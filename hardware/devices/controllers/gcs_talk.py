"""Talking GCS 2: commands that are checked, questions that are answered, over any transport."""

from __future__ import annotations

from typing import Protocol, final, runtime_checkable

from hardware.contracts import Transport
from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.controllers.gcs_step import InStep, OutOfStep
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut

__all__ = ["CODEPAGE", "GcsTalk", "OwnGcsTalk", "checked_identity", "error_number"]

CODEPAGE = "cp1252"
_MOST = 1 << 23


@runtime_checkable
class GcsTalk(Protocol):
    """A conversation with a GCS controller; after every call the two are in step, or it is over.

    All methods raise `LinkLost` (the conversation is over), `TimedOut` (this call failed, the next
    one is fine), `LimitViolation`, `Overrun` or `ProtocolFault` (the controller refused, with its
    number as `partial`, or said nonsense).
    """

    @property
    def address(self) -> str:
        """With whom."""
        ...

    def open(self) -> str:
        """Connect; return the answer to ``*IDN?``."""
        ...

    def send(self, command: str) -> None:
        """Send a command and ask for its error."""
        ...

    def ask(self, query: str) -> str:
        """Return the answer to a question; lines without their ends, joined by LF."""
        ...

    def code(self, number: int, answered: bool = True) -> str:
        """Send one of the single characters (5, 7, 9, 24), which act at once."""
        ...

    def close(self) -> None:
        """Hang up; never raises and never hangs."""
        ...


@final
class OwnGcsTalk:
    """The conversation in our own words.

    Lines end with LF; in an answer of several lines all but the last have a space before it. Every
    command and every answer is followed by ``ERR?``. After an answer that came late, in part or as
    nonsense the link is drained and the identity asked for until it fits; if it does not within
    `patience`, the link is given up.

    Parameters
    ----------
    transport : Transport
        TCP or serial.
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
        patience = 3.0 * timeout if patience is None else patience
        self._step = InStep(TransportWire(transport), timeout, patience)

    @property
    def address(self) -> str:
        """With whom."""
        return self._transport.address

    def open(self) -> str:
        """Connect; return the answer to ``*IDN?``."""
        self._transport.open()
        self._transport.drain()
        try:
            self._write("*IDN?")
            line = self._transport.read_until(b"\n", self._timeout)
            identity = checked_identity(line, self.address)
        except HardwareError:
            self.close()
            raise
        self._step.identity = line.strip()
        # an old error must not be laid to the next command
        self._step.run("ERR?", lambda: self._number("ERR?"))
        return identity

    def send(self, command: str) -> None:
        """Send a command and ask for its error."""

        def exchange() -> int:
            self._transport.drain()
            self._write(command)
            return self._number(command)

        self._refuse(self._step.run(command, exchange), command)

    def ask(self, query: str) -> str:
        """Return the answer to a question; lines without their ends, joined by LF."""

        def exchange() -> tuple[str, int]:
            self._transport.drain()
            self._write(query)
            return self._answer(), self._number(query)

        answer, number = self._step.run(query, exchange)
        self._refuse(number, query)
        return answer

    def code(self, number: int, answered: bool = True) -> str:
        """Send one of the single characters (5, 7, 9, 24), which act at once."""
        name = f"#{number}"

        def exchange() -> tuple[str, int]:
            self._transport.drain()
            self._transport.write(bytes((number,)))
            return (self._answer(), self._number(name)) if answered else ("", 0)

        answer, error = self._step.run(name, exchange)
        self._refuse(error, name)
        return answer

    def close(self) -> None:
        """Hang up; never raises and never hangs."""
        self._transport.close()

    def _write(self, line: str) -> None:
        self._transport.write(f"{line}\n".encode(CODEPAGE))

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
        return "\n".join(line.decode(CODEPAGE, "replace").strip("\r\n ") for line in lines)

    def _number(self, command: str) -> int:
        self._write("ERR?")
        return error_number(self._answer(), command, self.address)

    def _refuse(self, number: int, command: str) -> None:
        if number:
            raise device_error(number, command, self.address)


@final
class TransportWire:
    """Lines over a transport."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    @property
    def address(self) -> str:
        """Where it leads."""
        return self._transport.address

    def send_line(self, line: str) -> None:
        """Send a line."""
        self._transport.write(f"{line}\n".encode(CODEPAGE))

    def line(self, seconds: float) -> bytes | None:
        """Return the next line; None if none comes in time."""
        try:
            return self._transport.read_until(b"\n", seconds)
        except TimedOut:
            return None

    def drain(self) -> None:
        """Forget what waits."""
        self._transport.drain()

    def close(self) -> None:
        """Close it."""
        self._transport.close()


def checked_identity(line: bytes, address: str) -> str:
    """Return the answer to ``*IDN?`` if it can be one: maker, model, serial number, firmware."""
    identity = line.decode(CODEPAGE, "replace").strip()
    if identity.count(",") < 2:
        raise ProtocolFault(
            f"{address}: {identity[:60]!r} is no answer to *IDN?; is it a GCS controller, and do "
            "the settings of the line fit?",
            line,
        )
    return identity


def error_number(answer: str, command: str, address: str) -> int:
    """Return the number answered to ``ERR?``; anything else belongs to another question."""
    try:
        return int(answer)
    except ValueError:
        raise OutOfStep(
            f"{address}: {answer[:40]!r} is no answer to ERR? after {command[:40]!r}", answer
        ) from None
