"""A drive that can change only so fast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Law, SlewLimit
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Signature
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

RATES = (0.95, 0.85, 0.7, 0.5, 0.35, 0.2)
"""Slew rates to try, in fastest changes of the command."""
JUMPS = (1.0, 4.0, 16.0)
"""Samples that the largest jump of a command of steps may take."""


class SlewLimitEffect(Effect):
    """The drive's output changes at a limited rate."""

    name = "slew_limit"
    family = "drive"
    kind = "command"
    law = "slew_limit"
    laws = (SlewLimit,)
    sentence = "its output cannot change faster than a limited rate"
    looks = "sines become triangles and steps become ramps; slow commands pass unharmed"
    confused_with = ("low_pass", "saturation", "delay")
    separated_by = (
        "the same fast command at half the amplitude: a rate limit vanishes, a lag stays; and a "
        "slow command of full amplitude, which a saturation cuts and a rate limit does not"
    )
    source = "large-signal bandwidth of operational amplifiers and valves"
    where = staticmethod(commands)

    strengths = ("slowness", "falling")

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the slownesses that would show."""
        return [{"slowness": float(s)} for s in _candidates(at.past)]

    def made(self, at: Site, slowness: float = 0.0) -> Law:
        """Return the same limit for both directions."""
        found, unit = _candidates(at.past), f"s/({at.unit or '1'})"
        s = slowness or (float(found[0]) if found.size else at.past.dt)
        return SlewLimit(s, s, unit, even=False, falling=s)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """How far the output stays behind where the command rises and where it falls."""
        found = super().signatures(scene, element)
        # below the command it rises too slowly, above it falls too slowly
        return tuple(
            replace(s, columns=np.hstack([np.minimum(s.columns, 0.0), np.maximum(s.columns, 0.0)]))
            for s in found
        )

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return one rate for each direction, where the signature has it or all over."""
        found = _candidates(at.past)
        if hint is None:
            pairs = [(s, s) for s in found] or [(at.past.dt, at.past.dt)]
        else:
            s = float(hint.shape["slowness"])
            # amplifiers and valves seldom rise as fast as they fall; below the least it is no limit
            less = max(UNEVEN * s, float(found.min(initial=s)))
            pairs = [(s, s), (s, less), (less, s)]
        return [dict(zip(self.strengths, pair, strict=True)) for pair in dict.fromkeys(pairs)]


UNEVEN = 0.6
"""Slowness of one direction over that of the other, where they are tried as different."""


def _candidates(past: PortHistory) -> Array:
    """Slownesses (s per unit) that would show in a command, rising; none if it stands still."""
    change = np.abs(np.diff(past.argument))
    largest = float(change.max(initial=0.0))
    if not largest > 0:
        return np.zeros(0)
    # a command that mostly rests moves in jumps: a limit shows only over many samples
    fast = float(np.quantile(change, 0.98))
    if fast > 0.3 * largest:
        shares = [1.0 / r for r in RATES]
    else:
        shares = [1.02 + k for k in JUMPS]
        shares += [largest / fast / r for r in RATES[1::2]] if fast > 0 else []
    return np.unique(past.dt / largest * np.array(shares))
