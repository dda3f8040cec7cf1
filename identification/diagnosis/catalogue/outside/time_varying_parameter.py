"""Time-varying parameter: a stiffness or a resistance that changes during the record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, R
from bondgraph.laws import Ageing, Law, Onset, TimedSlope, Tone
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import storages
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

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

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Argument times the time and its square; times a step; times a sine and a cosine."""
        past = scene.of(element)
        s, t, whole = past.argument, past.time, _duration(scene)
        found = [Signature(np.stack([s * t / whole, s * (t / whole) ** 2], axis=1))]
        for share in np.arange(1, MOMENTS) / MOMENTS:
            shape = {"moment": float(share * whole)}
            p = (1.0, *(x.value for x in _law(past, whole, shape, "1").parameters("x")[1:]), 0.0)
            column = _law(past, whole, shape, "1").deviation(NUMPY, s, (t,), p)
            found.append(Signature(np.asarray(column)[:, None], shape=shape))
        for turns in SWINGS:
            turn = 2 * np.pi * turns * t / whole
            shape = {"frequency": float(turns / whole)}
            found.append(Signature.of((s * np.sin(turn), s * np.cos(turn)), **shape))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Give the element a law whose slope follows the course of the hint, or drifts."""
        shape = hint.shape if hint is not None else {}
        law = _law(scene.of(element), _duration(scene), shape, _slope_unit(element))
        graph, names = self.with_law(scene, element, law)
        strengths = names[:1] if "moment" in shape else names[:2]
        starts = {} if hint is None else hint.by_name(strengths)
        return self.inserted(element, graph, (starts,), strengths)


def _law(past: PortHistory, whole: float, shape: Mapping[str, float], unit: str) -> Law:
    size = 0.1 * past.slope
    if "moment" in shape:
        spacing = whole / MOMENTS
        onset = Onset(shape["moment"], 0.1 * spacing, 1.5 * spacing, size, unit)
        return TimedSlope(replace(onset, free_standing=False))
    if "frequency" in shape:
        return TimedSlope(Tone(shape["frequency"], 1 / whole, size, unit, False))
    return Ageing(whole, size, unit)


def _duration(scene: FittedModel) -> float:
    return float(scene.data.dt * scene.data.n)


def _slope_unit(element: Element) -> str:
    unit = str(getattr(element, "unit", "")) or "1"
    return f"1/({unit})" if isinstance(element, C) and element.stiffness is None else unit
