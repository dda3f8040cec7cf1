"""Block mode, the thesis' superfast: the device's memory is filled, then handed over."""

from __future__ import annotations

from typing import Any, final

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk
from hardware.devices.interferometer.constants import BLOCK_MEMORY, BLOCK_RATE, trigger_mode
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.measurement import Measurement
from hardware.errors import LinkLost, Overrun, TimedOut


@final
class Block(Measurement):
    """One block of samples.

    Length and rate are checked before anything is sent. The rate of the interface is a whole
    number of Hz.

    Parameters
    ----------
    device : Interferometer
        Opened and zeroed.
    samples : int
        At most `memory`.
    rate : float
        Hz, at most `fastest`; with an external clock what is expected.
    start : bool
        An edge on the trigger input starts it.
    external : bool
        Every edge on the clock input takes one sample, where the device can.
    memory : int
        Values the device can hold.
    fastest : float
        Its largest rate (Hz).
    **options
        As of `Measurement`. `patience` is the time that is waited for the block beyond its own
        duration: the trigger must come within it.

    Raises
    ------
    Overrun
        If more samples are asked for than fit.
    UnusableInput
        If the rate is too high or not whole.
    """

    def __init__(
        self,
        device: Interferometer,
        samples: int,
        rate: float,
        *,
        start: bool = True,
        external: bool = False,
        memory: int = BLOCK_MEMORY,
        fastest: float = BLOCK_RATE,
        **options: Any,
    ) -> None:
        mode = trigger_mode(start=start, clock=external)
        super().__init__(device, rate, trigger=mode, **options)
        if samples < 1:
            raise UnusableInput(
                f"interferometer: a block of {samples} samples; ask for one or more"
            )
        if samples > memory:
            raise Overrun(
                f"interferometer: {samples} samples asked for, its memory holds {memory}; ask for "
                "less or stream"
            )
        if rate > fastest or rate != round(rate):
            raise UnusableInput(
                f"interferometer: {rate:g} Hz for a block; it takes whole Hz up to {fastest:g}"
            )
        self.samples = samples
        self._armed = 0.0

    def _set(self) -> None:
        call, d = self.device.library.call, self.device.handle
        flags = self._flags("IfmSetBlockModeFilter")
        call("IfmSetBlockMode", d, flags, self._trigger, round(self.rate))

    def _arm(self) -> None:
        self.device.library.call("IfmStartBlock", self.device.handle, self.samples)
        self._armed = self.device.clock.now()

    def _collect(self, chunks: list[Chunk]) -> None:
        device = self.device
        if self._complete:
            return
        try:
            ready = device.library.call("IfmIsBlockAvailable", device.handle)
        except LinkLost:
            self._salvage(chunks)
            raise
        if ready:
            # fewer than asked for if some were lost: by an age beyond them the library gives others
            held = int(device.library.call("IfmValueCount", device.handle))
            count = min(held, self.samples) if held > 0 else self.samples
            self._take(count, chunks, oldest=count - 1)
            self._require_presence()
            device.library.call("IfmClearBuffers", device.handle)
            self._complete = True
            return
        self._require_presence()
        waited = device.clock.now() - self._armed
        if waited > self.samples / self.rate * 1.01 + self._patience:
            self._stop()
            raise TimedOut(
                f"{self.stream} {self.identity.serial}: no block within {waited:.3g} s; the "
                f"trigger {'or the clock ' if self.external_clock else ''}did not come; the block "
                "was cancelled"
            )

    def _salvage(self, chunks: list[Chunk]) -> None:
        """Take what had arrived of a block before the link was lost."""
        device = self.device
        count = int(device.library.function("IfmValueCount")(device.handle))
        if count > 0:
            self._take(min(count, self.samples), chunks)

    def _end(self, chunks: list[Chunk]) -> None:
        if not self._complete:
            self._collect(chunks)
        if not self._complete:
            self._stop()

    def _stop(self) -> None:
        self.device.library.call("IfmCancelBlock", self.device.handle)
