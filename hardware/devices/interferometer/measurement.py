"""What streaming, triggered values and blocks have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import final

from bondgraph.support.errors import UnusableInput, real_number
from hardware.contracts import Chunk, Flag, Identity
from hardware.devices.interferometer.constants import Measure, Trigger
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.pump import drain
from hardware.devices.interferometer.quietly import quietly
from hardware.devices.interferometer.watch import MeasurementWatch
from hardware.errors import BeamLost, HardwareError, LinkLost, Overrun, ProtocolFault

EXTRAS = ("sin", "cos", "clock")
_LOOK_EVERY = 1.0
_WEAK = 0.3
_STAGE_2 = 0x02


class Measurement(ABC):
    """An acquisition of the interferometer.

    Parameters
    ----------
    device : Interferometer
        Opened and zeroed.
    rate : float
        Samples per second of the device's clock (Hz); with an external clock what is expected.
    trigger : Trigger
        Inputs it obeys.
    extras : sequence of str
        Channels beside ``x`` (m) and ``sample`` (the device's counter): ``"sin"``, ``"cos"`` (raw
        quadrature, counts), ``"clock"`` (the device's own time, s, from an arbitrary instant).
    filtered : bool
        Use the device's default filter; it delays the values.
    average : int
        Primary values that the device averages for one of its output; instead of `filtered`.
    patience : float
        Longest silence (s) before it counts as a fault.
    stop_on_beam_loss : bool
        Raise `BeamLost` at the first sample without a beam; else its samples are only flagged.
    stream : str
        Name of the stream.
    native : bool
        False drains by the loop in Python even where there is a compiler.
    """

    def __init__(
        self,
        device: Interferometer,
        rate: float,
        *,
        trigger: Trigger = Trigger.OFF,
        extras: Sequence[str] = (),
        filtered: bool = False,
        average: int = 1,
        patience: float = 2.0,
        stop_on_beam_loss: bool = True,
        stream: str = "interferometer",
        native: bool = True,
    ) -> None:
        unknown = [k for k in extras if k not in EXTRAS]
        if unknown:
            raise UnusableInput(f"interferometer: no channel {unknown[0]!r}; known: {EXTRAS}")
        if real_number("rate", rate) <= 0.0 or real_number("patience", patience) <= 0.0:
            raise UnusableInput("interferometer: rate and patience must be positive")
        if average < 1 or (average > 1 and filtered):
            raise UnusableInput("interferometer: average at least 1, and not with the filter")
        self.device = device
        self.rate = float(rate)
        self._trigger = trigger
        self._extras = tuple(dict.fromkeys(extras))
        self._filtered, self._average = filtered, average
        self._patience = patience
        self._stop_on_beam_loss = stop_on_beam_loss
        self.stream = stream
        self._native = native
        self._running = False
        self._complete = False
        self._watch = MeasurementWatch(stream, self._extras)
        self._condition = Flag.GOOD
        self._looked = float("-inf")
        self._silent = self._polled = 0.0
        self._told_losses = self._lost_before = False

    # ---- the contract

    @property
    def identity(self) -> Identity:
        """The device."""
        return self.device.identity

    @property
    def done(self) -> bool:
        """Whether all that was asked for has been handed out."""
        return self._complete

    @property
    def external_clock(self) -> bool:
        """Whether foreign edges clock the samples, so that there is no second clock."""
        return bool(self._trigger & (Trigger.CLOCK | Trigger.EVENT))

    @property
    def received(self) -> int:
        """Samples handed out so far."""
        return self._watch.received

    @final
    def try_settings(self) -> None:
        """Let the device take mode and rate without starting, before anything else moves.

        Raises
        ------
        UnusableInput
            It does not take them; what to change.
        LinkLost
            It is gone.
        """
        try:
            with self._carrying([]):
                self._set()
        except UnusableInput as error:
            clock = "edges as a clock, " if self.external_clock else ""
            raise UnusableInput(
                f"{self.stream}: the device does not take {clock}{type(self).__name__.lower()} at "
                f"{self.rate:g} Hz ({error}); see rate and clocked under [interferometer]"
            ) from None

    @final
    def kickoff(self) -> None:
        """Arm or start.

        Raises
        ------
        BeamLost
            If the device has no zero.
        UnusableInput, Overrun
            If it refuses the rate or the length; nothing is armed then.
        """
        device = self.device
        device.occupy(self)
        try:
            self._watch = MeasurementWatch(
                self.stream, self._extras, device.amplitude, device.stabilised
            )
            self._complete = self._told_losses = False
            self._lost_before = self._lost()
            self._set()
            self._arm()
            self.rate = device.true_rate(self.rate)
        except LinkLost as fault:
            device.release(self)
            raise device.gone(fault) from None
        except BaseException:
            device.release(self)
            raise
        self._running = True
        self._silent, self._polled = 0.0, device.clock.now()
        self._looked = float("-inf")

    @final
    def poll(self) -> Sequence[Chunk]:
        """Return what arrived since the last call.

        Raises
        ------
        BeamLost, Overrun, LinkLost, TimedOut
            With the chunks of this call as `partial`. After `Overrun` the measurement goes on;
            after the others `abort` is due.
        """
        if not self._running:
            if self._complete:
                return ()
            raise ProtocolFault(f"{self.stream}: poll before kickoff()")
        chunks: list[Chunk] = []
        with self._carrying(chunks):
            self._collect(chunks)
        self._judge(chunks)
        return chunks

    @final
    def finish(self) -> Sequence[Chunk]:
        """Stop the device in order and return the rest.

        Raises
        ------
        Overrun
            If the device lost samples and the counter did not tell where.
        """
        if not self._running:
            return ()
        chunks: list[Chunk] = []
        try:
            with self._carrying(chunks):
                self._end(chunks)
                lost = self._lost() and not self._lost_before
        finally:
            self._running = False
            self._complete = True
            self.device.release(self)
        unseen = lost and not self._watch.gaps and not self._told_losses
        self._judge(chunks)
        if unseen:
            raise Overrun(
                f"{self.stream}: the device says that values were lost, the sample counter does "
                "not tell where; measure again at a lower rate",
                chunks,
            )
        return chunks

    @final
    def abort(self) -> None:
        """Stop the device whatever its state; never raises, never hangs."""
        if self._running:
            self._running = False
            quietly(self._stop)
        self.device.release(self)

    # ---- what differs

    @abstractmethod
    def _set(self) -> None:
        """Set mode and rate; nothing starts."""

    @abstractmethod
    def _arm(self) -> None:
        """Start."""

    @abstractmethod
    def _collect(self, chunks: list[Chunk]) -> None:
        """Put what arrived behind `chunks`, also if it raises."""

    @abstractmethod
    def _end(self, chunks: list[Chunk]) -> None:
        """Stop and put the rest behind `chunks`."""

    @abstractmethod
    def _stop(self) -> None:
        """Stop at once."""

    # ---- common parts

    @contextmanager
    def _carrying(self, chunks: list[Chunk]) -> Iterator[None]:
        """Let errors carry what had arrived."""
        try:
            yield
        except LinkLost as fault:
            raise self.device.gone(fault).carrying(chunks) from None
        except HardwareError as fault:
            raise fault.carrying(chunks) from None

    def _flags(self, setting: str) -> Measure:
        """Set the averaging by a function of the library; return what a value consists of."""
        processing = Measure.FILTER_DEFAULT if self._filtered else Measure.FILTER_OFF
        if self._average > 1:
            processing = Measure.FILTER_USER
            self.device.library.call(setting, self.device.handle, _STAGE_2, 0, self._average)
        return self.device.measure_flags(self._extras, processing)

    def _take(self, count: int, chunks: list[Chunk], oldest: int | None = None) -> None:
        """Drain values, from the age `oldest` on, and put them behind `chunks`.

        An early end raises.
        """
        device = self.device
        values = drain(
            device.library, device.handle, count, self._watch.wanted,
            channel=device.channel, oldest=oldest, native=self._native,
        )  # fmt: skip
        if values.length.size:
            self._silent, self._polled = 0.0, self.device.clock.now()
        chunks += self._watch.chunks(values, self._conditions())
        if values.code:
            raise self.device.library.error(values.code, "IfmGetValues")

    def _conditions(self) -> Flag:
        """Return the flag for air, and for light where values have no amplitude, once a second."""
        device, now = self.device, self.device.clock.now()
        if now - self._looked >= _LOOK_EVERY and device.present:
            self._looked = now
            self._condition = device.environment().flag
            if device.amplitude == 0.0 and 0.0 < device.health().quality < _WEAK:
                self._condition |= Flag.LEVEL_LOW
        return self._condition

    def _lost(self) -> bool:
        """Return whether the device says that values were lost since the last zero."""
        return bool(self.device.library.call("IfmWasLostValues", self.device.handle))

    def _require_presence(self) -> None:
        if not self.device.present:
            raise self.device.gone()

    def _judge(self, chunks: list[Chunk]) -> None:
        """Raise for a lost beam or lost samples, with the chunks."""
        watch = self._watch
        serial = self.identity.serial
        if watch.beam_lost_at is not None:
            self.device.beam_lost()
            if self._stop_on_beam_loss:
                raise BeamLost(
                    f"{self.stream} {serial}: beam lost at sample {watch.beam_lost_at}; samples "
                    "from there on are off by unknown fringes; align, zero() and measure again",
                    chunks,
                )
        if watch.gaps:
            first, count = watch.gaps[0].first, sum(g.count for g in watch.gaps)
            watch.gaps.clear()
            self._told_losses = True
            raise Overrun(
                f"{self.stream} {serial}: {count} samples lost, the first is {first}; poll more "
                "often or lower the rate",
                chunks,
            )
