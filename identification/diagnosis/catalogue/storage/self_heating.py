"""A resistor or a damper that its own heat changes."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import SelfHeating
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import mechanical_resistors, warming_resistors
from identification.diagnosis.catalogue.starts import rubbing_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

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
    sentence = "it changes with its own heat, which leaves with a time constant"
    looks = "the flow changes slowly under load and comes back in pauses, whatever its sign"
    confused_with = ("nonlinear_resistance", "time_varying_parameter", "creep")
    separated_by = (
        "a strong flow, a pause and a weak probing flow: the resistance differs just after the "
        "load and comes back in the pause"
    )
    source = "lumped thermal body; Incropera et al., Fundamentals of Heat and Mass Transfer, ch. 5"
    where = staticmethod(warming_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Temperature rise times flow, for several time constants."""
        past = scene.of(element)
        return tuple(
            Signature.of((warmth(past.argument / past.rms, tau, past.dt) * past.argument,), tau=tau)
            for tau in _time_constants(past)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a resistance that changes beside the constant one."""
        past = scene.of(element)
        size, taus = past.slope, _time_constants(past)
        if hint is not None:
            rise, tau = float(hint.weights[0]), float(hint.shape["tau"])
            tried = [(max(rise, -_most(past, tau)), tau)]
        else:
            tried = [
                (sign * min(0.1 * size, _most(past, tau)), tau)
                for tau in (taus[1], taus[3]) for sign in (1.0, -1.0)
            ]  # fmt: skip
        unit, flow = ("ohm", "A")
        if element in mechanical_resistors(scene.graph):
            unit, flow = element.unit, rubbing_units(element)[1]  # type: ignore[attr-defined]
        law = SelfHeating(0.1 * size, tried[0][1], past.rms, unit=unit, flow_unit=flow)
        graph, (gained, pace) = self.with_law(scene, element, law)
        starts = tuple({gained: r, pace: t} for r, t in tried)
        # what work thins may be warm oil or a fluid that lost its structure; nor is heat quick
        within = ((gained, 0.0, np.inf), (pace, taus[0], np.inf))
        return self.inserted(element, graph, starts, (gained,), within)


def _most(past: PortHistory, tau: float) -> float:
    """Gain that heat may take away: a resistance below zero would drive what it should damp."""
    warmest = float(np.max(warmth(past.argument / past.rms, tau, past.dt)))
    return 0.5 * past.slope / max(warmest, 1.0)


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
    from scipy.signal import lfilter

    kept = float(np.exp(-dt / tau))
    heat = np.concatenate([[0.0], 0.5 * (relative[1:] ** 2 + relative[:-1] ** 2)])
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], heat))


def _time_constants(past: PortHistory) -> tuple[float, ...]:
    return tuple(share * past.dt * past.n for share in SHARES)
