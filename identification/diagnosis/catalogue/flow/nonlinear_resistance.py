"""A resistor whose characteristic bends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element, R
from bondgraph.laws import NonlinearResistance, Radiation
from bondgraph.laws.radiation import bent
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import (
    electrical_resistors,
    has_unit,
    hydraulic_resistors,
    other_resistors,
)
from identification.diagnosis.catalogue.starts import rebalanced, tamed
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

ROOM = 293.15
"""Absolute temperature of what heat is lost to, K: 10 K more or less change a share by 7 %."""
LIKE = 0.2
"""Part of a bend, beside any line, by which radiation may miss it and still be tried for it."""
MOST = 1.3
"""Share of the resistance, by its signature, up to which radiation may explain a bend."""
COLD = (1.0, 1.3, 1.7, 2.2)
"""Resistances at small differences tried, over the fitted one, which is that of large ones."""


class NonlinearResistanceEffect(Effect):
    """Effort that is no straight line of the flow; radiation, where heat flows and it bends so."""

    name = "nonlinear_resistance"
    family = "flow"
    kind = "dissipative"
    law = "cubic_characteristic"
    sentence = "its effort bends away from the straight line as more flows"
    looks = "effort over flow is one curve, the same at every speed and with no loop"
    confused_with = ("square_root_flow", "self_heating", "saturation", "diode")
    separated_by = (
        "steady flow at several levels, each held short and long: a bent characteristic answers "
        "at once, heat takes its time"
    )
    source = "series of a characteristic through the origin; Chua, IEEE Trans. Circuit Theory 1969"
    where = staticmethod(other_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Square and cube of the scaled flow."""
        past = scene.of(element)
        z = past.argument / _level(past)
        return (Signature(np.stack([z**2, z**3], axis=1)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term."""
        past = scene.of(element)
        if hint is not None and has_unit(element, ("K/W",)):
            found = _radiating(past, hint)
            if found is not None:
                return self._radiation(scene, element, *found)
        effort, flow = "K", "W"
        if element in electrical_resistors(scene.graph):
            unit = getattr(element, "unit", "")
            effort, flow = "V", "A" if has_unit(element, ("ohm",)) else f"V/({unit})"
        elif element in hydraulic_resistors(scene.graph):
            effort, flow = "Pa", "m3/s"
        size = float(np.abs(past.output).max()) or 1.0
        law = NonlinearResistance(0.1 * size, _level(past), effort, flow)
        graph, names = self.with_law(scene, element, law)
        starts: tuple[dict[str, float], ...] = ({},)
        if hint is not None:
            weights = tamed(hint.weights, size)
            start = {n: float(w) for n, w in zip(names, weights, strict=True)}
            z = past.argument / _level(past)
            added = np.stack([z**2, z**3], axis=1) @ weights
            starts = ({**start, **rebalanced(element, past, added)}, start)
        return self.inserted(element, graph, starts, names)

    def _radiation(
        self, scene: FittedModel, element: Element, share: float, resistance: float
    ) -> Insertion:
        """Insert a share of the resistance that radiates."""
        assert isinstance(element, R)
        own = element.value if isinstance(element.value, str) else element.name
        law = Radiation(share, ROOM, own, resistance, element.unit)
        graph, names = self.with_law(scene, element, law)
        start = {names[-1]: share}
        starts = ({**start, own: resistance}, start)
        inserted = self.inserted(element, graph, starts, names[-1:])
        return replace(
            inserted, law=law.name,
            sentence="its heat grows faster than the temperature difference, as by radiation",
        )  # fmt: skip


def _radiating(past: PortHistory, hint: Hint) -> tuple[float, float] | None:
    """Return share and resistance of radiation that bends as both weights do; None if none does."""
    z = past.argument / _level(past)
    line = np.stack([np.ones_like(z), z], axis=1)
    curves = [z**2 * hint.weights[0] + z**3 * hint.weights[1]]
    curves += [ROOM * bent(NUMPY, r * past.slope * past.argument / ROOM) for r in COLD]
    made = np.stack(curves, axis=1)
    told, *tried = (made - line @ np.linalg.lstsq(line, made, rcond=None)[0]).T
    best, found = LIKE * float(np.linalg.norm(told)), None
    for r, c in zip(COLD, tried, strict=True):
        share = float(told @ c) / max(float(c @ c), 1e-300)
        missed = float(np.linalg.norm(told - share * c))
        if 0.0 < share < MOST and missed < best:
            best, found = missed, (share, r * past.slope)
    return found


def _level(past: PortHistory) -> float:
    return float(np.abs(past.argument).max()) or 1.0
