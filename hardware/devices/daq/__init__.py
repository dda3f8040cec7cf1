"""Converter cards: Humusoft MF624 and MF634 by their registers, NI by its driver."""

from hardware.devices.daq.card import MF624, MF634, Card
from hardware.devices.daq.card_wave import CardWave, CardWiring, SampleClock
from hardware.devices.daq.channels import CardChannel, CardInputs
from hardware.devices.daq.codes import dac_codes, dac_volts, input_volts
from hardware.devices.daq.compiled_wave import CompiledWave
from hardware.devices.daq.mapped import MappedRegisters, MemoryRegisters
from hardware.devices.daq.ni import NiChannel, NiTimedInputs
from hardware.devices.daq.ni_acquisition import NiAcquisition
from hardware.devices.daq.ni_wave import NiTerminals, NiWave
from hardware.devices.daq.register_map import RegisterMap
from hardware.devices.daq.registers import Access, AccessKind, Registers
from hardware.devices.daq.schedule import Schedule
from hardware.devices.daq.socket_registers import SocketRegisters
from hardware.devices.daq.uio import PciRegisters, UioRegisters
from hardware.devices.daq.wave import SoftwareTimedWave

__all__ = [
    "MF624",
    "MF634",
    "Access",
    "AccessKind",
    "Card",
    "CardChannel",
    "CardInputs",
    "CardWave",
    "CardWiring",
    "CompiledWave",
    "MappedRegisters",
    "MemoryRegisters",
    "NiAcquisition",
    "NiChannel",
    "NiTerminals",
    "NiTimedInputs",
    "NiWave",
    "PciRegisters",
    "RegisterMap",
    "Registers",
    "SampleClock",
    "Schedule",
    "SocketRegisters",
    "SoftwareTimedWave",
    "UioRegisters",
    "dac_codes",
    "dac_volts",
    "input_volts",
]
