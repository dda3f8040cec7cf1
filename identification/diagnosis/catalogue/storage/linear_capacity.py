"""A capacity of heat, of charge or of a fluid that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, One, R, Se, Sf, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.graph.sensors import De, Sensor
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.lacking_branch import (
    nearest_resistance,
    signature_of_run,
    unit_of,
)
from identification.diagnosis.catalogue.lacking_element import LEAST, free_name
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.catalogue.places import (
    CAPACITORS,
    ends,
    has_unit,
    lump_at,
    other_resistors,
    sharing_effort,
    vessels,
)
from identification.diagnosis.localisation.recording.variables import (
    GENERIC,
    MOVES,
    variables_beside,
)
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SIZES = (1.0, 10.0, 0.1, 100.0, 0.01, 1e3)
"""Times the typical capacity that are tried as starts."""
SHARES = (0.003, 0.012, 0.05, 0.2)
"""Time constants of a further store, over the duration of the record."""
FEWEST = 3.0
"""Samples that the shortest of them takes."""


@final
class LinearCapacity(Effect):
    """A store at an effort that none holds, or a further one that a resistance leads to."""

    name = "linear_capacity"
    family = "storage"
    kind = "slow"  # as a filter of the effort, whose form is that of an after-effect
    sort = "a flow in proportion to the rate of an effort"
    law = "capacity"
    sentence = "a capacity that the model lacks takes up a part of what flows there"
    looks = "what jumps at once in the model rises late; the slow end is right"
    confused_with = ("low_pass", "sensor_lag", "creep", "delay")
    simpler = ("leakage",)
    separated_by = (
        "record what flows in as well, or the effort next to it: a lag of a drive or of a sensor "
        "draws nothing from the machine, a capacity does"
    )
    source = "Karnopp, Margolis, Rosenberg, System Dynamics, chapter 3 (linear C)"
    meanings: ClassVar[Mapping[str, str]] = {
        "capacity": "missing capacity",
        "resistance": "what leads to it, where the model has a store at that effort already",
        "before": "part of a resistance that lies before the capacity inside it",
    }
    plain = True

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return an element at each effort without a store, stores, and resistors between them."""
        open_ones = efforts(graph)
        return (*open_ones.values(), *stores_of_mass(graph), *divisible(graph, open_ones))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what a small capacity changes; of a store what follows it with a lag."""
        if isinstance(element, C):
            past = scene.of(element)
            return tuple(
                Signature.of((-past.slope * lagged(past.argument, tau, past.dt),), tau=tau)
                for tau in _times(past)
            )
        return signature_of_run(scene, self.insert(scene, element))

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Hang a capacity at the effort, or a resistance and a capacity beside the store."""
        if isinstance(element, C):
            return self._behind(scene, element, hint)
        g, data = scene.graph, scene.data
        node = next((n for n, e in efforts(g).items() if e.name == element.name), "")
        divided, share = g, ""
        if not node:
            divided, node, share = _divided(g, element)
        v = variables_beside(g, element.name)
        typical = float(np.sqrt(data.dt * data.n * data.dt)) / nearest_resistance(
            scene, element.name
        )
        amount = Parameter(
            free_name(g, f"capacity_{element.name}"), typical, unit_of(v, "capacity"),
            lower=LEAST * typical, upper=typical / LEAST, scale=typical,
        )  # fmt: skip
        held = C(free_name(g, f"lacking_{element.name}"), amount.name, unit=amount.unit)
        graph = divided.with_parameters([amount]).with_branch(node, [held])
        tried = [typical * times for times in SIZES]
        if hint is not None and hint.weights[0] > 0:
            tried = [float(np.clip(hint.weights[0], 1e-4 * typical, 1e4 * typical)), *tried]
        starts = tuple({amount.name: c} for c in tried)
        made = self.inserted(element, graph, starts, (amount.name,))
        where = "inside it" if share else f"of the {v.effort} there" if v.effort else "there"
        word = lump_at(g, element) or "capacity"
        says = f"a {word} {where}, which the model lacks, takes up a part of what flows"
        # what it draws is felt all around: it is no matter of a command or of a reading
        return replace(made, sentence=says, kind=self.kind)

    def _behind(self, scene: FittedModel, element: C, hint: Hint | None) -> Insertion:
        g, past, name = scene.graph, scene.of(element), element.name
        v = variables_beside(g, name)
        times: tuple[float, ...] = _times(past)
        shares: tuple[float, ...] = (0.3,)
        if hint is not None:
            times = (float(hint.shape["tau"]),)
            shares = (float(np.clip(hint.weights[0], 0.02, 20.0)), 1.0)
        store, lead = 1.0 / past.slope, past.duration * past.slope
        amount = Parameter(
            free_name(g, f"capacity_{name}"), 0.3 * store, unit_of(v, "capacity"),
            lower=1e-5 * store, upper=1e5 * store, scale=0.3 * store,
        )  # fmt: skip
        through = Parameter(
            free_name(g, f"resistance_{name}"), 0.1 * lead, unit_of(v, "resistance"),
            lower=1e-8 * lead, upper=1e4 * lead, scale=0.1 * lead,
        )  # fmt: skip
        node, branch = Zero(free_name(g, f"beside_{name}")), One(free_name(g, f"to_{name}"))
        (bond,) = g.bonds_of(name)
        g = g.with_parameters([amount, through]).with_inserted(bond, node)
        g = g.with_branch(node.name, [branch])
        lacking = C(free_name(g, f"lacking_{name}"), amount.name, unit=amount.unit)
        g = g.with_branch(branch.name, [lacking])
        leads = R(free_name(g, f"R_lacking_{name}"), through.name, unit=through.unit)
        g = g.with_branch(branch.name, [leads])
        starts = tuple(
            {amount.name: a * store, through.name: tau / (a * store)}
            for tau in times
            for a in shares
        )
        made = self.inserted(element, g, starts, (amount.name,))
        lump = lump_at(scene.graph, element)
        says = f"a further {lump} hangs at it behind a resistance, and gives back late what it took"
        return replace(made, law="capacity_behind_resistance", sentence=says)


def efforts(graph: BondGraph) -> dict[str, Element]:
    """Return 0-junctions without a store, each with the element that stands for it.

    Of heat, charge or a fluid; where a source gives the effort, a store would do nothing. What
    stands for it is a resistor there, the source that feeds it, its sensor, or a resistor that
    leads there.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, De, One, R, Sf, Zero
    >>> with BondGraph("oven") as g:
    ...     heater, wall, room = Zero("heater"), One("wall"), Zero("room")
    ...     _ = Sf("P", unit="W") >> heater >> wall >> room >> C("C", 9.0, unit="J/K")
    ...     _ = wall >> R("R", 1.0, unit="K/W")
    >>> {node: e.name for node, e in efforts(g).items()}
    {'heater': 'P'}
    """
    found: dict[str, Element] = {}
    seen: set[str] = set()
    for zero in graph.of_type(Zero):
        if zero.name in seen:
            continue
        nodes = sharing_effort(graph, zero.name)
        seen |= set(nodes)
        v = variables_beside(graph, zero.name)
        beside = [graph[m] for n in nodes for m in ends(graph, n) if m not in nodes]
        if v is GENERIC or v.displacement in MOVES or any(isinstance(e, C | Se) for e in beside):
            continue
        leading = (
            graph[m] for e in beside if isinstance(e, One) for m in ends(graph, e.name)
        )  # fmt: skip
        for kind, among in ((R, beside), (Sf, beside), (De, beside), (R, leading)):
            if stands := next((e for e in among if isinstance(e, kind)), None):
                if all(stands.name != e.name for e in found.values()):
                    found[zero.name] = stands
                break
    return found


def divisible(graph: BondGraph, open_ones: Mapping[str, Element]) -> tuple[Element, ...]:
    """Return linear resistors of heat, charge or a fluid that a store may divide.

    Each leads from one element to another one; where it leads to one of the efforts `open_ones`, a
    store there does the same.
    """
    found = []
    for e in other_resistors(graph):
        node = graph.neighbour(e.name)
        ways = _ways(graph, e)
        closed = not any(w in sharing_effort(graph, n) for w in ways for n in open_ones)
        known = variables_beside(graph, e.name) is not GENERIC
        # inside a coil, or between a coil and its resistance, little is held
        holds = all(isinstance(graph[w], One | Zero | C | Se | Sf) for w in ways)
        if isinstance(graph[node], One) and len(ways) == 2 and holds and closed and known:
            found.append(e)
    return tuple(found)


def _ways(graph: BondGraph, resistor: Element) -> list[str]:
    """Return what a resistor leads from and to: the rest of its junction, but for sensors."""
    others = ends(graph, graph.neighbour(resistor.name))
    return [m for m in others if m != resistor.name and not isinstance(graph[m], Sensor)]


def _divided(graph: BondGraph, resistor: Element) -> tuple[BondGraph, str, str]:
    """Return a graph with a resistor in two parts, the junction between, and its parameter."""
    name, node = resistor.name, graph.neighbour(resistor.name)
    whole, own = graph.coefficient(resistor), graph.parameters.get(name)
    before = Parameter(
        free_name(graph, f"before_{name}"), 0.5, "1", lower=0.02, upper=0.98, scale=0.3
    )  # fmt: skip
    share = symbol(before.name, positive=True)
    middle, rest = Zero(free_name(graph, f"inside_{name}")), One(free_name(graph, f"behind_{name}"))
    unit = str(getattr(resistor, "unit", ""))
    behind = R(free_name(graph, f"R_behind_{name}"), (1 - share) * whole, unit=unit)
    bonds = [
        b for w in _ways(graph, resistor) for b in graph.bonds_of(node) if w in (b.tail, b.head)
    ]
    bond = next((b for b in bonds if b.tail == node), bonds[-1])  # sensors read what goes in
    last = bond.head if bond.tail == node else bond.tail
    # what was the value of the element is that of both parts together
    declared = [before] if own is None or name in graph.declared_parameters else [before, own]
    g = graph.with_element(name, value=share * whole).with_parameters(declared)
    inner = rest if bond.head == node else middle
    g = g.with_inserted(bond, inner)
    (onward,) = (b for b in g.bonds_of(inner.name) if last not in (b.tail, b.head))
    if inner is middle:
        (onward,) = (b for b in g.bonds_of(inner.name) if last in (b.tail, b.head))
    other = middle if inner is rest else rest
    g = g.with_inserted(onward, other).with_branch(rest.name, [behind])
    return g, middle.name, before.name


def stores_of_mass(graph: BondGraph) -> tuple[Element, ...]:
    """Return stores of heat and of fluids: what is soaked up by a capacitor has another name."""
    return tuple(e for e in vessels(graph) if not has_unit(e, CAPACITORS))


def _times(past: PortHistory) -> tuple[float, ...]:
    shortest = FEWEST * past.dt
    found = tuple(s * past.duration for s in SHARES if s * past.duration > shortest)
    return found or (max(0.2 * past.duration, shortest),)
