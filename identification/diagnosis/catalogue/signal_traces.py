"""What signals become on their way: lagged, late, seen without a sensor's nuisances."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from identification.diagnosis.catalogue.effect import Hint, Signature
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.catalogue.site import Site
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

LAGS = (0.4, 2.0, 6.0, 20.0, 100.0)
"""Time constants to try, in samples."""


def lateness(scene: FittedModel, element: Element) -> tuple[Signature, ...]:
    """Return how far a signal stays behind itself, for several time constants of a lag."""
    s, dt = scene.of(element).argument, scene.data.dt
    tried = (k * dt for k in LAGS if k < 0.1 * scene.data.n)
    return tuple(Signature.of((lagged(s, tau, dt) - s,), tau=tau) for tau in tried)


def reading(scene: FittedModel, element: Element) -> Site:
    """Return a sensor with its simulated reading before the fitted offset as its history."""
    # the catalogue is listed without loading what simulates
    from identification.study.residual import offset_scale, slots

    problem = scene.nominal.problem
    at = scene.data.names.index(element.name)
    theta = scene.nominal.point.theta[slots(problem).offsets]
    y = scene.of(element).argument - float(theta[at] * offset_scale(problem)[at])
    return Site(scene, element, PortHistory(y, y, scene.data.dt))


def weight_of(hint: Hint | None, at: int = 0, low: float = 0.3, high: float = 3.0) -> float:
    """Weight of one column, kept to where a first-order step still means something; 1 without."""
    if hint is None or at >= hint.weights.size:
        return 1.0
    return float(np.clip(hint.weights[at], low, high))
