"""One take: drive a waveform, record all that arrives, align, store with its provenance."""

from hardware.recorder.assembling import OUTPUT as OUTPUT
from hardware.recorder.assembling import Assembled as Assembled
from hardware.recorder.assembling import assemble as assemble
from hardware.recorder.keeping import Notebook as Notebook
from hardware.recorder.plan import SYNCHRONISATIONS as SYNCHRONISATIONS
from hardware.recorder.plan import Synchronisation as Synchronisation
from hardware.recorder.plan import TakePlan as TakePlan
from hardware.recorder.recording import Taken as Taken
from hardware.recorder.recording import record as record
from hardware.recorder.station import GuardedVoltage as GuardedVoltage
from hardware.recorder.station import Preparation as Preparation
from hardware.recorder.station import Station as Station
from hardware.recorder.station import no_preparation as no_preparation
from hardware.recorder.taking import TakeProgress as TakeProgress
from hardware.recorder.taking import Watch as Watch
from hardware.recorder.taking import take as take
