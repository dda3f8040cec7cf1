"""The envelope: the one object between every voltage and its transport."""

from hardware.envelope.capacitance import Capacitance as Capacitance
from hardware.envelope.guard import GuardedOutput as GuardedOutput
from hardware.envelope.guarded_wave import GuardedWave as GuardedWave
from hardware.envelope.limits import Converter as Converter
from hardware.envelope.limits import Dwell as Dwell
from hardware.envelope.limits import Envelope as Envelope
from hardware.envelope.monitor import check_monitor as check_monitor
from hardware.envelope.parking import Parkable as Parkable
from hardware.envelope.parking import parked as parked
from hardware.envelope.presets import P840_1 as P840_1
from hardware.envelope.presets import P840_1_UNIPOLAR as P840_1_UNIPOLAR
from hardware.envelope.presets import PRESETS as PRESETS
from hardware.envelope.raw_wave import RawWave as RawWave
from hardware.envelope.single import check_ramp as check_ramp
from hardware.envelope.single import check_set as check_set
from hardware.envelope.state import OutputState as OutputState
from hardware.envelope.state import OutputStatus as OutputStatus
from hardware.envelope.watchdog import Fed as Fed
from hardware.envelope.watchdog import Heartbeat as Heartbeat
from hardware.envelope.wave import allowed_share as allowed_share
from hardware.envelope.wave import check_wave as check_wave
