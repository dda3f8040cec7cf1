"""Units of ratios against the units at both ends, and of readings against those of what they read.

A number of an expression may hide a unit (``q_k / 0.25`` is a strain): only sums of terms with one
number are compared, and readings with no other numbers than 1 and -1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.domain_check import dimensions_of
from bondgraph.graph.elements import GY, TF, TwoPort
from bondgraph.graph.modulation import TIME
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Reading
from bondgraph.signals.units import Dimension, Unit, product, read_unit

Known = Dimension | None
_BASE = ("m", "kg", "s", "A", "K")
_NONE: Dimension = (0, 0, 0, 0, 0)
_SECOND: Dimension = (0, 0, 1, 0, 0)


def unit_notes(graph: BondGraph) -> tuple[str, ...]:
    """Return one line for every ratio with another unit than its ends, or reading than its signals.

    A TF has ``e_in / e_out = f_out / f_in``, a GY ``e_in / f_out = e_out / f_in``. Only what is
    known is compared: a ratio without unit (or with unit "1"), or an end whose units do not tell
    effort and flow, is passed over.

    Examples
    --------
    >>> from bondgraph import TF, BondGraph, I, One, Se
    >>> with BondGraph("g") as g:
    ...     loop, body = One("loop"), One("body")
    ...     _ = Se("V", unit="V") >> loop >> TF("n", 2.0, unit="N/V") >> body
    ...     _ = body >> I("m", 1.0, unit="kg")
    >>> print(unit_notes(g)[0])  # doctest: +ELLIPSIS
    n (TF): its ratio is in N/V = s*A/m, but along the half arrows e_in/e_out is in m/s/A; ...
    """
    known = dimensions_of(graph)
    lines: list[str] = []
    for e in graph.of_type(TF, GY):
        into = [b for b in graph.bonds_of(e.name) if b.head == e.name]
        out = [b for b in graph.bonds_of(e.name) if b.tail == e.name]
        if len(into) != 1 or len(out) != 1:
            continue
        e_in, f_in = known[into[0]]
        e_out, f_out = known[out[0]]
        lines.extend(_notes(graph, e, (e_in, f_in), (e_out, f_out)))
    if read := graph.of_type(Reading):
        signals = _signals(graph)
        for r in read:
            lines.extend(_reading_notes(graph, r, signals))
    return tuple(lines)


def _notes(
    graph: BondGraph, e: TwoPort, first: tuple[Known, Known], second: tuple[Known, Known]
) -> Iterator[str]:
    (e_in, f_in), (e_out, f_out) = first, second
    if isinstance(e, TF):
        quotients = (("e_in/e_out", _over(e_in, e_out)), ("f_out/f_in", _over(f_out, f_in)))
    else:
        quotients = (("e_in/f_out", _over(e_in, f_out)), ("e_out/f_in", _over(e_out, f_in)))
    word = "ratio" if isinstance(e, TF) else "modulus"
    unit, dims = _ratio(graph, e)
    for text, expected in quotients:
        if dims is not None and expected is not None and dims != expected:
            same = "" if unit == _text(dims) else f" = {_text(dims)}"
            turned = dims == _over(_NONE, expected)
            yield (
                f"{e.name} ({e.kind}): its {word} is in {unit}{same}, but along the half "
                f"arrows {text} is in {_text(expected)}; "
                + (f"give 1/{word}" if turned else "correct a unit")
            )
            return
    (one, a), (two, b) = quotients
    if a is not None and b is not None and a != b:
        yield (
            f"{e.name} ({e.kind}): {one} is in {_text(a)}, {two} in {_text(b)}, so it does not "
            "conserve power (a pseudo domain at one side?); correct a unit"
        )


def _ratio(graph: BondGraph, e: TwoPort) -> tuple[str, Known]:
    """Return the unit of a ratio as text, and its dimension."""
    if isinstance(e.ratio, int | float):
        return e.unit, _read(e.unit)
    parameters = graph.parameters
    if isinstance(e.ratio, str):
        unit = parameters[e.ratio].unit if e.ratio in parameters else ""
        return unit, _read(unit)
    return f"that of {e.ratio}", _expression(sp.sympify(e.ratio), parameters)


def _expression(x: sp.Expr, parameters: dict[str, Parameter]) -> Known:
    """Dimension of an expression of parameters; None if a part of it is not known."""
    if x.is_Number or x.is_NumberSymbol:
        return _NONE
    if isinstance(x, sp.Symbol):
        return _read(parameters[str(x)].unit) if str(x) in parameters else None
    parts = [_expression(a, parameters) for a in x.args]
    if isinstance(x, sp.Pow) and x.exp.is_Integer and parts[0] is not None:
        return product(_NONE, parts[0], int(x.exp))
    if isinstance(x, sp.Mul):
        total: Known = _NONE
        for p in parts:
            total = None if total is None or p is None else product(total, p, 1)
        return total
    if isinstance(x, sp.Add) and len(set(parts)) == 1:
        return parts[0]
    return None


def _signals(graph: BondGraph) -> dict[str, Known]:
    """Return the dimensions of the signals of a graph by name; None where units do not tell."""
    from bondgraph.causality.assignment import storage_ports
    from bondgraph.equations.bond_signals import SignalNames

    names, known = SignalNames(graph), dimensions_of(graph)
    found: dict[str, Known] = {str(TIME): _SECOND}
    for b, both in known.items():
        found |= zip(names.pair(b), both, strict=True)
        found |= zip((f"e_{b.name}", f"f_{b.name}"), both, strict=True)
    found |= {second: found[first] for second, first in names.aliases().items() if first in found}
    for name, b, _ in storage_ports(graph):
        e, f = known[b]
        found[f"q_{name}"] = None if f is None else product(f, _SECOND, 1)
        found[f"p_{name}"] = None if e is None else product(e, _SECOND, 1)
    return found


def _reading_notes(graph: BondGraph, e: Reading, signals: dict[str, Known]) -> Iterator[str]:
    """Yield what is added in one expression though it is of several units, or the reading's own."""
    if not isinstance(e.value, sp.Expr):
        return
    parameters = graph.parameters
    symbols = signals | {str(p.symbol): _read(p.unit) for p in parameters.values()}
    wrong: list[str] = []
    made = _dimension(e.value, lambda s: symbols.get(str(s)), wrong)
    if wrong:
        yield f"{e.name} (Reading): adds {wrong[0]}; correct its expression, or a unit"
        return
    own = _read(e.unit)
    if e.gain is not None and made is not None:
        named = parameters.get(str(e.gain))
        # a factor without a unit may be a sensitivity
        own = own if named is not None and named.unit in ("", "1") else None
    if e.law is None and None not in (own, made) and own != made:
        yield (
            f"{e.name} (Reading): its unit is {e.unit}, but {e.value} is in "
            f"{_text(made or _NONE)}; correct one of them, or give the factor between them as "
            "its gain"
        )


def _dimension(x: sp.Expr, known: Callable[[sp.Symbol], Known], wrong: list[str]) -> Known:
    """Dimension of an expression, None if it is not known; sums of several units go to `wrong`."""
    if x.is_Number or x.is_NumberSymbol:
        return _NONE if abs(x) == 1 else None
    if isinstance(x, sp.Symbol):
        return known(x)
    if isinstance(x, sp.Add):
        return _sum(x, known, wrong)
    parts = [_dimension(a, known, wrong) for a in x.args]
    if isinstance(x, sp.Abs):
        return parts[0]
    if isinstance(x, sp.Pow):
        return _power(parts[0], x.exp)
    if not isinstance(x, sp.Mul):
        return None
    total: Known = _NONE
    for p in parts:
        total = None if total is None or p is None else product(total, p, 1)
    return total


def _sum(x: sp.Add, known: Callable[[sp.Symbol], Known], wrong: list[str]) -> Known:
    seen: dict[sp.Expr, tuple[sp.Expr, Known]] = {}
    made: Known = None
    for term in x.args:
        number, rest = term.as_coeff_Mul()
        if rest.is_Number:
            continue  # a constant has the unit of the others, unsaid
        dims = _dimension(rest, known, wrong)
        first, other = seen.setdefault(abs(number), (rest, dims))
        if dims is not None and other is None:
            seen[abs(number)] = (rest, dims)
        elif dims is not None and dims != other:
            wrong.append(f"{first} in {_text(other or _NONE)} and {rest} in {_text(dims)}")
        if abs(number) == 1 and made is None:
            made = dims
    return made


def _power(base: Known, exponent: sp.Expr) -> Known:
    """Dimension of a power with a number that leaves whole ones, None of any other."""
    if base is None or not exponent.is_Rational:
        return None
    made = [Fraction(int(exponent.p), int(exponent.q)) * k for k in base]
    if any(k.denominator != 1 for k in made):
        return None
    m, kg, s, amp, kel = map(int, made)
    return (m, kg, s, amp, kel)


def _read(text: str) -> Known:
    unit = None if text.strip() == "1" else read_unit(text)
    return None if unit is None else unit.dims


def _over(a: Known, b: Known) -> Known:
    return None if a is None or b is None else product(a, b, -1)


def _text(dims: Dimension) -> str:
    return Unit(1.0, dims, "", tuple((s, k) for s, k in zip(_BASE, dims, strict=True) if k)).si
