"""Position-periodic force: cogging of magnets, ripple of teeth and screws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, One
from bondgraph.laws import Law, Periodic
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.screening.port_history import FittedModel, PortHistory, moved_by

PERIODS = (40, 360)
"""Periods of a scan: fewest, and most, where the way is long."""
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
    laws = (Periodic,)
    sentence = "a force that repeats along its way pushes it forth and back"
    looks = (
        "ripple whose frequency follows the speed; plotted over position it is the same wave at "
        "every speed and in both directions"
    )
    confused_with = (
        "periodic_error", "external_disturbance", "nonlinear_ratio", "nonlinear_stiffness",
    )  # fmt: skip
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

    weights = ("a", "b")

    def site(self, scene: FittedModel, element: Element) -> Site:
        """Return the inertia with its way as its history."""
        past = scene.of(element)
        return Site(scene, element, PortHistory(way_of(past), past.output, past.dt))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return columns along the fitted way, and along the recorded one, if there is one.

        A free run soon loses a short period; along its own way a bent model says more of long ones.
        How often a period fits into what was recorded is sure.
        """
        own, past = super().signatures(scene, element), scene.of(element)
        if past.recorded is None:
            return own
        there = replace(
            scene, past={**scene.past, element.name: replace(past, moved=_from_zero(past.recorded))}
        )
        most = float(np.ptp(past.recorded)) / SEEN
        recorded = (
            replace(s, course="recorded")
            for s in super().signatures(there, element)
            if s.shape and s.shape["period"] <= most
        )
        return (*own, *recorded)

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the periods of a scan, and shorter ones at which what is left repeats."""
        way = at.past.argument
        scan = periods(way)
        short = seen_to_repeat(way, at.scene.residual, float(scan.min()))
        return [{"period": float(p)} for p in (*scan, *short)]

    def made(self, at: Site, period: float | None = None) -> Law:
        """Return a periodic force without stiffness."""
        past = at.past
        unit, way_unit = ("N*m", "rad") if "m2" in at.unit else ("N", "m")
        period = float(np.ptp(past.argument) or 1) / 2 if period is None else period
        return Periodic(period, 0.1 * past.swing, past.half, unit, way_unit)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Hang a storage with the law at the junction; it is known which part of the way it saw."""
        past = scene.of(element)
        way = way_of(past) if past.recorded is None else _from_zero(past.recorded)
        made = super().insert(scene, element, hint)
        return replace(made, courses={f"q_ripple_{element.name}": way})

    def with_law(
        self, scene: FittedModel, element: Element, law: Law
    ) -> tuple[BondGraph, tuple[str, ...]]:
        """Hang a storage with the law at the junction of the inertia."""
        g, ripple = scene.graph, C(f"ripple_{element.name}", law=law)
        names = tuple(p.name for p in law.parameters(ripple.name))
        return g.with_branch(g.neighbour(element.name), [ripple]), names

    def holds(self, at: Site) -> Mapping[str, tuple[float, float]]:
        """Return the periods that are seen to repeat."""
        return {"period": (0.0, float(np.ptp(at.past.argument)) / SEEN)}


def way_of(past: PortHistory) -> Array:
    """Displacement of an inertia from its start, shape (N,)."""
    if past.moved is not None:
        return _from_zero(past.moved)
    return moved_by(past.argument, past.dt)


def _from_zero(way: Array) -> Array:
    return np.asarray(way - way[0])


def periods(way: Array, fewest: int = PERIODS[0], most: int = PERIODS[1]) -> Array:
    """Periods to try: from one that the samples still resolve to twice the range.

    Neighbours differ by no more than a third of a turn over the range, as far as `most` reach:
    evenly spaced in one over the period.
    """
    reach = float(np.ptp(way))
    if not reach:
        return np.asarray(1.0 / np.linspace(0.5, 1.0, fewest))
    steps = np.abs(np.diff(way))
    step = float(np.quantile(steps[steps > 0], 0.95))
    least = max(RESOLVED * step, reach / (most / 3), 1e-9 * reach)
    count = int(np.clip(np.ceil(3 * reach / least), fewest, most))
    return np.asarray(1.0 / np.linspace(1 / (2 * reach), max(1 / least, 1 / reach), count))


def seen_to_repeat(way: Array, residual: Array, most: float) -> Array:
    """Return periods shorter than `most` at which a residual repeats along the way, or its rates.

    What acts along the way shows there through the plant, which changes slowly from period to
    period: lines over what lies around them, at periods that the samples resolve.

    Parameters
    ----------
    way : ndarray, shape (N,)
    residual : ndarray, shape (N, n_y)
    """
    from scipy.ndimage import median_filter

    reach = float(np.ptp(way))
    step = float(np.quantile(np.abs(np.diff(way)), 0.95)) if way.size > 1 else 0.0
    least = max(RESOLVED * step, reach / FINEST)
    if not reach or least >= most:
        return np.zeros(0)
    cells = 1 << int(np.ceil(np.log2(4.0 * reach / least)))
    at = np.minimum((way - way.min()) / reach * cells, cells - 1).astype(int)
    waves = np.fft.rfftfreq(3 * cells, 1.0 / cells)  # over the range
    inside = np.flatnonzero((waves > reach / most) & (waves < reach / least))
    found: list[float] = []
    for r in residual.T:
        for signal in (r, np.gradient(r), np.gradient(np.gradient(r))):
            line = np.abs(np.fft.rfft(np.bincount(at, signal, cells), 3 * cells))
            over = line[inside] / np.maximum(median_filter(line[inside], AROUND), 1e-300)
            peaks = np.flatnonzero((over > np.roll(over, 1)) & (over >= np.roll(over, -1)))
            best = peaks[np.argsort(-over[peaks])][:LINES]
            found += [reach / float(w) for w in waves[inside[best]]]
    return np.asarray(sorted(set(found)))


RESOLVED = 2.5
"""Steps of the way that a period takes at least."""
FINEST = 4096
"""Periods in a way that are looked for at most."""
AROUND = 61
"""Neighbours of a line, thirds of a wave over the range, that it is held against."""
LINES = 3
"""Lines of a signal that are tried."""
