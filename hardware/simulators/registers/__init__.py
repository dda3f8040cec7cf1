"""Simulated Humusoft cards with an amplifier behind them."""

from hardware.simulators.registers.amplifier import AmplifierData as AmplifierData
from hardware.simulators.registers.amplifier import SimulatedAmplifier as SimulatedAmplifier
from hardware.simulators.registers.front import CardFront as CardFront
from hardware.simulators.registers.model import CardFaults as CardFaults
from hardware.simulators.registers.model import Logged as Logged
from hardware.simulators.registers.model import RegisterModel as RegisterModel
from hardware.simulators.registers.model import Wires as Wires
