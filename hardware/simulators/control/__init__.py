"""How a program makes the time of a virtual bench pass, and what happens when it dies."""

from hardware.simulators.control.client import BenchClock, LocalClock, ask
from hardware.simulators.control.front import ControlFront, Departure, Fault
from hardware.simulators.control.lines import LineServer
from hardware.simulators.control.watchdog import ConnectionWatchdog

__all__ = [
    "BenchClock",
    "ConnectionWatchdog",
    "ControlFront",
    "Departure",
    "Fault",
    "LineServer",
    "LocalClock",
    "ask",
]
