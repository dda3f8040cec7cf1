"""A store that does not keep what it holds."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element, Parameter, R, Zero, symbol
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import vessels
from identification.diagnosis.catalogue.starts import at_least
from identification.diagnosis.screening.port_history import FittedModel


class Leakage(Effect):
    """Charge, heat or volume seeps out in proportion to the effort."""

    name = "leakage"
    family = "storage"
    kind = "slow"
    law = "parallel_resistor"
    sentence = "it leaks: what it holds seeps away in proportion to its effort"
    looks = "the level sinks while nothing is drawn, and slow changes come out too small"
    confused_with = ("creep", "sensor_drift", "overflow")
    separated_by = (
        "fill it, close everything and wait at two levels: a leak empties it towards zero at a "
        "rate in proportion to the level; creep ends, drift does not care about the level"
    )
    source = "self-discharge resistor of a capacitor; linear outflow of a tank"
    where = staticmethod(vessels)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort lost with what has seeped away."""
        past = scene.of(element)
        q = past.argument
        seeped = np.concatenate([[0.0], np.cumsum(0.5 * (q[1:] + q[:-1]))]) * past.dt
        return (Signature((-past.slope * seeped)[:, None]),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a resistor across the storage; its value is slope over rate."""
        past, g, name = scene.of(element), scene.graph, element.name
        duration = past.dt * past.n
        typical = 0.1 / duration
        rate = Parameter(
            f"leak_{name}", typical, "1/s", lower=1e-5 / duration, upper=1.0 / past.dt,
            scale=typical,
        )  # fmt: skip
        slope = g.coefficient(element)
        (bond,) = g.bonds_of(name)
        junction = g[g.neighbour(name)]
        if not isinstance(junction, Zero):
            junction = Zero(f"leaking_{name}")
            g = g.with_inserted(bond, junction)
        leak = R(f"R_leak_{name}", slope / symbol(rate.name, positive=True))
        g = g.with_parameters([rate]).with_branch(junction.name, [leak])
        tried = [typical, 30 * typical]
        if hint is not None:
            tried = [at_least(hint.weights[0], 0.1 * typical)]
        return self.inserted(element, g, tuple({rate.name: v} for v in tried), (rate.name,))
