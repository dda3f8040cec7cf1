"""A drive that can change only so fast."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws.slew_limit import SlewLimit, slew_limited
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.signal_traces import unit_of, weight_of
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
        """How far the output stays behind, for several rates."""
        u, dt = scene.of(element).argument, scene.data.dt
        slowness = _candidates(u, dt)
        if not slowness.size:
            return (Signature(np.zeros((u.size, 1)), shape={"slowness": 0.0}),)
        behind = slew_limited(u, dt / slowness) - u[:, None]
        return tuple(
            Signature(behind[:, [i]], shape={"slowness": float(s)}) for i, s in enumerate(slowness)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One rate, where the signature has it or all over."""
        u, dt = scene.of(element).argument, scene.data.dt
        slowness = _candidates(u, dt)
        if hint is None:
            starts = [float(s) for s in slowness] or [dt]
        else:
            shape = float(hint.shape["slowness"])
            starts = [shape, shape * weight_of(hint, 0, 0.8, 1.25)]
        law = SlewLimit(starts[0], starts[0], f"s/({unit_of(element)})")
        graph, (name,) = self.with_law(scene, element, law)
        found = tuple({name: s} for s in dict.fromkeys(starts))
        return self.inserted(element, graph, found, (name,))


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
