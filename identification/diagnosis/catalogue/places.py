"""Elements where effects make sense: of one kind, of one physical domain."""

from __future__ import annotations

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import MGY, MTF, TF, C, Element, I, One, R, Source, Zero
from bondgraph.graph.sensors import Sensor
from bondgraph.laws.law import Law
from bondgraph.signals.units import Unit, parse_unit
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.recording.variables import (
    GENERIC,
    MOVES,
    variables_beside,
    variables_of,
)

SPRINGS = ("N/m", "m/N", "N*m/rad", "rad/(N*m)", "N*m", "1/(N*m)")
OUTLETS = ("Pa*s/m3", "s/m2")  # the second one where the effort is a level
FLUID = (*OUTLETS, "m3/(Pa*s)", "m2/s")
TANKS = ("m3/Pa", "Pa/m3", "m2", "1/m2")
CAPACITORS = ("F", "1/F", "F*m2")  # the last one between field and dipole moment
HEAT_STORES = ("J/K", "K/J")
MASSES = ("kg", "kg*m2")


def storages(graph: BondGraph) -> tuple[Element, ...]:
    """All C without a law of their own."""
    return tuple(e for e in graph.of_type(C) if e.law is None)


def mechanical_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors that can rub: all whose unit is not electrical, thermal or hydraulic."""
    return tuple(e for e in graph.of_type(R) if e.law is None and not _flows(e))


def _flows(element: R) -> bool:
    """Whether charge, heat or a fluid passes, by the unit."""
    unit = _unit(element.unit)
    return (
        _electrical(element) or (unit is not None and unit.dims[4] != 0) or has_unit(element, FLUID)
    )


def _electrical(element: R) -> bool:
    unit = _unit(element.unit)
    return unit is not None and unit.dims[3] != 0


def other_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Electrical, thermal and hydraulic resistors."""
    rubbing = {e.name for e in mechanical_resistors(graph)}
    return tuple(e for e in graph.of_type(R) if e.law is None and e.name not in rubbing)


def sources(graph: BondGraph) -> tuple[Element, ...]:
    """Return sources without a drive."""
    return tuple(e for e in graph.of_type(Source) if e.drive is None)


def commands(graph: BondGraph) -> tuple[Element, ...]:
    """Return sources that are driven by a command: those measured at the port have no amplifier."""
    return tuple(e for e in sources(graph) if isinstance(e, Source) and not e.measured)


def prompt_sensors(graph: BondGraph) -> tuple[Element, ...]:
    """Sensors without a law, lag, delay, drift or clock of their own."""
    return tuple(
        e
        for e in graph.of_type(Sensor)
        if e.law is None and e.lag is None and not (e.delay or e.clock or e.drift)
    )


def sensors(graph: BondGraph) -> tuple[Element, ...]:
    """Prompt sensors without a gain: a law of theirs is in the unit of the reading."""
    return tuple(e for e in prompt_sensors(graph) if isinstance(e, Sensor) and e.gain is None)


def store_of_way(graph: BondGraph, node: str) -> str:
    """Return the store that holds the displacement at a 1-junction; "" where none does.

    It hangs at the junction, or at one that is reached over 1-junctions alone: all share a flow.
    """
    reached = [node] if isinstance(graph[node], One) else []
    for n in reached:  # grows on the way
        beside = [b.head if b.tail == n else b.tail for b in graph.bonds_of(n)]
        stores = [m for m in beside if isinstance(graph[m], C)]
        if stores:
            return stores[0]
        reached += [m for m in beside if isinstance(graph[m], One) and m not in reached]
    return ""


def sharing_flow(graph: BondGraph, element: Element) -> tuple[Element, ...]:
    """Return all that is on a flow: the elements at 1-junctions where it is that of `element`.

    At its own junction, at others beside it, and behind transformers of constant ratio. Empty where
    it does not hang at a 1-junction.
    """
    return on_flow(graph, graph.neighbour(element.name))


def on_flow(graph: BondGraph, start: str) -> tuple[Element, ...]:
    """Return all that is on the flow of a 1-junction; see `sharing_flow`."""
    reached = [start] if isinstance(graph[start], One) else []
    found: dict[str, Element] = {}
    for n in reached:  # grows on the way
        for beside in ends(graph, n):
            e = graph[beside]
            passes = isinstance(e, One) or (isinstance(e, TF) and not isinstance(e, MTF))
            if not passes:
                found[beside] = e
            elif beside not in reached:
                reached.append(beside)
    return tuple(found.values())


def ends(graph: BondGraph, node: str) -> list[str]:
    """Return what is bonded to a junction."""
    return [b.head if b.tail == node else b.tail for b in graph.bonds_of(node)]


def sharing_effort(graph: BondGraph, start: str) -> list[str]:
    """Return the 0-junctions that share an effort."""
    reached = [start]
    for n in reached:  # grows on the way
        reached += [
            m for m in ends(graph, n) if isinstance(graph[m], Zero) and m not in reached
        ]  # fmt: skip
    return reached


def on_effort(graph: BondGraph, start: str) -> tuple[Element, ...]:
    """Return all that shares the effort of a 0-junction."""
    nodes = sharing_effort(graph, start)
    return tuple(graph[m] for n in nodes for m in ends(graph, n) if m not in nodes)


def sense(graph: BondGraph, element: Element) -> float:
    """Return -1 where the bond of an inertia or a resistor points out of it, else 1.

    Their histories count a flow the other way then than what is added there does.
    """
    backwards = isinstance(element, I | R) and graph.bonds_of(element.name)[0].tail == element.name
    return -1.0 if backwards else 1.0


def lump_at(graph: BondGraph, element: Element) -> str:
    """Return what a store of the domain is called that an element may stand for; "" of motions.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, Sf, Zero
    >>> with BondGraph("oven") as g:
    ...     _ = Sf("P", unit="W") >> Zero("room") >> C("C", 9.0, unit="J/K")
    >>> lump_at(g, g["P"])
    'heat capacity'
    """
    v = variables_beside(graph, graph.neighbour(element.name))
    words = {"V": "capacitor", "K": "heat capacity", "Pa": "fluid capacity", "m": "tank"}
    return words.get(v.effort_unit, "")


def undamped(graph: BondGraph) -> tuple[Element, ...]:
    """Return stores whose flow meets no resistor, one for each flow: inertias first."""
    return _alone(graph, (*graph.of_type(I), *graph.of_type(C)), R)


def unsprung(graph: BondGraph) -> tuple[Element, ...]:
    """Return masses and dampers that no spring holds, one for each flow: masses first."""
    of = (e for e in (*graph.of_type(I), *graph.of_type(R)) if moves(graph, e))
    return _alone(graph, tuple(of), C)


def without_inertia(graph: BondGraph) -> tuple[Element, ...]:
    """Return resistors of a current without a coil, and what moves against ground without a mass.

    One for each flow.
    """
    of = tuple(
        e
        for e in (*graph.of_type(R), *graph.of_type(C))
        if (isinstance(e, R) and _electrical(e)) or (moves(graph, e) and not _between(graph, e))
    )
    return _alone(graph, of, I)


def _between(graph: BondGraph, element: Element) -> bool:
    """Whether the flow of an element may be that between two parts: a 0-junction is beside it.

    One behind a transformer is of another domain, or of another shaft, and says nothing.
    """
    node = graph.neighbour(element.name)
    reached = [node] if isinstance(graph[node], One) else []
    for n in reached:  # grows on the way
        beside = {end for b in graph.bonds_of(n) for end in (b.tail, b.head)}
        if any(isinstance(graph[m], Zero) for m in beside):
            return True
        reached += [m for m in beside if isinstance(graph[m], One) and m not in reached]
    return False


def moves(graph: BondGraph, element: Element) -> bool:
    """Whether what flows through an element is a motion, by its unit or what hangs beside it.

    Where nothing tells, only an inertia does.
    """
    v = variables_of(element)
    if v is GENERIC and not getattr(element, "unit", ""):
        v = variables_beside(graph, graph.neighbour(element.name))
        if v is GENERIC:
            return isinstance(element, I)
    return v.displacement in MOVES[:2]


def _alone(
    graph: BondGraph, of: tuple[Element, ...], lacking: type[Element]
) -> tuple[Element, ...]:
    found: list[Element] = []
    seen: set[str] = set()
    for e in of:
        beside = sharing_flow(graph, e)
        if e.name in seen or not beside:
            continue
        seen |= {b.name for b in beside}
        if not any(isinstance(b, lacking) for b in beside):
            found.append(e)
    return tuple(found)


def law_of(element: Element) -> Law | None:
    """Return the law of an element, or that of its drive."""
    return getattr(getattr(element, "drive", None), "law", None) or getattr(element, "law", None)


def modulated_ratio(element: Element | None) -> sp.Expr | None:
    """Return the ratio of a two-port as an expression of signals; None of any other element."""
    own = element.ratio if isinstance(element, MTF | MGY) else None
    return own if isinstance(own, sp.Expr) else None


def has_unit(element: Element, units: tuple[str, ...]) -> bool:
    """Whether the unit of `element` has the dimension of one of `units`."""
    unit = _unit(getattr(element, "unit", ""))
    return unit is not None and any(unit.same_dimension(parse_unit(u)) for u in units)


def _unit(text: str) -> Unit | None:
    try:
        return parse_unit(text) if text else None
    except BondsightError:
        return None


def springs(graph: BondGraph) -> tuple[Element, ...]:
    """Mechanical storages without a law; without a unit those that are given a stiffness."""
    return tuple(
        e
        for e in storages(graph)
        if has_unit(e, SPRINGS)
        or (isinstance(e, C) and not e.unit and e.stiffness is not None)
    )  # fmt: skip


def coils(graph: BondGraph) -> tuple[Element, ...]:
    """Inductors without a law."""
    return tuple(e for e in graph.of_type(I) if e.law is None and has_unit(e, ("H",)))


def vessels(graph: BondGraph) -> tuple[Element, ...]:
    """Capacitors, tanks and heat stores without a law."""
    return tuple(e for e in storages(graph) if has_unit(e, (*TANKS, *CAPACITORS, *HEAT_STORES)))


def tanks(graph: BondGraph) -> tuple[Element, ...]:
    """Hydraulic storages without a law."""
    return tuple(e for e in storages(graph) if has_unit(e, TANKS))


def masses(graph: BondGraph) -> tuple[Element, ...]:
    """Mechanical inertias: all with the unit of a mass, or without a unit."""
    return tuple(e for e in graph.of_type(I) if not e.unit or has_unit(e, MASSES))


def electrical_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors of a current without a law: in ohm, or ohm times an area."""
    return tuple(e for e in graph.of_type(R) if e.law is None and _electrical(e))


def warming_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors whose own heat changes them: of wire, and dampers with their oil."""
    return (*electrical_resistors(graph), *mechanical_resistors(graph))


def hydraulic_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors of a fluid's flow without a law."""
    return tuple(e for e in other_resistors(graph) if has_unit(e, OUTLETS))


def apart(
    graph: BondGraph, element: Element, among: tuple[Element, ...], kind: type[One | Zero]
) -> tuple[Element, ...]:
    """Return what of `among`, after `element`, a law between both may join; the nearest first.

    Both hang at junctions of that kind, in one domain, and nothing joins these already: a law
    beside a spring or a pipe is one of the spring or the pipe.
    """
    import networkx as nx  # the catalogue is listed without it

    node, later = graph.neighbour(element.name), among[among.index(element) + 1 :]
    if not isinstance(graph[node], kind) or not later:
        return ()
    away = nx.single_source_shortest_path_length(graph.network.to_undirected(as_view=True), node)
    found = []
    for e in later:
        there = graph.neighbour(e.name)
        alike = isinstance(graph[there], kind) and variables_of(e) == variables_of(element)
        if alike and away.get(there, 0) > JOINED:
            found.append((away[there], e))
    return tuple(e for _, e in sorted(found, key=lambda pair: pair[0])[:NEAREST])


JOINED = 2
"""Bonds between two junctions that share an element, or are one."""
NEAREST = 2
"""Partners that are tried of each element, so that a large model stays quick."""
