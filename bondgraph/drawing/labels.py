"""Labels of elements with their extent, and the domains that colour them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import networkx as nx

from bondgraph.drawing.geometry import Rect, hull
from bondgraph.elements import Element, Junction, TwoPort
from bondgraph.graph import BondGraph

SIZE, SMALL, GLYPH = 14.0, 10.5, 18.0
_NARROW, _WIDE = frozenset("iIjltf.,:;|!'()[] r1"), frozenset("mwMWQOGDHNU@%")
_TOKENS: tuple[tuple[str, frozenset[str]], ...] = (
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
    below : str
        Small line under it: the name of a junction.
    body : Rect
        Box of the main line, filled with the colour of the domain.
    parts : tuple of Rect
        All boxes that bonds stay out of: body, name, caption.
    caption : str
        Marking; empty for none.
    caption_at : float
        Base line of the caption.
    name_at : float
        Base line of the small name.
    """

    text: str
    size: float
    below: str
    body: Rect
    parts: tuple[Rect, ...]
    caption: str = ""
    caption_at: float = 0.0
    name_at: float = 0.0

    @property
    def box(self) -> Rect:
        """Box around everything."""
        return hull(self.parts)


def text_width(text: str, size: float) -> float:
    """Generous estimate of the width of sans-serif text."""
    units = 0.0
    for ch in text:
        if ord(ch) > 0x2E80:
            units += 1.05
        elif ch in _NARROW:
            units += 0.40
        elif ch in _WIDE:
            units += 0.92
        else:
            units += 0.72 if ch.isupper() else 0.62
    return units * size


def label(
    element: Element, caption: str = "", *, ringed: bool = False, above: bool = False
) -> Label:
    """Return the label of `element`; `above` puts the caption over it instead of under it."""
    junction = isinstance(element, Junction)
    text = element.kind if junction else f"{element.kind} : {element.name}"
    size = GLYPH if junction else SIZE
    half = max(text_width(text, size) / 2 + 6, 13.0)
    body = Rect(-half, -13.0, half, 13.0)
    parts = [body.grown(4.0) if ringed or caption else body]
    name_at = 0.0
    if junction:
        w = text_width(element.name, SMALL) / 2
        top = parts[0].y1
        parts.append(Rect(-w, top, w, top + 13.0))
        name_at = top + 10.0
    caption_at = 0.0
    if caption:
        w = text_width(caption, SMALL) / 2 + 2
        everything = hull(parts)
        if above and not junction:
            parts.append(Rect(-w, everything.y0 - 14.0, w, everything.y0))
            caption_at = everything.y0 - 4.0
        else:
            parts.append(Rect(-w, everything.y1, w, everything.y1 + 14.0))
            caption_at = everything.y1 + 10.5
    below = element.name if junction else ""
    return Label(text, size, below, body, tuple(parts), caption, caption_at, name_at)


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
    """Domain of every element: the most frequent one on its side of the two-ports."""
    g: nx.Graph = nx.Graph(graph.network().to_undirected())
    two_ports = [e.name for e in graph.of_type(TwoPort)]
    g.remove_nodes_from(two_ports)
    found = dict.fromkeys(two_ports, "")
    for part in nx.connected_components(g):
        votes = Counter(
            d for n in graph.elements if n in part and (d := unit_domain(_unit(graph[n])))
        )
        common = votes.most_common(1)[0][0] if votes else ""
        found.update({n: unit_domain(_unit(graph[n])) or common for n in part})
    return found


def _unit(e: Element) -> str:
    return str(getattr(e, "unit", ""))
