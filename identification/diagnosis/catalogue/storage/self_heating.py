"""A resistor that grows with its own heat."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bondgraph.graph.elements import Element
from bondgraph.laws import SelfHeating
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import electrical_resistors
from identification.diagnosis.catalogue.starts import at_least
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SHARES = (0.003, 0.02, 0.1, 0.5)
"""Thermal time constants tried, over the duration of the record."""


class SelfHeatingEffect(Effect):
    """The resistance grows with the energy it has lately turned into heat."""

    name = "self_heating"
    family = "storage"
    kind = "slow"
    law = "lumped_heat"
    sentence = "it grows with its own heat, which leaves with a time constant"
    looks = "the current sinks slowly under load and recovers in pauses, whatever its sign"
    confused_with = ("nonlinear_resistance", "time_varying_parameter", "creep")
    separated_by = (
        "a strong current, a pause and a weak probing current: the resistance is high just after "
        "the load and comes back in the pause"
    )
    source = "lumped thermal body; Incropera et al., Fundamentals of Heat and Mass Transfer, ch. 5"
    where = staticmethod(electrical_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Temperature rise times flow, for several time constants."""
        past = scene.of(element)
        return tuple(
            Signature.of((warmth(past.argument / past.rms, tau, past.dt) * past.argument,), tau=tau)
            for tau in _time_constants(past)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a resistance that grows beside the constant one."""
        past = scene.of(element)
        size, taus = past.slope, _time_constants(past)
        tried = [(0.1 * size, taus[1]), (0.1 * size, taus[3])]
        if hint is not None:
            tried = [(at_least(hint.weights[0], 0.01 * size), float(hint.shape["tau"]))]
        law = SelfHeating(0.1 * size, tried[0][1], past.rms)
        graph, (rise, tau) = self.with_law(scene, element, law)
        starts = tuple({rise: r, tau: t} for r, t in tried)
        return self.inserted(element, graph, starts, (rise,))


def warmth(relative: Array, tau: float, dt: float) -> Array:
    """Temperature rise of a body heated by the square of a flow, from cold.

    Parameters
    ----------
    relative : ndarray, shape (N,)
        Flow over its reference level.
    tau, dt : float
        Time constant and time between samples, s.

    Returns
    -------
    ndarray, shape (N,)
        Over the rise that the reference level would keep up.
    """
    kept = float(np.exp(-dt / tau))
    heat = np.concatenate([[0.0], 0.5 * (relative[1:] ** 2 + relative[:-1] ** 2)])
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], heat))


def _time_constants(past: PortHistory) -> tuple[float, ...]:
    return tuple(share * past.dt * past.n for share in SHARES)
