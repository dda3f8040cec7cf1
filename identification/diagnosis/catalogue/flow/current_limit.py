"""A current that cannot exceed a limit."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import CurrentLimit, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import electrical_resistors, has_unit
from identification.diagnosis.catalogue.site import Site, Values, numbers, over, plain
from identification.diagnosis.catalogue.starts import shared_slope

FAR = 1e9
"""Largest flows at which a limit does nothing."""
AWAY = 2.0
"""The same of one that a fit may still move into the motion."""
COUNTS = 0.1
"""Share of the larger weight below which an end is left alone."""


class CurrentLimitEffect(Effect):
    """What drives the current through a resistor gives and takes only so much."""

    name = "current_limit"
    family = "flow"
    kind = "dissipative"
    law = "current_limit"
    laws = (CurrentLimit,)
    sentence = "its current cannot exceed a limit"
    looks = (
        "fast, large steps become ramps of one slope, as the current into a capacitive load stays "
        "at its limit; small or slow ones pass unharmed"
    )
    confused_with = ("slew_limit", "nonlinear_resistance", "saturation", "low_pass")
    separated_by = (
        "the same command at a third of the amplitude, where a limit vanishes and a lag stays, and "
        "with another load: a limit of the current changes the slope of the ramps, one of the "
        "command does not"
    )
    source = "peak current of high-voltage amplifiers, data sheets"
    where = staticmethod(electrical_resistors)

    shapes = over(share=plain(0.2, 0.35, 0.5, 0.65, 0.8, 0.92))
    strengths = ("low", "high")
    at_shape = False
    rebalances = False

    def made(self, at: Site, share: float = 0.5) -> Law:
        """Return limits that are shares of the largest flow either way."""
        unit = "A" if has_unit(at.element, ("ohm",)) else f"V/({at.unit})"
        most = at.past.largest
        return CurrentLimit(
            **shared_slope(at.element, at.past), low=-share * most, high=share * most, unit=unit
        )

    def parts(self, law: Law) -> Sequence[Values]:
        """Return what each limit takes away, without the other."""
        _, low, high = numbers(law)
        return {"low": FAR * low}, {"high": FAR * high}

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return limits where the signature has them or all over: the linear model passes them."""
        most = at.past.largest
        pairs = [(0.8, 0.8), (0.5, 0.5), (0.3, 0.3)]
        if hint is not None:
            share = float(hint.shape["share"])
            high, low = (float(w) for w in hint.weights)
            least = COUNTS * max(high, low)
            ends = (share if low > least else AWAY, share if high > least else AWAY)
            pairs = list(dict.fromkeys([ends, (share, share), (0.6 * share, 0.6 * share), *pairs]))
        return [{"low": -low * most, "high": high * most} for low, high in pairs]
