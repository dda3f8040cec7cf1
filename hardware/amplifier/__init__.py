"""Amplifiers without a digital interface, behind any converter."""

from hardware.amplifier.analogue import AnalogueAmplifier
from hardware.amplifier.calibration import Line, calibrated, fit_line, monitor_calibrated
from hardware.amplifier.channel import AnalogueChannel, AnalogueInputs, DigitalLines
from hardware.amplifier.data import EPA_104, Amplifier, Monitors
from hardware.amplifier.ultrasonic_driver import UltrasonicDriver, UltrasonicLimits

__all__ = [
    "EPA_104",
    "Amplifier",
    "AnalogueAmplifier",
    "AnalogueChannel",
    "AnalogueInputs",
    "DigitalLines",
    "Line",
    "Monitors",
    "UltrasonicDriver",
    "UltrasonicLimits",
    "calibrated",
    "fit_line",
    "monitor_calibrated",
]
