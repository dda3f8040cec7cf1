"""How a program makes the time of a virtual bench pass, and what happens when it dies."""

from hardware.simulators.control.client import BenchClock as BenchClock
from hardware.simulators.control.client import LocalClock as LocalClock
from hardware.simulators.control.client import ask as ask
from hardware.simulators.control.front import ControlFront as ControlFront
from hardware.simulators.control.front import Departure as Departure
from hardware.simulators.control.front import Fault as Fault
from hardware.simulators.control.lines import LineServer as LineServer
from hardware.simulators.control.watchdog import ConnectionWatchdog as ConnectionWatchdog
