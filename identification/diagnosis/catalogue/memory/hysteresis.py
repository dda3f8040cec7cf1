"""Hysteresis: output that remembers where its argument turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, R, Source
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Law, MaxwellSlip, Parametrised, StopSum
from bondgraph.laws.along import along
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.friction.forms import way_of
from identification.diagnosis.catalogue.places import (
    commands,
    electrical_resistors,
    sensors,
    storages,
)
from identification.diagnosis.catalogue.site import Site, Values, numbers, of_element
from identification.diagnosis.catalogue.starts import at_least, law_units, reciprocal_unit
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SHARES = np.array([0.03, 0.09, 0.18, 0.3, 0.45, 0.65, 0.9])
"""Thresholds over half of the argument's range; seven stops draw loops of all sizes."""


class Hysteresis(Effect):
    """Rate-independent memory as a bank of stops."""

    name = "hysteresis"
    family = "memory"
    kind = "memory"
    law = "prandtl_ishlinskii"
    laws = (StopSum, MaxwellSlip)
    sentence = "its output depends on the turning points of the past, whatever the speed"
    looks = (
        "loops that open at every reversal, close at the old turning point and keep their area at "
        "every speed; odd harmonics and a lag that no frequency changes"
    )
    confused_with = ("creep", "coulomb_friction", "presliding_friction", "backlash", "delay")
    separated_by = (
        "a slow triangle with small loops inside the large one, then the same at a tenth of the "
        "speed: hysteresis draws the same loops, creep and delay do not, friction of a resistor "
        "and backlash have one width"
    )
    richer = (
        "hysteresis_with_creep", "stops_in_a_potential", "rate_dependent_prandtl_ishlinskii",
        "bouc_wen", "maxwell_slip",
    )  # fmt: skip
    source = "Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages, and what a charge passes; drives and sensors as the unusual places."""
        passed = electrical_resistors(graph)
        return (*storages(graph), *passed, *commands(graph), *sensors(graph))

    def home(self, element: Element) -> bool:
        """Storages and resistors."""
        return isinstance(element, C | R)

    weights = tuple(f"{n}_{i}" for n in "hF" for i in range(1, len(SHARES) + 1))
    rebalances = False

    def made(self, at: Site) -> Law:
        """Return a stop sum beside the linear law; in a resistor its charge drives it."""
        if isinstance(at.element, R):
            ways, (effort, flow, way) = SHARES * _half_way(at), at.units
            level = at_least(at.past.swing, 1e-12) / (5 * len(SHARES))
            return MaxwellSlip(
                tuple(map(float, ways)), level, unit=effort, flow_unit=flow, way_unit=way,
                fitted="levels",
            )  # fmt: skip
        stops = stops_at(at.element, at.past)
        return Parametrised(stops, ("thresholds",), law_units(at.element)[1:])

    def added(self, at: Site, law: Law, values: Values) -> Array:
        """Return the effort along the charge as such: the law would add up the current anew."""
        if not isinstance(law, MaxwellSlip):
            return super().added(at, law, values)
        way, p = way_of(at.scene, at.element), np.array(numbers(law, values))
        if not np.isfinite(way).all():
            return np.full(way.size, np.nan)
        levels, ends = np.split(p, 2)
        return along(StopSum(tuple(map(float, ends))), way - way[0], at.past.dt, levels / ends)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the heights of the hint, and what hardly is a spring any more."""
        if isinstance(law, MaxwellSlip):
            return super().tried(at, law, hint)
        found: Values = {}
        if hint is not None:
            slope = _slope(at.element, at.past)
            # a height at its lower bound of zero would stay there
            weights = np.clip(hint.weights, 1e-3 * slope, 3.0 * slope)
            found = dict(zip(self._weights(law), map(float, weights), strict=True))
        return (found, *_switching(at))

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return richer laws of the memory, see `hysteresis_forms`."""
        from identification.diagnosis.catalogue.memory.hysteresis_forms import hysteresis_forms

        return hysteresis_forms(scene, element, ended)

    def without_zeros(
        self, scene: FittedModel, made: Insertion, values: Mapping[str, float]
    ) -> Insertion | None:
        """Return the stops of a bank that bear anything, numbered anew."""
        from identification.diagnosis.catalogue.memory.hysteresis_forms import bearing

        return bearing(scene, made, values)


def stops_at(element: Element, past: PortHistory) -> StopSum:
    """Return the law whose thresholds share the range of the argument."""
    slope = _slope(element, past)
    return StopSum(
        tuple(float(r) for r in _thresholds(past)), height=0.02 * slope, scale=0.1 * slope,
        sign=_sign(element), unit=_slope_unit(element),
    )  # fmt: skip


def _slope(element: Element, past: PortHistory) -> float:
    """Return the slope of a store in its own unit; a signal path has slope one."""
    return past.slope if isinstance(element, C) else 1.0


SWITCHED, SOFTER = 0.7, 0.2
"""Part of a storage's effort that its stops give where it switches, and what its slope keeps."""


def _switching(at: Site) -> tuple[Values, ...]:
    """Return a start for what hardly is a spring any more: it takes the effort to turn it round.

    The nominal model is a spring and has another history; weights found along that lead astray.
    """
    element, past = at.element, at.past
    own = at.scene.graph.parameters.get(element.name)
    if not isinstance(element, C) or own is None or own.fixed:
        return ()
    level = SWITCHED * past.swing / len(SHARES)
    found = {f"h_{i}": float(level / r) for i, r in enumerate(_thresholds(past), start=1)}
    slope = SOFTER * past.slope
    slope = slope if element.stiffness is not None else 1.0 / slope
    return ({**found, of_element(own.name): slope},)


def _thresholds(past: PortHistory) -> Array:
    return np.asarray(past.half * SHARES)


def _half_way(at: Site) -> float:
    return 0.5 * float(np.ptp(way_of(at.scene, at.element))) or 1.0


def _sign(element: Element) -> float:
    return 1.0 if isinstance(element, C) else -1.0


def _slope_unit(element: Element) -> str:
    if isinstance(element, C):
        own = element.unit or "1"
        return own if element.stiffness is not None else reciprocal_unit(own)
    return "1" if isinstance(element, Source | Sensor) else ""
