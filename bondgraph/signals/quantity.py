"""Numbers with units as a user writes them, such as ``47uF`` or ``0.2 A``."""

from __future__ import annotations

from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput


def quantity(text: str, unit: str, where: str) -> float:
    """Return a number with an optional unit in SI; without one it is taken to be in `unit`.

    Examples
    --------
    >>> quantity("200 mA", "A", "--current"), quantity("1e3", "Hz", "--frequency")
    (0.2, 1000.0)
    """
    number = text.strip()
    cut = len(number)
    while cut and not _is_number(number[:cut]):
        cut -= 1
    if not cut:
        raise UnusableInput(f"{where}: {text!r} does not start with a number; write 1.5 {unit}")
    symbol = number[cut:].strip()
    if not symbol:
        return float(number)
    found, wanted = parse_unit(symbol), parse_unit(unit)
    if not found.same_dimension(wanted):
        raise UnusableInput(f"{where}: {symbol} is not a unit of this quantity; give {unit}")
    if unit == "Hz" and any(s == "rad" for s, _ in found.factors):
        raise UnusableInput(f"{where}: {symbol} is an angular unit; give cycles per second, {unit}")
    return float(number[:cut]) * found.scale / wanted.scale


def _is_number(text: str) -> bool:
    try:
        return float(text) == float(text)
    except ValueError:
        return False
