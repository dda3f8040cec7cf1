"""NI inputs as an acquisition of their own, such as a recorded copy of the voltage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from hardware.contracts import Chunk, Identity
from hardware.devices.daq.ni import NiChannel, NiTimedInputs
from hardware.errors import ProtocolFault


@final
class NiAcquisition:
    """An `Acquisition` of NI inputs.

    Parameters
    ----------
    inputs : NiTimedInputs
        Channels, clock and trigger.
    channels : sequence of str
        Name of each channel in the record.
    rate : float
        Hz.
    count : int
        Samples wanted.
    """

    stream = "inputs"

    def __init__(
        self,
        inputs: NiTimedInputs,
        channels: Sequence[str],
        rate: float,
        count: int,
    ) -> None:
        if len(channels) != len(inputs.names):
            raise ProtocolFault(f"NI: {len(channels)} names for {len(inputs.names)} inputs")
        self._inputs = inputs
        self._channels = tuple(channels)
        self.rate = rate
        self._count = count
        self._got = 0

    @property
    def identity(self) -> Identity:
        """The device of the first input."""
        return NiChannel(self._inputs.names[0]).identity

    @property
    def done(self) -> bool:
        """Whether all samples have been handed out."""
        return self._got >= self._count

    def kickoff(self) -> None:
        """Arm."""
        self._got = 0
        self._inputs.start(self.rate, self._count)

    def poll(self) -> Sequence[Chunk]:
        """Return what arrived (V)."""
        volts = self._inputs.drain()
        n = volts.shape[1]
        if n == 0:
            return ()
        first, self._got = self._got, self._got + n
        channels = dict(zip(self._channels, volts, strict=True))
        return (Chunk(self.stream, first, channels, dict.fromkeys(channels, "V")),)

    def finish(self) -> Sequence[Chunk]:
        """Return the rest and stop."""
        try:
            return self.poll()
        finally:
            self._inputs.stop()

    def abort(self) -> None:
        """Stop whatever the state."""
        self._inputs.stop()
