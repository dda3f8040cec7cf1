"""Which further sensor would separate elements that now look the same: every place is tried."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from bondgraph.analysis.fault_signatures import Classes, FaultSignatures, separated, signatures
from bondgraph.analysis.operator_equations import positions
from bondgraph.analysis.residual_space import diagnostic
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import One, Zero
from bondgraph.graph.sensors import De, Df, Sensor
from bondgraph.support.errors import BondsightError
from bondgraph.support.html import html_table


@dataclass(frozen=True, slots=True)
class Advice:
    """One further sensor and what it would separate.

    Attributes
    ----------
    kind : {"De", "Df"}
    junction : str
    pairs : int
        Pairs of the class with different signatures afterwards.
    separable : int
        Pairs that some combination of relations tells apart afterwards.
    parts : tuple of tuple of str
        The class by signature afterwards.
    inverted : bool
        Whether the sensor can impose what it reads.
    """

    kind: str
    junction: str
    pairs: int
    separable: int
    parts: Classes
    inverted: bool

    @property
    def text(self) -> str:
        """The parts, separated by strokes."""
        return " | ".join(", ".join(p) for p in self.parts)

    def __str__(self) -> str:
        """One line."""
        return (
            f"{self.kind} at {self.junction}: {self.pairs} pairs by signature, "
            f"{self.separable} in principle: {self.text}"
        )


@dataclass(frozen=True)
class SensorAdvice:
    """Ranked advice for one class.

    Attributes
    ----------
    elements : tuple of str
        The class.
    ranked : tuple of Advice
        Best first; places that separate nothing are left out.
    """

    elements: tuple[str, ...]
    ranked: tuple[Advice, ...]

    def __str__(self) -> str:
        """One line a place."""
        head = f"to split {', '.join(self.elements)}:"
        if not self.ranked:
            return f"{head} no single De or Df does"
        return "\n".join([head, *(f"  {a}" for a in self.ranked)])

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        titles = ("sensor", "junction", "pairs", "in principle", "parts")
        rows = ((a.kind, a.junction, a.pairs, a.separable, a.text) for a in self.ranked)
        return html_table(f"to split {', '.join(self.elements)}", titles, rows)


def splitting_sensors(graph: BondGraph, elements: Iterable[str] | None = None) -> SensorAdvice:
    """Try a De at every 0-junction and a Df at every 1-junction without one.

    Ranked by pairs separated by signature, then by pairs separable at all, then sensors that can be
    inverted, then the order of the graph.

    Parameters
    ----------
    graph : BondGraph
    elements : iterable of str, optional
        The class to split; the largest one when not given.

    Raises
    ------
    UnknownName
        An element has no signature.
    """
    places = positions(graph)
    now = signatures(graph, diagnostic(graph, places))
    group = tuple(elements) if elements is not None else max(now.classes, key=len)
    for e in group:
        now.column(e)
    found: list[Advice] = []
    for kind, junction in unmeasured(graph):
        name = fresh_sensor(graph, junction.name)
        try:
            wider = graph.with_branch(junction.name, [kind(name)])
            made = diagnostic(wider, places)
            then = signatures(wider, made)
        except BondsightError:
            continue
        advice = _advice(kind, junction.name, group, then, name in made.inverted)
        if advice.pairs or advice.separable > separated(group, now.inseparable):
            found.append(advice)
    ranked = sorted(found, key=lambda a: (-a.pairs, -a.separable, not a.inverted))
    return SensorAdvice(group, tuple(ranked))


def _advice(
    kind: type[Sensor], junction: str, group: Sequence[str], then: FaultSignatures, inverted: bool
) -> Advice:
    parts: dict[tuple[bool, ...], list[str]] = {}
    for e in group:
        parts.setdefault(then.column(e), []).append(e)
    classes = tuple(tuple(p) for p in parts.values())
    return Advice(
        kind.kind,
        junction,
        separated(group, classes),
        separated(group, then.inseparable),
        classes,
        inverted,
    )


def unmeasured(graph: BondGraph) -> Iterator[tuple[type[De | Df], One | Zero]]:
    """Yield the junctions whose own signal no sensor reads, with the sensor that would."""
    taken = {(type(s), graph.neighbour(s.name)) for s in graph.of_type(De, Df)}
    for junction in graph.of_type(One, Zero):
        kind = Df if isinstance(junction, One) else De
        if (kind, junction.name) not in taken:
            yield kind, junction


def fresh_sensor(graph: BondGraph, junction: str) -> str:
    """Return a name that `graph` does not hold yet for one more sensor at a junction."""
    name = f"extra_{junction}"
    while name in graph.elements or name in graph.parameters:
        name += "_"
    return name
