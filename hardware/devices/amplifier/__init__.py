"""Amplifiers without a digital interface, behind any converter."""

from hardware.devices.amplifier.analogue import AnalogueAmplifier
from hardware.devices.amplifier.calibration import (
    CalibrationLine,
    calibrated,
    fit_line,
    monitor_calibrated,
)
from hardware.devices.amplifier.channel import AnalogueChannel, AnalogueInputs, DigitalLines
from hardware.devices.amplifier.data import EPA_104, Amplifier, Monitors
from hardware.devices.amplifier.ultrasonic_driver import UltrasonicDriver, UltrasonicLimits

__all__ = [
    "EPA_104",
    "Amplifier",
    "AnalogueAmplifier",
    "AnalogueChannel",
    "AnalogueInputs",
    "CalibrationLine",
    "DigitalLines",
    "Monitors",
    "UltrasonicDriver",
    "UltrasonicLimits",
    "calibrated",
    "fit_line",
    "monitor_calibrated",
]
