"""A drive that bends flat near the ends of its range."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Law, Saturation
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.site import Site, Values, numbers, over, plain

KNEE = 0.02
FAR = 0.1
"""Spans beyond its end at which a limit does nothing."""
UNREACHED = 1e9
"""Spans beyond its end at which the corner of a limit is rounded off."""
COUNTS = 0.1
"""Share of the larger weight below which an end is left alone."""


class SaturationEffect(Effect):
    """The drive bends flat near the ends of its range."""

    name = "saturation"
    family = "drive"
    kind = "command"
    law = "soft_saturation"
    laws = (Saturation,)
    sentence = "its output stays behind the command near the ends of the range"
    looks = "missing only at large commands: the response is cut, whatever the frequency"
    confused_with = ("nonlinear_stiffness", "sensor_nonlinearity", "slew_limit")
    separated_by = (
        "the same shape at half the amplitude, where a limit vanishes altogether, and a second "
        "sensor behind the drive"
    )
    source = "hyperbolic corner, common in describing-function texts"
    where = staticmethod(commands)

    shapes = over(inside=plain(0.02, 0.05, 0.1, 0.18, 0.27, 0.36))
    strengths = ("low", "high")
    at_shape = False

    def made(self, at: Site, inside: float = 0.08) -> Law:
        """Two limits with a soft knee."""
        low, high, knee = _limits(at, inside, inside, KNEE)
        return Saturation(low, high, knee, at.unit or "1")

    def parts(self, law: Law) -> Sequence[Values]:
        """Return what is cut off at the upper and at the lower end: each without the other."""
        low, high, _ = numbers(law)
        never = UNREACHED * (high - low)
        return {"low": low - never}, {"high": high + never}

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return limits where the signature has them or all over."""
        places = _everywhere() if hint is None else _hinted(hint)
        found = [_limits(at, *place) for place in places]
        return [dict(zip(("low", "high", "knee"), values, strict=True)) for values in found]


def _limits(at: Site, below: float, above: float, knee: float) -> tuple[float, float, float]:
    """Return limits and knee that are given in spans of the command inside its ends."""
    past, span = at.past, 2 * at.past.half
    return past.reach(-1.0) + below * span, past.reach(1.0) - above * span, knee * span


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
