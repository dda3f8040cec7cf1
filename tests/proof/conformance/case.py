"""The published cases: a graph in the terms of its source, and what must come out of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from typing import Any

import sympy as sp

from bondgraph.support.errors import UnusableInput, unknown_name
from tests.proof.conformance.reader import read_expression

TYPES = ("Se", "Sf", "MSe", "R", "C", "I", "CF", "RE", "TF", "GY", "0", "1")
SOURCES = ("Se", "Sf")
STORES = {"C": "q", "I": "p", "CF": "q"}


@dataclass(frozen=True, slots=True)
class Part:
    """One element of a case.

    Attributes
    ----------
    name, type : str
        As in the source; types are those of `TYPES`, ``CF`` is a multiport C.
    value : sympy.Expr or None
        Coefficient (R, C, I), ratio (TF: ``e_in = n e_out``; GY: ``e_in = r f_out``), rate constant
        (RE), gain (MSe), constant (Se, Sf; without one the source is the input ``u_<name>``).
    law : sympy.Expr or None
        Effort in ``q`` (C) or ``f`` (R) instead of the linear law.
    energy : sympy.Expr or None
        Energy of a CF in ``q1, q2, ..``
    of : tuple of str
        Ends of the bond whose effort an MSe amplifies.
    """

    name: str
    type: str
    value: sp.Expr | None = None
    law: sp.Expr | None = None
    energy: sp.Expr | None = None
    of: tuple[str, ...] = ()

    @property
    def is_input(self) -> bool:
        """Whether the part is a source without a constant."""
        return self.type in SOURCES and self.value is None


@dataclass(frozen=True, slots=True)
class Transfer:
    """Transfer function from an input to ``e:<one-port>`` or ``f:<one-port>``."""

    input: str
    output: str
    function: sp.Expr


@dataclass(frozen=True)
class Case:
    """A graph with its expected results.

    Attributes
    ----------
    identity : str
        Name of the case.
    citation : str
        Authors, year, title, place and public address of the source.
    note : str
        What is special; may be empty.
    parts : tuple of Part
    bonds : tuple of (str, str)
        Half arrows from the first to the second.
    values : dict of str to float
        Numbers of parameters at which `expected` eigenvalues are given.
    expected : dict
        The fields to compare; expressions are still text.
    published : tuple of str
        Fields that the source states; the others were derived by brute force.
    """

    identity: str
    citation: str
    note: str
    parts: tuple[Part, ...]
    bonds: tuple[tuple[str, str], ...]
    values: Mapping[str, float]
    expected: Mapping[str, Any]
    published: tuple[str, ...]
    _by_name: dict[str, Part] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Index the parts; refuse bonds to nothing."""
        self._by_name.update({p.name: p for p in self.parts})
        for bond in self.bonds:
            for end in bond:
                self.part(end)

    def part(self, name: str) -> Part:
        """Part by name."""
        if name not in self._by_name:
            raise unknown_name("element", name, self.identity, self._by_name)
        return self._by_name[name]

    @cached_property
    def stores(self) -> dict[str, tuple[str, int]]:
        """State name -> its element and the port (from 0), e.g. ``q_c1`` or ``q_cm2``."""
        found = {}
        for p in self.parts:
            if p.type == "CF":
                found.update({f"q_{p.name}{i + 1}": (p.name, i) for i in range(self.ports(p.name))})
            elif p.type in STORES:
                found[f"{STORES[p.type]}_{p.name}"] = (p.name, 0)
        return found

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the sources that are inputs."""
        return tuple(p.name for p in self.parts if p.is_input)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names in the values, laws and energies of the parts."""
        ports = {"q", "f", *(f"q{i}" for i in range(1, 10))}
        found: set[str] = set()
        for p in self.parts:
            for e in (p.value, p.law, p.energy):
                if e is not None:
                    own = set() if e is p.value else ports
                    found |= {str(s) for s in e.free_symbols} - own
        return tuple(sorted(found))

    @property
    def impossible(self) -> bool:
        """Whether no causality exists."""
        return bool(self.expected.get("conflict", False))

    @property
    def equations(self) -> dict[str, sp.Expr]:
        """Expected equations, ``dq_x`` or ``q_x`` -> right-hand side; empty if not stated."""
        stated = self.expected.get("state_equations", {})
        return {k: read_expression(v) for k, v in stated.items()}

    @property
    def transfers(self) -> tuple[Transfer, ...]:
        """Expected transfer functions; empty if not stated."""
        return tuple(
            Transfer(t["input"], t["output"], read_expression(t["G"]))
            for t in self.expected.get("tf", ())
        )

    def ports(self, name: str) -> int:
        """Count the bonds at an element."""
        return sum(name in b for b in self.bonds)

    def bonds_of(self, name: str) -> tuple[int, ...]:
        """Return the indices of the bonds at an element, in order."""
        return tuple(i for i, b in enumerate(self.bonds) if name in b)

    def arrow(self, name: str) -> int:
        """+1 where the port flow of a one-port is the flow of its bond, -1 where it is opposed.

        A source gives its bond variable as it is.
        """
        if self.part(name).type in (*SOURCES, "MSe"):
            return 1
        return 1 if self.bonds[self.bonds_of(name)[0]][1] == name else -1

    def bond_between(self, ends: tuple[str, ...]) -> int:
        """Index of the bond with these two ends, whatever its direction."""
        for i, b in enumerate(self.bonds):
            if set(b) == set(ends):
                return i
        raise UnusableInput(f"{self.identity}: no bond joins {' and '.join(ends)}")


def cases() -> tuple[Case, ...]:
    """Read the conformance set that comes with the package."""
    data = json.loads(files(__package__).joinpath("cases.json").read_text(encoding="utf-8"))
    return tuple(_case(raw, data["works"]) for raw in data["cases"])


def case(identity: str) -> Case:
    """Return the case with this name."""
    known = {c.identity: c for c in cases()}
    if identity not in known:
        raise unknown_name("case", identity, "the conformance set", known)
    return known[identity]


def _case(raw: dict[str, Any], works: dict[str, Any]) -> Case:
    w = works[raw["work"]]
    return Case(
        raw["id"],
        f"{w['authors']} ({w['year']}), {w['title']}, {raw['where']}; {w['address']}",
        raw.get("note", ""),
        tuple(_part(e, raw["id"]) for e in raw["elements"]),
        tuple((tail, head) for tail, head in raw["bonds"]),
        {k: float(v) for k, v in raw["values"].items()},
        raw["expected"],
        tuple(raw["published"]),
    )


def _part(raw: dict[str, Any], where: str) -> Part:
    if raw["type"] not in TYPES:
        raise UnusableInput(
            f"{where}.{raw['name']}: type {raw['type']!r} is none of {', '.join(TYPES)}"
        )
    value = next((raw[k] for k in ("value", "ratio", "gain") if k in raw), None)
    return Part(
        raw["name"],
        raw["type"],
        None if value is None else read_expression(str(value)),
        read_expression(raw["law"]) if "law" in raw else None,
        read_expression(raw["energy"]) if "energy" in raw else None,
        tuple(raw.get("of", ())),
    )
