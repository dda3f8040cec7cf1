"""Converter cards: Humusoft MF624 and MF634 by their registers, NI by its driver."""

from hardware.daq.card import MF624, MF634, Card
from hardware.daq.card_wave import CardWave, SampleClock, Wiring
from hardware.daq.channels import CardChannel, CardInputs
from hardware.daq.codes import dac_codes, dac_volts, input_volts
from hardware.daq.compiled_wave import CompiledWave
from hardware.daq.mapped import MappedRegisters, MemoryRegisters
from hardware.daq.ni import NiChannel, NiTimedInputs
from hardware.daq.ni_acquisition import NiAcquisition
from hardware.daq.ni_wave import NiTerminals, NiWave
from hardware.daq.register_map import RegisterMap
from hardware.daq.registers import Access, Kind, Registers
from hardware.daq.schedule import Schedule
from hardware.daq.socket_registers import SocketRegisters
from hardware.daq.uio import PciRegisters, UioRegisters
from hardware.daq.wave import SoftwareTimedWave

__all__ = [
    "MF624",
    "MF634",
    "Access",
    "Card",
    "CardChannel",
    "CardInputs",
    "CardWave",
    "CompiledWave",
    "Kind",
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
    "Wiring",
    "dac_codes",
    "dac_volts",
    "input_volts",
]
