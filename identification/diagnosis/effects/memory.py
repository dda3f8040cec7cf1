"""Effects with memory: hysteresis and creep."""

from __future__ import annotations

import numpy as np

from bondgraph.drives import Drive
from bondgraph.elements import C, Element, One, Parameter, R, Sensor, Source, Zero, symbol
from bondgraph.graph import BondGraph
from bondgraph.laws import StopSum
from identification.diagnosis.effects.effect import (
    Effect,
    Insertion,
    sensors,
    sources,
    storages,
)
from identification.diagnosis.scene import Scene

STOPS = 12
BRANCHES = 3


class Hysteresis(Effect):
    """Rate-independent memory as a bank of stops."""

    name = "hysteresis"
    family = "memory"
    law = "prandtl_ishlinskii"
    sentence = "its output depends on the turning points of the past, whatever the speed"
    confused_with = ("creep", "coulomb_friction", "delay")
    source = "Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages; drives and sensors as the unusual places."""
        return (*storages(graph), *sources(graph), *sensors(graph))

    def home(self, element: Element) -> bool:
        """Storages."""
        return isinstance(element, C)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Insert a stop sum beside the linear law."""
        past = scene.of(element)
        thresholds = tuple(float(r) for r in past.half * np.linspace(0.03, 0.95, STOPS))
        slope = past.swing / past.half
        stores = isinstance(element, C)
        law = StopSum(
            thresholds, height=0.02 * slope, scale=0.1 * slope, sign=1.0 if stores else -1.0,
            unit=_slope_unit(scene.graph, element),
        )  # fmt: skip
        if isinstance(element, Source):
            graph = scene.graph.with_element(element.name, drive=Drive(law=law))
        else:
            graph = scene.graph.with_element(element.name, law=law)
        names = tuple(p.name for p in law.parameters(element.name))
        return self.inserted(element, graph, ({},), names)


class Creep(Effect):
    """Slow after-effect: Kelvin-Voigt branches in series with a storage."""

    name = "creep"
    family = "memory"
    law = "kelvin_voigt"
    sentence = "it keeps yielding for a while after a step, over several time scales"
    confused_with = ("hysteresis", "sensor_drift", "low_pass")
    source = "Kuhnen and Janocha, Creep and hysteresis compensation, 1998; Kelvin-Voigt chain"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages."""
        return storages(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Insert a 0-junction before the storage, with three branches of resistor and storage."""
        g, name = scene.graph, element.name
        duration = scene.data.dt * scene.data.n
        (bond,) = g.bonds_of(name)
        node = Zero(f"creep_{name}")
        g = g.with_inserted(bond, node)
        slope = scene.graph.coefficient(element)
        strengths = []
        for j, share in zip(range(1, BRANCHES + 1), (0.006, 0.045, 0.3), strict=True):
            amount = Parameter(f"creep_{j}_{name}", 0.01, "1", lower=1e-5, upper=3.0, scale=0.02)
            tau = Parameter(
                f"tau_{j}_{name}", share * duration, "s",
                lower=0.3 * share * duration, upper=3.0 * share * duration,
            )  # fmt: skip
            g = g.with_parameters([amount, tau])
            a, t = symbol(amount.name, positive=True), symbol(tau.name, positive=True)
            branch = One(f"branch_{j}_{name}")
            g = g.with_branch(node.name, [branch])
            g = g.with_branch(branch.name, [C(f"C_{j}_{name}", stiffness=slope / a)])
            g = g.with_branch(branch.name, [R(f"R_{j}_{name}", slope * t / a)])
            strengths.append(amount.name)
        return self.inserted(element, g, ({},), tuple(strengths))


def _slope_unit(graph: BondGraph, element: Element) -> str:
    if isinstance(element, C) and element.stiffness is not None:
        return element.unit
    if isinstance(element, C) and element.unit:
        return f"1/({element.unit})"
    return "1" if isinstance(element, Source | Sensor) else ""
