"""What is shown of a running acquisition at one instant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

RECENT = 240
"""Points of a channel that are kept for drawing."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelState:
    """One channel.

    Parameters
    ----------
    name, unit : str
        Name and unit.
    last, low, high : float
        Last, least and greatest finite value so far; NaN if there is none.
    recent : ndarray
        (k,), evenly spaced values up to the last, at most `RECENT`.
    """

    name: str
    unit: str
    last: float
    low: float
    high: float
    recent: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class StreamState:
    """One stream.

    Parameters
    ----------
    name : str
        Its name.
    samples : int
        Samples that arrived.
    total : int, optional
        Samples asked for.
    lost : int
        Samples missing among those that arrived.
    rate : float
        Samples a second of the program's time (Hz), over the last seconds; 0 at the beginning.
    channels : tuple of ChannelState
        Its channels.
    flags : mapping of str to int
        Samples under each flag, only those there are.
    """

    name: str
    samples: int = 0
    total: int | None = None
    lost: int = 0
    rate: float = 0.0
    channels: tuple[ChannelState, ...] = ()
    flags: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class LiveState:
    """All that is shown at one instant.

    Parameters
    ----------
    name : str
        Name of the recording.
    elapsed : float
        s since the start.
    left : float, optional
        s to the end, as far as can be told.
    streams : tuple of StreamState
        The streams.
    output : str
        State of the output in words: "driving, 43.1 V", "parked", "unknown".
    warnings : tuple of str
        Sentences, the first first.
    ended : bool
        Whether it is over.
    phase : str
        What is being done, in a word.
    """

    name: str
    elapsed: float
    left: float | None = None
    streams: tuple[StreamState, ...] = ()
    output: str = ""
    warnings: tuple[str, ...] = ()
    ended: bool = False
    phase: str = ""
