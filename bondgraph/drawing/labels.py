"""Labels of elements with their extent, and the domains that colour them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import networkx as nx

from bondgraph.drawing.geometry import Rect, hull
from bondgraph.drawing.readings import expression
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, Junction, Multiport, Switched, TwoPort

SIZE, SMALL, GLYPH, NOTE = 14.0, 10.5, 18.0, 24
# advance of a bold glyph over the font size; DejaVu Sans, the widest of the usual fonts
_GLYPHS = (
    (0.40, "'ijl /IJ\\|,.:;"),
    (0.50, "-f!()[]tr_`"),
    (0.60, '"*?zcs'),
    (0.70, "LvxyakEFTeo$0123456789"),
    (0.77, "hnu{}SYbdgpqCPZBAKRVX"),
    (0.87, "UGD#+<=>HN^~OQ&"),
    (1.10, "w%@MmW"),
)
_ADVANCE = {ch: width for width, glyphs in _GLYPHS for ch in glyphs}
_TOKENS: tuple[tuple[str, frozenset[str]], ...] = (
    ("chemical", frozenset({"mol"})),
    ("electrical", frozenset({"V", "A", "ohm", "Ohm", "F", "C", "H", "S", "Wb"})),
    ("hydraulic", frozenset({"Pa", "bar"})),
    ("thermal", frozenset({"K", "W", "degC"})),
    ("mechanical", frozenset({"N", "m", "mm", "um", "kg", "rad", "J", "g"})),
)


@dataclass(frozen=True, slots=True)
class Label:
    """What is written at an element, relative to the point its bonds aim at.

    Attributes
    ----------
    text : str
        Main line, centred on the anchor.
    size : float
        Font size of the main line.
    body : Rect
        Box of the main line, filled with the colour of the domain.
    parts : tuple of Rect
        All boxes that bonds stay out of: body (with its ring), note, caption.
    note : str
        Small line: the name of a junction, the expression of a modulated element.
    note_at : float
        Base line of the note.
    caption : str
        Marking; empty for none.
    caption_at : float
        Base line of the caption.
    """

    text: str
    size: float
    body: Rect
    parts: tuple[Rect, ...]
    note: str = ""
    note_at: float = 0.0
    caption: str = ""
    caption_at: float = 0.0

    @property
    def box(self) -> Rect:
        """Box around everything."""
        return hull(self.parts)


def text_width(text: str, size: float) -> float:
    """Width that bold sans-serif text does not exceed."""
    return size * sum(_ADVANCE.get(ch, 0.85 if ord(ch) < 0x2E80 else 1.05) for ch in text)


def label(
    element: Element, caption: str = "", *, ringed: bool = False, above: bool = False
) -> Label:
    """Return the label of `element`; `above` puts its small lines over it instead of under it."""
    junction = isinstance(element, Junction)
    text = element.kind if junction else f"{element.kind} : {element.name}"
    size = GLYPH if junction else SIZE
    half = max(text_width(text, size) / 2 + 6, 13.0)
    body = Rect(-half, -13.0, half, 13.0)
    parts = [body.grown(4.5) if ringed or caption else body]
    upwards = above and not junction
    base_lines = []
    note = _note(element)
    for line, room, rise in ((note, 13.0, 3.0), (caption, 14.0, 3.5)):
        everything = hull(parts)
        top = everything.y0 - room if upwards else everything.y1
        base_lines.append(top + room - rise)
        if line:
            w = text_width(line, SMALL) / 2 + 1
            parts.append(Rect(-w, top, w, top + room))
    return Label(text, size, body, tuple(parts), note, base_lines[0], caption, base_lines[1])


def describe(e: Element) -> str:
    """Text shown when the pointer rests on an element: kind, name, value, unit, its channel."""
    value, unit = _value(e), getattr(e, "unit", "")
    shown = "" if value is None else f" = {value}"
    held = {f: getattr(e, f) for f in getattr(e, "channel", ())}
    more = "".join(f", {f.replace('_', ' ')} {v}" for f, v in held.items() if v is not None)
    return f"{e.kind} {e.name}{shown}{f' {unit}' if unit else ''}{more}"


def table(graph: BondGraph) -> list[dict[str, str | float]]:
    """Return a row for each element: name, kind, value and unit, law, and what it is joined to."""
    rows: list[dict[str, str | float]] = []
    for n, e in graph.elements.items():
        value, law = _value(e), getattr(e, "law", None)
        named = graph.parameters.get(str(value))
        shown = "" if value is None else str(value)
        number = value if isinstance(value, float | int) else named.value if named else shown
        joined = ({b.tail, b.head} - {n} for b in graph.bonds_of(n))
        rows.append(
            {
                "name": n,
                "kind": e.kind,
                "value": number,
                "unit": getattr(e, "unit", ""),
                "law": "" if law is None else law.name,
                "joined to": ", ".join(sorted(set().union(*joined))),
            }
        )
    return rows


def _value(e: Element) -> Any:
    value = getattr(e, "stiffness", None)
    for field in ("value", "ratio"):
        value = getattr(e, field, None) if value is None else value
    return value


def _note(e: Element) -> str:
    """Small line of an element: name and position of a junction, expression if it is short."""
    if isinstance(e, Switched):
        return f"{e.name}: {'on' if e.on else 'off'}"
    if isinstance(e, Junction):
        return e.name
    value = expression(e)
    return str(value) if value is not None and len(str(value)) <= NOTE else ""


def unit_domain(unit: str) -> str:
    """Guess the domain from a unit; empty if nothing tells."""
    tokens = set(re.findall(r"[A-Za-z]+", unit))
    if tokens & {"K", "degC"}:
        return "thermal"
    for name, known in _TOKENS:
        if tokens & known:
            return name
    return ""


def element_domains(graph: BondGraph) -> Mapping[str, str]:
    """Domain of every element: the most frequent one on its side of two-ports and multiports."""
    g: nx.Graph = nx.Graph(graph.network)
    couplers = [e.name for e in graph.of_type(TwoPort, Multiport)]
    found = dict.fromkeys(couplers, "")
    votes: dict[str, list[str]] = {n: [unit_domain(_unit(graph[n]))] for n in graph.elements}
    for e in graph.of_type(Multiport):
        for b, unit in zip(graph.bonds_of(e.name), e.units, strict=False):
            votes[b.head if b.tail == e.name else b.tail].append(unit_domain(unit))
    g.remove_nodes_from(couplers)
    for part in nx.connected_components(g):
        count = Counter(d for n in graph.elements if n in part for d in votes[n] if d)
        common = count.most_common(1)[0][0] if count else ""
        found.update({n: votes[n][0] or common for n in part})
    return found


def _unit(e: Element) -> str:
    return str(getattr(e, "unit", ""))
