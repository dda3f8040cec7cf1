"""Front door: two streams with their own clocks, and what the wiring allows."""

from __future__ import annotations

import math

import numpy as np

from bondgraph.support.errors import UnusableInput
from hardware.synchrony.alignment import Alignment
from hardware.synchrony.budget import Budget, checked
from hardware.synchrony.by_copy import align_by_copy
from hardware.synchrony.by_length import align_by_length
from hardware.synchrony.stream import COPY, LENGTH, VOLTAGE, Stream
from hardware.synchrony.time_map import TimeMap
from hardware.synchrony.wiring import ClockWiring


def align(
    drive: Stream,
    sensor: Stream,
    wiring: ClockWiring | None = None,
    *,
    budget: Budget | None = None,
) -> Alignment:
    """Estimate how the clocks of drive and sensor run, by the best that is there.

    A shared clock with a known trigger needs no estimate; a recorded copy of the voltage gives
    ratio and delay; the length alone gives the ratio, and a delay only where that is honest.

    Parameters
    ----------
    drive : Stream
        With the commanded voltage as `VOLTAGE`.
    sensor : Stream
        With the length as `LENGTH`, a copy of the voltage as `COPY`, or both.
    wiring : ClockWiring, optional
    budget : Budget, optional
        What may remain.

    Raises
    ------
    UnusableInput
        If the record cannot tell the ratio.
    ClockSkew
        If what remains exceeds the budget (with the alignment as `partial`).
    """
    wiring = ClockWiring() if wiring is None else wiring
    drive.channel(VOLTAGE)
    if COPY in sensor.channels:
        found = align_by_copy(drive, sensor, wiring)
    elif wiring.shared_clock:
        found = _by_wiring(sensor, wiring)
    elif LENGTH in sensor.channels:
        found = align_by_length(drive, sensor, wiring)
    else:
        raise UnusableInput(
            f"clock: the sensor has neither {COPY!r} nor {LENGTH!r}; it has "
            f"{', '.join(sensor.channels)}"
        )
    return found if budget is None else checked(found, budget)


def _by_wiring(sensor: Stream, wiring: ClockWiring) -> Alignment:
    """One clock for both: the ratio is exact, the delay as well as the trigger is known."""
    known = wiring.delay_error is not None
    error = math.inf if wiring.delay_error is None else wiring.delay_error
    covariance = np.zeros((3, 3))
    covariance[0, 0] = error**2
    return Alignment(
        TimeMap(wiring.delay), covariance, "shared clock", known, float(sensor.time[-1]),
        hold=wiring.hold, lag=wiring.lag or 0.0, lag_error=wiring.lag_error,
        notes=() if known else ("state delay_error, if the trigger's delay is known",),
    )  # fmt: skip
