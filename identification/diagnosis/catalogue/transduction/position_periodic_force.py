"""Position-periodic force: cogging of magnets, ripple of teeth and screws."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, One
from bondgraph.laws import Periodic
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

PERIODS = 40
SEEN = 2.0
"""Periods that the way must cover before anything can be said to repeat."""
NOT_MOVING = ("H", "kg/m4", "kg/m^4")
"""Units of inertias of electric circuits and of fluids."""


class PositionPeriodicForce(Effect):
    """A force that repeats along the way of a mass and does no work over a period."""

    name = "position_periodic_force"
    family = "transduction"
    kind = "restoring"
    law = "periodic_force"
    sentence = "a force that repeats along its way pushes it forth and back"
    looks = (
        "ripple whose frequency follows the speed; plotted over position it is the same wave at "
        "every speed and in both directions"
    )
    confused_with = ("periodic_error", "external_disturbance", "nonlinear_ratio")
    separated_by = (
        "two slow passes over the same way at different constant speeds: this force keeps its "
        "place, a disturbance keeps its frequency; an error of the sensor leaves the current alone"
    )
    source = "Jahns and Soong, IEEE Trans. Ind. Electron. 43 (1996) 321 (cogging torque)"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return the mechanical inertias of 1-junctions."""
        return tuple(
            e
            for e in graph.of_type(I)
            if e.unit not in NOT_MOVING and isinstance(graph[graph.neighbour(e.name)], One)
        )

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Sine and cosine of the position for each period of a scan."""
        past = scene.of(element)
        way = way_of(past)
        found = []
        for p in periods(way):
            turn = 2 * np.pi * way / p
            found.append(Signature.of((np.sin(turn), np.cos(turn)), period=float(p)))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a storage with a periodic law and no stiffness at the junction of the inertia."""
        past = scene.of(element)
        way = way_of(past)
        period = float(hint.shape["period"]) if hint is not None else 0.5 * float(np.ptp(way) or 1)
        name = f"ripple_{element.name}"
        unit, way_unit = ("N*m", "rad") if "m2" in getattr(element, "unit", "") else ("N", "m")
        law = Periodic(period, 0.1 * past.swing, 0.5 * float(np.ptp(way)) or 1.0, unit, way_unit)
        node = scene.graph.neighbour(element.name)
        graph = scene.graph.with_branch(node, [C(name, law=law)])
        names = tuple(p.name for p in law.parameters(name))
        starts: dict[str, float] = {names[2]: period}
        if hint is not None:
            starts |= dict(zip(names, map(float, hint.weights), strict=False))
        longest = float(np.ptp(way)) / SEEN
        return self.inserted(element, graph, (starts,), names[:2], ((names[2], 0.0, longest),))


def way_of(past: PortHistory) -> Array:
    """Displacement of an inertia from its start, shape (N,)."""
    if past.moved is not None:
        return np.asarray(past.moved - past.moved[0])
    steps = 0.5 * past.dt * (past.argument[1:] + past.argument[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def periods(way: Array, count: int = PERIODS) -> Array:
    """Periods to try: from one that the samples still resolve to twice the range.

    Neighbours differ by no more than a third of a turn over the range where `count` allows it:
    evenly spaced in one over the period.
    """
    reach = float(np.ptp(way)) or 1.0
    step = float(np.quantile(np.abs(np.diff(way)), 0.95)) if way.size > 1 else reach
    least = max(4 * step, reach / (count / 3), 1e-9 * reach)
    return np.asarray(1.0 / np.linspace(1 / (2 * reach), max(1 / least, 1 / reach), count))
