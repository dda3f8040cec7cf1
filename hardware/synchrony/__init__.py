"""Two clocks: ratio and delay of drive and sensor, with how well they are known.

>>> import numpy as np
>>> drive_time = np.arange(4000) / 1000.0
>>> drive = Stream.of(1000.0, V=50 - 50 * np.cos(2 * np.pi * 3.0 * drive_time))
>>> held = HeldColumns(drive.channels["V"][:, None], 1e-3, lag=5e-4)
>>> late = held.at(np.arange(3900) / 1000.0 + 2e-3)
>>> found = align(drive, Stream.of(1000.0, V_copy=late[0][:, 0]), ClockWiring(lag=5e-4))
>>> print(f"{1e3 * found.map.delay:.3f} ms")
2.000 ms
"""

from hardware.synchrony.align import align as align
from hardware.synchrony.alignment import Alignment as Alignment
from hardware.synchrony.alignment import SilentLoss as SilentLoss
from hardware.synchrony.between import between as between
from hardware.synchrony.budget import Budget as Budget
from hardware.synchrony.budget import checked as checked
from hardware.synchrony.budget import false_width as false_width
from hardware.synchrony.by_copy import align_by_copy as align_by_copy
from hardware.synchrony.by_length import align_by_length as align_by_length
from hardware.synchrony.held import HeldColumns as HeldColumns
from hardware.synchrony.merge import Merged as Merged
from hardware.synchrony.merge import merged as merged
from hardware.synchrony.several_tones import delay_from_lags as delay_from_lags
from hardware.synchrony.stream import LENGTH as LENGTH
from hardware.synchrony.stream import Stream as Stream
from hardware.synchrony.time_map import TimeMap as TimeMap
from hardware.synchrony.wiring import ClockWiring as ClockWiring
