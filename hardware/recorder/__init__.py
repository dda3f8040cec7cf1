"""One take: drive a waveform, record all that arrives, align, store with its provenance."""

from hardware.recorder.assembling import OUTPUT, Assembled, assemble
from hardware.recorder.plan import SYNCHRONISATIONS, Synchronisation, TakePlan
from hardware.recorder.recording import Taken, record
from hardware.recorder.station import GuardedVoltage, Preparation, Station, no_preparation
from hardware.recorder.taking import Notebook, TakeProgress, Watch, take

__all__ = [
    "OUTPUT",
    "SYNCHRONISATIONS",
    "Assembled",
    "GuardedVoltage",
    "Notebook",
    "Preparation",
    "Station",
    "Synchronisation",
    "TakePlan",
    "TakeProgress",
    "Taken",
    "Watch",
    "assemble",
    "no_preparation",
    "record",
    "take",
]
