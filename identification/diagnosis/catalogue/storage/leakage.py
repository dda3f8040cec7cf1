"""A store that does not keep what it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from sympy import Expr

from bondgraph.graph.elements import Element, R, Sf, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.laws import Orifice
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import (
    CAPACITORS,
    HEAT_STORES,
    ends,
    has_unit,
    vessels,
)
from identification.diagnosis.catalogue.starts import at_least
from identification.diagnosis.screening.port_history import FittedModel, moved_by

SEEPS, HOLE = 0.0, 1.0
"""A leak in proportion to the effort, or to its root."""
NARROW = 0.01
"""Part of the effort that is lost in proportion to the flow through a hole: it has a length."""


class Leakage(Effect):
    """Charge, heat or volume seeps out in proportion to the effort, or to its root."""

    name = "leakage"
    family = "storage"
    kind = "slow"
    law = "parallel_resistor"
    sentence = "it leaks: what it holds seeps away the faster the higher its effort"
    looks = "the level sinks while nothing is drawn, and slow changes come out too small"
    confused_with = ("internal_leakage", "creep", "sensor_drift", "overflow")
    separated_by = (
        "fill it, close everything and wait at two levels: a leak empties it towards zero at a "
        "rate that grows with the level; creep ends, drift does not care about the level"
    )
    source = "self-discharge resistor of a capacitor; Torricelli 1643 (a hole in a tank)"
    meanings: ClassVar[Mapping[str, str]] = {
        "leak": "rate at which what is stored seeps out",
    }
    where = staticmethod(vessels)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort lost with what has seeped away, and with what has left through a hole."""
        past = scene.of(element)
        flows = {SEEPS: past.argument, HOLE: through_hole(past.output)}
        return tuple(
            Signature((-past.slope * moved_by(f, past.dt))[:, None], shape={"way": way})
            for way, f in flows.items()
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a resistor or a hole across the storage, whichever explained more."""
        past, name, g = scene.of(element), element.name, scene.graph
        (bond,) = g.bonds_of(name)
        junction = g[g.neighbour(name)]
        if not isinstance(junction, Zero):
            junction = Zero(f"leaking_{name}")
            g = g.with_inserted(bond, junction)
        duration = past.duration
        typical = 0.1 / duration
        if hint is not None and hint.shape["way"] == HOLE:
            level = float(np.abs(past.output).max()) or 1.0
            least = 0.1 * typical * past.largest
            full = at_least(hint.weights[0] * np.sqrt(level), least)
            leak, rate = hole(element, full, level)
            tried = [full, 3 * full]
        else:
            leak, rate = seep(name, typical, duration, past.dt, g.coefficient(element))
            g = g.with_parameters([rate])
            tried = [typical, 30 * typical]
            if hint is not None:
                tried = [at_least(hint.weights[0], 0.1 * typical)]
        g = g.with_branch(junction.name, [leak])
        made = self.inserted(element, g, tuple({rate.name: v} for v in tried), (rate.name,))
        if isinstance(leak.law, Orifice):
            made = replace(made, law=leak.law.name)
        # what feeds it may lose the same inside: a pump slips, a current source has a resistance
        node = scene.graph.neighbour(name)
        beside = (scene.graph[m] for m in ends(scene.graph, node) if m != name)
        feeds = next((e for e in beside if isinstance(e, Sf) and not e.measured), None)
        if feeds is None or not isinstance(scene.graph[node], Zero):
            return made
        says = f"; a loss inside {feeds.name}, whose flow falls with the effort, is the same"
        return replace(made, sentence=self.sentence + says)


def through_hole(effort: Array) -> Array:
    """Return the flow through a hole that lets one unit of flow pass at one of effort."""
    return np.asarray(np.sign(effort) * np.sqrt(np.abs(effort)))


def seep(
    name: str, typical: float, duration: float, dt: float, slope: Expr, word: str = "leak"
) -> tuple[R, Parameter]:
    """Return the resistor of a leak and its parameter: the rate, slope over resistance."""
    rate = Parameter(
        f"{word}_{name}", typical, "1/s", lower=1e-5 / duration, upper=1.0 / dt, scale=typical
    )
    return R(f"R_{word}_{name}", slope / symbol(rate.name, positive=True)), rate


def hole(element: Element, full: float, level: float, word: str = "leak") -> tuple[R, Parameter]:
    """Return the hole of a leak, and its parameter: the flow at the highest effort."""
    flow, effort = "m3/s", "Pa"
    if has_unit(element, CAPACITORS):
        flow, effort = "A", "V"
    elif has_unit(element, HEAT_STORES):
        flow, effort = "W", "K"
    law, name = Orifice(full, level, flow, effort), f"R_{word}_{element.name}"
    return R(name, NARROW * level / full, law=law, fixed=True), law.parameters(name)[0]
