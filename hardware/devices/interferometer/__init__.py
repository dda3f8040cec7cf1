"""SIOS interferometers through the vendor's public C library: one beam, read in three ways.

`Streaming` takes values as they come on the device's clock, `Triggered` takes one for every edge
of a foreign clock, `Block` fills the device's memory at up to 1 MHz. The library is loaded at run
time; nothing of it is part of this project. The interface knows no input for a foreign analogue
signal: a copy of the voltage cannot be sampled beside the length, so one clock for both is had by
the external sample clock.
"""

from hardware.devices.interferometer.adjusting import vibrating as vibrating
from hardware.devices.interferometer.block import Block as Block
from hardware.devices.interferometer.constants import Trigger as Trigger
from hardware.devices.interferometer.device import Interferometer as Interferometer
from hardware.devices.interferometer.environment import AirCorrection as AirCorrection
from hardware.devices.interferometer.library import VARIABLE as VARIABLE
from hardware.devices.interferometer.library import VendorLibrary as VendorLibrary
from hardware.devices.interferometer.readouts import EllipseCorrection as EllipseCorrection
from hardware.devices.interferometer.readouts import Health as Health
from hardware.devices.interferometer.readouts import OpticalReading as OpticalReading
from hardware.devices.interferometer.streaming import NORMAL_RATE as NORMAL_RATE
from hardware.devices.interferometer.streaming import Streaming as Streaming
from hardware.devices.interferometer.streaming import Triggered as Triggered
