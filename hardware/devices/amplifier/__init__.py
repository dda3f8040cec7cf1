"""Amplifiers without a digital interface, behind any converter."""

from hardware.devices.amplifier.analogue import AnalogueAmplifier as AnalogueAmplifier
from hardware.devices.amplifier.channel import AnalogueChannel as AnalogueChannel
from hardware.devices.amplifier.channel import AnalogueInputs as AnalogueInputs
from hardware.devices.amplifier.channel import DigitalLines as DigitalLines
from hardware.devices.amplifier.data import EPA_104 as EPA_104
from hardware.devices.amplifier.data import Amplifier as Amplifier
from hardware.devices.amplifier.data import Monitors as Monitors
from hardware.devices.amplifier.ended_wave import EndedWave as EndedWave
from hardware.devices.amplifier.ultrasonic_driver import UltrasonicDriver as UltrasonicDriver
from hardware.devices.amplifier.ultrasonic_driver import UltrasonicLimits as UltrasonicLimits
