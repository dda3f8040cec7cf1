"""Inputs that one could apply next, each within the amplitude that is known to be allowed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.experiments.design.loops import through
from identification.experiments.design.signal import Signal
from identification.experiments.design.steps import staircase
from identification.experiments.design.sweep import sweep
from identification.study.data import Data

LOOPS = 3
SINES = 4


@dataclass(frozen=True, eq=False)
class CandidateInput:
    """One input that could be applied.

    Attributes
    ----------
    kind : str
        ``repeat``, ``stronger``, ``weaker``, ``triangle``, ``minor loops``, ``hold``, ``sine`` or
        ``sweep``.
    words : str
        What to do, in the imperative.
    commands : dict of str to ndarray, shape (N,), SI
        All sources.
    amplitude : float
        Half of the moving source's range, SI.
    """

    kind: str
    words: str
    commands: Mapping[str, Array]
    amplitude: float


def candidate_inputs(
    data: Data, units: Mapping[str, str], envelopes: Mapping[str, DriveLimits] | None = None
) -> tuple[CandidateInput, ...]:
    """Return inputs for every source that moved, the others at their mean.

    Parameters
    ----------
    data : Data
        The record: sampling, length, commands.
    units : dict of str to str
        Unit of each source, for the words.
    envelopes : dict of str to DriveLimits, optional
        What each source may do; the recorded range where it is not given.
    """
    found = []
    still = {n: np.full(data.n, float(np.mean(u))) for n, u in data.commands.items()}
    for name, u in data.commands.items():
        if not np.ptp(u) > 0:
            continue
        unit = units.get(name, "")
        low, high, steepest = float(u.min()), float(u.max()), np.inf
        if envelopes and name in envelopes:
            given = envelopes[name]
            low = given.low if np.isfinite(given.low) else low
            high = given.high if np.isfinite(given.high) else high
            steepest = given.steepest
        centre, half = 0.5 * (low + high), 0.5 * (high - low)
        for kind, text, course in _courses(u, data.dt, centre, half, unit):
            slope = np.abs(np.diff(course)).max(initial=0.0) / data.dt
            # a step is steep by nature; its rise can be chosen
            if kind != "hold" and slope > steepest * (1 + 1e-9):
                continue
            inside = low - 1e-9 * half <= course.min() and course.max() <= high + 1e-9 * half
            if not inside and kind != "repeat":
                continue
            where = f" at {name}" if len(data.commands) > 1 else ""
            found.append(
                CandidateInput(
                    kind, text + where, {**still, name: course}, 0.5 * float(np.ptp(course))
                )
            )
    return tuple(found)


def _courses(
    u: Array, dt: float, centre: float, half: float, unit: str
) -> list[tuple[str, str, Array]]:
    n, rate = u.size, 1.0 / dt
    span = (n - 1) * dt
    size = f"+-{half:.3g} {unit}".rstrip()
    middle, own = float(np.mean(u)), 0.5 * float(np.ptp(u))
    most = min(
        (centre + half - middle) / max(float(u.max()) - middle, 1e-300),
        (middle - centre + half) / max(middle - float(u.min()), 1e-300),
        2.0,
    )
    found = [("repeat", f"repeat the recorded input over another {span:.3g} s", u)]
    if most > 1.05:
        words = f"apply the recorded input {most:.3g} times as large (+-{most * own:.3g} {unit})"
        found.append(("stronger", words, middle + most * (u - middle)))
    found.append(
        (
            "weaker",
            f"apply half of the recorded input (+-{0.5 * own:.3g} {unit})",
            middle + 0.5 * (u - middle),
        )
    )
    # 4 half * LOOPS is the way of the loops
    slew = 4.0 * half * LOOPS / (0.97 * span)
    turns = [half if i % 2 == 0 else -half for i in range(2 * LOOPS)]
    made: list[tuple[str, str, Signal | None]] = [
        (
            "triangle",
            f"apply a slow triangle of {size}, {LOOPS} loops over {span:.3g} s",
            _made(lambda: through([centre, *(centre + t for t in turns), centre], rate, slew=slew)),
        )
    ]
    fading = [half * (1 - i / 8) * (1 if i % 2 == 0 else -1) for i in range(8)]
    way = half + sum(abs(a - b) for a, b in pairwise(fading)) + half / 8
    made.append(
        (
            "minor loops",
            f"apply shrinking triangles from {size} to rest over {span:.3g} s",
            _made(
                lambda: through(
                    [centre, *(centre + f for f in fading), centre], rate, slew=way / (0.97 * span)
                )
            ),
        )
    )
    levels = [centre - half, centre + half, centre]
    made.append(
        (
            "hold",
            f"step by {2 * half:.3g} {unit} and hold, {span / 3:.3g} s at each level",
            _made(lambda: staircase(rate, span / 3, levels, rise=4 * dt)),
        )
    )
    time = dt * np.arange(n)
    lowest, highest = 4.0 / span, min(0.2 * rate, _busiest(u, dt))
    for f in np.geomspace(lowest, max(highest, 2 * lowest), SINES):
        found.append(
            (
                "sine",
                f"apply a sine of {size} at {f:.3g} Hz for {span:.3g} s",
                centre + half * np.sin(2 * np.pi * f * time),
            )
        )
    top = min(0.25 * rate, 2.0 * highest)
    made.append(
        (
            "sweep",
            f"apply a sweep of {size} from {lowest:.3g} to {top:.3g} Hz over {span:.3g} s",
            _made(lambda: sweep(rate, lowest, top, span, kind="log", amplitude=half, bias=centre)),
        )
    )
    return found + [(k, w, _length(s.values, n)) for k, w, s in made if s is not None]


def _made(maker: Callable[[], Signal]) -> Signal | None:
    """Return the signal, or nothing where this record's length or rate does not allow it."""
    try:
        return maker()
    except BondsightError:
        return None


def _length(values: Array, n: int) -> Array:
    """Cut or rest at the last value."""
    if values.size >= n:
        return values[:n].copy()
    return np.concatenate([values, np.full(n - values.size, values[-1])])


def _busiest(u: Array, dt: float) -> float:
    """Frequency below which 99 % of the recorded power lies, Hz."""
    power = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(u.size))) ** 2
    grown = np.cumsum(power)
    at = int(np.searchsorted(grown, 0.99 * grown[-1]))
    return max(at, 1) / (u.size * dt)
