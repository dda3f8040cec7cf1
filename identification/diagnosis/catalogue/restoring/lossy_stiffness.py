"""A bent spring whose bent part has a loss of its own."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import LossySpring, Parametrised
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import storages
from identification.diagnosis.catalogue.starts import rebalanced, tamed
from identification.diagnosis.screening.port_history import FittedModel, PortHistory


class LossyStiffness(Effect):
    """Effort bends away from the straight line, and what bends it loses energy as it changes."""

    name = "lossy_stiffness"
    family = "restoring"
    kind = "surface"
    law = "polynomial_with_loss"
    sentence = "its effort bends away from the straight line, and the bent part costs energy"
    looks = "a smooth curve of effort over displacement whose loops widen away from the middle"
    confused_with = ("nonlinear_stiffness", "quadratic_drag", "hysteresis")
    simpler = ("nonlinear_stiffness",)
    separated_by = (
        "free decays from several heights: with a lossy spring they fade faster the higher they "
        "begin, in proportion to the square of the height"
    )
    source = "Findley, Lai, Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976"
    where = staticmethod(storages)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Square and cube of the scaled displacement, and their rates times the shortest time."""
        past = scene.of(element)
        powers = _powers(past)
        return (Signature(np.hstack([powers, np.gradient(powers, axis=0)])),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term about the centre of the record, and the time of the loss."""
        past = scene.of(element)
        law = LossySpring(past.centre, past.half, 0.1 * past.swing, past.dt)
        graph, _ = self.with_law(scene, element, Parametrised(law, ("centre", "half")))
        names = tuple(p.name for p in law.parameters(element.name))
        starts: tuple[dict[str, float], ...] = ({},)
        if hint is not None:
            bent = tamed(hint.weights[:2], past.swing)
            size = float(hint.weights[:2] @ hint.weights[:2])
            loss = past.dt * float(hint.weights[2:] @ hint.weights[:2]) / (size or 1.0)
            start = dict(zip(names, (float(bent[0]), float(bent[1]), loss), strict=True))
            added = _powers(past) @ bent
            starts = ({**start, **rebalanced(element, past, added)}, start)
        return self.inserted(element, graph, starts, names)


def _powers(past: PortHistory) -> Array:
    z = (past.argument - past.centre) / past.half
    return np.stack([z**2, z**3], axis=1)
