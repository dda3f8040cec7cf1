"""How punctual a loop was, and how fast this host and this transport can be."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bondgraph.signals.quantity import engineering
from bondgraph.support.arrays import FloatArray

SHARE = 0.95
"""Of the cycles that must fit into a period."""


@dataclass(frozen=True, slots=True)
class CycleCost:
    """What one cycle of waking, reading, deciding and writing takes, tried at rest.

    Parameters
    ----------
    median, most : float
        Of all cycles, and within which `SHARE` of them are done (s of the host).
    real : bool
        Whether the bench's time passes meanwhile; a virtual one waits for the program.
    """

    median: float
    most: float
    real: bool

    @property
    def fastest(self) -> float:
        """Highest rate (Hz) that leaves every period a cycle."""
        return 1.0 / self.most


@dataclass(frozen=True, slots=True)
class LoopTiming:
    """What a loop's clock did.

    Parameters
    ----------
    asked, reached : float
        Rate asked for, and ticks a second from the first to the last (Hz).
    jitter, latest : float
        Standard deviation and largest value of the lateness of a write after its tick (s).
    ticks, missed, stale, cut : int
        Ticks done and left out, those without a new reading, those that the envelope held back.
    cost : CycleCost
    """

    asked: float
    reached: float
    jitter: float
    latest: float
    ticks: int
    missed: int
    stale: int
    cut: int
    cost: CycleCost

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {**asdict(self), "fastest": self.cost.fastest}

    @property
    def sentences(self) -> tuple[str, ...]:
        """What a reader must know, one line each."""
        c = self.cost
        said = [
            f"loop: {engineering(self.reached, 'Hz')} of {engineering(self.asked, 'Hz')} reached, "
            f"writes {engineering(self.jitter, 's')} rms about their mean, the latest "
            f"{engineering(self.latest, 's')} after its tick",
            f"loop: {self.ticks} ticks, {self.missed} missed, {self.stale} without a new reading, "
            f"{self.cut} held back by the envelope",
            f"limit: a cycle takes this host and transport {engineering(c.median, 's')}, "
            f"{100 * SHARE:g} % of them at most {engineering(c.most, 's')}: up to "
            f"{engineering(c.fastest, 'Hz')}",
        ]
        if not c.real:
            said.append(
                "limit: the bench's time is virtual and waits for the program, so its jitter is "
                "that of no clock"
                + (
                    f"; in real time {engineering(self.asked, 'Hz')} would be out of reach"
                    if self.asked > c.fastest
                    else ""
                )
            )
        return tuple(said)


def cost_of(seconds: FloatArray, real: bool) -> CycleCost:
    """Return the cost of cycles that took so long (s of the host, (n,)).

    Parameters
    ----------
    seconds : ndarray
        (n,)
    real : bool
        Whether the bench's time passed meanwhile.
    """
    ordered = np.sort(seconds)
    most = float(ordered[min(int(SHARE * ordered.size), ordered.size - 1)])
    return CycleCost(float(np.median(ordered)), most, real)
