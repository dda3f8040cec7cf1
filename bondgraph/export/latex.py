r"""Equations as LaTeX: closed form and ordered assignments, names set as nested subscripts."""

from __future__ import annotations

import re
import unicodedata

import sympy as sp
from sympy.printing.latex import LatexPrinter, accepted_latex_functions

from bondgraph.equations.decimals import BETWEEN, decimals, is_word
from bondgraph.equations.system import System
from bondgraph.graph.parameter import symbol

_GREEK = frozenset(
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau "
    "upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega".split()
)
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "$": r"\char36{}",  # \$ would need the TS1 fonts, which a small TeX lacks
    **{c: "\\" + c for c in "&%#_{}"},
}
_SIGNS = {
    "\u00b0": r"^{\circ}",
    "\u00b2": "^{2}",
    "\u00b3": "^{3}",
    "\u00b5": r"\mu ",
    "\u00b7": r"\cdot ",
    "\u2126": r"\Omega ",
}


def pretty(name: str) -> str:
    r"""Return a name as LaTeX, underscores as nested subscripts.

    Examples
    --------
    >>> pretty("q_C_nl")
    'q_{C_{nl}}'
    >>> pretty("tau_m")
    '\\tau_{m}'
    """
    found = ""
    for part in reversed([p for p in name.split("_") if p]):
        word = "\\" + part if part in _GREEK else "".join(_letter(ch) for ch in part)
        found = f"{word}_{{{found}}}" if found else word
    return found or rf"\text{{{words(name)}}}"


def _letter(ch: str) -> str:
    r"""Return a letter of a name for math mode; what TeX has no letter for shows as its number."""
    if ch.isascii():
        return ch if ch.isalnum() else rf"\text{{{_SPECIAL.get(ch, ch)}}}" if ch > " " else ""
    said = unicodedata.name(ch, "").split()
    if said[:2] in (["GREEK", "SMALL"], ["GREEK", "CAPITAL"]) and len(said) == 4:
        letter = said[3].replace("LAMDA", "LAMBDA")
        greek = letter.lower() if said[1] == "SMALL" else letter.capitalize()
        if greek in _GREEK:
            return f"\\{greek} "
    return rf"\mathrm{{u{ord(ch):04X}}}"


def words(text: str) -> str:
    r"""Return any text as LaTeX text on one line, with nothing TeX would obey.

    Examples
    --------
    >>> words("50 % of C_1 \\input{x}")
    '50 \\% of C\\_1 \\textbackslash{}input\\{x\\}'
    """
    plain = " ".join("".join(ch if ch.isprintable() else " " for ch in text).split())
    return "".join(_character(ch) for ch in plain)


def _character(ch: str) -> str:
    if ch.isascii():
        return _SPECIAL.get(ch, ch)
    if ch in _SIGNS:
        return rf"\ensuremath{{{_SIGNS[ch]}}}"
    return rf"\ensuremath{{{_letter(ch)}}}"


class _Printer(LatexPrinter):  # type: ignore[misc]  # SymPy has no types
    """SymPy's printer with Bondsight's names."""

    def _print_Symbol(self, expr: sp.Symbol, style: str = "plain") -> str:
        name = str(expr.name)
        if ramp := re.fullmatch(r"ramp(\d*)", name):
            return r"\bar{t}" if not ramp[1] else rf"\bar{{t}}^{{{ramp[1]}}}"
        return pretty(name)

    def _hprint_Function(self, func: str) -> str:
        if func in accepted_latex_functions:
            return "\\" + func
        if func == "sign":
            return r"\operatorname{sgn}"
        for ending, mark in (
            ("_inverse", "^{-1}"),
            ("_drive", r"^{\mathrm{drive}}"),
            ("_reading", r"^{\mathrm{reading}}"),
        ):
            if func.endswith(ending):
                return law_name(func.removesuffix(ending)) + mark
        if func.endswith("_deviation"):
            return deviation_name(func.removesuffix("_deviation"))
        return law_name(func)


def law_name(element: str) -> str:
    r"""Return the name of an element's law: an element and its law are not to be mistaken.

    Examples
    --------
    >>> law_name("k_2")
    '\\varphi_{k_{2}}'
    """
    return rf"\varphi_{{{pretty(element)}}}"


def deviation_name(element: str) -> str:
    r"""Return the name of what an element's law adds to its straight line."""
    return rf"w_{{{pretty(element)}}}"


def latex(model: System) -> str:
    r"""Return the closed equations of a system as an ``aligned`` environment.

    Laws stand as functions named after their element. The time ramp of a drifting sensor shows as
    ``\bar{t}``: time over the length of the recording.

    Returns
    -------
    str
        ``dx/dt`` of every state, the residuals of the unknowns, then every output.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> C("C_1", 1e-6)
    >>> print(latex(equations(g)))
    \begin{aligned}
    \frac{\mathrm{d}}{\mathrm{d}t}\, q_{C_{1}} &= \frac{V - \frac{q_{C_{1}}}{C_{1}}}{R_{1}}
    \end{aligned}
    """
    lines = [f"{rate_of(symbol(s.name))} &= {tex(model.shown(s.rate))}" for s in model.stored]
    lines += [f"0 &= {tex(model.shown(a.residual))}" for a in model.algebraic]
    lines += [f"{pretty(n)} &= {tex(model.shown(y))}" for n, y, _ in model.readings]
    return _aligned(lines)


def ordered_latex(model: System) -> str:
    """Return the causal assignments of a system in their order, each with its reason.

    Returns
    -------
    str
        An ``aligned`` environment: assignments, residuals, rates, outputs.
    """
    lines = [
        f"{left} &{sign} {tex(right)} && \\text{{{words(reason)}}}"
        for left, sign, right, reason in ordered(model)
    ]
    return _aligned(lines)


def ordered(model: System) -> list[tuple[str, str, sp.Expr, str]]:
    """Return left side (LaTeX), sign, right side and reason of all equations, laws whole."""
    right = model.right_side
    rows = [(tex(symbol(r.target)), ":=", right(r), r.reason) for r in model.relations]
    rows += [("0", "=", right(a.residual), f"{a.name} solves it: {a.reason}")
             for a in model.algebraic]  # fmt: skip
    rows += [(rate_of(symbol(s.name)), ":=", symbol(s.rate), f"state of {s.element}")
             for s in model.stored]  # fmt: skip
    return rows + [(pretty(n), ":=", symbol(y), "output") for n, y, _ in model.readings]


def tex(expression: sp.Expr) -> str:
    """Return an expression as LaTeX with Bondsight's names."""
    shown = decimals(expression.xreplace({symbol("one"): sp.S.One}))
    apart = BETWEEN if any(map(is_word, shown.free_symbols)) else None
    return str(_Printer({"mul_symbol": apart}).doprint(shown))


def rate_of(state: sp.Symbol) -> str:
    """Return the time derivative of a state."""
    return rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}}t}}\, {tex(state)}"


def _aligned(lines: list[str]) -> str:
    return "\n".join([r"\begin{aligned}", " \\\\\n".join(lines), r"\end{aligned}"])
