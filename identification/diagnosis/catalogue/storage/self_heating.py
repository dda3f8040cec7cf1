"""A resistor or a damper that its own heat changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.laws import Law, SelfHeating
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import mechanical_resistors, warming_resistors
from identification.diagnosis.catalogue.site import Site, Values, over, times

SHARES = (0.003, 0.02, 0.1, 0.5)
"""Thermal time constants tried, over the duration of the record."""


class SelfHeatingEffect(Effect):
    """The resistance changes with the energy it has lately turned into heat.

    Wire gains resistance; the oil of a damper loses viscosity.
    """

    name = "self_heating"
    family = "storage"
    kind = "slow"
    law = "lumped_heat"
    laws = (SelfHeating,)
    sentence = "it changes with its own heat, which leaves with a time constant"
    looks = "the flow changes slowly under load and comes back in pauses, whatever its sign"
    confused_with = ("nonlinear_resistance", "time_varying_parameter", "creep")
    separated_by = (
        "a strong flow, a pause and a weak probing flow: the resistance differs just after the "
        "load and comes back in the pause"
    )
    source = "lumped thermal body; Incropera et al., Fundamentals of Heat and Mass Transfer, ch. 5"
    where = staticmethod(warming_resistors)

    weights = ("r_heat",)
    shapes = over(tau=times("duration", *SHARES))
    rebalances = False

    def made(self, at: Site, tau: float = 0.0) -> Law:
        """Return a resistance that changes beside the constant one."""
        unit, flow = "ohm", "A"
        if at.element in mechanical_resistors(at.scene.graph):
            unit, flow = at.unit, at.units[1]
        tau = tau or SHARES[1] * at.past.duration
        return SelfHeating(0.1 * at.past.slope, tau, at.past.rms, unit, flow)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return what the hint says, or either sign at two time constants."""
        if hint is not None:
            tau = float(hint.shape["tau"])
            rises = [(max(float(hint.weights[0]), -self._most(at, tau)), tau)]
        else:
            rises = [
                (sign * min(0.1 * at.past.slope, self._most(at, tau)), tau)
                for tau in (share * at.past.duration for share in SHARES[1::2])
                for sign in (1.0, -1.0)
            ]
        return [{"r_heat": r, "tau_heat": tau} for r, tau in rises]

    def holds(self, at: Site) -> Mapping[str, tuple[float, float]]:
        """Return a slow gain: what work thins may be a fluid that lost its structure."""
        quickest = SHARES[0] * at.past.duration
        return {"r_heat": (0.0, np.inf), "tau_heat": (quickest, np.inf)}

    def _most(self, at: Site, tau: float) -> float:
        """Return what heat may take away: no resistance below zero, which drives what it damps."""
        flow = np.where(at.past.argument == 0.0, np.inf, at.past.argument)
        warmth = at.added(self.made(at, tau), {"r_heat": 1.0}) / flow
        return 0.5 * at.past.slope / max(float(np.max(warmth)), 1.0)
