"""Numbers for people: SI prefixes, few digits, words for percentages."""

from __future__ import annotations

import math
import re

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_TAKES_PREFIX = re.compile(r"(m|A|V|N|Nm|W|Pa|s|Hz|F|H|C|ohm|Ω|J|rad|Wb)(?![\w^*²³]|\*\*)")


def prefixed(unit: str, size: float) -> tuple[float, str]:
    """Return the factor from SI and the unit with the prefix that suits `size`.

    Examples
    --------
    >>> prefixed("m", 3e-6)
    (1000000.0, 'µm')
    >>> prefixed("kg", 3e-6)
    (1.0, 'kg')
    """
    shown = "" if unit in ("", "1") else unit.replace("ohm", "Ω")
    starts = _TAKES_PREFIX.match(unit) or unit[:2] in ("N*", "V*", "A*", "Ns", "Nm")
    if not starts or not (math.isfinite(size) and size > 0):
        return 1.0, shown
    power = 3 * math.floor(math.log10(size) / 3 + 1e-9)
    power = min(max(power, -15), 9)
    return 10.0**-power, _PREFIXES[power] + shown


def axis_scale(unit: str, size: float) -> tuple[float, str]:
    """Like `prefixed`, with a power of ten where the unit takes no prefix."""
    factor, shown = prefixed(unit, size)
    scaled = size * factor
    if math.isfinite(scaled) and scaled > 0 and not 1e-2 <= scaled < 1e4:
        power = 3 * math.floor(math.log10(scaled) / 3)
        return factor * 10.0**-power, f"10{superscript(power)} {shown}".strip()
    return factor, shown


def unit_of_level(unit: str, read_in: str) -> str:
    """Return the unit in which values of a channel are shown; differences keep that of the model.

    Examples
    --------
    >>> unit_of_level("K", "degC"), unit_of_level("m", "mm"), unit_of_level("K", "")
    ('degC', 'm', 'K')
    """
    return CELSIUS if read_in == CELSIUS else unit


CELSIUS = "degC"
"""The only unit whose numbers are taken as they stand, its zero with them."""


def times_noise(mean_square: float) -> float:
    """Return the one measure of a misfit that texts tell: root mean square over the noise.

    Parameters
    ----------
    mean_square : float
        Of what is left, in units of the noise's variance; scores and intervals reckon in it.

    Examples
    --------
    >>> times_noise(9.0)
    3.0
    """
    return math.sqrt(mean_square) if mean_square >= 0 else math.nan


def within(width: float) -> str:
    """Return half an interval of logarithms in words.

    Examples
    --------
    >>> within(0.012), within(3.0)
    ('±1.2 %', 'a factor of 20')
    """
    if width < 0.5:
        return f"±{100.0 * width:.2g} %"
    return f"a factor of {math.exp(width):.2g}" if width < 20.0 else "nothing at all"


def sureness(errors: float) -> str:
    """Say by how many standard errors something is better: what engineers call z.

    Examples
    --------
    >>> sureness(99.26)
    '99.3 standard errors better'
    """
    return f"{errors:.{0 if abs(errors) >= 100 else 1}f} standard errors better"


def superscript(power: int) -> str:
    """Integer as superscript characters."""
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def short(value: float, digits: int = 4) -> str:
    """Return a bare number with few digits."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    if value and not 1e-3 <= abs(value) < 10**6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        if "." in mantissa:
            mantissa = mantissa.rstrip("0").rstrip(".")
        return f"{mantissa}·10{superscript(int(exponent))}".replace("-", "−")
    text = f"{value:.{digits}g}"
    if "e" in text:
        text = f"{value:.0f}"
    return text.replace("-", "−")


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """Return a number with its unit."""
    factor, shown = prefixed(unit, abs(value))
    return f"{short(value * factor, digits)} {shown}".strip()


def told_by(value: float, size: float) -> float:
    """Return the size that gives a value and its interval one unit: the value's, if not tiny."""
    return abs(value) if size < 1e3 * abs(value) < math.inf else size


def interval(low: float, high: float, unit: str, value: float = 0.0) -> str:
    """Return an interval, both ends in one unit, with digits enough to tell them apart.

    Parameters
    ----------
    low, high : float, SI
    unit : str
    value : float, SI
        What the interval is of, as `quantity` shows it: the unit is the same, unless an end is a
        thousand times larger.

    Examples
    --------
    >>> interval(0.0355301, 0.0355325, "m")
    '35.5301 … 35.5325 mm'
    >>> interval(0.9e-3, 1.2e-3, "N", 0.99e-3)
    '900 … 1200 µN'
    >>> interval(1.2215e9, 1.2225e9, "ohm*N/m")
    '1.2215·10⁹ … 1.2225·10⁹ Ω*N/m'
    >>> interval(0.00125654, 0.001257, "m2")
    '0.00125654 … 0.00125700 m2'
    """
    ends = [abs(v) for v in (low, high) if math.isfinite(v)]
    size = max(ends, default=0.0)
    factor, shown = prefixed(unit, told_by(value, size))
    width = high - low
    if len(ends) == 2 and 0 < width < size and 1e-3 <= size * factor < 1e6:
        decimals = min(max(0, 1 - math.floor(math.log10(width * factor))), 12)
        text = " … ".join(f"{v * factor:.{decimals}f}".replace("-", "−") for v in (low, high))
    else:
        digits = max(3, telling_apart(low, high)) if 0 < width < math.inf else 3
        text = f"{short(low * factor, digits)} … {short(high * factor, digits)}"
    return f"{text} {shown}".strip()


def ends(low: float, high: float, unit: str, of: float = 0.0) -> str:
    """Return an interval with as many digits as tell its ends apart, in the unit of its value.

    Examples
    --------
    >>> ends(199.93, 200.11, "N/m")
    '199.93 … 200.11 N/m'
    """
    if not 0 < abs(high - low) < math.inf:
        return interval(low, high, unit, of)
    digits = telling_apart(low, high)
    factor, shown = prefixed(unit, told_by(of, max(abs(low), abs(high))))
    return f"{short(low * factor, digits)} … {short(high * factor, digits)} {shown}".strip()


def telling_apart(low: float, high: float) -> int:
    """Return the digits that tell the ends of an interval apart; 3 where it has no width.

    Examples
    --------
    >>> telling_apart(8.99997, 9.00002)
    8
    """
    size, width = max(abs(low), abs(high)), abs(high - low)
    if not 0 < width < math.inf:
        return 3
    return min(max(math.ceil(math.log10(size / width)) + 2, 3), 12)


def told(value: float, low: float, high: float, unit: str) -> str:
    """Return a value with as many digits as its interval gives it.

    Examples
    --------
    >>> told(7.4004695, 7.39947, 7.40147, "N/A")
    '7.40047 N/A'
    """
    width = abs(high - low)
    if not (0 < width < math.inf and value):
        return quantity(value, unit)
    digits = min(max(math.ceil(math.log10(abs(value) / width)) + 2, 2), 12)
    return quantity(value, unit, digits)


def percent(share: float) -> str:
    """Share as a percentage.

    Examples
    --------
    >>> percent(0.0469), percent(4.7e-6)
    ('4.69 %', '0.0005 %')
    """
    if not math.isfinite(share):
        return "–"
    v = 100 * share
    text = f"{v:.0f}" if abs(v) >= 100 else f"{v:.3g}" if abs(v) >= 0.1 else f"{v:.3f}"
    if 0 < abs(v) < 0.0005:
        text = f"{v:.1g}"
    return f"{text} %".replace("-", "−")
