"""Everything that can be wrong with a graph before causality is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import (
    GY,
    MGY,
    MTF,
    TF,
    X0,
    X1,
    C,
    Element,
    Field,
    Junction,
    Modulated,
    Multiport,
    One,
    Source,
    TwoPort,
    Value,
    Valued,
    Zero,
)
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Da, De, Df, Dq, Reading, Sensor
from bondgraph.graph.unit_check import unit_problems
from bondgraph.laws.law import Law
from bondgraph.laws.law_sum import LawSum
from bondgraph.support.bounds import broken
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput, unknown_name
from bondgraph.support.typed_reader import hints_of


def require_graph(given: object, call: str, kinds: str = "a BondGraph") -> None:
    """Refuse what stands where a call has its graph: a function that makes one, a recording.

    Raises
    ------
    UnusableInput
        It is no graph; how the call is written.
    """
    if isinstance(given, BondGraph):
        return
    kind, name = type(given).__name__, getattr(given, "__name__", "")
    remedy = f"call it, {name}()" if callable(given) and name else f"the graph comes first: {call}"
    raise UnusableInput(f"{call.partition('(')[0]} takes {kinds}, not a {kind}; {remedy}")


_TAPS: dict[type[Element], tuple[tuple[type[Element], ...], str]] = {
    De: ((Zero, X0), "a 0-junction (one effort)"),
    Df: ((One, X1), "a 1-junction (one flow)"),
    Dq: ((One, X1), "a 1-junction (one flow)"),
    Da: ((One, X1, Zero, X0), "a junction (one flow, or one effort)"),
}


SMALLEST, LARGEST = 1e-100, 1e100


def problems(graph: BondGraph) -> tuple[str, ...]:
    """Return one line for each problem: the element, what is wrong, what to do."""
    if not graph.elements:
        return (
            "the graph has no elements: create them inside 'with BondGraph(...)' and bond them "
            "with >>",
        )
    lines = [line for e in graph.elements.values() for line in _law_problems(e)]
    if lines:
        return tuple(lines)  # such a law may not even have parameters
    parameters = graph.parameters
    told = set()
    for e in graph.elements.values():
        lines.extend(_bond_problems(graph, e))
        if wrong := _value_problems(graph, e, parameters):
            lines.extend(wrong)
            told.add(e.name)
        lines.extend(_name_problems(graph, e, parameters))
    lines.extend(_parameter_problems({n: p for n, p in parameters.items() if n not in told}))
    lines.extend(unit_problems(graph.elements.values(), parameters))
    lines.extend(_connection_problems(graph))
    if not lines:
        lines.extend(_physics_problems(graph))
    return tuple(lines)


def _physics_problems(graph: BondGraph) -> tuple[str, ...]:
    """Signals that are none, domains joined without a transducer, fields that are no stores."""
    lines = tuple(_signal_problems(graph))
    if lines:
        return lines
    if any(getattr(e, "unit", "") or getattr(e, "units", ()) for e in graph.elements.values()):
        from bondgraph.graph.domain_check import domain_problems
        from bondgraph.graph.unit_notes import unit_notes

        lines += domain_problems(graph) or unit_notes(graph)
    if graph.of_type(Field):
        from bondgraph.energy.stores import energy_problems

        lines += energy_problems(graph)
    return lines


def _bond_problems(graph: BondGraph, e: Element) -> list[str]:
    bonds = graph.bonds_of(e.name)
    n = len(bonds)
    if isinstance(e, Reading):
        return _reading_problems(graph, e, n)
    if n == 0 and len(graph.elements) > 1:
        return [f"{e.name} ({e.kind}) has no bond: connect it with >> or remove it"]
    if isinstance(e, Junction):
        if n < 2:
            return [f"{e.name} ({e.kind}-junction) has {n} bond: a junction joins at least two"]
        return []
    if isinstance(e, Multiport):
        return _multiport_problems(graph, e)
    if isinstance(e, TwoPort):
        return _two_port_problems(e, n, [b.head == e.name for b in bonds])
    if n != 1:
        return [f"{e.name} ({e.kind}) has {n} bonds: a one-port has one; put a junction between"]
    b = bonds[0]
    other = graph[b.head if b.tail == e.name else b.tail]
    if isinstance(e, Sensor):
        wanted, text = _TAPS[type(e)]
        if not isinstance(other, wanted):
            return [
                f"{e.name} ({e.kind}) is bonded to {other.name} ({other.kind}): attach it to {text}"
            ]
        return []
    return []


def _reading_problems(graph: BondGraph, e: Reading, bonds: int) -> list[str]:
    if bonds:
        return [f"{e.name} (Reading) reads signals by their names: take its bond out"]
    found = [str(s).partition("_") for s in getattr(e.value, "free_symbols", ())]
    if found and all(letter in ("time", "in") for letter, _, _ in found):
        found = []  # a clock, or what comes from outside
    if not found:
        return [
            f"{e.name} (Reading) reads nothing of the model: give it an expression of signals, "
            f"such as Reading({e.name!r}, effort('k'))"
        ]
    taken = [name for _, _, name in found]
    return [
        f"{e.name} (Reading) reads the sensor {n}, which has no signal: read what that one reads"
        for n in taken
        if isinstance(graph.elements.get(n), Sensor)
    ]


def _two_port_problems(e: TwoPort, n: int, into: list[bool]) -> list[str]:
    if n != 2:
        return [f"{e.name} ({e.kind}) has {n} bonds: a two-port has two, one in and one out"]
    if into[0] == into[1]:
        return [
            f"{e.name} ({e.kind}): both half arrows point {'in' if into[0] else 'out'}; "
            "one goes in, one goes out, write a >> two_port >> b"
        ]
    return []


def _multiport_problems(graph: BondGraph, e: Multiport) -> list[str]:
    bonds = graph.bonds_of(e.name)
    lines = []
    if len(bonds) != e.ports:
        lines.append(
            f"{e.name} ({e.kind}) has {len(bonds)} bonds and {e.ports} ports: bond every port, or "
            "set ports="
        )
    return lines


def _value_problems(graph: BondGraph, e: Element, parameters: Mapping[str, Parameter]) -> list[str]:
    if isinstance(e, MTF | MGY) or not isinstance(e, Valued | TwoPort):
        return []
    own = e.ratio if isinstance(e, TwoPort) else e.value
    if isinstance(e, C) and own is None:
        own = e.stiffness
    if isinstance(e, Valued) and e.law is not None and e.law.slope is not None:
        return _idle_problems(e, own)
    if isinstance(own, int | float) and SMALLEST < own < LARGEST:
        if not isinstance(e, C) or None in (e.value, e.stiffness):
            return []  # the usual case, without symbols
    try:
        c = graph.coefficient(e)
    except BondsightError as error:
        return [str(error)]
    if isinstance(e, C) and e.value is not None and e.stiffness is not None:
        return [f"{e.name} (C) has both a capacitance and a stiffness: give one"]
    if c.is_Symbol:
        v = complex(parameters[str(c)].value)
    else:
        numbers = {s: parameters[str(s)].value for s in c.free_symbols}
        v = complex(sp.N(c.subs(numbers))) if numbers else complex(sp.N(c))
    if v.imag or v.real != v.real or abs(v) == float("inf"):
        return [
            f"{e.name} ({e.kind}): its coefficient {c} is not a finite number; check its parameters"
        ]
    if v.real and not SMALLEST < abs(v) < LARGEST:
        return [
            f"{e.name} ({e.kind}): coefficient {v.real:g} is beyond {SMALLEST:g} to {LARGEST:g}, "
            "whose products a float cannot hold; choose other units"
        ]
    if isinstance(e, Valued) and v.real < 0:
        return [
            f"{e.name} ({e.kind}): coefficient {v.real:g} is negative, which creates energy; "
            "give a positive value"
        ]
    if v.real == 0 and not (isinstance(e, Valued) and e.law is not None):
        return [
            f"{e.name} ({e.kind}): coefficient is zero; give a nonzero value or remove the element"
        ]
    return []


def _idle_problems(e: Valued, value: Value | None) -> list[str]:
    """Return what is wrong with a value beside a law that has a slope of its own: it would be lost.

    A zero takes nothing away from a law whose own slope is none.
    """
    assert e.law is not None
    if value is None or (value == 0 and e.law.slope == 0):
        return []
    what = "stiffness" if isinstance(e, C) and e.stiffness is not None else "value"
    added = getattr(e.law, "free_standing", False)
    other = "give the law free_standing=False" if added else "give it to an element of its own"
    return [
        f"{e.name} ({e.kind}): its law {e.law.name} is whole, so that the {what} {value} beside it "
        f"would do nothing; leave the {what} out, or {other}"
    ]


def _law_problems(e: Element) -> list[str]:
    """Return the fields of a law that break the bounds of their annotations."""
    law = getattr(getattr(e, "drive", None) or e, "law", None)
    return _out_of_bounds(e.name, law) if isinstance(law, Law) else []


def _out_of_bounds(name: str, law: Law) -> list[str]:
    try:
        hints = hints_of(type(law))
    except NameError:
        return []  # a law of somebody's own, annotated with what a type checker alone imports
    parts = law.parts if isinstance(law, LawSum) else ()
    lines = [line for part in parts for line in _out_of_bounds(name, part)]
    for field, kind in hints.items():
        if wanted := broken(kind, held := getattr(law, field)):
            lines.append(f"{name}: {field} = {held!r} of its law {law.name} is not {wanted}")
    return lines


def _measured_problems(e: Source) -> list[str]:
    """Return what cannot be measured: a signal of the model, or what a law makes of a command."""
    said: object = e.measured
    if not isinstance(said, bool):
        return [f"{e.name}: measured is {said!r}; give True or False"]
    if not e.measured:
        return []
    if isinstance(e, Modulated):
        return [
            f"{e.name}: its value is a signal of the model, which nothing measures; "
            f"use Se or Sf for a recorded input, or leave out measured"
        ]
    if e.drive is not None and e.drive.law is not None:
        return [
            f"{e.name}: measured at its port, so that no law of a drive lies between; "
            f"leave out the law or measured"
        ]
    return []


def _given_problems(e: Source) -> list[str]:
    """Return what cannot be recorded of a source."""
    if e.given not in GIVEN:
        return [str(unknown_name("quantity that is given", e.given, e.name, GIVEN))]
    if isinstance(e, Modulated) and e.given != "value":
        return [f"{e.name}: a modulated source has a value of its own; leave out given"]
    return []


GIVEN = ("value", "rate", "integral")


def tried_problems(graph: BondGraph, values: Mapping[str, float]) -> tuple[str, ...]:
    """Return one line for each source or sensor that makes no sense at other parameter values."""
    known = graph.parameters
    tried = known | {n: replace(known[n], value=float(v)) for n, v in values.items() if n in known}
    channels = graph.of_type(Source, Sensor)
    return tuple(line for e in channels for line in _name_problems(graph, e, tried))


def _name_problems(graph: BondGraph, e: Element, parameters: Mapping[str, Parameter]) -> list[str]:
    """Parameters that a source or a sensor names: they must exist, and times must not run back."""
    if isinstance(e, Source):
        drive = e.drive
        uses = [("lag", drive.lag), ("delay", drive.delay)] if drive is not None else []
        lines = [*_measured_problems(e), *_given_problems(e)]
    elif isinstance(e, Sensor):
        uses = [("delay", e.delay), ("clock", e.clock), *(("drift", n) for n in e.drift)]
        lines = _dynamics_problems(e, parameters)
    else:
        return []
    lines += _channel_problems(graph, e, parameters)
    if isinstance(e, Modulated) and e.gain is not None:
        lines.append(f"{e.name}: a modulated source has no gain; write {e.gain} into its value")
    for what, name in uses:
        if name is None:
            continue
        if name not in parameters:
            error = unknown_name(f"parameter for the {what}", name, e.name, parameters)
            lines.append(str(error))
        elif what == "lag" and not parameters[name].value > 0:
            lines.append(f"{e.name}: its lag {name} must be positive; give a time, or leave it out")
        elif what == "delay" and not parameters[name].value >= 0:
            lines.append(f"{e.name}: its delay {name} must not be negative")
    return lines


def _dynamics_problems(e: Sensor, parameters: Mapping[str, Parameter]) -> list[str]:
    """Return what is missing of second-order dynamics, and resolutions that are no parameter."""
    lines = []
    given = [f for f in ("natural_frequency", "damping_ratio") if getattr(e, f) is not None]
    if len(given) == 1:
        lines.append(
            f"{e.name}: second-order dynamics have a natural_frequency (rad/s) and a "
            f"damping_ratio, not only the {given[0]}; give both"
        )
    named = parameters.get(str(e.resolution))
    if isinstance(e.resolution, sp.Expr) and named is None:
        lines.append(
            f"{e.name}: its resolution {e.resolution} is an expression; give a number, or declare "
            "a parameter for it"
        )
    elif named is not None and not named.fixed:
        lines.append(
            f"{e.name}: its resolution {e.resolution} is a parameter that fits are free to change, "
            "and no fit finds it; declare it fixed=True"
        )
    return lines


def _channel_problems(
    graph: BondGraph, e: Source | Sensor, parameters: Mapping[str, Parameter]
) -> list[str]:
    """Numbers, parameters and expressions of a channel: known names, and values that make sense."""
    lines = []
    for what in e.channel:
        held = getattr(e, what)
        if held is None:
            continue
        if isinstance(held, int | float) and f"{what}_{e.name}" in graph.declared_parameters:
            lines.append(
                f"{e.name}: its {what} {held} is the parameter {what}_{e.name}, which is declared "
                f"as well; give {what}='{what}_{e.name}', or leave out the declaration"
            )
            continue
        try:
            value = graph.channel_value(e, what)
        except UnknownName as error:
            lines.append(f"{e.name}: its {what}: {error}")
            continue
        assert value is not None
        at = {s: parameters[str(s)].value for s in value.free_symbols if str(s) in parameters}
        number = complex(sp.N(value.subs(at)))
        if isinstance(held, int | float):
            held = number.real  # another one than the field's may be tried
        if number.imag or not abs(number) < float("inf"):
            lines.append(f"{e.name}: its {what} {held} is not a finite number; check it")
        elif what == "gain" and number == 0:
            lines.append(f"{e.name}: its gain {held} must not be 0; give a factor, or leave it out")
        elif what not in ("gain", "offset") and not number.real > 0:
            lines.append(
                f"{e.name}: its {what} {held} must be positive; give another one, or leave it out"
            )
    return lines


def _parameter_problems(parameters: Mapping[str, Parameter]) -> list[str]:
    lines = []
    for p in parameters.values():
        if p.value != p.value or abs(p.value) == float("inf"):
            lines.append(f"parameter {p.name} is {p.value}: give a finite number")
        elif p.positive and p.value < 0:
            lines.append(
                f"parameter {p.name} = {p.value:g} must be positive: check its sign and unit"
            )
    return lines


def _connection_problems(graph: BondGraph) -> list[str]:
    import networkx as nx

    # what a reading reads is looked up by name, and said where there is none
    read = {e.name for e in graph.of_type(Reading)}
    network = graph.network.subgraph(graph.network.nodes - read)
    modulations = list(_modulations(graph))
    if modulations:
        network = nx.DiGraph(network)
        network.add_edges_from(modulations)
    parts = sorted(nx.weakly_connected_components(network), key=len, reverse=True)
    if len(parts) < 2:
        return []
    rest = ", ".join(sorted(n for part in parts[1:] for n in part))
    return [
        f"the graph falls into {len(parts)} parts: {rest} not connected to "
        f"{min(parts[0])}; bond them"
    ]


def _signal_problems(graph: BondGraph) -> Iterator[str]:
    """Yield a line for every symbol that an element reads and the graph does not have."""
    readers = graph.of_type(Reading, Modulated, MTF, MGY)
    watchers = [(e, name) for e in graph.elements.values() if (name := _watched(e))]
    if not readers and not watchers:
        return
    from bondgraph.equations.bond_signals import SignalNames, signal_called

    names = SignalNames(graph)
    own = {p.symbol for p in graph.parameters.values()}
    for e in readers:
        value = e.ratio if isinstance(e, TwoPort) else e.value
        for s in sorted(getattr(value, "free_symbols", set()) - own, key=str):
            try:
                signal_called(names, str(s), graph, e.name)
            except BondsightError as error:
                yield str(error)
    for e, watched in watchers:
        try:
            signal_called(names, watched, graph, e.name)
        except BondsightError as error:
            yield f"{e.name}: no signal {watched!r} for its law to read beside its own: {error}"


def _watched(e: Element) -> str:
    """Return the signal that the law of an element or of its drive reads, "" if none."""
    held = getattr(e, "drive", None) or e
    law = getattr(held, "law", None)
    return law.watched if isinstance(law, Law) else ""


def _modulations(graph: BondGraph) -> Iterator[tuple[str, str]]:
    """Yield the elements whose signals an element reads, each with that element."""
    for e in graph.of_type(Modulated, TF, GY):
        value = e.value if isinstance(e, Modulated) else e.ratio
        for s in getattr(value, "free_symbols", ()):
            _, _, name = str(s).partition("_")
            yield from ((end, e.name) for end in name.split(">") if end in graph.elements)
