"""Every element as linear equations in the operator ``s = d/dt``, each with its owner.

No causality is needed here: unknowns are efforts, flows, stored quantities and positions; known
are inputs and readings. Laws keep their linear part; where the deviation enters is remembered.
Sizes: n unknowns, n_y sensors, n + n_y equations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import sympy as sp

from bondgraph.analysis.exact_algebra import rational
from bondgraph.analysis.linear import LAPLACE
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.field_laws import field_laws
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import (
    GY,
    MGY,
    MTF,
    TF,
    C,
    Element,
    Field,
    I,
    Junction,
    Modulated,
    R,
    Se,
    Source,
    Zero,
    common_variable,
)
from bondgraph.graph.modulation import port_variables
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Da, De, Df, Dq, Reading, Sensor
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.support.errors import BondsightError, GraphError

FAULT_ROLES = ("law", "ratio", "source", "reading")
"""Equations that a fault of their element breaks; balances and definitions always hold."""

Terms: TypeAlias = tuple[tuple[Any, str], ...]
Positions: TypeAlias = Mapping[str, Terms]


@dataclass(frozen=True, slots=True)
class OperatorEquation:
    """``0 = sum(c * unknown) + sum(c * known) - deviation``.

    Attributes
    ----------
    element : str
    role : {"balance", "law", "rate", "ratio", "source", "place", "reading"}
    unknown, known : tuple of (sympy.Expr, str)
        Coefficients, polynomials in ``s``, with signals; inputs or sensors.
    argument : str
        Signal that the nonlinear law of the element acts on; empty without one.
    lag : sympy.Expr
        Factor of the deviation.
    """

    element: str
    role: str
    unknown: Terms
    known: Terms = ()
    argument: str = ""
    lag: Any = sp.S.One


@dataclass(frozen=True)
class OperatorEquations:
    """All equations of a graph.

    Attributes
    ----------
    name : str
    equations : tuple of OperatorEquation
    unknowns : tuple of str
    inputs : tuple of str
        Sources, and ``one``, ``ramp`` of offsets and drifts.
    sensors : tuple of str
    """

    name: str
    equations: tuple[OperatorEquation, ...]
    unknowns: tuple[str, ...]
    inputs: tuple[str, ...]
    sensors: tuple[str, ...]

    def rows_of(self, element: str, roles: Iterable[str] = FAULT_ROLES) -> tuple[int, ...]:
        """Return the positions of the equations of an element."""
        wanted = tuple(roles)
        return tuple(
            i for i, q in enumerate(self.equations) if q.element == element and q.role in wanted
        )

    @property
    def owners(self) -> tuple[str, ...]:
        """Elements that a fault can change, in order."""
        return tuple(dict.fromkeys(q.element for q in self.equations if q.role in FAULT_ROLES))


def operator_equations(graph: BondGraph, places: Positions | None = None) -> OperatorEquations:
    """Return the equations of `graph`.

    Parameters
    ----------
    graph : BondGraph
        Switched junctions are taken in the mode their `on` says. Delays are not part of the
        equations: a reading stands for what the sensor sees, already shifted back.
    places : mapping of str to terms, optional
        `positions` of the graph, if known already.

    Raises
    ------
    GraphError
        An element is not linear and has no law to set aside (modulation, reaction, heat).
    """
    graph = in_mode(graph)
    graph.require_sound()
    build = _Equations(graph)
    for e in graph.elements.values():
        build.element(e)
    found = positions(graph) if places is None else places
    for s in graph.of_type(Sensor):
        build.sensor(s, found)
    unknowns = dict.fromkeys(n for q in build.made for _, n in q.unknown)
    inputs = [n for n in dict.fromkeys(n for q in build.made for _, n in q.known)
              if not isinstance(graph.elements.get(n), Sensor)]  # fmt: skip
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    return OperatorEquations(graph.name, tuple(build.made), tuple(unknowns), tuple(inputs), sensors)


def positions(graph: BondGraph) -> dict[str, Terms]:
    """Return, for each position sensor, the stored displacements that add up to its reading.

    A sensor that no displacements give is left out: its reading is then the integral of the flow.
    """
    wanted = [s.name for s in graph.of_type(Dq)]
    if not wanted:
        return {}
    from bondgraph.equations.derivation import equations

    try:
        model = equations(graph)
    except BondsightError:
        return {}
    stores = {f"q_{c.name}" for c in graph.of_type(C)}
    found = {}
    for n in wanted:
        terms = model.relations[model.index[f"x_{n}"]].terms
        if all(s in stores for _, s in terms):
            found[n] = tuple((rational(c), s) for c, s in terms)
    return found


@dataclass
class _Equations:
    """Writes the equations down, element by element."""

    graph: BondGraph
    made: list[OperatorEquation] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.names = SignalNames(self.graph)
        sensors = {s.name for s in self.graph.of_type(Sensor)}
        bonds = self.graph.bonds
        self.power = frozenset(b for b in bonds if not {b.tail, b.head} & sensors)

    def put(self, element: str, role: str, unknown: Iterable[tuple[Any, str]], **more: Any) -> None:
        total: dict[str, Any] = {}
        for c, n in unknown:
            total[n] = total.get(n, sp.S.Zero) + rational(c)
        kept = tuple((c, n) for n, c in total.items() if c != 0)
        self.made.append(OperatorEquation(element, role, kept, **more))

    def bonds(self, name: str) -> list[Bond]:
        return [b for b in self.graph.bonds_of(name) if b in self.power]

    def element(self, e: Element) -> None:
        if isinstance(e, Sensor):
            return
        if isinstance(e, Junction):
            variable = self.names.flow if isinstance(e, Zero) else self.names.effort
            signs = [(1 if b.head == e.name else -1, variable(b)) for b in self.bonds(e.name)]
            self.put(e.name, "balance", signs)
        elif isinstance(e, MTF | MGY):
            raise self._refuse(e, "its ratio is a signal")
        elif isinstance(e, TF | GY):
            self._two_port(e)
        elif isinstance(e, Field):
            self._field(e)
        elif isinstance(e, Modulated):
            self._modulated(e)
        elif isinstance(e, Source):
            self._source(e)
        elif isinstance(e, R | C | I):
            self._one_port(e)
        else:
            raise self._refuse(e, "it is not linear")

    def _refuse(self, e: Element, why: str) -> GraphError:
        return GraphError(
            f"{self.graph.name}: {e.name} ({e.kind}) has no equation in the operator s ({why}); "
            "put a linear element in its place at the operating point of interest"
        )

    def _inward(self, b: Bond, name: str) -> int:
        return 1 if b.head == name else -1

    def _two_port(self, e: TF | GY) -> None:
        n = self.graph.coefficient(e)
        (into,) = (b for b in self.graph.bonds_of(e.name) if b.head == e.name)
        (out,) = (b for b in self.graph.bonds_of(e.name) if b.tail == e.name)
        e1, f1 = self.names.effort(into), self.names.flow(into)
        e2, f2 = self.names.effort(out), self.names.flow(out)
        pairs = ((e1, e2), (f2, f1)) if isinstance(e, TF) else ((e1, f2), (e2, f1))
        for target, source in pairs:
            self.put(e.name, "ratio", [(1, target), (-n, source)])

    def _source(self, e: Source) -> None:
        (b,) = self.graph.bonds_of(e.name)
        target = self.names.effort(b) if isinstance(e, Se) else self.names.flow(b)
        times = {"rate": 1 / LAPLACE, "integral": LAPLACE}.get(e.given, sp.S.One)
        if e.drive is not None and e.drive.law is not None:
            times = times * rational(e.drive.law.signal_slope)
        known: list[tuple[Any, str]] = [(-self._factor(e) * times, e.name)]
        if (offset := self.graph.channel_value(e, "offset")) is not None:
            known.append((-offset * times, "one"))
        lag = 1
        argument = ""
        if e.drive is not None:
            if e.drive.lag:
                lag = 1 + symbol(e.drive.lag, positive=True) * LAPLACE
            argument = e.name if e.drive.law else ""
        self.put(e.name, "source", [(lag, target)], known=tuple(known), argument=argument)

    def _factor(self, e: Source | Sensor) -> sp.Expr:
        """Return the factor of a source or a sensor; 1 without one."""
        gain = self.graph.channel_value(e, "gain")
        return sp.S.One if gain is None else gain

    def _modulated(self, e: Modulated) -> None:
        (b,) = self.graph.bonds_of(e.name)
        target = self.names.effort(b) if e.kind == "MSe" else self.names.flow(b)
        unknown, known = self._linear(e)
        self.put(e.name, "source", [(1, target), *unknown], known=tuple(known))

    def _linear(
        self, e: Modulated | Reading
    ) -> tuple[list[tuple[Any, str]], list[tuple[Any, str]]]:
        """Return the terms of a value that is linear in signals, each with the sign turned."""
        unknown: list[tuple[Any, str]] = []
        known: list[tuple[Any, str]] = []
        value = rational(e.value) if not isinstance(e.value, str) else symbol(e.value)
        parameters = {p.symbol for p in self.graph.parameters.values()}
        signals = sorted(value.free_symbols - parameters, key=str)
        rest = value.xreplace(dict.fromkeys(signals, sp.S.Zero))
        for v in signals:
            slope = value.diff(v)
            letter, _, name = str(v).partition("_")
            if slope.free_symbols - parameters or str(v) == "time":
                raise self._refuse(e, f"its value is not linear in {v}")
            if letter == "in":
                known.append((-slope, str(v)))
            else:
                at = self.names.at(letter, name) if letter in ("e", "f") else str(v)
                unknown.append((-slope, at))
        if rest != 0:
            known.append((-rest, "one"))
        return unknown, known

    def _one_port(self, e: R | C | I) -> None:
        (b,) = self.graph.bonds_of(e.name)
        effort, flow = self.names.effort(b), self.names.flow(b)
        inward = self._inward(b, e.name)
        if isinstance(e, R):
            r = sp.S.Zero if e.value == 0 else self.graph.coefficient(e)
            argument = flow if e.law else ""
            self.put(e.name, "law", [(1, effort), (-r * inward, flow)], argument=argument)
            return
        slope = self.graph.slope(e)
        if isinstance(e, C):
            stored, output, sign, rate = f"q_{e.name}", effort, 1, (-inward, flow)
        else:
            stored, output, sign, rate = f"p_{e.name}", flow, inward, (-1, effort)
        argument = stored if e.law else ""
        self.put(e.name, "law", [(sign, output), (-slope, stored)], argument=argument)
        self.put(e.name, "rate", [(LAPLACE, stored), rate])

    def _field(self, e: Field) -> None:
        local = port_variables(e.letter, e.ports)
        laws = field_laws(self.graph, e)
        jacobian = sp.Matrix(laws).jacobian(local)
        rest = sp.Matrix(laws).xreplace(dict.fromkeys(local, sp.S.Zero))
        if jacobian.free_symbols & set(local):
            raise self._refuse(e, "its law is not linear")
        bonds = self.graph.bonds_of(e.name)
        efforts = [(sp.S.One, self.names.effort(b)) for b in bonds]
        flows = [(sp.Integer(self._inward(b, e.name)), self.names.flow(b)) for b in bonds]
        if e.letter == "f":
            variables, outputs = flows, efforts
        else:
            variables = [(sp.S.One, f"{e.letter}_{e.name}{i + 1}") for i in range(len(bonds))]
            outputs, rates = (efforts, flows) if e.letter == "q" else (flows, efforts)
            for (_, stored), (sign, signal) in zip(variables, rates, strict=True):
                self.put(e.name, "rate", [(LAPLACE, stored), (-sign, signal)])
        for i, (sign, output) in enumerate(outputs):
            terms = [(-jacobian[i, j] * c, v) for j, (c, v) in enumerate(variables)]
            known = () if rest[i] == 0 else ((-rest[i], "one"),)
            self.put(e.name, "law", [(sign, output), *terms], known=known)

    def sensor(self, e: Sensor, places: Positions) -> None:
        if isinstance(e, Reading):
            value = f"r_{e.name}"
            unknown, rest = self._linear(e)
            self.put(e.name, "signal", [(1, value), *unknown], known=tuple(rest))
            self._reading(e, value)
            return
        at = self.graph.neighbour(e.name)
        if isinstance(e, De | Df):
            value = self.names.at("e" if isinstance(e, De) else "f", at)
        elif isinstance(e, Da):
            value = f"a_{e.name}"
            shared = self.names.at(common_variable(self.graph[at]), at)
            self.put(e.name, "rate", [(1, value), (-LAPLACE, shared)])
        else:
            value = f"x_{e.name}"
            if e.name in places:
                stored = [(-c, n) for c, n in places[e.name]]
                self.put(e.name, "place", [(1, value), *stored])
            else:
                self.put(e.name, "place", [(LAPLACE, value), (-1, self.names.at("f", at))])
        self._reading(e, value)

    def _reading(self, e: Sensor, value: str) -> None:
        own, gain = self.graph.channel_value, self._factor(e)
        tau, omega, offset = own(e, "lag"), own(e, "natural_frequency"), own(e, "offset")
        lag = sp.S.One if tau is None else 1 + tau * LAPLACE
        if omega is not None:
            z = LAPLACE / omega
            zeta: Any = own(e, "damping_ratio")
            lag = sp.expand(lag * (z**2 + 2 * zeta * z + 1))
        known = [(lag, e.name)]
        if offset is not None:
            known.append((-lag * offset, "one"))
        for power, name in enumerate(e.drift, start=1):
            known.append((-lag * symbol(name), "ramp" if power == 1 else f"ramp{power}"))
        argument = value if e.law else ""
        through = rational(e.law.signal_slope) if e.law else sp.S.One
        self.put(
            e.name, "reading", [(-gain * through, value)],
            known=tuple(known), argument=argument, lag=gain * lag,
        )  # fmt: skip
