"""Sequential causality assignment (Karnopp and Rosenberg): every stroke with its reason.

One machinery serves integral, derivative and diagnostic assignments: a preference for storages and
a set of sensors whose reading imposes its variable (Samantaray and Ould Bouamama, Model-based
Process Supervision, 2008, ch. 4). The work grows linearly with the number of bonds.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, combinations
from math import inf
from typing import Literal, TypeAlias

from bondgraph.causality.existence import completable
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import (
    GY,
    RE,
    RS,
    TF,
    X0,
    C,
    CField,
    Element,
    I,
    IField,
    Junction,
    MSe,
    MSf,
    R,
    RField,
    Se,
    Sf,
    Zero,
)
from bondgraph.graph.sensors import De, Sensor
from bondgraph.support.errors import GraphError, require_known
from bondgraph.support.spelled import spelled

MOST_ALTERNATIVES = 1000
MOST_RETRIES = 10_000
MOST_FIRST = 200
MOST_YIELDING = 6
MOST_WORK = 60_000
"""Bonds that are assigned anew at the most, in search of storages that have to yield."""
MOST_TURNS = 100
"""Choices that are taken back at the most in one assignment of that search; by any other, before
it is asked whether there is an answer at all."""

Preference: TypeAlias = Literal["integral", "derivative"]


class CausalConflict(GraphError):
    """Two elements impose the same variable; the message names the bonds.

    Examples
    --------
    >>> def wrong():
    ...     with BondGraph("two sources") as g:
    ...         node = Zero("node")
    ...         Se("a") >> node
    ...         Se("b") >> node
    ...         node >> R("r", 1.0)
    ...     return g
    >>> try:
    ...     assign_causality(wrong())
    ... except CausalConflict as error:
    ...     print(error)
    two sources: causal conflict at bond b>node: effort to b because a>node sets the ...
    """


@dataclass(frozen=True, slots=True)
class Stroke:
    """Causal stroke of a bond: `effort_to` receives the effort, the other end the flow."""

    bond: Bond
    effort_to: str
    reason: str

    @property
    def flow_to(self) -> str:
        """The end that receives the flow."""
        return self.bond.tail if self.effort_to == self.bond.head else self.bond.head

    def __str__(self) -> str:
        """Readable line."""
        return (
            f"{self.bond.name}: effort to {self.effort_to}, flow to {self.flow_to} ({self.reason})"
        )


@dataclass(frozen=True, slots=True)
class Causality:
    """Result of the assignment.

    Attributes
    ----------
    strokes : dict of Bond to Stroke
        For every power bond (sensor taps carry no power and are left out, unless inverted).
    derivative : tuple of str
        Storages in derivative causality; a port of a field as ``name1``.
    free_choices : tuple of str
        Resistors or bonds whose causality had to be chosen: candidates for algebraic loops.
    """

    strokes: dict[Bond, Stroke]
    derivative: tuple[str, ...]
    free_choices: tuple[str, ...]

    def __str__(self) -> str:
        """All strokes, one a line."""
        lines = [str(s) for s in self.strokes.values()]
        if self.derivative:
            lines.append("derivative causality: " + ", ".join(self.derivative))
        if self.free_choices:
            lines.append("chosen freely: " + ", ".join(self.free_choices))
        return "\n".join(lines)


@spelled
def assign_causality(
    graph: BondGraph,
    *,
    prefer: Preference = "integral",
    inverted: Iterable[str] = (),
    first: Sequence[str] = (),
) -> Causality:
    """Assign strokes: sources, fixed laws, storages by preference, resistors, the rest.

    Parameters
    ----------
    graph : BondGraph
    prefer : {"integral", "derivative"}
        What storages should have.
    inverted : iterable of str
        Sensors that impose what they read (a De its effort, a Df or Dq its flow); what they take
        from the graph is the residual of a redundancy relation.
    first : sequence of str
        Storages (ports of fields as ``name1``) to be served before all others, in this order.

    Raises
    ------
    CausalConflict
        Sources (or laws with one possible causality) contradict each other.

    Examples
    --------
    >>> print(assign_causality(graph))
    F>body: effort to body, flow to F (Se F imposes its variable)
    body>m: effort to m, flow to body (integral causality of I m)
    body>d: effort to body, flow to d (body>m sets the flow of body)
    body>k: effort to body, flow to k (body>m sets the flow of body)
    """
    graph.require_sound()
    given, served = tuple(inverted), tuple(first)
    try:
        return _assign(graph, prefer, given, served)
    except CausalConflict as conflict:
        if not _imposed_strokes(graph, given).completable():
            raise
        # serving a store too early may leave another without a stroke: try other orders
        names = [n for n, _, _ in storage_ports(graph) if n not in served]
        orders = [names, names[::-1], *([n] for n in names[:MOST_FIRST])]
        for order in orders:
            try:
                return _assign(graph, prefer, given, (*served, *order))
            except CausalConflict:
                continue
        raise conflict


def with_dependent_storages(graph: BondGraph, first: Sequence[str] = ()) -> Iterator[Causality]:
    """Yield assignments of a graph that has none while each storage gets what it prefers.

    A loop of bonds may tie storages to each other though each of them alone could be independent:
    only where some of them yield is a choice left for the loop. As few as will do come first;
    nothing is tried where sources contradict each other.

    Parameters
    ----------
    graph : BondGraph
    first : sequence of str
        As in `assign_causality`.
    """
    graph.require_sound()
    with suppress(CausalConflict):
        if not _imposed_strokes(graph, ()).completable():
            return
        yield from _yielding(graph, tuple(first))


def _yielding(graph: BondGraph, first: tuple[str, ...]) -> Iterator[Causality]:
    names = [n for n, _, _ in storage_ports(graph) if n not in first]
    every = (combinations(names, count) for count in range(1, MOST_YIELDING + 1))
    work = _Work(MOST_WORK, MOST_TURNS)
    for yielding in chain.from_iterable(every):
        if work.bonds <= 0:
            return
        with suppress(CausalConflict):
            yield _assign(graph, "integral", (), first, yielding, work)


def alternatives(graph: BondGraph, most: int = MOST_ALTERNATIVES) -> tuple[Causality, ...]:
    """Return one assignment for every smallest set of storages in derivative causality.

    The sets are the complements of the bases of a matroid, so every one is reached from any other
    by exchanging one storage at a time.

    Raises
    ------
    CausalConflict
        There is none.
    GraphError
        There are more than `most`.

    Examples
    --------
    >>> [a.derivative for a in alternatives(graph)]
    [()]
    """
    graph.require_sound()
    stores = [name for name, _, _ in _storage_ports(graph)]
    start = _assign(graph, "integral", (), ())
    found = {frozenset(start.derivative): start}
    queue = deque([frozenset(start.derivative)])
    while queue:
        held = queue.popleft()
        free = [s for s in stores if s not in held]
        for give in free:
            rest = tuple(s for s in free if s != give)
            for take in sorted(held):
                others = tuple(s for s in sorted(held) if s != take)
                made = _assign(graph, "integral", (), (*rest, take, *others, give))
                key = frozenset(made.derivative)
                if key not in found and len(key) == len(held):
                    if len(found) >= most:
                        raise GraphError(
                            f"{graph.name}: more than {most} sets of storages could be the "
                            "dependent ones; name those to keep with first="
                        )
                    found[key] = made
                    queue.append(key)
    return tuple(found.values())


def _assign(
    graph: BondGraph,
    prefer: Preference,
    inverted: tuple[str, ...],
    first: tuple[str, ...],
    yielding: tuple[str, ...] = (),
    work: _Work | None = None,
) -> Causality:
    table = _imposed_strokes(graph, inverted, work)
    derivative = []
    for name, bond, e in _ordered(graph, (*yielding, *first)):
        integral = isinstance(e, C | CField)
        wanted = (integral == (prefer == "integral")) != (name in yielding)
        other = "derivative" if name in yielding else "preferred derivative"
        word = "integral" if integral == wanted else other
        if not table.prefer(bond, e, wanted, f"{word} causality of {e.kind} {name}"):
            table.force(bond)
        got = table.effort_to[bond] != e.name
        if got != integral:
            derivative.append(name)
    chosen = table.choose(_choices(graph))
    return Causality(
        {
            b: Stroke(b, table.effort_to[b], table.reasons[b])
            for b in graph.bonds
            if b in table.effort_to
        },
        tuple(derivative),
        chosen,
    )


def _imposed_strokes(
    graph: BondGraph, inverted: tuple[str, ...], work: _Work | None = None
) -> _Table:
    """Return the strokes that no choice can change."""
    sensors = {s.name for s in graph.of_type(Sensor)}
    require_known("sensor", graph.name, sensors, *inverted)
    table = _Table(graph, sensors - set(inverted), work or _Work())
    for e, bond, effort_out, reason in _imposed(graph, inverted):
        table.stroke(bond, _end(bond, e.name, effort_out), reason)
    return table


def _imposed(
    graph: BondGraph, inverted: Sequence[str]
) -> Iterator[tuple[Element, Bond, bool, str]]:
    """Elements with one possible causality: element, bond, whether it gives effort, reason."""
    for e in graph.of_type(Se, Sf, MSe, MSf):
        (b,) = graph.bonds_of(e.name)
        yield e, b, isinstance(e, Se | MSe), f"{e.kind} {e.name} imposes its variable"
    for name in inverted:
        (b,) = graph.bonds_of(name)
        e = graph[name]
        yield e, b, isinstance(e, De), f"{e.kind} {name} imposes what it reads"
    for e in graph.of_type(R):
        if e.value == 0 and e.law is not None and e.law.set_valued:
            (b,) = graph.bonds_of(e.name)
            yield e, b, True, f"{e.name}: its law gives effort from flow only"
    for e in graph.of_type(RE):
        for b in graph.bonds_of(e.name):
            yield e, b, False, f"{e.name}: a reaction gives flow from affinities"
    for e in graph.of_type(RS):
        (b,) = (b for b in graph.bonds_of(e.name) if b.tail == e.name)
        yield e, b, False, f"{e.name}: the heat port gives a flow"


def storage_ports(graph: BondGraph) -> tuple[tuple[str, Bond, Element], ...]:
    """Return every storage port: its name (``name1`` for fields), bond and element."""
    return tuple(_storage_ports(graph))


def _storage_ports(graph: BondGraph) -> Iterator[tuple[str, Bond, Element]]:
    for e in graph.of_type(C, I, CField, IField):
        bonds = graph.bonds_of(e.name)
        for i, b in enumerate(bonds, start=1):
            yield (f"{e.name}{i}" if isinstance(e, CField | IField) else e.name), b, e


def _ordered(graph: BondGraph, first: Sequence[str]) -> list[tuple[str, Bond, Element]]:
    """Storages in the order in which they get what they prefer."""
    ports = list(_storage_ports(graph))
    names = [n for n, _, _ in ports]
    require_known("storage", graph.name, names, *first)
    rank = {n: i for i, n in enumerate(first)}

    def key(port: tuple[str, Bond, Element]) -> tuple[int, bool, bool]:
        name, _, e = port
        # a C with a law gives way first: it can be solved at the level of displacements
        plain = getattr(e, "law", None) in (None, ())
        return rank.get(name, len(rank)), isinstance(e, C | CField), not plain

    return sorted(ports, key=key)


def _choices(graph: BondGraph) -> Iterator[tuple[str, Bond, str, str]]:
    """Bonds that may be chosen freely: name, bond, preferred receiver of the effort, reason."""
    for e in graph.of_type(R, RS, RField):
        bonds = graph.bonds_of(e.name)
        for i, b in enumerate(bonds, start=1):
            if isinstance(e, RS) and b.tail == e.name:
                continue
            name = f"{e.name}{i}" if isinstance(e, RField) else e.name
            yield name, b, _end(b, e.name, True), f"free choice at {e.kind} {name}"
    for b in graph.bonds:
        yield b.name, b, b.head, f"free choice at {b.name}"


@dataclass
class _Work:
    """What assignments may still cost: bonds in all of them, choices taken back in each."""

    bonds: float = inf
    turns: int = MOST_RETRIES


class _Table:
    """Strokes under construction; a trail takes back what led to a conflict."""

    def __init__(self, graph: BondGraph, taps: set[str], work: _Work) -> None:
        self.graph, self.work = graph, work
        self.effort_to: dict[Bond, str] = {}
        self.reasons: dict[Bond, str] = {}
        self.trail: list[Bond] = []
        self.at: dict[str, tuple[Bond, ...]] = {
            n: tuple(b for b in graph.bonds_of(n) if b.tail not in taps and b.head not in taps)
            if isinstance(e, Junction)
            else graph.bonds_of(n)
            for n, e in graph.elements.items()
        }
        words = {t: _passes_on(t) for t in {type(e) for e in graph.elements.values()}}
        self.kinds = {n: words[type(e)] for n, e in graph.elements.items()}
        self.open = {n: len(self.at[n]) for n, k in self.kinds.items() if k in ("0", "1")}
        self.strong: dict[str, Bond] = {}
        self.taps = taps

    def prefer(self, bond: Bond, e: Element, effort_out: bool, reason: str) -> bool:
        return self.attempt(bond, _end(bond, e.name, effort_out), reason)

    def force(self, bond: Bond) -> None:
        """Take the stroke that is left where the preferred one conflicts."""
        if bond in self.effort_to:
            return
        for to in (bond.head, bond.tail):
            if self.attempt(bond, to, "the only stroke without a conflict"):
                return
        self.stroke(bond, bond.head, "no stroke is without a conflict")

    def attempt(self, bond: Bond, to: str, reason: str) -> bool:
        """Set a stroke; take everything back and answer False if it leads to a conflict."""
        if bond in self.effort_to:
            return self.effort_to[bond] == to
        mark = len(self.trail)
        try:
            self.stroke(bond, to, reason)
        except CausalConflict:
            self.undo(mark)
            return False
        return True

    def undo(self, mark: int) -> None:
        while len(self.trail) > mark:
            b = self.trail.pop()
            del self.effort_to[b], self.reasons[b]
            for end in (b.tail, b.head):
                if end in self.open:
                    self.open[end] += 1
                    if self.strong.get(end) == b:
                        del self.strong[end]

    def choose(self, choices: Iterable[tuple[str, Bond, str, str]]) -> tuple[str, ...]:
        """Decide what is still open, taking choices back in turn where they end in a conflict."""
        todo = [c for c in choices if c[1].tail not in self.taps and c[1].head not in self.taps]
        made: list[tuple[int, int, bool]] = []  # position, trail mark, second option taken
        position, retries, conflict, begun = 0, 0, None, len(self.trail)
        while position < len(todo):
            _, bond, to, reason = todo[position]
            if bond in self.effort_to:
                position += 1
                continue
            mark = len(self.trail)
            if self.attempt(bond, to, reason):
                made.append((position, mark, False))
                position += 1
                continue
            second = False
            while not second:
                try:
                    other = bond.tail if to == bond.head else bond.head
                    self.stroke(bond, other, f"only choice left at {todo[position][0]}")
                    made.append((position, mark, True))
                    second = True
                except CausalConflict as error:
                    conflict = conflict or error
                    self.undo(mark)
                    while made and made[-1][2]:
                        self.undo(made.pop()[1])
                    retries += 1
                    hopeless = retries == MOST_TURNS and not self.completable(begun)
                    if hopeless or not made or retries > self.work.turns or self.work.bonds <= 0:
                        raise conflict from None
                    position, mark, _ = made.pop()
                    self.undo(mark)
                    _, bond, to, reason = todo[position]
            position += 1
        return tuple(todo[i][0] for i, _, _ in made)

    def completable(self, first: int | None = None) -> bool:
        """Whether all strokes, or the first so many, leave every junction a stroke."""
        decided = {b: self.effort_to[b] for b in self.trail[:first]}
        return completable(self.at, self.kinds, decided)

    def stroke(self, bond: Bond, effort_to: str, reason: str) -> None:
        """Set a stroke and propagate what follows from it."""
        queue = deque([(bond, effort_to, reason)])
        while queue:
            b, to, why = queue.popleft()
            old = self.effort_to.get(b)
            if old is not None:
                if old != to:
                    raise self._conflict(b, to, why)
                continue
            self.work.bonds -= 1
            self.effort_to[b] = to
            self.reasons[b] = why
            self.trail.append(b)
            for end in (b.tail, b.head):
                if end in self.open:
                    self.open[end] -= 1
            for end in (b.tail, b.head):
                kind = self.kinds[end]
                if kind in ("0", "1"):
                    self._junction(end, kind == "0", b, queue)
                elif kind:
                    self._two_port(end, kind == "GY", b, queue)

    def _conflict(self, b: Bond, to: str, why: str) -> CausalConflict:
        return CausalConflict(
            f"{self.graph.name}: causal conflict at bond {b.name}: effort to {self.effort_to[b]} "
            f"because {self.reasons[b]}, but effort to {to} because {why}; put a resistance, "
            "a compliance or an inertia between the two elements that impose the same variable"
        )

    def _two_port(
        self, name: str, gyrator: bool, b: Bond, queue: deque[tuple[Bond, str, str]]
    ) -> None:
        first, second = self.at[name]
        other = second if b == first else first
        effort_in = self.effort_to[b] == name
        wants_in = effort_in if gyrator else not effort_in
        to = _end(other, name, not wants_in)
        if self.effort_to.get(other) != to:
            kind = self.graph[name].kind
            queue.append((other, to, f"{kind} {name} passes it on from {b.name}"))

    def _junction(
        self, name: str, zero: bool, b: Bond, queue: deque[tuple[Bond, str, str]]
    ) -> None:
        word = "effort" if zero else "flow"
        if (self.effort_to[b] == name) == zero:
            before = self.strong.get(name)
            if before is not None:
                # two bonds set one variable: the later one contradicts what the first implied
                why = f"{before.name} sets the {word} of {name}"
                raise self._conflict(b, _end(b, name, zero), why)
            self.strong[name] = b
            why = f"{b.name} sets the {word} of {name}"
            for other in self.at[name]:
                if other != b and other not in self.effort_to:
                    queue.append((other, _end(other, name, zero), why))
            return
        if name in self.strong:
            return
        if self.open[name] == 1:
            (last,) = (o for o in self.at[name] if o not in self.effort_to)
            why = f"the only bond left to set the {word} of {name}"
            queue.append((last, _end(last, name, not zero), why))
        elif self.open[name] == 0:
            raise self._conflict(b, _end(b, name, not zero), f"no bond sets the {word} of {name}")


def _passes_on(kind: type[Element]) -> str:
    """Which of the four ways of passing strokes on an element has; empty for none."""
    ways = (("0", (Zero, X0)), ("1", (Junction,)), ("TF", (TF,)), ("GY", (GY,)))
    return next((word for word, kinds in ways if issubclass(kind, kinds)), "")


def _end(b: Bond, name: str, effort_out: bool) -> str:
    """End that receives the effort when `name` gives it out (or not)."""
    other = b.head if b.tail == name else b.tail
    return other if effort_out else name
