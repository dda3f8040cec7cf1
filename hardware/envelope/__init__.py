"""The envelope: the one object between every voltage and its transport."""

from hardware.envelope.capacitance import Capacitance
from hardware.envelope.guard import GuardedOutput
from hardware.envelope.guarded_wave import GuardedWave
from hardware.envelope.limits import Converter, Dwell, Envelope
from hardware.envelope.monitor import check_monitor
from hardware.envelope.parking import Parkable, parked
from hardware.envelope.presets import P840_1, P840_1_UNIPOLAR, PRESETS
from hardware.envelope.raw_wave import RawWave
from hardware.envelope.single import check_ramp, check_set
from hardware.envelope.state import OutputState, OutputStatus
from hardware.envelope.watchdog import Fed, Heartbeat
from hardware.envelope.wave import check_wave

__all__ = [
    "P840_1",
    "P840_1_UNIPOLAR",
    "PRESETS",
    "Capacitance",
    "Converter",
    "Dwell",
    "Envelope",
    "Fed",
    "GuardedOutput",
    "GuardedWave",
    "Heartbeat",
    "OutputState",
    "OutputStatus",
    "Parkable",
    "RawWave",
    "check_monitor",
    "check_ramp",
    "check_set",
    "check_wave",
    "parked",
]
