"""Digital controllers in front of the virtual bench, speaking their own bytes."""

from hardware.simulators.controllers.ascii_devices import ASCII_DEVICES, AsciiDevice
from hardware.simulators.controllers.ascii_front import AsciiFront
from hardware.simulators.controllers.faults import Fault, FaultQueue
from hardware.simulators.controllers.gcs_front import GcsFront
from hardware.simulators.controllers.gcs_model import GcsModel
from hardware.simulators.controllers.watchdog import CommandWatchdog

__all__ = [
    "ASCII_DEVICES",
    "AsciiDevice",
    "AsciiFront",
    "CommandWatchdog",
    "Fault",
    "FaultQueue",
    "GcsFront",
    "GcsModel",
]
