"""Structural controllability and observability, by causal paths and by derivative causality.

A graph is structurally controllable if every storage in integral causality is reached by a causal
path from a source, and if all storages take derivative causality once that is preferred and
sources may be dualised (an Se becomes an Sf). For observability paths lead to a sensor, and
sensors are dualised (they impose what they read) (Sueur and Dauphin-Tanguy, J. Franklin Inst. 328
(1991) 869). Storages that stay in integral causality are tied: a combination of them never moves,
or never shows; it is found exactly and named. Two readings of the rule are needed beyond that
paper: a position sensor fixes the effort of one of the storages it adds up, and a position that no
storage gives, or a source that is recorded by its rate, is an integrator outside the graph, so what
it adds to the rank is found exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Literal, TypeAlias

from bondgraph.analysis.exact_algebra import rank
from bondgraph.analysis.kalman import (
    generic_matrices,
    linear_skeleton,
    null_vectors,
    transposed,
)
from bondgraph.analysis.operator_equations import positions
from bondgraph.causality.assignment import CausalConflict, assign_causality, storage_ports
from bondgraph.equations.derivation import equations
from bondgraph.equations.elimination import echelon
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.rewriting import replace as replaced
from bondgraph.graph.elements import MGY, MTF, Field, Se, Sf, Source
from bondgraph.graph.sensors import Da, De, Df, Dq
from bondgraph.simulation.start import own_input
from bondgraph.support.html import html_table

if TYPE_CHECKING:
    import networkx as nx

Matrix: TypeAlias = list[list[int]]
Question: TypeAlias = Literal["controllability", "observability"]
MOST_TRIED = 8


@dataclass(frozen=True)
class Reach:
    """Answer to one of the two questions, with its reasons.

    Attributes
    ----------
    name : str
    question : {"controllability", "observability"}
    states : tuple of str
    paths : dict of str to tuple of str
        For every state that has one, the signals of a shortest causal path.
    separate : tuple of str
        States without a causal path.
    integral : tuple of str
        Storages that stay in integral causality though derivative causality is preferred.
    dualised : tuple of str
        Sources (sensors) dualised to get there.
    structural_rank : int or None
        Rank of ``[A B]`` (of ``[A; C]``) by causality: states less what is tied. None if a loop of
        bonds left no assignment without a conflict, there is a field or an accelerometer, or
        modulated two-ports share a ratio; the exact rank decides.
    exact_rank : int
        The same at random exact parameter values.
    tied : tuple of tuple of str
        States of which one combination never moves (never shows), by exact elimination.
    """

    name: str
    question: Question
    states: tuple[str, ...]
    paths: dict[str, tuple[str, ...]]
    separate: tuple[str, ...]
    integral: tuple[str, ...]
    dualised: tuple[str, ...]
    structural_rank: int | None
    exact_rank: int
    tied: tuple[tuple[str, ...], ...]

    @property
    def rank(self) -> int:
        """The rank by causality where there is one."""
        return self.exact_rank if self.structural_rank is None else self.structural_rank

    @property
    def holds(self) -> bool:
        """Whether every state can be moved (shows), for almost all parameter values."""
        return not self.separate and self.rank == len(self.states)

    @property
    def problems(self) -> tuple[str, ...]:
        """One line for every state or combination that fails, with the reason."""
        moved = self.question == "controllability"
        lines = [
            f"{n}: no causal path {'from a source to it' if moved else 'from it to a sensor'}"
            for n in self.separate
        ]
        if self.rank < len(self.states):
            what = "sources" if moved else "sensors"
            why = (
                f"{', '.join(self.integral)} cannot take derivative causality, however {what} are "
                "dualised"
                if self.integral
                else "by exact elimination"
            )
            lines.append(f"rank {self.rank} of {len(self.states)}: {why}")
        does = "keeps its value for ever" if moved else "may have any value unseen"
        lines += [f"{', '.join(t)}: one combination {does}" for t in self.tied if len(t) > 1]
        return tuple(lines)

    def __str__(self) -> str:
        """Verdict, then every problem."""
        word = "controllable" if self.question == "controllability" else "observable"
        verdict = f"{self.name}: structurally {'' if self.holds else 'not '}{word}"
        return "\n".join([verdict, *(f"  {p}" for p in self.problems)])

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        tied = {n for t in self.tied for n in t}
        rows = []
        for n in self.states:
            path = " > ".join(self.paths.get(n, ())) or "none"
            note = "tied" if n in tied else ""
            rows.append((n, path, note))
        return html_table(str(self).splitlines()[0], ("state", "causal path", ""), rows)


def controllability(graph: BondGraph) -> Reach:
    """Tell which states the sources can move, whatever the parameters.

    Nonlinear laws count by their linear part, modulated two-ports by a constant ratio.

    Raises
    ------
    GraphError
        An element has no linear part.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se
    >>> with BondGraph("pair") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1.0)
    ...     _ = loop >> C("C_1", 1.0)
    ...     _ = loop >> C("C_2", 1.0)
    >>> print(controllability(g))
    pair: structurally not controllable
      rank 1 of 2: C_2 cannot take derivative causality, however sources are dualised
      q_C_1, q_C_2: one combination keeps its value for ever
    """
    return _reach(graph, "controllability")


def observability(graph: BondGraph) -> Reach:
    """Tell which states the sensors see, whatever the parameters; see `controllability`."""
    return _reach(graph, "observability")


def _reach(graph: BondGraph, question: Question) -> Reach:
    plain = linear_skeleton(graph)
    model = equations(plain)
    paths = _paths(model, question)
    separate = tuple(n for n in model.states if n not in paths)
    held = _held_back(plain, question)
    n = model.order
    form = echelon(_rows(model, question))
    outside = {f"u_{s.name}" for s in graph.of_type(Source)}  # what is recorded by its rate
    own = [
        j for j, x in enumerate(model.stored)
        if isinstance(graph[x.element], Dq) or x.name in outside
    ]  # fmt: skip
    without = rank(_rows(model, question, own)) if own else len(form)
    tied = tuple(
        tuple(model.states[j] for j, v in enumerate(w) if v) for w in null_vectors(form, n)
    )
    return Reach(
        graph.name,
        question,
        model.states,
        paths,
        separate,
        *(held or ((), ())),
        # causality sees neither the law that ties the ports of a field, nor what rates tell, nor
        # that two ratios are one
        None
        if held is None or graph.of_type(Field, Da) or _share_ratios(plain)
        else n - len(own) - len(held[0]) + len(form) - without,
        len(form),
        tied,
    )


def _share_ratios(graph: BondGraph) -> bool:
    held = [graph.coefficient(e).free_symbols for e in graph.of_type(MTF, MGY)]
    return sum(map(len, held)) > len(set().union(*held))


def _rows(model: System, question: Question, without: Sequence[int] = ()) -> Matrix:
    """Return the transpose of ``[A B]``, or ``[A; C]``, some states left out."""
    a, b, c = generic_matrices(model, 2)
    kept = [j for j in range(model.order) if j not in without]
    if question == "controllability":
        return transposed([[*a[j], *b[j]] for j in kept], len(kept))
    return [[row[j] for j in kept] for row in (*(a[j] for j in kept), *c)]


# -- causal paths -----------------------------------------------------------------------------
def _paths(model: System, question: Question) -> dict[str, tuple[str, ...]]:
    """Return a shortest causal path for every state that has one."""
    import networkx as nx

    net = _signal_graph(model)
    moved = question == "controllability"
    if moved:
        ends = [n for n in model.inputs if own_input(n, 1) is None]
    else:
        ends = [signal for _, signal, _ in model.readings]
        net = net.reverse(copy=False)
    found: dict[str, tuple[str, ...]] = {}
    known = [n for n in ends if n in net]
    if known:
        _, routes = nx.multi_source_dijkstra(net, known, weight=None)
        for n in model.states:
            if n in routes:
                found[n] = tuple(routes[n] if moved else reversed(routes[n]))
    return found


def _signal_graph(model: System) -> nx.DiGraph:
    """Signals, with an edge from each to those computed from it."""
    import networkx as nx

    net = nx.DiGraph()
    for r in model.relations:
        net.add_edges_from((s, r.target) for s in r.sources)
    for x in model.stored:
        net.add_edge(x.rate, x.name)
    for z in model.algebraic:
        net.add_edges_from((s, z.name) for s in z.residual.sources)
    for d in model.input_rates:
        net.add_edge(_source_of(d, model), d)
    return net


def _source_of(rate: str, model: System) -> str:
    return next(n for n in model.inputs for k in ("d_", "d2_", "d3_") if rate == k + n)


# -- derivative causality -----------------------------------------------------------------------
def _held_back(
    graph: BondGraph, question: Question
) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Return storages that stay integral at best, and what was dualised for it.

    None if no assignment is free of conflicts, which a loop of bonds can cause. The fewest
    possible are dualised: sizes go up and the search ends when nothing is held back.
    """
    best: tuple[tuple[str, ...], tuple[str, ...]] | None = None
    for chosen, wide, inverted in _dualisations(graph, question):
        try:
            causality = assign_causality(wide, prefer="derivative", inverted=inverted)
        except CausalConflict:
            continue
        left = tuple(n for n, _, _ in storage_ports(wide) if n not in causality.derivative)
        if best is None or len(left) < len(best[0]):
            best = (left, chosen)
        if not left:
            break
    return best


def _dualisations(
    graph: BondGraph, question: Question
) -> Iterator[tuple[tuple[str, ...], BondGraph, tuple[str, ...]]]:
    """Yield what is dualised, the graph for it, and the sensors to invert in it."""
    if question == "controllability":
        for chosen in _choices(tuple(s.name for s in graph.of_type(Se, Sf))):
            yield chosen, _dualised(graph, chosen), ()
        return
    places = positions(graph)
    plain = graph.of_type(De, Df)
    for chosen in _choices((*(s.name for s in plain), *places)):
        inverted = tuple(s.name for s in plain if s.name in chosen)
        # a position adds up displacements: it fixes the effort of any one of those storages
        stores = [[n.removeprefix("q_") for _, n in places[s]] for s in chosen if s in places]
        for fixed in product(*stores):
            if len(set(fixed)) == len(fixed):
                wide = graph
                for n in fixed:
                    wide = replaced(wide, n, Se(n))
                yield chosen, wide, inverted


def _choices(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    if len(names) <= MOST_TRIED:
        for size in range(len(names) + 1):
            yield from combinations(names, size)
        return
    for size in range(len(names) + 1):
        yield tuple(names[:size])


def _dualised(graph: BondGraph, names: Sequence[str]) -> BondGraph:
    for n in names:
        # without its unit: what a source gives is another quantity now
        graph = replaced(graph, n, Sf(n) if isinstance(graph[n], Se) else Se(n))
    return graph
