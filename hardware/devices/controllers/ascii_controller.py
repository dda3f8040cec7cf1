"""A controller with an ASCII dialect as a raw output: one class for all of them."""

from __future__ import annotations

import math
import re
import threading
from typing import final

from hardware.contracts import Clock, Identity, Transport, WallClock
from hardware.devices.controllers.ascii_dialect import AsciiDialect
from hardware.devices.transport import back_in_step
from hardware.devices.walking import WalkToRest, walk
from hardware.envelope.limits import Envelope
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault, TimedOut

_SKIPPED = 8
"""Frames without the answer looked for, before it counts as nonsense."""


@final
class AsciiController:
    """One open-loop channel of an ASCII controller.

    Every command is followed by a question, so that an error is laid to the command that caused
    it and devices that do or do not acknowledge commands are served alike. After a late, partial
    or senseless answer the identity is asked for until it fits; else the link is given up.

    Parameters
    ----------
    dialect : AsciiDialect
        How it speaks.
    transport : Transport
        The line.
    clock : Clock, optional
        Time of the program.
    timeout : float
        Longest wait for an answer (s, real time).
    patience : float, optional
        Longest time to get back in step (s); by default three time-outs.
    safe : float
        Where the output rests (V).
    gentle : float
        Rate of going there on power-up (V/s).
    watchdog : bool
        Whether this device goes to its safe value when the program is gone; none is known to.
    """

    def __init__(
        self,
        dialect: AsciiDialect,
        transport: Transport,
        clock: Clock | None = None,
        timeout: float = 0.6,
        patience: float | None = None,
        safe: float = 0.0,
        gentle: float = 100.0,
        watchdog: bool = False,
    ) -> None:
        self._dialect = dialect
        self._transport = transport
        self._clock: Clock = WallClock() if clock is None else clock
        self._timeout = timeout
        self._patience = 3.0 * timeout if patience is None else patience
        self._safe = safe
        self._gentle = gentle
        self._way = WalkToRest(gentle)
        self.has_watchdog = watchdog
        self._identity: tuple[str, ...] = ()
        self._lock = threading.RLock()

    @property
    def identity(self) -> Identity:
        """The device, as far as the dialect tells."""
        if not self._identity:
            self.open()
        d = self._dialect
        serial = self._identity[1] if len(self._identity) > 1 else ""
        return Identity(d.maker, f"{d.model} ({self._identity[0]})", serial)

    @property
    def rest(self) -> float:
        """Where it stands after a power-up (V), for the guard."""
        return self._safe

    def open(self) -> None:
        """Connect and identify."""
        self._transport.open()
        self._transport.drain()
        try:
            self._identity = tuple(self._identify())
        except HardwareError:
            self.close()
            raise

    def keep_within(self, envelope: Envelope) -> None:
        """Take the limits of the guard for the way to safe at power-up."""
        self._way = WalkToRest.within(envelope, self._gentle)

    def power_up(self) -> None:
        """Connect where the link is not alive, take remote open-loop control, walk to safe.

        Raises
        ------
        ProtocolFault
            The device tells a voltage that is not allowed; nothing was put out.
        """
        self._revive()
        for command in self._dialect.prepare:
            self._exchange(command)
        stands = self._exchange("")
        self._way.require(stands, f"{self._transport.address}: stands at")
        walk(self.write, stands, self._safe, self._way, self._clock)

    def write(self, volts: float) -> None:
        """Set the voltage (V)."""
        if not math.isfinite(volts):
            raise LimitViolation(
                f"{self._transport.address}: {volts} V is no voltage; nothing was sent"
            )
        stands = self._exchange(self._dialect.set_voltage.format(volts=volts))
        allowed = self._dialect.echoes_setpoint
        if allowed is not None and abs(stands - volts) > allowed:
            raise ProtocolFault(
                f"{self._transport.address}: set to {volts:g} V but stands at {stands:g} V; is "
                "the channel under remote open-loop control?",
                stands,
            )

    def read(self) -> float | None:
        """Voltage (V) as the dialect's query gives it: the setpoint, or a measured one."""
        return self._exchange("")

    def limits(self) -> tuple[float, float] | None:
        """Return the limits set in the device (V); None where the dialect knows no query."""
        d = self._dialect
        if not (d.lowest and d.highest):
            return None
        low, high = (float(self._guarded(q, p)) for q, p in (d.lowest, d.highest))
        return low, high

    def close(self) -> None:
        """Hang up; the output keeps its voltage. Never raises and never hangs."""
        self._identity = ()
        self._transport.close()

    def _revive(self) -> None:
        """Open the link unless it answers."""
        if self._identity:
            try:
                self._exchange("")
                return
            except (LinkLost, TimedOut):
                self.close()
        self.open()

    def _exchange(self, command: str) -> float:
        """Send a command (or none) and ask for the voltage; its errors concern the command."""
        query, pattern = self._dialect.read_voltage, self._dialect.voltage_pattern
        return float(self._guarded(query, pattern, command))

    def _guarded(self, query: str, pattern: str, command: str = "") -> str:
        if not self._identity:
            raise LinkLost(f"{self._transport.address}: not open; call open() first")
        with self._lock:
            try:
                self._transport.drain()
                refusal, answer = self._converse(query, pattern, command)
                self._require_silence(query)
            except (TimedOut, ProtocolFault) as error:
                self._back_in_step(error)
                raise
        if refusal is not None:
            raise refusal
        return answer

    def _converse(
        self, query: str, pattern: str, command: str = ""
    ) -> tuple[HardwareError | None, str]:
        """Return a refusal on the way, if any, and the answer to the query."""
        if command:
            self._send(command)
        self._send(query)
        refusal: HardwareError | None = None
        frames: list[str] = []
        for _ in range(_SKIPPED):
            frame = self._frame((command, query))
            refused = self._refusal(frame, command or query)
            if refused is not None and not command:
                return refused, ""
            refusal = refusal or refused
            if found := re.search(pattern, frame):
                return refusal, found.group(1).strip()
            frames.append(frame)
        raise ProtocolFault(
            f"{self._transport.address}: {frames} are no answer to {query!r}", tuple(frames)
        )

    def _require_silence(self, query: str) -> None:
        """Refuse an answer behind which another one waits: one of them is not ours."""
        more = self._transport.drain()
        if self._dialect.answer_end in more:
            raise ProtocolFault(
                f"{self._transport.address}: two answers to {query!r}, the second is {more!r}", more
            )

    def _send(self, line: str) -> None:
        self._transport.write(line.encode("ascii") + self._dialect.command_end)

    def _frame(self, sent: tuple[str, ...] = ()) -> str:
        d = self._dialect
        data = self._transport.read_until(d.answer_end, self._timeout)
        frame = data.strip(d.framing).decode("ascii", "replace")
        if d.echo:
            for line in sent:
                if line and frame.lower().startswith(line.lower()):
                    frame = frame[len(line) :].strip("\r\n ")
                    break
        return frame

    def _refusal(self, frame: str, command: str) -> HardwareError | None:
        for pattern, limit in self._dialect.refusals:
            if re.search(pattern, frame):
                text = f"{self._transport.address}: refused {command!r} with {frame!r}"
                if limit:
                    return LimitViolation(f"{text}; nothing was put out", frame)
                return ProtocolFault(text, frame)
        return None

    def _identify(self) -> list[str]:
        parts = []
        for query, pattern in self._dialect.identity:
            refusal, answer = self._converse(query, pattern)
            if refusal is not None:
                raise refusal
            parts.append(answer)
        return parts

    def _back_in_step(self, error: HardwareError) -> None:
        """Get back in step, or give the link up."""
        query, pattern = self._dialect.identity[0]
        known = self._identity[0]

        def right(answer: bytes) -> bool:
            text = answer.strip(self._dialect.framing).decode("ascii", "replace")
            found = re.search(pattern, text) or re.search(pattern, text[len(query) :].strip())
            return found is not None and found.group(1).strip() == known

        back_in_step(
            self._transport, error, lambda: self._send(query), right, self._patience,
            self._dialect.answer_end, lambda: None, self.close,
        )  # fmt: skip
