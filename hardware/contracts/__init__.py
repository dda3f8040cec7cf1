"""What the parts of a bench promise each other: clocks, chunks, outputs, acquisitions, links."""

from hardware.contracts.acquisition import Acquisition as Acquisition
from hardware.contracts.acquisition import Air as Air
from hardware.contracts.acquisition import Identity as Identity
from hardware.contracts.acquisition import Tried as Tried
from hardware.contracts.chunk import INSTANT as INSTANT
from hardware.contracts.chunk import Chunk as Chunk
from hardware.contracts.chunk import Flag as Flag
from hardware.contracts.clock import Clock as Clock
from hardware.contracts.clock import WallClock as WallClock
from hardware.contracts.output import RawOutput as RawOutput
from hardware.contracts.output import VoltageOut as VoltageOut
from hardware.contracts.output import WaveOut as WaveOut
from hardware.contracts.output import WaveProgress as WaveProgress
from hardware.contracts.transport import Transport as Transport
