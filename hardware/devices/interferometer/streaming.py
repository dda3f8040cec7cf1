"""Values as they come: on the device's clock, or one for every edge of a foreign one."""

from __future__ import annotations

from typing import Any, Final, final

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk
from hardware.devices.interferometer.constants import Trigger, trigger_mode
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.measurement import Measurement
from hardware.errors import LinkLost, TimedOut

NORMAL_RATE: Final = 16_000.0
"""Largest rate of primary values in the thesis' normal mode (Hz)."""

_BATCH = 65_536


class _Flowing(Measurement):
    """Values are drained while they come; memory holds at most one batch."""

    def __init__(
        self,
        device: Interferometer,
        rate: float,
        samples: int | None,
        trigger: Trigger,
        options: dict[str, Any],
    ) -> None:
        super().__init__(device, rate, trigger=trigger, **options)
        if samples is not None and samples < 1:
            raise UnusableInput(f"interferometer: samples = {samples}; ask for at least one")
        self._samples = samples

    @final
    def _set(self) -> None:
        call, d = self.device.library.call, self.device.handle
        call("IfmSetTrigger", d, self._trigger)
        flags = self._flags("IfmSetFilter")
        call("IfmSetMeasurement", d, flags, self.rate)

    @final
    def _arm(self) -> None:
        call, d = self.device.library.call, self.device.handle
        call("IfmClearBuffers", d)
        call("IfmStart", d)

    @final
    def _collect(self, chunks: list[Chunk]) -> None:
        device = self.device
        count = int(device.library.call("IfmValueCount", device.handle))
        if self._samples is not None:
            count = min(count, self._samples - self.received)
        if count:
            self._take(min(count, _BATCH), chunks)
        self._require_presence()
        if self._samples is not None and self.received >= self._samples:
            self._complete = True
            self._stop()
        elif not count:
            self._silence()

    def _silence(self) -> None:
        """Raise if nothing came for too long; who is to blame depends on the clock.

        A long time without a poll counts little, since nobody could have heard anything then.
        """
        now, limit = self.device.clock.now(), max(self._patience, 10.0 / self.rate)
        self._silent += min(now - self._polled, 0.25 * limit)
        self._polled = now
        silent = self._silent
        if silent <= limit:
            return
        waiting = bool(self._trigger & Trigger.START) and not self.received
        if waiting or self.external_clock:
            self._stop()
            what = "start trigger" if waiting else "clock edge"
            raise TimedOut(
                f"{self.stream} {self.identity.serial}: no {what} within {silent:.3g} s after "
                f"{self.received} samples; check cable and edge"
            )
        raise LinkLost(
            f"{self.stream} {self.identity.serial}: no value for {silent:.3g} s at "
            f"{self.rate:g} Hz; check cable and supply, reopen(), and zero() again"
        )

    @final
    def _end(self, chunks: list[Chunk]) -> None:
        if self._complete:
            return
        self.device.library.call("IfmStop", self.device.handle)
        while not self._complete:
            before = self.received
            self._collect(chunks)
            if self.received == before:
                break
        self.device.library.call("IfmClearBuffers", self.device.handle)

    @final
    def _stop(self) -> None:
        self.device.library.call("IfmStop", self.device.handle)
        self.device.library.call("IfmClearBuffers", self.device.handle)


@final
class Streaming(_Flowing):
    """Normal mode: a continuous stream on the device's own clock.

    Parameters
    ----------
    device : Interferometer
        Opened and zeroed.
    rate : float
        Hz; the device takes the nearest it can.
    samples : int, optional
        Ends after so many; by default it runs until `finish`.
    start : bool
        An edge on the trigger input starts it.
    **options
        As of `Measurement`: `extras`, `filtered`, `patience`, `stop_on_beam_loss`, `stream`,
        `native`.
    """

    def __init__(
        self,
        device: Interferometer,
        rate: float = NORMAL_RATE,
        samples: int | None = None,
        *,
        start: bool = False,
        **options: Any,
    ) -> None:
        super().__init__(device, rate, samples, trigger_mode(start=start), options)


@final
class Triggered(_Flowing):
    """Fast mode: every edge of a foreign clock gives one sample, so there is no second clock.

    Parameters
    ----------
    device : Interferometer
        Opened and zeroed.
    rate : float
        Expected rate of the edges (Hz).
    samples : int, optional
        Ends after so many; by default it runs until `finish`.
    by : {"clock", "event"}
        Clock input (the counter itself is read at the edge) or event input (the last processed
        value is sent).
    start : bool
        An edge on the trigger input opens it.
    **options
        As of `Measurement`.
    """

    def __init__(
        self,
        device: Interferometer,
        rate: float,
        samples: int | None = None,
        *,
        by: str = "clock",
        start: bool = False,
        **options: Any,
    ) -> None:
        if by not in ("clock", "event"):
            raise UnusableInput(f"interferometer: triggered by {by!r}; choose 'clock' or 'event'")
        mode = trigger_mode(start=start, clock=by == "clock", event=by == "event")
        super().__init__(device, rate, samples, mode, options)
