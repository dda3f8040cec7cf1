"""Resonances without a law: what filters of a mass's flow, of the second order, may add to it.

An attached mass (`added_mode`) is one of them; the mode of a continuum whose shape changes its
sign between the force and the reading is another, and no mass hung anywhere gives it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.signal import cont2discrete, lfilter

from bondgraph.graph.elements import Element
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.catalogue.places import masses
from identification.diagnosis.catalogue.storage.added_mode import peaks
from identification.diagnosis.screening.port_history import FittedModel

DAMPINGS = (0.02, 0.006)
"""Damping ratios: between them lies that of most structures."""
MODES = 3
"""Peaks of what is left that are tried together."""


def mode_forms(scene: FittedModel, element: Element) -> Mapping[str, Signature]:
    """Return the columns of the kind ``mode`` at an inertia of a mechanism, empty elsewhere."""
    if element.name not in {e.name for e in masses(scene.graph)}:
        return {}
    past = scene.of(element)
    runs = np.split(past.argument, scene.data.breaks)  # every recording begins at rest
    found = [
        np.concatenate(parts)
        for omega in peaks(scene)[:MODES]
        for damping in DAMPINGS
        for parts in zip(*(ringing(v, omega, damping, past.dt) for v in runs), strict=True)
    ]
    return {"mode": Signature(np.stack(found, axis=1))} if found else {}


def ringing(flow: Array, omega: float, damping: float, dt: float) -> tuple[Array, Array]:
    """Displacement and velocity of an oscillator that a flow shakes, exact for straight lines.

    ``omega^2 / (s^2 + 2 zeta omega s + omega^2) v`` and ``omega s / (...) v``: any weights of the
    two are a residue of any size and phase.

    Parameters
    ----------
    flow : ndarray, shape (N,)
        From rest.
    omega, damping : float
        rad/s, 1.
    dt : float
        Time between samples, s.

    Returns
    -------
    tuple of ndarray, shape (N,)
    """
    a = np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]])
    b, c, d = np.array([[0.0], [1.0]]), np.diag([omega**2, omega]), np.zeros((2, 1))
    ad, bd, cd, dd, _ = cont2discrete((a, b, c, d), dt, method="foh")
    bottom = np.poly(ad)
    z = flow - flow[0]
    made = []
    for row, direct in zip(cd, dd, strict=True):
        # numerator of c (z - A)^-1 b + d
        top = np.poly(ad - bd @ row[None, :]) + (direct[0] - 1.0) * bottom
        made.append(np.asarray(lfilter(top, bottom, z)))
    return made[0], made[1]
