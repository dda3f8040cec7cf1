"""Simulated Humusoft cards with an amplifier behind them."""

from hardware.simulators.registers.amplifier import AmplifierData, SimulatedAmplifier
from hardware.simulators.registers.front import CardFront
from hardware.simulators.registers.model import CardFaults, Logged, RegisterModel, Wires

__all__ = [
    "AmplifierData",
    "CardFaults",
    "CardFront",
    "Logged",
    "RegisterModel",
    "SimulatedAmplifier",
    "Wires",
]
