"""Physical domains of bonds from the units of elements; a voltage never meets a force unnoticed.

Bonds at one junction share a domain; two-ports and fields separate domains. Every unit is a
statement about the effort, the flow or their quotient of its group of bonds: a source or sensor
gives one of them, R is effort over flow, C displacement over effort (a stiffness the inverse), I
momentum over flow. Two statements contradict each other if they say the same quantity in different
dimensions, or if the domains of `bondgraph.graph.domains` that they fit have none in common.
Elements without unit, or with unit "1", say nothing, nor do commands and readings on the far side
of a drive's or a sensor's law, or of a gain with a unit; what is ambiguous is no error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.domains import DOMAINS
from bondgraph.graph.elements import (
    RS,
    C,
    Element,
    I,
    Junction,
    MSe,
    Multiport,
    R,
    Se,
    Source,
    common_variable,
)
from bondgraph.graph.sensors import Da, De, Df, Dq, Sensor
from bondgraph.graph.unit_slips import TRANSDUCER, slip
from bondgraph.signals.units import Dimension, parse_unit, product
from bondgraph.support.errors import UnusableInput

SECOND: Dimension = (0, 0, 1, 0, 0)


@dataclass(frozen=True, slots=True)
class UnitStatement:
    """What the unit of one element says about its bond.

    Attributes
    ----------
    element : Element
    bond : Bond
    quantity : {"e", "f", "z"}
        Effort, flow, or effort over flow.
    dims : tuple of 5 int
        Its dimension.
    unit : str
        As it was written.
    """

    element: Element
    bond: Bond
    quantity: str
    dims: Dimension
    unit: str

    @property
    def domains(self) -> frozenset[str]:
        """Names of the domains it fits; none if it fits no domain of the table."""
        return fitting(self.quantity, self.dims)

    def __str__(self) -> str:
        """Element, kind, unit, domain, bond."""
        names = " or ".join(sorted(self.domains)) or "no domain of the table"
        e = self.element
        return f"{e.name} ({e.kind}, unit {self.unit}: {names}, bond {self.bond.name})"


def domain_problems(graph: BondGraph) -> tuple[str, ...]:
    """Return one line for every group of bonds whose units belong to different domains.

    Examples
    --------
    >>> from bondgraph import BondGraph, I, One, Se
    >>> with BondGraph("g") as g:
    ...     body = One("body")
    ...     _ = Se("V", unit="V") >> body >> I("m", 1.0, unit="kg")
    >>> print(domain_problems(g)[0].split(";")[0])
    V (Se, unit V: electrical, bond V>body) meets m (I, unit kg: translation, bond body>m)
    """
    lines: list[str] = []
    for group in _stated(graph, lines):
        if stiff := [s for s in group if _meant_stiffness(s, group)]:
            lines.extend(map(_stiffness_line, stiff))
            continue
        pair = _contradiction(group)
        if pair is not None:
            lines.append(slip(group) or _line(*pair))
            continue
        e, f, z = (next((s for s in group if s.quantity == q), None) for q in "efz")
        if e and f and z and product(e.dims, f.dims, -1) != z.dims:
            lines.append(
                slip(group)
                or f"{e}, {f} and {z} do not fit together: effort over flow is not the unit of "
                f"{z.element.name}; correct one of the units, or put a TF or GY between"
            )
    return tuple(lines)


def groups_of_bonds(graph: BondGraph) -> dict[Bond, int]:
    """Return the number of the group of every bond: bonds at one junction share theirs."""
    from networkx.utils import UnionFind

    number = {b: i for i, b in enumerate(graph.bonds)}
    joined = UnionFind(number.values())
    for e in graph.of_type(Junction):
        joined.union(*(number[b] for b in graph.bonds_of(e.name)))
    return {b: joined[i] for b, i in number.items()}


def statements(graph: BondGraph) -> tuple[UnitStatement, ...]:
    """Return what the units of all elements say; units that cannot be read say nothing."""
    return tuple(s for e in graph.elements.values() for s in _of(graph, e, []))


def dimensions_of(graph: BondGraph) -> dict[Bond, tuple[Dimension | None, Dimension | None]]:
    """Return dimensions of effort and flow of every bond, None where the units do not tell.

    Two of effort, flow and their quotient give the third; if the statements fit one domain only,
    it gives both.
    """
    group = groups_of_bonds(graph)
    said: dict[int, list[UnitStatement]] = {}
    for s in statements(graph):
        said.setdefault(group[s.bond], []).append(s)
    known = {i: _resolved(ss) for i, ss in said.items()}
    return {b: known.get(i, (None, None)) for b, i in group.items()}


def _resolved(said: list[UnitStatement]) -> tuple[Dimension | None, Dimension | None]:
    by = {s.quantity: s.dims for s in reversed(said)}
    e, f, z = by.get("e"), by.get("f"), by.get("z")
    if e is None and f is not None and z is not None:
        e = product(f, z)
    if f is None and e is not None and z is not None:
        f = product(e, z, -1)
    if e is not None and f is not None:
        return e, f
    fits = [s.domains for s in said if s.domains]
    common = frozenset.intersection(*fits) if fits else frozenset()
    if len(common) == 1 and all(s.domains for s in said):
        d = DOMAINS[next(iter(common))]
        return d.effort.parsed.dims, d.flow.parsed.dims
    return e, f


def _stated(graph: BondGraph, lines: list[str]) -> list[list[UnitStatement]]:
    """Statements by group; units that cannot be read become lines."""
    group = groups_of_bonds(graph)
    said: dict[int, list[UnitStatement]] = {}
    for e in graph.elements.values():
        for s in _of(graph, e, lines):
            said.setdefault(group[s.bond], []).append(s)
    return list(said.values())


def _contradiction(said: list[UnitStatement]) -> tuple[UnitStatement, UnitStatement] | None:
    """Return the first two statements that cannot both hold."""
    distinct: dict[tuple[str, Dimension], UnitStatement] = {}
    for s in said:
        key = (s.quantity, s.dims)
        if key in distinct:
            continue
        for other in distinct.values():
            if other.quantity == s.quantity:
                return other, s
            if s.domains and other.domains and not (s.domains & other.domains):
                return other, s
        distinct[key] = s
    return None


def _meant_stiffness(said: UnitStatement, group: list[UnitStatement]) -> bool:
    """Whether the unit of a compliance fits no other unit of the group, and as a stiffness all."""
    e = said.element
    if not isinstance(e, C) or e.stiffness is not None or said.quantity != "z":
        return False
    others = [s.domains for s in group if not isinstance(s.element, C) and s.domains]
    if not others:
        return False
    common = frozenset.intersection(*others)
    inverse = fitting(*as_quotient("k", parse_unit(said.unit).dims))
    return bool(common & inverse) and not common & said.domains


def _stiffness_line(said: UnitStatement) -> str:
    e = said.element
    assert isinstance(e, C)
    value = e.value if e.value is None or isinstance(e.value, str) else f"{e.value:g}"
    return (
        f"{said}: a C takes the compliance, displacement over effort, and {said.unit} is a "
        f'stiffness; write C("{e.name}", stiffness={value}, unit="{said.unit}")'
    )


def _line(first: UnitStatement, second: UnitStatement) -> str:
    return (
        f"{first} meets {second}; bonds at one junction share a domain: correct a unit or, if both "
        f"are meant, {TRANSDUCER}"
    )


def _of(graph: BondGraph, e: Element, lines: list[str]) -> Iterator[UnitStatement]:
    """Statements of one element."""
    bonds = graph.bonds_of(e.name)
    if (gain := getattr(e, "gain", None)) is not None:
        named = graph.parameters.get(str(gain))
        if named is None or named.unit not in ("", "1"):
            return  # the unit is that of what is recorded, not of the bond
    for i, (quantity, unit) in enumerate(_written(graph, e)):
        if not unit.strip() or unit.strip() == "1" or not quantity:
            continue
        at = 1 if isinstance(e, RS) and i else i if isinstance(e, Multiport) else 0
        if isinstance(e, RS):
            ends = [b for b in bonds if (b.tail == e.name) == bool(at)]
        else:
            ends = list(bonds[at : at + 1])
        if not ends:
            continue
        try:
            dims = parse_unit(unit).dims
        except UnusableInput as error:
            lines.append(f"{e.name} ({e.kind}): {error}")
            continue
        yield UnitStatement(e, ends[0], *as_quotient(quantity, dims), unit)


def _written(graph: BondGraph, e: Element) -> tuple[tuple[str, str], ...]:
    """Return what the element's units measure, one entry a port (two for the heat port of RS)."""
    if isinstance(e, RS):
        heat = (("f", "W"), ("e", "K")) if e.heat == "energy" else (("e", "K"),)
        return (("z", e.unit), *heat)
    if isinstance(e, Multiport):
        return tuple(("e", unit) for unit in e.units)
    unit = getattr(e, "unit", "")
    if isinstance(e, Source):
        effort = isinstance(e, Se | MSe)
        command = e.drive is not None and e.drive.law is not None
        letter = "e" if effort else "f"
        quantity = {"rate": f"d{letter}", "integral": "p" if effort else "q"}.get(e.given, letter)
        return () if command else ((quantity, unit),)
    if isinstance(e, Sensor):
        if e.law is not None:
            return ()
        table: dict[type[Element], str] = {De: "e", Df: "f", Dq: "q"}
        if isinstance(e, Da):
            return ((f"d{common_variable(graph[graph.neighbour(e.name)])}", unit),)
        return ((table.get(type(e), ""), unit),)
    if isinstance(e, R):
        return (("z", unit),)
    if isinstance(e, C):
        if e.law is not None and e.value is None and e.stiffness is None:
            return ()  # the unit may be that of a stiffness or of a compliance
        return (("k" if e.stiffness is not None else "c", unit),)
    if isinstance(e, I):
        return (("i", unit),)
    return (("e", unit),) if isinstance(e, Junction) and unit else ()


def as_quotient(quantity: str, dims: Dimension) -> tuple[str, Dimension]:
    """Express a displacement or a rate as its flow or effort; the coefficients as a quotient."""
    if quantity == "q":
        return "f", product(dims, SECOND, -1)
    if quantity == "p":
        return "e", product(dims, SECOND, -1)
    if quantity in ("df", "de"):
        return quantity[1:], product(dims, SECOND)
    if quantity == "k":  # effort / displacement
        return "z", product(dims, SECOND)
    if quantity == "c":  # displacement / effort
        return "z", product(SECOND, dims, -1)
    if quantity == "i":  # momentum / flow
        return "z", product(dims, SECOND, -1)
    return quantity, dims


@lru_cache(maxsize=512)
def fitting(quantity: str, dims: Dimension) -> frozenset[str]:
    """Return the domains in which effort, flow or their quotient has these dimensions."""
    found = set()
    for d in DOMAINS.values():
        e, f = d.effort.parsed.dims, d.flow.parsed.dims
        if d.name != "generic" and dims == {"e": e, "f": f, "z": product(e, f, -1)}[quantity]:
            found.add(d.name)
    return frozenset(found)
