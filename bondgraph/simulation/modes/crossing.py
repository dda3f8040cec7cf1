"""Where a guard first acts: seen at the samples of a run, located inside a step.

A crossing is located by runs of the mode's own step that end there, none by interpolated readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import count

import numpy as np

from bondgraph.simulation.modes.mode_run import ModeRun, ModeState, Moment, Passage
from bondgraph.support.arrays import Array

SLACK = 1e-11
"""Share of a signal, and of what it is summed of, that rounding may put beyond a level."""
FINEST = 1e-13
"""Share of a step to which a crossing is located."""
_FINER = 64


@dataclass(frozen=True)
class Located:
    """A crossing: so long (s) after a sample, the run that ends there, and which junctions act."""

    sample: int
    after: float
    run: Passage
    acting: tuple[str, ...]


class GuardMargins:
    """How far the conditions of a mode are beyond their levels along one piece.

    Sizes: n_g conditions. A condition that rounding puts beyond its level where the piece begins
    acts once it is beyond by more than the rounding, or has left it.
    """

    def __init__(
        self,
        run: ModeRun,
        first: Moment,
        shift: Mapping[str, float],
        largest: Mapping[tuple[str, str], float],
    ) -> None:
        self.run, self.conditions = run, run.mode.conditions
        self._at = [run.columns.get(c.reading, -1) for c in self.conditions]
        self._shift = [shift.get(c.reading, 0.0) for c in self.conditions]
        self.slack = SLACK * np.array(
            [
                max(
                    c.size,
                    largest.get((c.junction, c.reading), 0.0),
                    first.sizes[i] if i >= 0 else 0.0,
                )
                for c, i in zip(self.conditions, self._at, strict=True)
            ]
        )
        self.margin = self.of(first.y[None])[0]
        self.tight = self.margin > 0.0

    @property
    def wanting(self) -> tuple[str, ...]:
        """Junctions that switch at once where the piece begins."""
        return self.names(self.margin > self.slack)

    def names(self, acting: Array) -> tuple[str, ...]:
        """Return the junctions of some conditions."""
        return tuple(c.junction for c, a in zip(self.conditions, acting, strict=True) if a)

    def signals(self, y: Array) -> Array:
        """Return the signals that are compared, shape (N, n_g)."""
        found = np.empty((y.shape[0], len(self.conditions)))
        for k, (c, i, shift) in enumerate(zip(self.conditions, self._at, self._shift, strict=True)):
            found[:, k] = c.constant if i < 0 else y[:, i] + shift
        return found

    def of(self, y: Array) -> Array:
        """Return the margins, shape (N, n_g)."""
        return self._of_signals(self.signals(y))

    def _of_signals(self, signals: Array) -> Array:
        columns = [c.margin(signals[:, k]) for k, c in enumerate(self.conditions)]
        return np.stack(columns, axis=1) if columns else np.zeros((signals.shape[0], 0))

    def left(self, margins: Array) -> None:
        """Take note of the conditions that have left their levels."""
        self.tight = self.tight & ~(margins <= 0.0).any(axis=0)

    def first_crossing(self, made: Passage, begun: ModeState) -> Located | None:
        """Return the first crossing within a run from a state, or None."""
        signals, times = self.signals(made.y), made.times
        margins = self._of_signals(signals)
        left = np.logical_or.accumulate(margins <= 0.0, axis=0)
        needed = np.where(self.tight & ~left, self.slack, 0.0)
        seen = _after(margins > needed) | _peaks(margins, self.slack)
        if (jumped := self.run.jumped(made)) is not None:
            seen[1:] |= (self.of(jumped) > needed[1:-1]).any(axis=1)
        step = float(times[-1] - times[0]) / (times.size - 1)
        for j in np.flatnonzero(seen):
            at = self._standing(made, int(j), begun)
            least = np.where(self.tight & ~left[j], self.slack, 0.0)
            found = self._within(at, least, FINEST + 1e-15 * abs(times[j]) / step)
            if found is not None:
                part, run, acting = found
                return Located(int(j), part * step, run, self.names(acting))
        return None

    def _standing(self, made: Passage, j: int, begun: ModeState) -> Callable[[float, int], Passage]:
        """Return ``at(part, n)``: a run from sample `j` over a part of a step, in `n` rows."""
        run, times, n_sub = self.run, made.times, made.n_sub
        begin = float(times[j])
        step = float(times[-1] - times[0]) / (times.size - 1)
        state = run.along(times[: j + 1], begun, n_sub).end if j else begun

        def at(part: float, n: int = 1) -> Passage:
            if part == 0.0:
                here = run.now(begin, state)
                return Passage(times[j : j + 1], here.y[None], here.state, n_sub)
            return run.part(begin, part * step, n, state, n_sub)

        return at

    def _within(
        self, at: Callable[[float, int], Passage], least: Array, finest: float
    ) -> tuple[float, Passage, Array] | None:
        """Return after which part of a step something acts, with the run up to there, or None."""
        begun = at(0.0, 1)
        if (acting := self.of(begun.y)[0] > least).any():
            return 0.0, begun, acting
        fine = self.of(at(1.0, _FINER).y) > least
        row = int(np.argmax(fine.any(axis=1)))
        if not row:  # or by rounding alone; the next interval begins with it
            return None
        low, part, first = (row - 1) / _FINER, row / _FINER, fine[row]
        beyond = self._beyond(at, first, least)
        # a run that ends there takes longer steps, and may meet it earlier or later
        while part < 1.0 and beyond(part) <= 0.0:
            low, part = part, part + 1.0 / _FINER
        while low > 0.0 and beyond(low) > 0.0:
            low, part = low - 1.0 / _FINER, low
        while True:
            part = _first_beyond(beyond, low, part, finest)
            run = at(part, 1)
            acting = self.of(run.y)[-1] > least
            if not (acting & ~first).any():
                return part, run, acting if acting.any() else first
            first = acting & ~first  # these were beyond before
            beyond = self._beyond(at, first, least)

    def _beyond(
        self, at: Callable[[float, int], Passage], some: Array, least: Array
    ) -> Callable[[float], float]:
        """Return how far some conditions are beyond their levels after a part of a step."""
        return lambda part: float((self.of(at(part, 1).y)[-1] - least)[some].max())


def _first_beyond(
    beyond: Callable[[float], float], low: float, high: float, finest: float
) -> float:
    """Return where a function rises above zero, from the side on which it is above.

    It is not above zero at `low`, where it may be zero (a current that begins), and is at `high`;
    both but for rounding.
    """
    from scipy.optimize import brentq

    if beyond(high) <= 0.0:
        return high
    if beyond(low) > 0.0:
        return low
    least, most, begins = low, high, True
    while most - least > 2.0 * finest and np.nextafter(least, most) < most:
        at = least
        if beyond(least) < 0.0:
            at = brentq(beyond, least, most, xtol=finest, rtol=8.9e-16)
        elif not begins:  # zero all along: no slope leads to where it rises
            at = 0.5 * (least + most)
            least, most = (least, at) if beyond(at) > 0.0 else (at, most)
            continue
        begins, above = False, beyond(at) > 0.0
        for k in count():  # away from the root, until the other side is met
            way = finest * 2.0**k
            tried = max(at - way, least) if above else min(at + way, most)
            if (beyond(tried) > 0.0) != above:
                least, most = sorted((at, tried))
                break
            at = tried
    return most


def _after(acting: Array) -> Array:
    """Return the intervals at whose ends something acts, shape (N - 1,)."""
    return np.asarray(acting[1:].any(axis=1))


def _peaks(margins: Array, slack: Array) -> Array:
    """Return the intervals in which a parabola through three samples goes beyond a level.

    Twice what it rises above the middle sample counts: it is no more than a first look.
    """
    seen = np.zeros(margins.shape[0] - 1, bool)
    if margins.shape[0] < 3:
        return seen
    a, b, c = margins[:-2], margins[1:-1], margins[2:]
    bent = 2.0 * b - a - c
    with np.errstate(divide="ignore", invalid="ignore"):
        at = 0.5 * (c - a) / bent  # of the vertex, in steps from the middle sample
        top = b + 0.5 * at * (c - a)
    high = (bent > 0.0) & (np.abs(at) <= 1.0) & (top > slack)
    high &= np.maximum(np.maximum(a, b), c) <= slack
    early, late = (high & (at <= 0.25)).any(axis=1), (high & (at >= -0.25)).any(axis=1)
    seen[:-1] |= early
    seen[1:] |= late
    return seen
