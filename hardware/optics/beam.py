"""Light of the beam: a warning while it fades, and the sample from which nothing is sure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag


@dataclass(frozen=True, slots=True)
class BeamWatch:
    """Limits of the level, as shares of full light.

    Parameters
    ----------
    warn : float
        Below it a sample is marked `LEVEL_LOW`.
    lost : float
        Below it the counter may have lost fringes: this sample and all later ones are marked
        `BEAM_LOST`, until a new zero.
    """

    warn: float = 0.5
    lost: float = 0.15

    def __post_init__(self) -> None:
        """Refuse a warning that comes too late."""
        if not 0.0 < self.lost < self.warn < 1.0:
            raise UnusableInput(
                f"beam: limits lost {self.lost:g}, warn {self.warn:g}; give 0 < lost < warn < 1"
            )


@dataclass(frozen=True, slots=True)
class BeamState:
    """What the beam went through since the zero.

    Parameters
    ----------
    samples : int
        Seen so far.
    warned_at, lost_at : int or None
        Number of the first sample below each limit.
    lowest : float
        Lowest level.
    """

    samples: int = 0
    warned_at: int | None = None
    lost_at: int | None = None
    lowest: float = float("inf")


def watch_beam(
    level: ArrayLike, limits: BeamWatch | None = None, state: BeamState | None = None
) -> tuple[NDArray[np.uint16], BeamState]:
    """Flag a chunk of levels.

    Parameters
    ----------
    level : array_like
        ``(n,)``, share of full light; NaN counts as none.
    limits : BeamWatch, optional
        Limits.
    state : BeamState, optional
        What the chunks before returned.

    Returns
    -------
    flags : ndarray
        ``(n,)``, uint16.
    state : BeamState
        For the next chunk.
    """
    limits, state = limits or BeamWatch(), state or BeamState()
    share = np.nan_to_num(np.asarray(level, dtype=np.float64), nan=0.0)
    flags = np.zeros(share.size, np.uint16)
    if share.size == 0:
        return flags, state
    flags[share < limits.warn] |= int(Flag.LEVEL_LOW)
    warned = _first(state.warned_at, share < limits.warn, state.samples)
    lost = _first(state.lost_at, share < limits.lost, state.samples)
    if lost is not None:
        flags[max(lost - state.samples, 0) :] |= int(Flag.BEAM_LOST)
    lowest = min(state.lowest, float(share.min()))
    return flags, BeamState(state.samples + share.size, warned, lost, lowest)


def _first(already: int | None, hit: NDArray[np.bool_], offset: int) -> int | None:
    if already is not None or not hit.any():
        return already
    return offset + int(np.argmax(hit))
