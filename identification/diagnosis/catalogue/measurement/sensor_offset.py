"""A reading whose zero jumps during the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import Law, Onset
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.site import Site, Values

EVENLY = 8
"""Times of a jump tried wherever the residual has none."""
SPANS = (6, 20, 60)
"""Parts of the record whose means are compared before and after a time."""
OF_EACH = 3
SHARP = 1.0
"""Rise of a jump, in samples."""


class SensorOffset(Effect):
    """The zero of the reading jumps once.

    An offset that stays is a nuisance of every fit, not a finding. The time of the jump counts from
    the start of a run, so where a record is scored on windows this law starts anew in each and will
    not explain a jump; the linear screening still sees it. Times to try are those at which the mean
    of the residual changes most, and some between.
    """

    name = "sensor_offset"
    family = "measurement"
    kind = "sensing"
    law = "jump_of_zero"
    laws = (Onset,)
    sentence = "the zero of its reading jumps at one time"
    looks = "the residual is flat, then flat again at another level"
    confused_with = ("sensor_drift", "external_disturbance")
    separated_by = (
        "a second sensor of the same motion: a jump of one zero is not felt by the plant and sets "
        "nothing swinging"
    )
    source = "step in time with a finite rise"
    where = staticmethod(sensors)

    weights = ("h",)

    def grid(self, at: Site) -> Sequence[Values]:
        """Return times of a jump."""
        return [{"time": t} for t in _times(at)]

    def made(self, at: Site, time: float | None = None) -> Law:
        """Return one jump, which may move some samples, or anywhere where no time is known."""
        dt = at.past.dt
        margin = 20 * dt if time is not None else at.past.duration
        begin = _times(at)[0] if time is None else time
        size = 0.05 * at.past.half
        return Onset(begin, SHARP * dt, margin, size, at.unit or "1", free_standing=False)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the jump of the hint, or none at several times."""
        if hint is not None:
            return super().tried(at, law, hint)
        return [{"h": 0.0, "t_0": t} for t in _times(at)[: 2 * OF_EACH]]


def _times(at: Site) -> list[float]:
    """Return times to try, s: the largest changes of the residual's mean, then even ones."""
    n, dt = at.past.n, at.past.dt
    found = [k for part in SPANS for k in changes_of_mean(at.residual, n // part, OF_EACH)]
    found += [round(n * (i + 1) / (EVENLY + 1)) for i in range(EVENLY)]
    return [(k - 0.5) * dt for k in dict.fromkeys(found)]


def changes_of_mean(residual: Array, span: int, count: int) -> list[int]:
    """Return samples at which the mean of `span` samples differs most from the `span` before.

    Parameters
    ----------
    residual : ndarray, shape (N,)
    span : int
        Also the least distance of two such samples.
    count : int
        How many to return at most.
    """
    n = residual.size
    if span < 2 or n < 2 * span + 1:
        return []
    total = np.concatenate([[0.0], np.cumsum(residual)])
    change = np.abs(total[2 * span :] - 2 * total[span:-span] + total[: -2 * span])
    found: list[int] = []
    for _ in range(count):
        k = int(np.argmax(change))
        if not change[k] > 0:
            break
        found.append(k + span)
        change[max(k - span, 0) : k + span + 1] = 0.0
    return found
