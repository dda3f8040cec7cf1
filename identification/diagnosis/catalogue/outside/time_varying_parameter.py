"""Time-varying parameter: a stiffness or a resistance that changes during the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, R
from bondgraph.laws import Ageing, Law, Onset, TimedSlope, Tone
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.places import storages
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import reciprocal_unit

MOMENTS = 12
"""Times tried for a jump, evenly over the record."""
SWINGS = tuple(1.5 + 0.5 * i for i in range(17))
"""Periods over the record of the swings tried: faster ones are no change of a value."""


class TimeVaryingParameter(Effect):
    """Slope of a storage or a resistor that drifts, jumps at one moment, or swings slowly."""

    name = "time_varying_parameter"
    family = "outside"
    kind = "time"
    law = "ageing"
    laws = (Ageing, TimedSlope)
    sentence = "its value changes while the record lasts"
    looks = (
        "the same command gives another answer late in the record than early; each stretch alone "
        "is fitted well, with another value"
    )
    confused_with = ("nonlinear_stiffness", "sensor_drift", "creep", "self_heating")
    separated_by = (
        "the same excitation twice with a long pause, and once at half the amplitude: a drift "
        "changes between the two equal parts, a nonlinear law between the amplitudes"
    )
    source = "Taylor series of the parameter over time; a step; a line of its Fourier series"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages and resistors of every domain."""
        return (*storages(graph), *(e for e in graph.of_type(R) if e.law is None))

    weights = ("a_t", "b_t", "h", "a", "b")
    rebalances = False

    def grid(self, at: Site) -> Sequence[Values]:
        """Return a drift, steps and swings."""
        whole = at.past.duration
        moments = np.arange(1, MOMENTS) / MOMENTS
        return [
            {}, *({"moment": float(share * whole)} for share in moments),
            *({"frequency": turns / whole} for turns in SWINGS),
        ]  # fmt: skip

    def made(self, at: Site, moment: float | None = None, frequency: float | None = None) -> Law:
        """Return a slope that drifts, jumps at a moment, or swings."""
        whole, size, unit = at.past.duration, 0.1 * at.past.slope, at.unit or "1"
        if isinstance(at.element, C) and at.element.stiffness is None:
            unit = reciprocal_unit(unit)
        if moment is not None:
            spacing = whole / MOMENTS
            return TimedSlope(
                Onset(moment, 0.1 * spacing, 1.5 * spacing, size, unit, free_standing=False)
            )
        if frequency is not None:
            return TimedSlope(Tone(frequency, 1 / whole, size, unit, False))
        return Ageing(whole, size, unit)
