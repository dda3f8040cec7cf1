"""A slow sensor beside the others, such as a force gauge, put on the instants of the output."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray
from hardware.contracts import INSTANT
from hardware.devices.gauge.averaging import FAR, FEWEST, outlying
from hardware.storage import StreamData


def beside(stream: StreamData, instants: FloatArray) -> tuple[dict[str, FloatArray], str]:
    """Return its channels at instants of the program's clock, and what was done.

    Linear between readings; outliers are left out as where forces are averaged (section 8.3 of the
    stack actuator thesis).

    Parameters
    ----------
    stream : StreamData
        Every reading with its instant.
    instants : ndarray
        (N,), s.
    """
    name, told = stream.layout.name, stream.channels[INSTANT]
    found, spoiled = {}, 0
    for channel, values in stream.channels.items():
        if channel == INSTANT:
            continue
        kept = np.isfinite(values)
        if values.size < FEWEST:
            return {}, f"{name}: {values.size} readings are too few; they are in the journal only"
        kept[kept] = ~outlying(values[kept])
        spoiled += int(values.size - kept.sum())
        found[channel] = np.interp(instants, told[kept], values[kept])
    return found, (
        f"{name}: {told.size} readings, linear between them; {spoiled} left out beyond {FAR:g} "
        "robust standard deviations of their neighbours"
    )
