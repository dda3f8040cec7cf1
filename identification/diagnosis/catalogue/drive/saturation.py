"""A drive that bends flat near the ends of its range."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Saturation
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.signal_traces import unit_of
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

INSIDE = (0.02, 0.05, 0.1, 0.18, 0.27, 0.36)
"""Limits to try, in spans of the command inside its ends."""
KNEE = 0.02
FAR = 0.1
"""Spans beyond its end at which a limit does nothing."""
COUNTS = 0.1
"""Share of the larger weight below which an end is left alone."""


class SaturationEffect(Effect):
    """The drive bends flat near the ends of its range."""

    name = "saturation"
    family = "drive"
    kind = "command"
    law = "soft_saturation"
    sentence = "its output stays behind the command near the ends of the range"
    looks = "missing only at large commands: the response is cut, whatever the frequency"
    confused_with = ("nonlinear_stiffness", "sensor_nonlinearity", "slew_limit")
    separated_by = (
        "the same shape at half the amplitude, where a limit vanishes altogether, and a second "
        "sensor behind the drive"
    )
    source = "hyperbolic corner, common in describing-function texts"
    where = staticmethod(commands)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what is cut off at the upper and the lower end, for several limits."""
        past = scene.of(element)
        u, (low, high) = past.argument, _ends(past)
        span = high - low
        return tuple(
            Signature.of(
                (
                    -_excess(u - high + a * span, KNEE * span),
                    _excess(low + a * span - u, KNEE * span),
                ),
                inside=a,
            )
            for a in INSIDE
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Two limits with a soft knee, tried where the signature has them or all over."""
        low, high = _ends(scene.of(element))
        span = high - low
        law = Saturation(low + 0.08 * span, high - 0.08 * span, KNEE * span, unit_of(element))
        graph, names = self.with_law(scene, element, law)

        def start(below: float, above: float, knee: float) -> Mapping[str, float]:
            return dict(
                zip(names, (low + below * span, high - above * span, knee * span), strict=True)
            )

        starts = tuple(start(*s) for s in (_everywhere() if hint is None else _hinted(hint)))
        return self.inserted(element, graph, starts, names[:2])


def _ends(past: PortHistory) -> tuple[float, float]:
    return past.centre - past.half, past.centre + past.half


def _excess(z: Array, knee: float) -> Array:
    """``max(z, 0)`` with the corner of the law."""
    return np.asarray(0.5 * (z + np.sqrt(z * z + knee * knee)))


def _everywhere() -> list[tuple[float, float, float]]:
    """Limits below and above and knee, in spans."""
    insides = ((0.02, 0.02), (0.05, 0.05), (0.1, 0.1), (0.25, 0.25), (-0.1, 0.08), (0.08, -0.1))
    return [(a, b, knee) for a, b in insides for knee in (0.01, 0.05)]


def _hinted(hint: Hint) -> list[tuple[float, float, float]]:
    """Where the signature has the limits; an end that it does not use is set free."""
    a = float(hint.shape["inside"])
    above, below = (float(w) for w in hint.weights)
    most = max(above, below, 0.0)
    if most <= 0.0:
        return [(a, a, KNEE)]
    lower = a if below > COUNTS * most else -FAR
    upper = a if above > COUNTS * most else -FAR
    found = [(lower, upper, KNEE), (0.5 * a, 0.5 * a, 0.5 * KNEE)]
    if (lower, upper) != (a, a):
        found.insert(1, (a, a, KNEE))
    return found
