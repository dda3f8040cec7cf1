r"""Long expressions as several lines of LaTeX, without a package that breaks them."""

from __future__ import annotations

import sympy as sp

from bondgraph.equations.decimals import decimals
from bondgraph.export.latex import tex

_SCRIPT = 0.7
_OPERATOR = 2.3
_THIN = 0.4
_WIDTHS = {
    **dict.fromkeys(
        ("left", "right", "bigl", "bigr", "Bigl", "Bigr", "mathrm", "text", "bar"), 0.0
    ),
    **dict.fromkeys((",", ";", " ", "quad"), _THIN),
}


def broken(expression: sp.Expr, limit: float) -> list[str]:
    r"""Return `expression` as lines of LaTeX, each at most about `limit` letters wide.

    Sums break before a sign, long factors inside ``\bigl( .. \bigr)``, a long denominator becomes
    the power -1. A single symbol or number is never broken.

    Parameters
    ----------
    expression : sympy.Expr
    limit : float
        Width in letters of normal size.
    """
    lines: list[str] = []
    used = 0.0
    for piece in _pieces(decimals(expression), limit):
        wide = width(piece)
        if lines and used + wide <= limit:
            lines[-1] += " " + piece
            used += wide
        else:
            lines.append(piece)
            used = wide + (_OPERATOR if len(lines) > 1 else 0.0)
    return lines


def _pieces(expression: sp.Expr, limit: float) -> list[str]:
    """Pieces between which a line may end."""
    text = tex(expression)
    if width(text) <= limit:
        return [text]
    if expression.is_Add:
        return _sum(expression, limit)
    if expression.is_Mul:
        return _product(expression, limit)
    if expression.is_Pow and width(tex(expression.exp)) <= limit / 2:
        return _bracketed(expression.base, limit, after=f"^{{{tex(expression.exp)}}}")
    if isinstance(expression, sp.Function) and len(expression.args) == 1:
        head, opening, _ = tex(expression.func(sp.Symbol("x"))).partition(r"{\left(")
        if opening:
            return _bracketed(expression.args[0], limit, before=head)
    return [text]


def _sum(expression: sp.Expr, limit: float) -> list[str]:
    found: list[str] = []
    for term in expression.as_ordered_terms():
        negative = term.could_extract_minus_sign()
        body = -term if negative else term
        parts = _bracketed(body, limit) if body.is_Add else _pieces(body, limit)
        sign = "- " if negative else "+ " if found else ""
        found += [sign + parts[0], *parts[1:]]
    return found


def _product(expression: sp.Expr, limit: float) -> list[str]:
    if expression.could_extract_minus_sign():
        body = -expression
        parts = _bracketed(body, limit) if body.is_Add else _pieces(body, limit)
        return ["- " + parts[0], *parts[1:]]
    above, below = sp.fraction(expression)
    factors = sp.Mul.make_args(above)
    plain = [f for f in factors if not f.is_Add and width(tex(f)) <= limit / 4]
    long = [f for f in factors if f not in plain]
    short_below = below == 1 or width(tex(below)) <= limit / 2
    head = sp.Mul(*plain, evaluate=False) if plain else sp.S.One
    found: list[str] = []
    if short_below and below != 1:
        found += [rf"\frac{{{tex(sp.Mul(*plain))}}}{{{tex(below)}}}"]
    elif plain and head != 1:
        found += [tex(sp.Mul(*plain))]
    for f in long:
        found += _bracketed(f, limit)
    if not short_below:
        for f in sp.Mul.make_args(below):
            power = f.exp if f.is_Pow else sp.S.One
            found += _bracketed(f.base if f.is_Pow else f, limit, after=f"^{{{tex(-power)}}}")
    return found


def _bracketed(expression: sp.Expr, limit: float, before: str = "", after: str = "") -> list[str]:
    inner = _pieces(expression, limit - 2 * _OPERATOR)
    size = "Big" if any("frac" in piece for piece in inner) else "big"
    inner[0] = rf"{before}\{size}l({inner[0]}"
    inner[-1] = rf"{inner[-1]}\{size}r){after}"
    return inner


def width(text: str) -> float:
    r"""Return about how wide LaTeX mathematics is set, in letters of normal size.

    Examples
    --------
    >>> width(r"\frac{a b}{c}")
    2.0
    """
    return _measure(text, 0, False)[0]


def _measure(text: str, at: int, inside: bool) -> tuple[float, int]:
    """Width up to the end or the closing brace, and the place after it."""
    total, scale = 0.0, 1.0
    while at < len(text):
        ch = text[at]
        if ch == "}" and inside:
            return total, at + 1
        at += 1
        if ch in "^_":
            scale = _SCRIPT
            continue
        if ch == "{":
            wide, at = _measure(text, at, True)
        elif ch == "\\":
            wide, at = _command(text, at)
        else:
            wide = _OPERATOR if ch in "+-=:" else 0.0 if ch in " &" else 1.0
        total, scale = total + scale * wide, 1.0
    return total, at


def _command(text: str, at: int) -> tuple[float, int]:
    end = at
    while end < len(text) and text[end].isalpha():
        end += 1
    name = text[at : max(end, at + 1)]
    at += len(name)
    if name != "frac":
        named = len(name) if name in ("sin", "cos", "tan", "tanh", "log", "exp", "sign") else 1.0
        return _WIDTHS.get(name, float(named)), at
    above, at = _measure(text, text.index("{", at) + 1, True)
    below, at = _measure(text, text.index("{", at) + 1, True)
    return max(above, below), at
