"""Numbers with units as a user writes them, such as ``47uF`` or ``0.2 A``."""

from __future__ import annotations

from math import floor, isfinite, log10

from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


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


def engineering(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with a unit and a prefix that leaves one to three digits before the point.

    Examples
    --------
    >>> engineering(0.0471, "A"), engineering(57e6, "N/m"), engineering(0.016, "kg")
    ('47.1 mA', '57 MN/m', '16 g')
    """
    if unit == "kg":
        value, unit = 1e3 * value, "g"
    if value == 0 or not isfinite(value):
        return f"{value:g} {unit}"
    # rounded first, so that 999.9 becomes 1 k and not 1e+03
    value = float(f"{value:.{digits - 1}e}")
    power = min(9, max(-12, 3 * floor(log10(abs(value)) / 3 + 1e-12)))
    return f"{value / 10.0**power:.{digits}g} {_PREFIXES[power]}{unit}"


def _is_number(text: str) -> bool:
    try:
        return float(text) == float(text)
    except ValueError:
        return False
