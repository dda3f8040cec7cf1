"""Units at the border: text such as `um`, `N*s/m` or `rad_per_s` to an SI scale and a dimension.

The grammar is small and read by hand (no evaluation of text): factors joined by `*`, a space or a
middle dot (product) or `/`, `_per_` (quotient), each with an integer power (`m^2`, `m2`, `s-1`).
A quotient takes only the next factor, from left to right: `N/m/s` is `N/(m*s)`; parentheses group.
The bare underscore of column names (`m_s2`, `rad_s`) divides a length, angle or volume by a time
and is refused as ambiguous anywhere else (`N_m`). Angles and ratios have no dimension.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import isclose, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.errors import UnusableInput, nearest

Dimension = tuple[int, int, int, int, int]
"""Exponents of (m, kg, s, A, K)."""

_Factors = tuple[tuple[str, int], ...]
_MAX_LENGTH = 60
_MAX_POWER = 12
_NONE: Dimension = (0, 0, 0, 0, 0)
_TIME: Dimension = (0, 0, 1, 0, 0)
_DEGC_NOTE = (
    "degC is read as a difference in K: the offset of 273.15 K is not added "
    "(write K for absolute temperatures); temperatures of the model are then K above 0 degC"
)


GRAM, GRAVITY = "g", "g0"
"""Gram, and standard gravity, which loggers of acceleration write like it."""


def product(a: Dimension, b: Dimension, power: int = 1) -> Dimension:
    """Return the dimension of ``a b^power``.

    Examples
    --------
    >>> product((1, 0, 0, 0, 0), (0, 0, 1, 0, 0), -2)
    (1, 0, -2, 0, 0)
    """
    m, kg, s, amp, kel = (x + power * y for x, y in zip(a, b, strict=True))
    return (m, kg, s, amp, kel)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of measure: value in SI = scale * value as written.

    Parameters
    ----------
    scale : float
        Factor to SI.
    dims : tuple of 5 int
        Exponents of (m, kg, s, A, K); angles and ratios have none.
    symbol : str
        The unit as it was written.
    factors : tuple of (str, int)
        SI symbols and their powers, for printing.
    note : str
        What a reader must know about this unit (only degC has one).
    """

    scale: float
    dims: Dimension
    symbol: str
    factors: _Factors = ()
    note: str = ""

    @property
    def si(self) -> str:
        """Symbol of the SI unit of the same quantity, such as `N*s/m`; `1` for a pure number."""
        up = [s if k == 1 else f"{s}^{k}" for s, k in self.factors if k > 0]
        down = [f"/{s}" if k == -1 else f"/{s}^{-k}" for s, k in self.factors if k < 0]
        return ("*".join(up) or "1") + "".join(down)

    @property
    def is_si(self) -> bool:
        """Whether a value in this unit is already its SI value."""
        return isclose(self.scale, 1.0, rel_tol=1e-12)

    def same_dimension(self, other: Unit) -> bool:
        """Whether both units measure the same dimension (rad and 1 count as the same)."""
        return self.dims == other.dims

    def to_si(self, values: ArrayLike) -> NDArray[np.float64]:
        """Values in this unit, any shape, as float64 in SI."""
        return np.asarray(values, dtype=np.float64) * self.scale

    def from_si(self, values: ArrayLike) -> NDArray[np.float64]:
        """SI values, any shape, as float64 in this unit."""
        return np.asarray(values, dtype=np.float64) / self.scale

    def __str__(self) -> str:
        """Return the unit as it was written."""
        return self.symbol

    def _times(self, other: Unit, sign: int) -> Unit:
        powers = dict(self.factors)
        for symbol, power in other.factors:
            powers[symbol] = powers.get(symbol, 0) + sign * power
        scale = self.scale * other.scale if sign > 0 else self.scale / other.scale
        factors = tuple((s, k) for s, k in powers.items() if k)
        dims = product(self.dims, other.dims, sign)
        return Unit(scale, dims, self.symbol, factors, self.note or other.note)

    def _power(self, power: int) -> Unit:
        factors = tuple((s, k * power) for s, k in self.factors)
        dims = product(_NONE, self.dims, power)
        return Unit(self.scale**power, dims, self.symbol, factors, self.note)


_PREFIXES = {
    "f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3,
    "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12,
}  # fmt: skip
_DECIMAL_PREFIXES = {"c": 1e-2, "d": 1e-1, "h": 1e2}
_DECIMAL_STEMS = ("m", "l", "L", "Pa", "N")

# name -> scale, (m, kg, s, A, K), SI factors; these take prefixes
_STEMS: dict[str, tuple[float, Dimension, _Factors]] = {
    "m": (1.0, (1, 0, 0, 0, 0), (("m", 1),)),
    "g": (1e-3, (0, 1, 0, 0, 0), (("kg", 1),)),
    "s": (1.0, _TIME, (("s", 1),)),
    "A": (1.0, (0, 0, 0, 1, 0), (("A", 1),)),
    "K": (1.0, (0, 0, 0, 0, 1), (("K", 1),)),
    "rad": (1.0, _NONE, (("rad", 1),)),
    "mol": (1.0, _NONE, (("mol", 1),)),
    "Hz": (1.0, (0, 0, -1, 0, 0), (("Hz", 1),)),
    "N": (1.0, (1, 1, -2, 0, 0), (("N", 1),)),
    "Nm": (1.0, (2, 1, -2, 0, 0), (("N", 1), ("m", 1))),
    "J": (1.0, (2, 1, -2, 0, 0), (("J", 1),)),
    "W": (1.0, (2, 1, -3, 0, 0), (("W", 1),)),
    "Pa": (1.0, (-1, 1, -2, 0, 0), (("Pa", 1),)),
    "bar": (1e5, (-1, 1, -2, 0, 0), (("Pa", 1),)),
    "C": (1.0, (0, 0, 1, 1, 0), (("C", 1),)),
    "V": (1.0, (2, 1, -3, -1, 0), (("V", 1),)),
    "ohm": (1.0, (2, 1, -3, -2, 0), (("ohm", 1),)),
    "S": (1.0, (-2, -1, 3, 2, 0), (("S", 1),)),
    "F": (1.0, (-2, -1, 4, 2, 0), (("F", 1),)),
    "H": (1.0, (2, 1, -2, -2, 0), (("H", 1),)),
    "T": (1.0, (0, 1, -2, -1, 0), (("T", 1),)),
    "Wb": (1.0, (2, 1, -2, -1, 0), (("Wb", 1),)),
    "l": (1e-3, (3, 0, 0, 0, 0), (("m", 3),)),
    "L": (1e-3, (3, 0, 0, 0, 0), (("m", 3),)),
    "Wh": (3600.0, (2, 1, -2, 0, 0), (("J", 1),)),
    "Ah": (3600.0, (0, 0, 1, 1, 0), (("C", 1),)),
}
# these take no prefix
_FIXED: dict[str, tuple[float, Dimension, _Factors]] = {
    "1": (1.0, _NONE, ()),
    "%": (1e-2, _NONE, ()),
    "percent": (1e-2, _NONE, ()),
    "ppm": (1e-6, _NONE, ()),
    "min": (60.0, _TIME, (("s", 1),)),
    "h": (3600.0, _TIME, (("s", 1),)),
    "sec": (1.0, _TIME, (("s", 1),)),
    "hz": (1.0, (0, 0, -1, 0, 0), (("Hz", 1),)),
    "deg": (pi / 180.0, _NONE, (("rad", 1),)),
    "rev": (2.0 * pi, _NONE, (("rad", 1),)),
    "rpm": (2.0 * pi / 60.0, (0, 0, -1, 0, 0), (("rad", 1), ("s", -1))),
    "degC": (1.0, (0, 0, 0, 0, 1), (("K", 1),)),
    "atm": (101325.0, (-1, 1, -2, 0, 0), (("Pa", 1),)),
    "psi": (6894.757293168361, (-1, 1, -2, 0, 0), (("Pa", 1),)),
    "inch": (0.0254, (1, 0, 0, 0, 0), (("m", 1),)),
    "ft": (0.3048, (1, 0, 0, 0, 0), (("m", 1),)),
    "lbf": (4.4482216152605, (1, 1, -2, 0, 0), (("N", 1),)),
    "g0": (9.80665, (1, 0, -2, 0, 0), (("m", 1), ("s", -2))),
}
_SPELLING = (
    ("\u00b0C", "degC"), ("\u00b0", "deg"), ("\u00b5", "u"), ("\u03bc", "u"),
    ("\u03a9", "ohm"), ("\u2126", "ohm"), ("\u00b2", "^2"), ("\u00b3", "^3"),
    ("\u00b7", "*"), ("\u22c5", "*"), ("\u2212", "-"), ("**", "^"), ("Ohm", "ohm"),
    ("_per_", "/"), (" per ", "/"),
)  # fmt: skip


@lru_cache(maxsize=2048)
def _atom(word: str) -> Unit | None:
    """Return the unit of one word such as `um`, `kPa`, `min`; None if there is none."""
    if word in _FIXED:
        scale, dims, factors = _FIXED[word]
        return Unit(scale, dims, word, factors, _DEGC_NOTE if word == "degC" else "")
    if word in _STEMS:
        return Unit(_STEMS[word][0], _STEMS[word][1], word, _STEMS[word][2])
    prefix, stem = word[:1], word[1:]
    factor = _PREFIXES.get(prefix)
    if factor is None and stem in _DECIMAL_STEMS:
        factor = _DECIMAL_PREFIXES.get(prefix)
    if factor is None or stem not in _STEMS:
        return None
    scale, dims, factors = _STEMS[stem]
    return Unit(factor * scale, dims, word, factors)


def _known() -> list[str]:
    return [*_STEMS, *_FIXED, *(p + s for s in _STEMS for p in _PREFIXES), "cm", "cN", "hPa"]


def _tokens(text: str) -> list[str]:
    """Cut text into words, whole numbers and single signs; a space between words is a `*`."""
    out: list[str] = []
    i = 0
    while i < len(text):
        c, j = text[i], i + 1
        if c.isalpha():
            while j < len(text) and text[j].isalpha():
                j += 1
            if text[i:j] == "g" and text[j : j + 1] == "0":  # standard gravity, the one digit name
                j += 1
        elif c in "0123456789":
            while j < len(text) and text[j] in "0123456789":
                j += 1
        elif c == " ":
            joined = bool(out) and (out[-1][-1].isalnum() or out[-1] in ")%")
            rest = text[i:].lstrip()
            if joined and rest[:1] and (rest[0].isalnum() or rest[0] in "(%"):
                out.append("*")
            i = j
            continue
        out.append(text[i:j])
        i = j
    return out


class _Parser:
    """Recursive descent over the tokens of one unit text.

    Names that are like an unknown one are looked up for `hints` only: that takes a while.
    """

    def __init__(self, text: str, where: str, hints: bool) -> None:
        self.text, self.where, self.hints = text, where, hints
        clean = text.strip()
        for old, new in _SPELLING:
            clean = clean.replace(old, new)
        self.tokens = _tokens("1/" + clean[4:] if clean.startswith("per_") else clean)
        self.at = 0

    def fail(self, why: str) -> UnusableInput:
        place = f" ({self.where})" if self.where else ""
        return UnusableInput(f"unit {self.text!r}{place}: {why}")

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self) -> str:
        self.at += 1
        return self.tokens[self.at - 1] if self.at <= len(self.tokens) else ""

    def product(self) -> Unit:
        unit = self.factor()
        while self.peek() in ("*", ".", "/", "_"):
            sign = self.take()
            other = self.factor()
            if sign == "_":
                reach = unit.dims in (_NONE, (1, 0, 0, 0, 0), (3, 0, 0, 0, 0)) and unit.factors
                if not (reach and other.dims in (_TIME, (0, 0, 2, 0, 0))):
                    raise self.fail("a bare '_' is ambiguous here; write '*' or '_per_'")
            unit = unit._times(other, 1 if sign in "*." else -1)
        return unit

    def factor(self) -> Unit:
        word = self.take()
        if word == "(":
            unit = self.product()
            if self.take() != ")":
                raise self.fail("a parenthesis is not closed")
        elif not word:
            raise self.fail("a unit is missing; write for example 'um', 'N*s/m' or '1'")
        else:
            found = _atom(word)
            if found is None:
                if not self.hints:
                    raise self.fail(f"{word!r} is not a known unit")
                full = _WORDS.get(word.lower().removesuffix("s"))
                close = " or ".join(repr(k) for k in ([full] if full else nearest(word, _known())))
                hint = f"did you mean {close}?" if close else "write for example 'um' or 'N*s/m'"
                raise self.fail(f"{word!r} is not a known unit; {hint}")
            unit = found
        return unit._power(self.power())

    def power(self) -> int:
        sign = 1
        marked = self.peek() == "^"
        if marked:
            self.take()
        if self.peek() in ("-", "+"):
            marked = True
            sign = -1 if self.take() == "-" else 1
        if not (self.peek()[:1] and self.peek()[0] in "0123456789"):
            if marked:
                raise self.fail("a power must be a whole number, such as m^2 or s^-1")
            return 1
        digits = self.take()
        if len(digits) > 2 or int(digits) > _MAX_POWER or int(digits) == 0:
            raise self.fail(f"the power {digits} is not between 1 and {_MAX_POWER}")
        return sign * int(digits)


@lru_cache(maxsize=1024)
def parse_unit(text: str, where: str = "") -> Unit:
    """Read a unit.

    Parameters
    ----------
    text : str
        Such as `um`, `N/V`, `N s/m`, `m/s^2`, `cm_per_s`, `m_s2`, `%`, `1/s`, `rpm`.
    where : str
        Where it was found, for the error.

    Returns
    -------
    Unit
        Scale to SI and dimension. `degC` is a difference in K and carries a note.

    Raises
    ------
    UnusableInput
        If a word is no known unit (nearest names are given) or the text is not well formed.

    Examples
    --------
    >>> parse_unit("N s/m").si, parse_unit("cm_per_s").scale
    ('N*s/m', 0.01)
    """
    return _read(text, where, hints=True)


def _read(text: str, where: str, hints: bool) -> Unit:
    parser = _Parser(text, where, hints)
    if not text.strip() or len(text) > _MAX_LENGTH:
        raise parser.fail(f"expected 1 to {_MAX_LENGTH} characters, such as 'um' or 'N*s/m'")
    unit = parser.product()
    if parser.peek():
        raise parser.fail(f"{parser.peek()!r} is not expected there")
    if not 0.0 < unit.scale < float("inf"):
        raise parser.fail("the scale to SI is out of range")
    tidy = float(f"{unit.scale:.12g}")  # 0.01, not 0.009999999999999998
    scale = tidy if isclose(tidy, unit.scale, rel_tol=2e-15) else unit.scale
    return Unit(scale, unit.dims, text.strip(), unit.factors, unit.note)


@lru_cache(maxsize=1024)
def read_unit(text: str) -> Unit | None:
    """Return the unit of a text; None if it is blank or no unit.

    Examples
    --------
    >>> read_unit("kN").si, read_unit("banana")
    ('N', None)
    """
    try:
        return _read(text, "", hints=False) if text.strip() else None
    except UnusableInput:
        return None


def meant_by(text: str, unit: str = "") -> tuple[str, ...]:
    """Return the units that a tail of a column header may have meant, the likeliest first.

    Parameters
    ----------
    text : str
        Letters that are no unit, such as `mQ`, `rmp`, `volts`.
    unit : str
        The unit that is expected there, if it is known: those of its dimension come first.

    Examples
    --------
    >>> meant_by("mQ"), meant_by("mQ", "N"), meant_by("volts"), meant_by("cmd")
    (('mA', 'mV', 'mN'), ('mN', 'mA', 'mV'), ('V',), ())
    """
    if word := _WORDS.get(text.lower().removesuffix("s")):
        return (word,)
    if len(text) < 2 or not text.isalpha() or text.lower() in _NO_TAILS:
        return ()
    # in another case, or behind the first letter one that is wrong or exchanged with the next;
    # two small letters are rather a part of the name: u_dc
    folded, slips = text.lower(), len(text) > 2 or not text.islower()
    close = [k for k in _known() if k.lower() == folded or (slips and _slips(text, k))]

    def order(k: str) -> tuple[bool, bool, int]:
        usual = _USUAL.index(k[1:]) if k[1:] in _USUAL else len(_USUAL)
        return k.lower() != folded, not same_dimension(k, unit or k), usual

    return tuple(sorted(dict.fromkeys(close), key=order)[:3])


def _slips(a: str, b: str) -> bool:
    """Whether two words differ by a letter behind the first, or by two that are exchanged."""
    if len(a) != len(b) or a[0] != b[0]:
        return False
    wrong = [i for i, (x, y) in enumerate(zip(a, b, strict=True)) if x != y]
    if len(wrong) == 2:
        i, j = wrong
        return j == i + 1 and a[i] + a[j] == b[j] + b[i]
    return len(wrong) == 1


_WORDS = {
    "volt": "V", "amp": "A", "ampere": "A", "newton": "N", "degree": "deg", "inche": "inch",
    "celsiu": "degC", "kelvin": "K", "second": "s", "meter": "m", "metre": "m", "watt": "W",
    "farad": "F", "henry": "H", "hertz": "Hz", "joule": "J", "coulomb": "C", "radian": "rad",
    "pascal": "Pa", "lpm": "l/min", "micron": "um", "kph": "km/h", "mum": "um", "nmm": "N*mm",
}  # fmt: skip
_NO_TAILS = ("ref", "raw", "set", "in", "act", "max", "min", "pos")
"""Usual ends of names of channels that look like misspelled units."""
_USUAL = ("A", "V", "N", "m", "Pa", "Nm", "W", "K", "Hz", "s")


def convert(values: ArrayLike, source: str, target: str) -> NDArray[np.float64]:
    """Convert values between two units of one dimension.

    Parameters
    ----------
    values : array_like
        Any shape, in `source` units.
    source, target : str
        The units.

    Returns
    -------
    ndarray
        float64, same shape, in `target` units.

    Raises
    ------
    UnusableInput
        If a unit is unknown or the dimensions differ.

    Examples
    --------
    >>> float(convert(3.6, "km/h", "m/s").round(12))
    1.0
    """
    a, b = parse_unit(source), parse_unit(target)
    if not a.same_dimension(b):
        raise UnusableInput(f"cannot convert {source!r} to {target!r}: {a.si} is not {b.si}")
    return a.to_si(values) * (1.0 / b.scale)


def same_dimension(a: str, b: str) -> bool:
    """Whether two texts are units of one dimension; texts that are none, whether they are equal.

    Parameters
    ----------
    a, b : str
        Such as "rpm" and "rad/s".

    Examples
    --------
    >>> same_dimension("rpm", "rad/s"), same_dimension("A", "V")
    (True, False)
    """
    one, other = read_unit(a), read_unit(b)
    return a == b if one is None or other is None else one.same_dimension(other)


def split_header(header: str) -> tuple[str, str | None]:
    """Split a column header into the name of the quantity and the text of its unit.

    Brackets win (`x[um]`, `x (um)`); otherwise the longest tail after an underscore that is a
    unit (`angular_velocity_rad_per_s`). The text in brackets is not checked here.

    Parameters
    ----------
    header : str
        One column header.

    Returns
    -------
    tuple of (str, str or None)
        Name and unit text; None if the header has no unit.

    Examples
    --------
    >>> split_header("angular_velocity_rad_per_s"), split_header("x[um]"), split_header("u")
    (('angular_velocity', 'rad_per_s'), ('x', 'um'), ('u', None))
    """
    text = header.strip()
    for left, right in ("[]", "()"):
        if text.endswith(right) and left in text:
            base, _, unit = text[:-1].rpartition(left)
            return base.strip(), unit.strip()
    parts = text.split("_")
    for i in range(1, len(parts)):
        base, tail = "_".join(parts[:i]), "_".join(parts[i:])
        if not base or tail == "1":
            continue
        unit_read = read_unit(tail)
        if unit_read is None:
            if all(_atom(word) for word in parts[i:]):
                return base, tail  # 'torque_N_m': ambiguous, refused when the unit is parsed
            continue
        if tail[-1].isdigit() and len(unit_read.factors) == 1 and tail != "g0":
            # a lone power is an area or a volume; 'u_V2' is more likely a second channel
            if unit_read.dims not in ((2, 0, 0, 0, 0), (3, 0, 0, 0, 0)):
                continue
        return base, tail
    return text, None
