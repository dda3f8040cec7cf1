"""Sequential causality assignment (Karnopp and Rosenberg): every stroke with its reason."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from bondgraph.elements import GY, TF, C, De, Df, Dq, Element, I, One, R, Se, Sensor, Sf, Zero
from bondgraph.errors import GraphError
from bondgraph.graph import Bond, BondGraph


class CausalConflict(GraphError):
    """Two elements impose the same variable; the message names the bonds."""


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
        For every power bond (sensor taps carry no power and are left out).
    derivative : tuple of str
        Storages that could not have integral causality.
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


def assign_causality(graph: BondGraph) -> Causality:
    """Assign strokes: sources, fixed laws, storages (integral preferred), resistors, the rest.

    Raises
    ------
    CausalConflict
        Sources (or laws with one possible causality) contradict each other.
    """
    graph.require_sound()
    table = _Table(graph)
    for e in graph.of_type(Se, Sf):
        table.impose(
            e, effort_out=isinstance(e, Se), reason=f"{e.kind} {e.name} imposes its variable"
        )
    for e in graph.of_type(R):
        if e.value == 0 and e.law is not None:
            table.impose(
                e, effort_out=True, reason=f"{e.name}: its law gives effort from flow only"
            )
    derivative = []
    # a dependent C can be solved, best if it is the one with a law; a dependent I cannot
    for e in sorted(graph.of_type(C, I), key=lambda e: (isinstance(e, C), e.law is not None)):
        wanted = isinstance(e, C)
        if not table.prefer(
            e, effort_out=wanted, reason=f"integral causality of {e.kind} {e.name}"
        ):
            derivative.append(e.name)
    chosen = []
    for e in graph.of_type(R):
        if table.is_open(e):
            chosen.append(e.name)
            if not table.prefer(e, effort_out=True, reason=f"free choice at R {e.name}"):
                table.impose(e, effort_out=False, reason=f"only choice left at R {e.name}")
    for b in table.open_bonds():
        if b not in table.strokes:
            chosen.append(b.name)
            if not table.try_stroke(b, b.head, f"free choice at {b.name}"):
                table.stroke(b, b.tail, f"only choice left at {b.name}")
    return Causality(
        {b: table.strokes[b] for b in graph.bonds if b in table.strokes},
        tuple(derivative),
        tuple(chosen),
    )


class _Table:
    """Strokes under construction, with propagation through junctions and two-ports."""

    def __init__(self, graph: BondGraph) -> None:
        sensors = {s.name for s in graph.of_type(Sensor)}
        self.graph = graph
        self.strokes: dict[Bond, Stroke] = {}
        self.at: dict[str, list[Bond]] = {n: [] for n in graph.elements}
        for b in graph.bonds:
            if b.tail not in sensors and b.head not in sensors:
                self.at[b.tail].append(b)
                self.at[b.head].append(b)
        self.order = [b for b in graph.bonds if b.tail not in sensors and b.head not in sensors]

    def is_open(self, e: Element) -> bool:
        return any(b not in self.strokes for b in self.at[e.name])

    def open_bonds(self) -> Iterable[Bond]:
        return [b for b in self.order if b not in self.strokes]

    def impose(self, e: Element, *, effort_out: bool, reason: str) -> None:
        (b,) = self.at[e.name]
        self.stroke(b, _end(b, e.name, effort_out), reason)

    def prefer(self, e: Element, *, effort_out: bool, reason: str) -> bool:
        (b,) = self.at[e.name]
        return self.try_stroke(b, _end(b, e.name, effort_out), reason)

    def try_stroke(self, b: Bond, effort_to: str, reason: str) -> bool:
        """Set a stroke; take everything back and answer False if it leads to a conflict."""
        if b in self.strokes:
            return self.strokes[b].effort_to == effort_to
        before = dict(self.strokes)
        try:
            self.stroke(b, effort_to, reason)
        except CausalConflict:
            self.strokes = before
            return False
        return True

    def stroke(self, bond: Bond, effort_to: str, reason: str) -> None:
        """Set a stroke and propagate what follows from it."""
        queue = deque([(bond, effort_to, reason)])
        while queue:
            b, to, why = queue.popleft()
            old = self.strokes.get(b)
            if old is not None:
                if old.effort_to != to:
                    raise self._conflict(b, old, to, why)
                continue
            self.strokes[b] = Stroke(b, to, why)
            for end in (b.tail, b.head):
                queue.extend(self._consequences(end))

    def _conflict(self, b: Bond, old: Stroke, to: str, why: str) -> CausalConflict:
        return CausalConflict(
            f"{self.graph.name}: causal conflict at bond {b.name}: effort to {old.effort_to} "
            f"because {old.reason}, but effort to {to} because {why}; put a resistance, "
            "a compliance or an inertia between the two elements that impose the same variable"
        )

    def _consequences(self, name: str) -> list[tuple[Bond, str, str]]:
        e, bonds = self.graph[name], self.at[name]
        if isinstance(e, TF | GY):
            return self._two_port(e, bonds)
        if isinstance(e, Zero | One):
            return self._junction(e, bonds)
        return []

    def _two_port(self, e: Element, bonds: list[Bond]) -> list[tuple[Bond, str, str]]:
        known = [b for b in bonds if b in self.strokes]
        out = []
        for b in bonds:
            if b in self.strokes:
                continue
            for k in known:
                effort_in = self.strokes[k].effort_to == e.name
                wants_in = effort_in if isinstance(e, GY) else not effort_in
                out.append((b, _end(b, e.name, not wants_in), f"{e.kind} {e.name} passes it on"))
        if len(known) == 2:
            first, second = (self.strokes[k].effort_to == e.name for k in known)
            if (first == second) != isinstance(e, GY):
                other = known[1]
                out.append(
                    (
                        other,
                        _other(other, self.strokes[other].effort_to),
                        f"{e.kind} {e.name} passes it on from {known[0].name}",
                    )
                )
        return out

    def _junction(self, e: Element, bonds: list[Bond]) -> list[tuple[Bond, str, str]]:
        zero = isinstance(e, Zero)

        def decides(b: Bond) -> bool:
            return (self.strokes[b].effort_to == e.name) == zero

        known = [b for b in bonds if b in self.strokes]
        strong = [b for b in known if decides(b)]
        word = "effort" if zero else "flow"
        if strong:
            why = f"{strong[0].name} sets the {word} of {e.name}"
            # a second strong bond contradicts the first: _end yields the opposite stroke for it
            return [
                (b, _end(b, e.name, zero), why)
                for b in bonds
                if b != strong[0] and (b not in known or b in strong)
            ]
        if len(known) == len(bonds) - 1:
            (last,) = (b for b in bonds if b not in self.strokes)
            return [
                (
                    last,
                    _end(last, e.name, not zero),
                    f"the only bond left to set the {word} of {e.name}",
                )
            ]
        if len(known) == len(bonds):
            last = known[-1]
            return [(last, _end(last, e.name, not zero), f"no bond sets the {word} of {e.name}")]
        return []


def _end(b: Bond, name: str, effort_out: bool) -> str:
    """End that receives the effort when `name` gives it out (or not)."""
    other = b.head if b.tail == name else b.tail
    return other if effort_out else name


def _other(b: Bond, end: str) -> str:
    return b.head if b.tail == end else b.tail


__all__ = ["CausalConflict", "Causality", "De", "Df", "Dq", "Stroke", "assign_causality"]
