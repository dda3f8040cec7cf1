"""Which signal is the effort and which the flow of every bond.

``e_<name>`` and ``f_<name>``: of the junction where all its bonds share the variable, of the
one-port or the port of a field (``name1``) otherwise, of both ends (``tail_head``) if neither is.
"""

from __future__ import annotations

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import X0, X1, C, CField, I, IField, Multiport, One, Zero
from bondgraph.graph.modulation import TIME
from bondgraph.support.errors import GraphError, require_known, unknown_name


class SignalNames:
    """Names of the signals of a graph, one look-up each."""

    def __init__(self, graph: BondGraph) -> None:
        self._graph = graph
        self._zero = {e.name for e in graph.of_type(Zero, X0)}
        self._one = {e.name for e in graph.of_type(One, X1)}
        self._alias = self._aliases()
        self._port = {
            b: f"{e.name}{i}"
            for e in graph.of_type(Multiport)
            for i, b in enumerate(graph.bonds_of(e.name), start=1)
        }
        bonded = {end for b in graph.bonds for end in (b.tail, b.head)}
        self._own_one_port = {
            n for n, e in graph.elements.items() if e.n_ports == 1 and n in bonded
        }
        self._pairs = {b: (self._effort(b), self._flow(b)) for b in graph.bonds}

    def effort(self, b: Bond) -> str:
        """Return the name of the effort of a bond."""
        return self._pairs[b][0]

    def flow(self, b: Bond) -> str:
        """Return the name of the flow of a bond."""
        return self._pairs[b][1]

    def pair(self, b: Bond) -> tuple[str, str]:
        """Return the names of the effort and of the flow of a bond."""
        return self._pairs[b]

    def _effort(self, b: Bond) -> str:
        for end in (b.tail, b.head):
            if end in self._zero:
                return f"e_{self._alias.get(end, end)}"
        return f"e_{self._own(b)}"

    def _flow(self, b: Bond) -> str:
        for end in (b.tail, b.head):
            if end in self._one:
                return f"f_{self._alias.get(end, end)}"
        return f"f_{self._own(b)}"

    def at(self, letter: str, name: str) -> str:
        """Return the signal ``e`` or ``f`` at an element, a port of a field or ``tail>head``."""
        pick = self.effort if letter == "e" else self.flow
        common = self._zero if letter == "e" else self._one
        if name in common:
            return f"{letter}_{self._alias.get(name, name)}"
        if name in self._own_one_port:
            return pick(self._graph.bonds_of(name)[0])
        for b, port in self._port.items():
            if port == name:
                return pick(b)
        for b in self._graph.bonds:
            if name in (b.name, f"{b.tail}_{b.head}"):
                return pick(b)
        known = [*self._own_one_port, *common, *self._port.values()]
        raise unknown_name(
            "effort at" if letter == "e" else "flow at", name, self._graph.name, known
        )

    def aliases(self) -> dict[str, str]:
        """Return second names: of the port of an element whose signal is named after a junction."""
        found: dict[str, str] = {}
        for b in self._graph.bonds:
            own = self._pairs[b]
            port = self._port.get(b)
            for end in (port,) if port else (b.tail, b.head):
                if port or end in self._own_one_port:
                    for letter, name in zip("ef", own, strict=True):
                        if f"{letter}_{end}" != name:
                            found[f"{letter}_{end}"] = name
        for name, first in self._alias.items():
            for letter, kind in (("e", self._zero), ("f", self._one)):
                if name in kind and name != first:
                    found[f"{letter}_{name}"] = f"{letter}_{first}"
        return found

    def _own(self, b: Bond) -> str:
        if b in self._port:
            return self._port[b]
        for end in (b.head, b.tail):
            if end in self._own_one_port:
                return end
        return f"{b.tail}_{b.head}"

    def _aliases(self) -> dict[str, str]:
        """Junctions of one kind bonded to each other share their variable: the first one's name."""
        order = {n: i for i, n in enumerate(self._graph.elements)}
        root: dict[str, str] = {}

        def find(n: str) -> str:
            while root.get(n, n) != n:
                root[n] = root.get(root[n], root[n])
                n = root[n]
            return n

        for b in self._graph.bonds:
            for kind in (self._zero, self._one):
                if b.tail in kind and b.head in kind:
                    a, c = sorted((find(b.tail), find(b.head)), key=order.__getitem__)
                    root[c] = a
                    root.setdefault(a, a)
        return {n: find(n) for n in root}


def signal_called(names: SignalNames, text: str, graph: BondGraph, reader: str) -> str:
    """Return the signal that a symbol of an expression means.

    Parameters
    ----------
    text : str
        Name of the symbol, see `bondgraph.graph.modulation`.
    reader : str
        Element that holds the expression.

    Raises
    ------
    UnknownName, GraphError
        There is no such signal; a parameter of this name has another symbol.
    """
    letter, _, name = text.partition("_")
    if text == str(TIME) or (letter == "in" and name):
        return text
    if letter in ("e", "f") and name:
        return names.at(letter, name)
    if letter in ("q", "p") and name:
        from bondgraph.causality.assignment import storage_ports

        kinds = C | CField if letter == "q" else I | IField
        stores = [n for n, _, s in storage_ports(graph) if isinstance(s, kinds)]
        require_known("storage", f"{graph.name}.{reader}", stores, name)
        return text
    if text in graph.parameters:
        raise GraphError(
            f"{graph.name}.{reader}: {text!r} is a parameter, whose symbol is another; write "
            f"graph.parameters[{text!r}].symbol"
        )
    known = [*graph.parameters, "e_.., f_.., q_.., p_.. of an element", str(TIME)]
    raise unknown_name("signal", text, f"{graph.name}.{reader}", known)
