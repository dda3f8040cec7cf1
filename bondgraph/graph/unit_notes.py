"""Units of ratios against the units at both ends."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.domain_check import dimensions_of
from bondgraph.graph.elements import GY, TF, Parameter, TwoPort
from bondgraph.signals.units import Dimension, read_unit

Known = Dimension | None
_BASE = ("m", "kg", "s", "A", "K")
_NONE: Dimension = (0, 0, 0, 0, 0)


def unit_notes(graph: BondGraph) -> tuple[str, ...]:
    """Return one line for every transformer or gyrator whose ratio has another unit than its ends.

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
        return _times(_NONE, parts[0], int(x.exp))
    if isinstance(x, sp.Mul):
        total: Known = _NONE
        for p in parts:
            total = None if total is None or p is None else _times(total, p, 1)
        return total
    if isinstance(x, sp.Add) and len(set(parts)) == 1:
        return parts[0]
    return None


def _read(text: str) -> Known:
    unit = None if text.strip() == "1" else read_unit(text)
    return None if unit is None else unit.dims


def _over(a: Known, b: Known) -> Known:
    return None if a is None or b is None else _times(a, b, -1)


def _times(a: Dimension, b: Dimension, power: int) -> Dimension:
    m, kg, s, amp, kel = (x + power * y for x, y in zip(a, b, strict=True))
    return (m, kg, s, amp, kel)


def _text(dims: Dimension) -> str:
    def power(symbol: str, k: int) -> str:
        return symbol if k == 1 else f"{symbol}^{k}"

    up = "*".join(power(s, k) for s, k in zip(_BASE, dims, strict=True) if k > 0)
    down = "".join("/" + power(s, -k) for s, k in zip(_BASE, dims, strict=True) if k < 0)
    return (up or "1") + down
