"""A graph with a source at every port, for latent signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.composing.renaming import reading_other_bond
from bondgraph.graph.elements import GY, TF, C, Element, I, One, R, Se, Sf, Source, TwoPort, Zero
from bondgraph.simulation.dynamics import dynamics_of
from bondgraph.support.errors import BondsightError


@dataclass(frozen=True)
class Probed:
    """The graph with its probes.

    Attributes
    ----------
    ports : dict of str to (str, float)
        By element: the source that stands for an addition to its effort, and the factor on it.
    flows : dict of str to (str, float)
        The same for the other side of two-ports.
    """

    graph: BondGraph
    ports: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    flows: Mapping[str, tuple[str, float]] = field(default_factory=dict)


def probed_graph(graph: BondGraph) -> Probed:
    """Probe every storage, resistor, inertia and two-port that can be probed."""
    everything = [e for e in graph.elements.values() if isinstance(e, C | R | I | TF | GY)]
    made = Probed(graph)
    try:
        for e in everything:
            made = _with_probe(made, e)
        dynamics_of(made.graph)
    except BondsightError:
        return _one_by_one(graph, everything)
    return made


def _one_by_one(graph: BondGraph, elements: Sequence[Element]) -> Probed:
    """Probe port by port: one that cannot be probed must not take the others along."""
    made = Probed(graph)
    for e in elements:
        try:
            wider = _with_probe(made, e)
            dynamics_of(wider.graph)
        except BondsightError:
            continue
        made = wider
    return made


def _with_probe(made: Probed, e: Element) -> Probed:
    if isinstance(e, TwoPort):
        return _with_two_probes(made, e)
    name = f"probe_{e.name}"
    (bond,) = made.graph.bonds_of(e.name)
    # a source pushes effort into the loop; the law takes it out
    sign = -1.0 if bond.head == e.name else 1.0
    node = One(f"{name}_1")
    ends = (bond.tail, node.name) if bond.head == e.name else (node.name, bond.head)
    graph = _reading(made.graph.with_inserted(bond, node), e.name, Bond(*ends))
    graph = _with_source(graph, node, Se(name))
    return Probed(graph, {**made.ports, e.name: (name, sign)}, made.flows)


def _reading(graph: BondGraph, element: str, bond: Bond) -> BondGraph:
    """Return the graph where all that reads the effort of an element reads the addition too."""
    for name, e in graph.elements.items():
        other = reading_other_bond(e, element, bond.name)
        if other is not e:
            graph = graph.replace(name, other)
    return graph


def _with_two_probes(made: Probed, e: TwoPort) -> Probed:
    graph = made.graph
    into = [b for b in graph.bonds_of(e.name) if b.head == e.name]
    out = [b for b in graph.bonds_of(e.name) if b.tail == e.name]
    if len(into) != 1 or len(out) != 1:
        return made
    ratio = _ratio(graph, e)
    first = One(f"probe_{e.name}_1")
    graph = _with_source(graph.with_inserted(into[0], first), first, Se(f"probe_{e.name}"))
    (out_bond,) = [b for b in graph.bonds_of(e.name) if b.tail == e.name]
    second: One | Zero
    source: Source
    if isinstance(e, TF):
        second, source = Zero(f"probe_{e.name}_2"), Sf(f"probe_{e.name}_f")
    else:
        second, source = One(f"probe_{e.name}_2"), Se(f"probe_{e.name}_f")
    graph = _with_source(graph.with_inserted(out_bond, second), second, source)
    return Probed(
        graph,
        {**made.ports, e.name: (f"probe_{e.name}", -ratio)},
        {**made.flows, e.name: (f"probe_{e.name}_f", ratio)},
    )


def _with_source(graph: BondGraph, node: One | Zero, source: Source) -> BondGraph:
    """Return the graph with a source whose half arrow points at `node`."""
    g = graph.copy()
    g.add(source)
    g.bond(source, g[node.name])
    return g


def _ratio(graph: BondGraph, e: TwoPort) -> float:
    """Ratio at the nominal values; of a modulated two-port where its variable is zero."""
    expression = graph.coefficient(e)
    values = {p.symbol: p.value for p in graph.parameters.values()}
    expression = expression.subs(values)
    return float(expression.subs(dict.fromkeys(expression.free_symbols, 0.0)))
