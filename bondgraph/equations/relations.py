"""Every element as causal relations between named signals; linear parts stay light."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cached_property
from math import isclose, isfinite
from typing import Any

import sympy as sp

from bondgraph.causality.assignment import Causality
from bondgraph.equations.bond_signals import SignalNames, signal_called
from bondgraph.equations.field_laws import crossed_ports, exact, field_laws
from bondgraph.equations.relation import (
    FINE,
    Dependent,
    LawUse,
    Relation,
    Relations,
    StoredState,
)
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import (
    GY,
    MGY,
    MTF,
    RE,
    RS,
    TF,
    C,
    Element,
    Field,
    I,
    Junction,
    Modulated,
    R,
    Source,
    Zero,
    common_variable,
)
from bondgraph.graph.modulation import TIME, port_variables
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Da, De, Df, Dq, Reading, Sensor
from bondgraph.laws.law import Law
from bondgraph.laws.rounding import Resolution
from bondgraph.laws.watching import WatchingLaw
from bondgraph.support.errors import GraphError, require_known


def collect(graph: BondGraph, causality: Causality) -> Relations:
    """Return the relations of every element of `graph` under `causality`."""
    made = Relations(graph, causality)
    builder = _Builder(made)
    for e in graph.elements.values():
        builder.element(e)
    for s in graph.of_type(Sensor):
        builder.sensor(s)
    made.aliases.update(builder.names.aliases())
    _refuse_collisions(made)
    return made


def _refuse_collisions(made: Relations) -> None:
    """Refuse an element or parameter that is called like a signal: one name, one meaning."""
    graph, parameters = made.graph, made.graph.parameters
    signals = {*made.found, *(s.name for s in made.states), *(d.stored for d in made.dependents)}
    ports = [n for use in made.laws for n in use.ports]
    if shared := [n for n in ports if ports.count(n) > 1]:
        raise GraphError(
            f"{graph.name}: {shared[0]!r} is an element with a law, and the rounding of a sensor "
            "or what a law watches is called like it; rename the element"
        )
    signals |= {f"w_{n}" for n in ports}
    stored = [*(s.name for s in made.states), *(d.stored for d in made.dependents)]
    if len(set(stored)) < len(stored):
        (twice, *_) = (n for n in stored if stored.count(n) > 1)
        raise GraphError(
            f"{graph.name}: two stores are called {twice!r}, one of them a port of a field; rename "
            "an element"
        )
    signals |= {f"{d}_{n}" for n in made.inputs for d in ("d", "d2", "d3")}
    sources = {e.name for e in graph.of_type(Source)}
    seen: set[str] = set()
    for n in (*made.inputs, *parameters):
        own = n in sources or n in parameters
        reserved = own and (n in (str(TIME), "one") or re.fullmatch(r"ramp\d*", n) is not None)
        if n in signals or n in seen or reserved:
            raise GraphError(
                f"{graph.name}: {n!r} is the name of a signal of this graph as well; rename the "
                "element or parameter"
            )
        seen.add(n)


class _Builder:
    """Emits relations; knows names, strokes and the meaning of symbols."""

    def __init__(self, made: Relations) -> None:
        self.made = made
        self.graph = made.graph
        self.names = SignalNames(made.graph)
        self.strokes = made.causality.strokes
        self._parameters = made.graph.parameters
        self._reads: dict[sp.Expr, tuple[sp.Expr, tuple[str, ...]]] = {}

    @cached_property
    def _symbols(self) -> frozenset[sp.Symbol]:
        return frozenset(p.symbol for p in self._parameters.values())

    # -- small tools --------------------------------------------------------------------------
    def put(
        self,
        target: str,
        terms: Iterable[tuple[Any, str]],
        reason: str,
        *,
        expression: sp.Expr | None = None,
        law: int | None = None,
        implicit: bool = False,
        reads: Iterable[str] = (),
    ) -> None:
        kept = tuple(terms)
        if (
            len(kept) == 1
            and kept[0][1] == target
            and isinstance(kept[0][0], int)
            and kept[0][0] == 1
            and expression is None
            and law is None
            and not implicit
        ):
            return
        if target in self.made.found:
            raise GraphError(
                f"{self.graph.name}: {target} is determined twice, by "
                f"{self.made.found[target].reason} and by {reason}; rename one of the elements"
            )
        more = tuple(reads)
        if law is not None:
            more = (*more, self.made.laws[law].argument)
        self.made.found[target] = Relation(target, kept, reason, expression, law, implicit, more)

    def effort_in(self, b: Bond, name: str) -> bool:
        return self.strokes[b].effort_to == name

    def signals(self, e: Element, value: Any) -> tuple[Any, tuple[str, ...]]:
        """Return `value` as an expression of signals by their names, and the signals it reads."""
        if value is None:
            raise GraphError(f"{self.graph.name}: {e.name} ({e.kind}) has no value; give one")
        if isinstance(value, int | float):
            return exact(value), ()
        if isinstance(value, str):
            require_known("parameter", f"{self.graph.name}.{e.name}", self._parameters, value)
            return self._parameters[value].symbol, ()
        table, reads = {}, []
        for s in sorted(value.free_symbols, key=str):
            if s in self._symbols:
                continue
            name = signal_called(self.names, str(s), self.graph, e.name)
            if name.startswith("in_") and name not in self.made.inputs:
                self.made.inputs.append(name)
            table[s] = symbol(name)
            reads.append(name)
        return value.xreplace(table), tuple(reads)

    def law_use(self, e: Element, role: str, law: Law, argument: str, slope: Any) -> int:
        names = tuple(p.name for p in law.parameters(e.name))
        if isinstance(law, WatchingLaw):
            law = law.watching(signal_called(self.names, law.watched, self.graph, e.name))
        return self._use(LawUse(e.name, role, law, argument, slope, names))

    def _use(self, use: LawUse) -> int:
        self.made.laws.append(use)
        return len(self.made.laws) - 1

    # -- elements -----------------------------------------------------------------------------
    def element(self, e: Element) -> None:
        if isinstance(e, Sensor):
            return
        if isinstance(e, Junction):
            self._junction(e)
        elif isinstance(e, RE):
            self._reaction(e)
        elif isinstance(e, RS):
            self._heating(e)
        elif isinstance(e, TF | GY):
            self._two_port(e)
        elif isinstance(e, Field):
            self._field(e)
        else:
            (b,) = self.graph.bonds_of(e.name)
            self._one_port(e, b)

    def _one_port(self, e: Element, b: Bond) -> None:
        effort, flow = self.names.pair(b)
        gets_effort = self.effort_in(b, e.name)
        if isinstance(e, Source):
            self._source(e, effort if not gets_effort else flow)
            return
        flow = self._inward(e, b, e.name, flow)
        if isinstance(e, R):
            self._resistor(e, effort, flow, gets_effort)
        elif isinstance(e, C):
            self._storage(e, "q", effort, flow, integral=not gets_effort)
        elif isinstance(e, I):
            self._storage(e, "p", flow, effort, integral=gets_effort)

    def _inward(self, e: Element, b: Bond, port: str, flow: str) -> str:
        """Return the flow into an element: its law holds for it wherever the half arrow points."""
        if b.tail != e.name:
            return flow
        inward = f"inward_{port}"
        why = f"the half arrow points out of {e.name}"
        if self.effort_in(b, e.name):
            self.put(flow, [(-1, inward)], why)
        else:
            self.put(inward, [(-1, flow)], why)
        return inward

    def _junction(self, e: Junction) -> None:
        zero = isinstance(e, Zero)
        bonds = [b for b in self.graph.bonds_of(e.name) if b in self.strokes]
        (strong,) = (b for b in bonds if self.effort_in(b, e.name) == zero)
        variable = self.names.flow if zero else self.names.effort
        sign = -1 if strong.head == e.name else 1
        terms = [
            (sign * (1 if b.head == e.name else -1), variable(b)) for b in bonds if b != strong
        ]
        word = "flows" if zero else "efforts"
        self.put(variable(strong), terms, f"sum of {word} at {e.name}")

    def _two_port(self, e: TF | GY) -> None:
        modulated = isinstance(e, MTF | MGY)
        if modulated and not isinstance(e.ratio, int | float):
            n, reads = self.signals(e, e.ratio)
        else:
            n, reads = self.graph.coefficient(e), ()
        (into,) = (b for b in self.graph.bonds_of(e.name) if b.head == e.name)
        (out,) = (b for b in self.graph.bonds_of(e.name) if b.tail == e.name)
        e1, f1 = self.names.effort(into), self.names.flow(into)
        e2, f2 = self.names.effort(out), self.names.flow(out)
        given = self.effort_in(into, e.name)
        why = f"{e.kind} {e.name}"
        if isinstance(e, TF):
            pairs = ((e2, e1), (f1, f2)) if given else ((e1, e2), (f2, f1))
        else:
            pairs = ((f2, e1), (f1, e2)) if given else ((e1, f2), (e2, f1))
        if given and (n == 0 or (modulated and e.ratio == 0)):
            raise GraphError(
                f"{self.graph.name}: {e.name} ({e.kind}) has ratio 0 and would be divided by it; "
                "give a ratio, or remove the element"
            )
        ratio = 1 / n if given else n
        for target, source in pairs:
            self.put(target, [(ratio, source)], why, reads=reads)

    def _reaction(self, e: RE) -> None:
        k = self.graph.coefficient(e)
        (into,) = (b for b in self.graph.bonds_of(e.name) if b.head == e.name)
        (out,) = (b for b in self.graph.bonds_of(e.name) if b.tail == e.name)
        forward, back = self.names.effort(into), self.names.effort(out)
        rate = k * (sp.exp(symbol(forward)) - sp.exp(symbol(back)))
        why = f"RE {e.name}"
        self.put(self.names.flow(into), [], why, expression=rate, reads=(forward, back))
        self.put(self.names.flow(out), [(1, self.names.flow(into))], why)

    def _heating(self, e: RS) -> None:
        r = self.graph.coefficient(e)
        (into,) = (b for b in self.graph.bonds_of(e.name) if b.head == e.name)
        (out,) = (b for b in self.graph.bonds_of(e.name) if b.tail == e.name)
        effort, flow = self.names.effort(into), self.names.flow(into)
        if self.effort_in(into, e.name):
            self.put(flow, [(1 / r, effort)], f"RS {e.name}")
        else:
            self.put(effort, [(r, flow)], f"RS {e.name}")
        heat, reads = symbol(effort) * symbol(flow), [effort, flow]
        if e.heat == "entropy":
            temperature = self.names.effort(out)
            heat, reads = heat / symbol(temperature), [*reads, temperature]
        elif e.heat != "energy":
            raise GraphError(
                f"{self.graph.name}: {e.name} (RS) has heat={e.heat!r}; give 'energy' or 'entropy'"
            )
        why = f"heat of RS {e.name}"
        self.put(self.names.flow(out), [], why, expression=heat, reads=reads)

    # -- sources ------------------------------------------------------------------------------
    def _source(self, e: Source, target: str) -> None:
        why = f"{e.kind} {e.name}"
        if isinstance(e, Modulated):
            value, reads = self.signals(e, e.value)
            linear, rest = _linear_part(value, reads)
            left = reads if rest is not None and linear is None else ()
            self.put(target, linear or [], why, expression=rest, reads=left)
            return
        self.made.inputs.append(e.name)
        terms: list[tuple[Any, str]] = [(self._factor(e), e.name)]
        rest, law = self.graph.channel_value(e, "offset"), None
        if e.given != "value":
            terms, rest = self._as_value(e, terms, rest), None
        if e.drive and (e.drive.law or e.drive.lag):
            command = f"c_{e.name}"
            self.put(command, terms, f"command of {e.name}", expression=rest)
            terms, rest = [(1, command)], None
            if e.drive.law:
                law, terms = self._signal_law(e, "drive", e.drive.law, command)
        if e.drive and e.drive.lag:
            limited, lagged, rate = f"l_{e.name}", f"z_{e.name}", f"rate_z_{e.name}"
            self.put(limited, terms, f"limited command of {e.name}", law=law)
            tau = symbol(e.drive.lag, positive=True)
            self.put(rate, [(1 / tau, limited), (-1 / tau, lagged)], f"lag of {e.name}")
            self.made.states.append(StoredState(lagged, rate, e.name, e.unit))
            terms, law = [(1, lagged)], None
        self.put(target, terms, why, law=law, expression=rest)

    def _signal_law(
        self, e: Element, role: str, law: Law, signal: str
    ) -> tuple[int, list[tuple[Any, str]]]:
        """Use a law on a signal; return its number and its linear part."""
        own = law.signal_slope
        slope = sp.S.One if isclose(own, 1.0, rel_tol=1e-12) else sp.Float(own)
        return self.law_use(e, role, law, signal, slope), [(slope, signal)] if slope != 0 else []

    def _as_value(
        self, e: Source, terms: list[tuple[Any, str]], offset: sp.Expr | None
    ) -> list[tuple[Any, str]]:
        """Make the value of a source from what is recorded of it."""
        if e.given == "rate":
            value, rate = f"u_{e.name}", f"rate_u_{e.name}"
            self.put(rate, terms, f"recorded rate of {e.name}", expression=offset)
            self.made.states.append(StoredState(value, rate, e.name))
            return [(1, value)]
        if e.given == "integral":
            self.made.recorded.append(f"d_{e.name}")
            return [(self._factor(e), f"d_{e.name}")]  # a constant offset has no rate
        return terms

    def _pseudo(self, name: str) -> str:
        if name not in self.made.inputs:
            self.made.inputs.append(name)
        return name

    # -- resistors and storages ---------------------------------------------------------------
    def _resistor(self, e: R, effort: str, flow: str, gets_effort: bool) -> None:
        r = self.graph.coefficient(e) if e.value != 0 else sp.S.Zero
        why = f"R {e.name}"
        if e.law is None:
            if gets_effort:
                self.put(flow, [(1 / r, effort)], why)
            else:
                self.put(effort, [(r, flow)], why)
            return
        law = self.law_use(e, "resistor", e.law, flow, r)
        terms = [(r, flow)] if r != 0 else []
        if gets_effort:
            self.put(flow, [*terms, (-1, effort)], f"{why} inverted", law=law, implicit=True)
        else:
            self.put(effort, terms, why, law=law)

    def _storage(self, e: C | I, letter: str, output: str, rate: str, *, integral: bool) -> None:
        state = f"{letter}_{e.name}"
        slope = self.graph.slope(e)
        law = None
        if e.law is not None:
            law = self.law_use(e, "storage", e.law, state, slope)
        if integral:
            self.made.states.append(StoredState(state, rate, e.name))
            why = f"{e.kind} {e.name} stores {state}"
            self.put(output, [(slope, state)], why, law=law)
            return
        why = f"{e.kind} {e.name} in derivative causality"
        self.made.dependents.append(Dependent(state, rate, e.name))
        if law is None:
            self.put(state, [(1 / slope, output)], why)
        else:
            self.put(state, [(slope, state), (-1, output)], why, law=law, implicit=True)

    def _field(self, e: Field) -> None:
        bonds = self.graph.bonds_of(e.name)
        letter = e.letter
        given = [self.effort_in(b, e.name) for b in bonds]
        efforts = [self.names.effort(b) for b in bonds]
        flows = [
            self._inward(e, b, f"{e.name}{i}", self.names.flow(b))
            for i, b in enumerate(bonds, start=1)
        ]
        if letter == "f":
            variables, outputs = flows, efforts
            forward = [not g for g in given]
        else:
            variables = [f"{letter}_{e.name}{i}" for i in range(1, len(bonds) + 1)]
            outputs = efforts if letter == "q" else flows
            rates = flows if letter == "q" else efforts
            forward = [g != (letter == "q") for g in given]
            for i in range(len(bonds)):
                if forward[i]:
                    self.made.states.append(StoredState(variables[i], rates[i], e.name))
                else:
                    self.made.dependents.append(Dependent(variables[i], rates[i], e.name))
        laws = field_laws(self.graph, e)
        local = port_variables(letter, len(bonds))
        outside = {s: symbol(v) for s, v in zip(local, variables, strict=True)}
        crossed = crossed_ports(
            laws, local, [i for i, g in enumerate(forward) if not g], self._vanishes
        )
        for i, law in enumerate(laws):
            why = f"{e.kind} {e.name}, port {i + 1}"
            slopes = [law.diff(s) for s in local]
            used = [v for s, v in zip(local, variables, strict=True) if s in law.free_symbols]
            linear = not any(d.free_symbols & set(local) for d in slopes)
            ports = [j for j, d in enumerate(slopes) if linear and d != 0]
            terms = [(slopes[j], variables[j]) for j in ports]
            rest = None
            if linear:
                constant = law.xreplace(dict.fromkeys(local, sp.S.Zero))
                rest = constant if constant != 0 else None
                used = []
            else:
                rest = law.xreplace(outside)
            if forward[i]:
                self.put(outputs[i], terms, why, expression=rest, reads=used)
                continue
            target = variables[i]
            if i in crossed:
                weights, known = crossed[i]
                terms = [(w, outputs[j]) for j, w in weights.items()]
                terms += [(-known.diff(s), v) for s, v in zip(local, variables, strict=True)]
                rest = -known.xreplace(dict.fromkeys(local, sp.S.Zero))
                self.put(
                    target,
                    [(c, v) for c, v in terms if c != 0],
                    f"{why} inverted",
                    expression=rest if rest != 0 else None,
                )
            elif linear and not self._vanishes(slopes[i]):
                # by port, not by name: two ports may share one flow
                inverse = [(-slopes[j] / slopes[i], variables[j]) for j in ports if j != i]
                shift = None if rest is None else -rest / slopes[i]
                self.put(
                    target,
                    [*inverse, (1 / slopes[i], outputs[i])],
                    f"{why} inverted",
                    expression=shift,
                )
            else:
                self.put(
                    target,
                    [*terms, (-1, outputs[i])],
                    f"{why} inverted",
                    expression=rest,
                    implicit=True,
                    # what it reads keeps it away from forms that know assignments only
                    reads=used or [outputs[i]],
                )

    def _vanishes(self, value: sp.Expr) -> bool:
        """Whether a coefficient is 0, or is at the declared values: nobody may divide by it."""
        if value == 0 or not value.free_symbols:
            return bool(value == 0)
        found = [p for p in self._parameters.values() if isfinite(p.value)]
        return bool(value.xreplace({p.symbol: exact(p.value) for p in found}) == 0)

    def _factor(self, e: Source | Sensor) -> sp.Expr:
        """Return the factor of a source or a sensor; 1 without one."""
        gain = self.graph.channel_value(e, "gain")
        return sp.S.One if gain is None else gain

    # -- sensors ------------------------------------------------------------------------------
    def _read(self, e: Sensor) -> str:
        """Return the signal that a sensor reads, before its chain."""
        if isinstance(e, Reading):
            target = f"r_{e.name}"
            value, reads = self.signals(e, e.value)
            linear, rest = _linear_part(value, reads)
            left = reads if rest is not None and linear is None else ()
            self.put(target, linear or [], f"signal read by {e.name}", expression=rest, reads=left)
            return target
        junction = self.graph.neighbour(e.name)
        if isinstance(e, De):
            return self.names.at("e", junction)
        if isinstance(e, Df):
            return self.names.at("f", junction)
        if isinstance(e, Da):
            shared = self.names.at(common_variable(self.graph[junction]), junction)
            self.made.rates.append(Dependent(shared, f"a_{e.name}", e.name))
            return f"a_{e.name}"
        assert isinstance(e, Dq)
        self.made.displacements.append(e)
        return f"x_{e.name}"  # its relation follows when all rates are known

    def sensor(self, e: Sensor) -> None:
        terms: list[tuple[Any, str]] = [(1, self._followed(e, self._read(e)))]
        law = None
        if e.law is not None:
            law, terms = self._signal_law(e, "sensor", e.law, terms[0][1])
        if e.gain is not None:
            if law is not None:
                bent = f"bent_{e.name}"
                self.put(bent, terms, f"bent reading of {e.name}", law=law)
                terms, law = [(1, bent)], None
            terms = [(self._factor(e) * c, v) for c, v in terms]
        for power, name in enumerate(e.drift, start=1):
            ramp = self._pseudo("ramp" if power == 1 else f"ramp{power}")
            terms.append((symbol(name), ramp))
        target = f"y_{e.name}"
        offset = self.graph.channel_value(e, "offset")
        if e.resolution is not None:
            fine, step = f"{FINE}{e.name}", str(self.graph.channel_value(e, "resolution"))
            self.put(fine, terms, f"{e.name} before it is rounded", expression=offset, law=law)
            use = LawUse(f"{e.name}_resolution", "rounding", Resolution(), fine, sp.S.One, (step,))
            terms, law, offset = [(1, fine)], self._use(use), None
        self.put(target, terms, f"{e.kind} {e.name}", expression=offset, law=law)
        self.made.outputs.append((e.name, target, e.unit))

    def _followed(self, e: Sensor, value: str) -> str:
        """Return what is left of a signal behind the dynamics of a sensor."""
        lag = self.graph.channel_value(e, "lag")
        if lag is not None:
            lagged, rate = f"z_{e.name}", f"rate_z_{e.name}"
            self.put(rate, [(1 / lag, value), (-1 / lag, lagged)], f"lag of {e.name}")
            self.made.states.append(StoredState(lagged, rate, e.name, e.unit))
            value = lagged
        omega = self.graph.channel_value(e, "natural_frequency")
        if omega is None:
            return value
        zeta: Any = self.graph.channel_value(e, "damping_ratio")
        shown, rate = f"shown_{e.name}", f"rate_shown_{e.name}"
        square = omega**2
        self.put(
            f"rate2_shown_{e.name}",
            [(square, value), (-square, shown), (-2 * zeta * omega, rate)],
            f"dynamics of {e.name}",
        )
        self.made.states.append(StoredState(shown, rate, e.name, e.unit))
        self.made.states.append(StoredState(rate, f"rate2_{shown}", e.name))
        return shown


def _linear_part(
    value: sp.Expr, reads: tuple[str, ...]
) -> tuple[list[tuple[Any, str]] | None, sp.Expr | None]:
    """Split an expression that is linear in the signals it reads; None and itself otherwise."""
    signals = [symbol(n) for n in reads]
    slopes = [sp.diff(value, s) for s in signals]
    if not reads or any(d.free_symbols & set(signals) for d in slopes):
        return None, value
    rest = value.xreplace(dict.fromkeys(signals, sp.S.Zero))
    return list(zip(slopes, reads, strict=True)), rest if rest != 0 else None
