"""Numbers of the public `siosifm` interface that the driver uses."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Final

BLOCK_MEMORY: Final = 32_768
"""Values that the memory of the thesis' device holds."""

BLOCK_RATE: Final = 1e6
"""Largest rate of block mode (Hz)."""


class Trigger(IntFlag):
    """Inputs and edges that a measurement obeys; an edge falls unless its rising bit is set."""

    OFF = 0
    START = 0x0001
    """An edge on the trigger input starts the values."""
    GATE_PROCESSED = 0x0002
    GATE_RAW = 0x0004
    CLOCK = 0x0008
    """An edge on the clock input takes one value of the counter: an external sample clock."""
    EVENT = 0x0010
    """An edge on the event input sends one processed value."""
    CLOCK_RISING = 0x0100
    START_RISING = 0x0200
    EVENT_RISING = 0x0400


class Measure(IntFlag):
    """What a value consists of."""

    LENGTH = 0x0002
    QUADRATURE = 0x0004
    CIRCLE = 0x0008
    CLOCK = 0x0020
    IGNORE_BEAM = 0x0040
    SAMPLE = 0x0080
    CHANNEL_1 = 0x0100
    FILTER_DEFAULT = 0x0000
    FILTER_OFF = 0x1000
    FILTER_USER = 0x2000


class Aux(IntEnum):
    """What stands beside a length.

    The two converters of the interface are those of the cosine and sine signals and the position
    sensors measure the lateral shift of the beam: there is no input for a foreign analogue signal.
    """

    COSINE = 1
    SINE = 2
    NORM = 3
    CLOCK = 5
    SAMPLE = 6


class ValueStatus(IntFlag):
    """State that stands beside a value."""

    QUADRANT = 0x0001
    LEVEL = 0x0002
    LASER_STABLE = 0x0010
    LASER_WAS_UNSTABLE = 0x0020
    OVERFLOW_DEVICE = 0x0100
    OVERFLOW_LIBRARY = 0x0200
    BLOCK_MODE = 0x0400
    BAD_REQUEST = 0x8000


class Quality(IntFlag):
    """Quantities of the signal monitor."""

    AMPLITUDE_1 = 0x10
    OFFSET_1 = 0x20
    AMPLITUDE_2 = 0x40
    OFFSET_2 = 0x80
    SUM = 0x100
    """Overall quality, 0 to 100 %."""


class AirFlag(IntFlag):
    """Where a value of the air comes from; the low byte is the number of the sensor."""

    MEASURED = 0x0100
    CURRENT = 0x0200
    """Measured with the last set of data, usually not older than 4 s."""
    MANUAL = 0x0400


class Info(IntEnum):
    """Device information; those that end in ``_AT`` are given as addresses."""

    AVAILABLE = 8
    SERIAL = 9
    READY = 11
    VERSION_TEXT_AT = 12
    RATE_AT = 14
    SAMPLE_RATE_AT = 21
    ELLIPSE_ON = 24
    ELLIPSE_COSINE_OFFSET_AT = 25
    ELLIPSE_SINE_OFFSET_AT = 26
    ELLIPSE_PHASE_AT = 27
    ELLIPSE_RATIO_AT = 28
    ELLIPSE_AMPLITUDE_AT = 29
    AIR_COUNTER = 30
    DEVICE_SERIAL_AT = 32
    ELLIPSE_UPDATING = 34
    ELLIPSE_COUNT = 35


def trigger_mode(*, start: bool = False, clock: bool = False, event: bool = False) -> Trigger:
    """Return the flags for rising edges.

    Parameters
    ----------
    start : bool
        An edge on the trigger input starts.
    clock : bool
        Every edge on the clock input takes one sample.
    event : bool
        Every edge on the event input sends one processed value.
    """
    mode = Trigger.OFF
    mode |= Trigger.START | Trigger.START_RISING if start else Trigger.OFF
    mode |= Trigger.CLOCK | Trigger.CLOCK_RISING if clock else Trigger.OFF
    return mode | (Trigger.EVENT | Trigger.EVENT_RISING if event else Trigger.OFF)
