"""Diffusion on the way into a store: creep of cells and walls, one number for all times.

A store that is filled by diffusion answers a step with the root of time, and Kelvin-Voigt branches
follow that over as many decades as there are branches.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.diffusion import warburg_ladder
from bondgraph.graph.elements import C, Element, One, R, Zero
from bondgraph.graph.parameter import Parameter, symbol
from identification.diagnosis.catalogue.effect import Insertion, kind_at
from identification.diagnosis.catalogue.places import CAPACITORS, HEAT_STORES, has_unit
from identification.diagnosis.screening.port_history import FittedModel

__all__ = ["DIFFUSION_FORMS", "diffusion_forms"]

DIFFUSION_FORMS = ("warburg",)
"""Laws that `diffusion_forms` may give."""
FASTEST = 4.0
"""Samples of the fastest time that the ladder follows."""
PARTS = (4.0, 1.0)
"""Times the estimate that is begun with: from too little diffusion the descent crawls."""
SENTENCE = "what flows into it diffuses: a step is answered with the root of time"


def diffusion_forms(
    scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
) -> tuple[Insertion, ...]:
    """Return Warburg's impedance in series with a capacitor or a heat store.

    Warburg, Ann. Physik 303 (1899) 493; for heat Carslaw and Jaeger, Conduction of Heat in Solids,
    1959, section 2.9. It starts from where creep ended.
    """
    crept = ended.get("creep")
    if crept is None or not has_unit(element, (*CAPACITORS, *HEAT_STORES)):
        return ()
    past, name = scene.of(element), element.name
    amounts = [crept.get(f"creep_{j}_{name}", 0.0) for j in (1, 2)]
    tau = sqrt(crept.get(f"tau_1_{name}", 1.0) * crept.get(f"tau_2_{name}", 1.0))
    # what a step finds open at that time, beyond what it leaves open for good
    kept = past.slope / (1.0 + sum(amounts))
    size = 0.5 * sqrt(pi * tau) * (past.slope / (1.0 + 0.5 * sum(amounts)) - kept)
    strength = f"W_{name}"
    graph = _with_ladder(scene, element, Parameter(strength, size, "1", lower=0.0, scale=size))
    known = {n: v for n, v in crept.items() if n in scene.graph.parameters}
    whole = {n: v * (1.0 + sum(amounts)) for n, v in known.items() if n == name}
    starts = tuple({**known, **whole, strength: part * size} for part in PARTS)
    return (
        Insertion(
            "creep", "memory", "warburg", name, graph, starts, (strength,), ("leakage",),
            ("hysteresis", "sensor_drift", "low_pass", "leakage"), SENTENCE,
            kind_at("slow", element), form=True,
        ),
    )  # fmt: skip


def _with_ladder(scene: FittedModel, element: Element, size: Parameter) -> BondGraph:
    """Return the graph with the ladder at a 1-junction in front of the store."""
    past, name = scene.of(element), element.name
    ladder = warburg_ladder(past.dt * past.n, FASTEST * past.dt)
    path, w = One(f"diffusion_{name}"), symbol(size.name, positive=True)
    (bond,) = scene.graph.bonds_of(name)
    g = scene.graph.with_inserted(bond, path).with_parameters([size])
    g = g.with_branch(path.name, [R(f"R_fast_{name}", w * ladder.direct)])
    g = g.with_branch(path.name, [C(f"C_slow_{name}", ladder.kept / w)])
    for k, (share, tau) in enumerate(ladder.branches, start=1):
        layer = Zero(f"layer_{k}_{name}")
        g = g.with_branch(path.name, [layer])
        g = g.with_branch(layer.name, [R(f"R_{k}_{name}", w * share)])
        g = g.with_branch(layer.name, [C(f"C_{k}_{name}", tau / share / w)])
    return g
