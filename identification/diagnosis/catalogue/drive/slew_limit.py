"""A drive that can change only so fast."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws.slew_limit import SlewLimit, slew_limited
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.signal_traces import unit_of
from identification.diagnosis.screening.port_history import FittedModel

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
    sentence = "its output cannot change faster than a limited rate"
    looks = "sines become triangles and steps become ramps; slow commands pass unharmed"
    confused_with = ("low_pass", "saturation", "delay")
    separated_by = (
        "the same fast command at half the amplitude: a rate limit vanishes, a lag stays; and a "
        "slow command of full amplitude, which a saturation cuts and a rate limit does not"
    )
    source = "large-signal bandwidth of operational amplifiers and valves"
    where = staticmethod(commands)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """How far the output stays behind where the command rises and where it falls."""
        u, dt = scene.of(element).argument, scene.data.dt
        slowness = _candidates(u, dt)
        if not slowness.size:
            return (Signature(np.zeros((u.size, 2)), shape={"slowness": 0.0}),)
        behind = slew_limited(u, dt / slowness) - u[:, None]
        # below the command it rises too slowly, above it falls too slowly
        return tuple(
            Signature(
                np.stack([np.minimum(b, 0.0), np.maximum(b, 0.0)], axis=1),
                shape={"slowness": float(s)},
            )
            for b, s in zip(behind.T, slowness, strict=True)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One rate for each direction, where the signature has it or all over."""
        u, dt = scene.of(element).argument, scene.data.dt
        slowness = _candidates(u, dt)
        if hint is None:
            starts = [(float(s), float(s)) for s in slowness] or [(dt, dt)]
        else:
            s = float(hint.shape["slowness"])
            # amplifiers and valves seldom rise as fast as they fall; below the least it is no limit
            less = max(UNEVEN * s, float(slowness.min(initial=s)))
            starts = [(s, s), (s, less), (less, s)]
        size = starts[0][0]
        law = SlewLimit(size, size, f"s/({unit_of(element)})", even=False, falling=size)
        graph, names = self.with_law(scene, element, law)
        found = tuple(dict(zip(names, s, strict=True)) for s in dict.fromkeys(starts))
        return self.inserted(element, graph, found, tuple(names))


UNEVEN = 0.6
"""Slowness of one direction over that of the other, where they are tried as different."""


def _candidates(u: Array, dt: float) -> Array:
    """Slownesses (s per unit) that would show in `u`, rising; none if it stands still."""
    change = np.abs(np.diff(u))
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
    return np.unique(dt / largest * np.array(shares))
