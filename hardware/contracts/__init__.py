"""What the parts of a bench promise each other: clocks, chunks, outputs, acquisitions, links."""

from hardware.contracts.acquisition import Acquisition, Air, Identity
from hardware.contracts.chunk import Chunk, Flag
from hardware.contracts.clock import Clock, WallClock
from hardware.contracts.output import RawOutput, VoltageOut, WaveOut, WaveProgress
from hardware.contracts.transport import Transport

__all__ = [
    "Acquisition",
    "Air",
    "Chunk",
    "Clock",
    "Flag",
    "Identity",
    "RawOutput",
    "Transport",
    "VoltageOut",
    "WallClock",
    "WaveOut",
    "WaveProgress",
]
