"""A reading whose zero jumps during the record."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws.onset import Onset
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import unit_of
from identification.diagnosis.screening.port_history import FittedModel

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
    sentence = "the zero of its reading jumps at one time"
    looks = "the residual is flat, then flat again at another level"
    confused_with = ("sensor_drift", "external_disturbance")
    separated_by = (
        "a second sensor of the same motion: a jump of one zero is not felt by the plant and sets "
        "nothing swinging"
    )
    source = "step in time with a finite rise"
    where = staticmethod(sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return unit steps at several times."""
        past, rise = scene.of(element), SHARP * scene.data.dt
        return tuple(
            Signature.of((0.5 * (1 + np.tanh((past.time - t) / rise)),), time=t)
            for t in _times(scene, element)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One jump, started where the signature has it or at several times."""
        half, dt = scene.of(element).half, scene.data.dt
        times = _times(scene, element) if hint is None else [float(hint.shape["time"])]
        margin = scene.data.n * dt if hint is None else 20 * dt
        law = Onset(
            times[0], SHARP * dt, margin, 0.05 * half, unit_of(element), free_standing=False
        )
        graph, (height, begin, _) = self.with_law(scene, element, law)
        size = 0.0 if hint is None else float(hint.weights[0])
        starts = tuple({height: size, begin: t} for t in times[: 2 * OF_EACH])
        return self.inserted(element, graph, starts, (height,))


def _times(scene: FittedModel, element: Element) -> list[float]:
    """Return times to try, s: the largest changes of the residual's mean, then even ones."""
    residual = scene.residual[:, scene.data.names.index(element.name)]
    n, dt = scene.data.n, scene.data.dt
    found = [k for part in SPANS for k in changes_of_mean(residual, n // part, OF_EACH)]
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
