"""Richer laws of dry friction: tried where a simple one explains much, but not all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, One, R, Se
from bondgraph.laws import (
    AsymmetricCoulomb,
    FrictionAlongWay,
    FrictionUnderLoad,
    Law,
    LuGre,
    MaxwellSlip,
    Odometer,
)
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Insertion, kind_at
from identification.diagnosis.catalogue.places import SPRINGS, TANKS, has_unit, store_of_way
from identification.diagnosis.catalogue.starts import at_least, rubbing_units
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.screening.port_history import FittedModel

FRICTION_FORMS = (
    "lugre", "maxwell_slip", "asymmetric_coulomb", "coulomb_along_way", "coulomb_under_load",
)  # fmt: skip
"""Laws that `friction_forms` may give."""
SHORTEST = 3e-4
"""Slip length over half of the motion below which a bristle is none."""
WAYS = {0.35: 0.15, 1.0: 0.35, 2.0: 0.32, 4.0: 0.18}
"""Slip lengths over Dahl's, with the shares of the force that come near his curve."""
LOADS = 3
"""Other ports whose effort may be the load."""
BENDS = "a contact that bends like a spring before it slides, and slides more easily in motion"
Values = Mapping[str, float]


def friction_forms(
    scene: FittedModel, element: Element, ended: Mapping[str, Values]
) -> tuple[Insertion, ...]:
    """Return LuGre, Maxwell slip, and Coulomb friction with another level each way or place.

    Parameters
    ----------
    ended : mapping of str to mapping of str to float
        Where the simpler laws at `element` ended, by effect: the forms start from there.
    """
    if not isinstance(element, R):  # a law at a mass brings a damper along that no form knows
        return ()
    past, name = scene.of(element), element.name
    known = [ended[e] for e in ("presliding_friction", "stribeck_friction", "coulomb_friction")
             if e in ended]  # fmt: skip
    own = {k: v for values in reversed(known) for k, v in values.items()}
    level = at_least(own.get(f"F_c_{name}", 0.0), 0.02 * past.swing or 1e-12)
    half = 0.5 * float(np.ptp(way_of(scene, element))) or 1.0
    delta = float(np.clip(own.get(f"delta_{name}", 0.03 * half), 2 * SHORTEST * half, half))
    speed = own.get(f"f_s_{name}", 0.3 * past.rms)
    drop = own.get(f"F_d_{name}", 0.2 * level)
    effort, flow, length = rubbing_units(element)
    made = _Forms(scene, element, known)
    lugre = LuGre(level, drop, speed, level / delta, 0.1 * past.slope, effort, flow)
    slip = MaxwellSlip(
        tuple(share * delta for share in WAYS), level, drop / level, speed, effort, flow, length
    )
    uneven = AsymmetricCoulomb(1.2 * level, 0.8 * level, effort)
    simpler = ("coulomb_friction", "stribeck_friction")
    longest = level / (SHORTEST * half)
    bristles = {f"F_{i}_{name}": part * level for i, part in enumerate(WAYS.values(), start=1)}
    return (
        made.form("presliding_friction", lugre, (f"F_c_{name}", f"F_d_{name}"), BENDS, simpler,
                  within=((f"sigma_0_{name}", 0.0, longest),)),
        made.form("presliding_friction", slip, tuple(bristles), BENDS, simpler,
                  more=(bristles, {**bristles, f"r_{name}": 0.0})),
        made.form("coulomb_friction", uneven, (f"F_1_{name}", f"F_2_{name}"),
                  "a force of another size in each direction opposes every motion",
                  more=({}, {f"F_1_{name}": 0.8 * level, f"F_2_{name}": 1.2 * level})),
        made.along_way(level),
        *made.under_loads(level),
    )  # fmt: skip


class _Forms:
    """Insertions at one element, each started from the ends of the simpler laws."""

    def __init__(self, scene: FittedModel, element: Element, known: Sequence[Values]) -> None:
        self.scene, self.element, self.known = scene, element, known

    def form(
        self,
        effect: str,
        law: Law,
        strengths: tuple[str, ...],
        sentence: str,
        simpler: tuple[str, ...] = (),
        more: Sequence[Values] = ({},),
        within: tuple[tuple[str, float, float], ...] = (),
        kind: str = "",
        graph: BondGraph | None = None,
    ) -> Insertion:
        """Label a law in the place of the simple one."""
        name = self.element.name
        own = {p.name: p.value for p in law.parameters(name) if not p.fixed}
        declared = self.scene.graph.parameters
        starts = tuple(
            {**{n: v for n, v in values.items() if n in declared}, **own, **extra}
            for values in self.known
            for extra in more
        )
        kind = kind or ("memory" if law.timed else "dissipative")
        return Insertion(
            effect, "friction", law.name, name,
            (graph or self.scene.graph).with_element(name, law=law), starts, strengths, simpler,
            ("coulomb_friction", "stribeck_friction", "presliding_friction", "hysteresis"),
            sentence, kind_at(kind, self.element), within, form=True,
        )  # fmt: skip

    def along_way(self, level: float) -> Insertion:
        """Coulomb friction whose level depends on the position."""
        graph, signal = _with_position(self.scene.graph, self.element)
        spring = signal.removeprefix("q_")
        way = way_of(self.scene, self.element)
        if spring in self.scene.graph.elements:
            way = self.scene.past[spring].argument
        name, (effort, _, length) = self.element.name, rubbing_units(self.element)
        law = FrictionAlongWay(
            signal, level, float(0.5 * (way.max() + way.min())),
            0.5 * float(np.ptp(way)) or 1.0, effort, length,
        )  # fmt: skip
        return self.form(
            "coulomb_friction", law, tuple(f"F_{i}_{name}" for i in ("c", 1, 2)),
            "a force that opposes every motion is larger at some places of the way than at others",
            kind="surface", graph=graph,
        )  # fmt: skip

    def under_loads(self, level: float) -> list[Insertion]:
        """Coulomb friction under the efforts of other ports."""
        name, effort = self.element.name, rubbing_units(self.element)[0]
        found = []
        for other, (load, unit) in _loads(self.scene, self.element).items():
            size = float(np.mean(np.abs(load)))
            if size > 0:
                law = FrictionUnderLoad(
                    f"e_{other}", 0.5 * level, 0.5 * level / size, effort, unit.format(effort)
                )
                found.append(self.form(
                    "coulomb_friction", law, tuple(f"{p}_{name}" for p in ("F_c", "mu_1", "mu_2")),
                    f"a force that grows with the load of {other} opposes every motion",
                ))  # fmt: skip
        return found[:LOADS]


def way_of(scene: FittedModel, element: Element) -> Array:
    """Displacement that belongs to the flow of a resistor, from its start, shape (N,)."""
    past = scene.of(element)
    if past.moved is not None:
        return past.moved
    return np.asarray(np.cumsum(past.argument) * past.dt)


def _with_position(graph: BondGraph, element: Element) -> tuple[BondGraph, str]:
    """Return the graph and the signal of the position where `element` rubs.

    A store of the same flow holds it; otherwise one without stiffness counts it.
    """
    node = graph[graph.neighbour(element.name)]
    if store := store_of_way(graph, node.name):
        return graph, f"q_{store}"
    if not isinstance(node, One):
        (bond,) = graph.bonds_of(element.name)
        node = One(f"rubbing_{element.name}")
        graph = graph.with_inserted(bond, node)
    counter = f"way_{element.name}"
    return graph.with_branch(node.name, [C(counter, law=Odometer())]), f"q_{counter}"


def _loads(scene: FittedModel, element: Element) -> dict[str, tuple[Array, str]]:
    """Efforts of springs, pressure stores and sources, with the unit of friction over load."""
    found: dict[str, tuple[Array, str]] = {}
    for e in scene.graph.of_type(Se, C):
        if e.name not in scene.past:
            continue
        past = scene.past[e.name]
        if isinstance(e, Se):
            found[e.name] = past.argument, "{}/" + (e.unit or "1")
        elif has_unit(e, SPRINGS) or has_unit(e, TANKS):
            found[e.name] = (
                past.output,
                "1" if has_unit(e, SPRINGS) else "{}/" + variables_of(e).effort_unit,
            )
    return found
