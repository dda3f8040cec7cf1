"""SIOS interferometers through the vendor's public C library: one beam, read in three ways.

`Streaming` takes values as they come on the device's clock, `Triggered` takes one for every edge
of a foreign clock, `Block` fills the device's memory at up to 1 MHz. The library is loaded at run
time; nothing of it is part of this project. The interface knows no input for a foreign analogue
signal: a copy of the voltage cannot be sampled beside the length, so one clock for both is had by
the external sample clock.
"""

from hardware.interferometer.block import Block
from hardware.interferometer.constants import Trigger
from hardware.interferometer.device import Interferometer
from hardware.interferometer.environment import Environment
from hardware.interferometer.library import VARIABLE, Library
from hardware.interferometer.readouts import EllipseCorrection, Health, Reading
from hardware.interferometer.streaming import NORMAL_RATE, Streaming, Triggered
from hardware.interferometer.thesis import Superfast, ThesisInterface

__all__ = [
    "NORMAL_RATE",
    "VARIABLE",
    "Block",
    "EllipseCorrection",
    "Environment",
    "Health",
    "Interferometer",
    "Library",
    "Reading",
    "Streaming",
    "Superfast",
    "ThesisInterface",
    "Trigger",
    "Triggered",
]
