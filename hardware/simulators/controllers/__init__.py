"""Digital controllers in front of the virtual bench, speaking their own bytes."""

from hardware.simulators.controllers.ascii_devices import ASCII_DEVICES as ASCII_DEVICES
from hardware.simulators.controllers.ascii_devices import AsciiDevice as AsciiDevice
from hardware.simulators.controllers.ascii_front import AsciiFront as AsciiFront
from hardware.simulators.controllers.faults import Fault as Fault
from hardware.simulators.controllers.faults import FaultQueue as FaultQueue
from hardware.simulators.controllers.gcs_front import GcsFront as GcsFront
from hardware.simulators.controllers.gcs_model import GcsModel as GcsModel
from hardware.simulators.controllers.watchdog import CommandWatchdog as CommandWatchdog
