"""Resonances without a law: what filters of a mass's flow, of the second order, may add to it.

An attached mass (`added_mode`) is one of them; the mode of a continuum whose shape changes its
sign between the force and the reading is another, and no mass hung anywhere gives it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.graph.elements import Element
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.catalogue.places import masses
from identification.diagnosis.catalogue.storage.added_mode import peaks, ringing
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
