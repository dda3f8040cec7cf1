"""A resistor whose characteristic bends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element, R
from bondgraph.laws import Law, NonlinearResistance, Radiation
from bondgraph.laws.radiation import bent
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import (
    electrical_resistors,
    has_unit,
    hydraulic_resistors,
    other_resistors,
    sense,
)
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import tamed
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

ROOM = 293.15
"""Absolute temperature of what heat is lost to, K: 10 K more or less change a share by 7 %."""
LIKE = 0.2
"""Part of a bend, beside any line, by which radiation may miss it and still be tried for it."""
MOST = 1.3
"""Share of the flow, by its signature, up to which radiation may explain a bend."""
LEAST, ALL = 0.05, 0.95
"""Smallest and largest share that a fit begins with: the ends of the range move no more."""
HEAT = ("K/W",)
COLD = (1.0, 1.3, 1.7, 2.2)
"""Resistances at small differences tried, over the fitted one, which is that of large ones."""


class NonlinearResistanceEffect(Effect):
    """Effort that is no straight line of the flow; radiation, where heat flows and it bends so."""

    name = "nonlinear_resistance"
    family = "flow"
    kind = "dissipative"
    law = "cubic_characteristic"
    laws = (NonlinearResistance, Radiation)
    sentence = "its effort bends away from the straight line as more flows"
    looks = "effort over flow is one curve, the same at every speed and with no loop"
    confused_with = ("square_root_flow", "self_heating", "saturation", "diode")
    separated_by = (
        "steady flow at several levels, each held short and long: a bent characteristic answers "
        "at once, heat takes its time"
    )
    source = "series of a characteristic through the origin; Chua, IEEE Trans. Circuit Theory 1969"
    where = staticmethod(other_resistors)

    weights = ("a_2", "a_3")

    def made(self, at: Site) -> Law:
        """Quadratic and cubic term."""
        effort, flow, graph = "K", "W", at.scene.graph
        if at.element in electrical_resistors(graph):
            effort, flow = "V", "A" if has_unit(at.element, ("ohm",)) else f"V/({at.unit})"
        elif at.element in hydraulic_resistors(graph):
            effort, flow = at.units[0], "m3/s"
        return NonlinearResistance(0.1 * _most(at.past), at.past.largest, effort, flow)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return the curve's, and where heat flows those of radiation as well."""
        found = super().signatures(scene, element)
        if not has_unit(element, HEAT):
            return found
        way, past = sense(scene.graph, element), scene.of(element)
        return *found, *(
            Signature((way * _bent(past, r))[:, None], shape={"cold": r}, course="radiates")
            for r in COLD
        )

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the weights, shrunk until the curve rises everywhere."""
        if hint is None:
            return ({},)
        return (dict(zip(self.weights, tamed(hint.weights, _most(at.past)), strict=True)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term, or radiation that bends as both of the hint do."""
        if hint is not None and has_unit(element, HEAT):
            at, cold = self.site(scene, element), (hint.shape or {}).get("cold")
            if cold is not None:
                share = min(max(float(hint.weights[0]), LEAST), ALL)
                return self._radiation(scene, element, share, cold * at.past.slope)
            bend = at.added(self.made(at), dict(zip(self.weights, hint.weights, strict=True)))
            found = _radiating(at.past, bend)
            if found is not None:
                return self._radiation(scene, element, *found)
        return super().insert(scene, element, hint)

    def _radiation(
        self, scene: FittedModel, element: Element, share: float, resistance: float
    ) -> Insertion:
        """Insert a share that radiates, beside the rest that conducts."""
        assert isinstance(element, R)
        own = element.value if isinstance(element.value, str) else element.name
        share = min(share, ALL)
        law = Radiation(share, ROOM, own, resistance, element.unit)
        graph, names = self.with_law(scene, element, law)
        start = {names[-1]: share}
        starts = ({**start, own: resistance}, start)
        inserted = self.inserted(element, graph, starts, names[-1:])
        return replace(
            inserted, law=law.name,
            sentence="its heat grows faster than the temperature difference, as by radiation (or, "
            "less steeply, by free convection)",
        )  # fmt: skip


def _radiating(past: PortHistory, bend: Array) -> tuple[float, float] | None:
    """Return share and resistance of radiation that bends so; None if none does."""
    z = past.argument / past.largest
    line = np.stack([np.ones_like(z), z], axis=1)
    curves = [bend]
    curves += [_bent(past, r) for r in COLD]
    made = np.stack(curves, axis=1)
    told, *tried = (made - line @ np.linalg.lstsq(line, made, rcond=None)[0]).T
    best, found = LIKE * float(np.linalg.norm(told)), None
    for r, c in zip(COLD, tried, strict=True):
        share = float(told @ c) / max(float(c @ c), 1e-300)
        missed = float(np.linalg.norm(told - share * c))
        if 0.0 < share < MOST and missed < best:
            best, found = missed, (share, r * past.slope)
    return found


def _bent(past: PortHistory, cold: float) -> Array:
    """Return what is added to a resistance at small differences if all of it radiates, K."""
    return np.asarray(ROOM * bent(NUMPY, cold * past.slope * past.argument / ROOM))


def _most(past: PortHistory) -> float:
    return float(np.abs(past.output).max()) or 1.0
