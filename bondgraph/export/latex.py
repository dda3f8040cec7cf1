r"""Equations as LaTeX: closed form and ordered assignments, names set as nested subscripts."""

from __future__ import annotations

import re

import sympy as sp
from sympy.printing.latex import LatexPrinter

from bondgraph.equations import ONE, StateSpace

__all__ = ["latex", "ordered_latex"]

_GREEK = frozenset(
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau "
    "upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega".split()
)
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{c: "\\" + c for c in "&%$#_{}"},
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
        word = "\\" + part if part in _GREEK else part
        found = f"{word}_{{{found}}}" if found else word
    return found


class _Printer(LatexPrinter):  # type: ignore[misc]  # SymPy has no types
    """SymPy's printer with Bondsight's names."""

    def _print_Symbol(self, expr: sp.Symbol, style: str = "plain") -> str:
        name = str(expr.name)
        if ramp := re.fullmatch(r"ramp(\d*)", name):
            return r"\bar{t}" if not ramp[1] else rf"\bar{{t}}^{{{ramp[1]}}}"
        return pretty(name)

    def _hprint_Function(self, func: str) -> str:
        for ending, mark in (
            ("_inverse", "^{-1}"),
            ("_drive", r"^{\mathrm{drive}}"),
            ("_reading", r"^{\mathrm{reading}}"),
        ):
            if func.endswith(ending):
                return pretty(func.removesuffix(ending)) + mark
        return pretty(func)


def latex(space: StateSpace) -> str:
    r"""Return the closed equations of `space` as an ``aligned`` environment.

    The time ramp of a drifting sensor shows as ``\bar{t}``: time over the length
    of the recording.

    Parameters
    ----------
    space : StateSpace
        Equations as `derive` returns them.

    Returns
    -------
    str
        ``dx/dt`` of every state, then every output.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se, derive
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> C("C_1", 1e-6)
    >>> print(latex(derive(g)))
    \begin{aligned}
    \frac{\mathrm{d}}{\mathrm{d}t}\, q_{C_{1}} &= \frac{V - \frac{q_{C_{1}}}{C_{1}}}{R_{1}}
    \end{aligned}
    """
    lines = [
        f"{_rate(s.symbol)} &= {_tex(f)}" for s, f in zip(space.states, space.dxdt, strict=True)
    ]
    lines += [f"{pretty(n)} &= {_tex(f)}" for n, f in zip(space.output_names, space.y, strict=True)]
    return _aligned(lines)


def ordered_latex(space: StateSpace) -> str:
    """Return the causal assignments of `space` in their order, each with its reason.

    Parameters
    ----------
    space : StateSpace
        Equations as `derive` returns them.

    Returns
    -------
    str
        An ``aligned`` environment: assignments, rates, outputs.
    """
    lines = [
        f"{_tex(a.target)} &:= {_tex(a.shown)} && \\text{{{_words(a.reason)}}}"
        for a in space.assignments
    ]
    lines += [
        f"{_rate(s.symbol)} &:= {_tex(s.rate)} && \\text{{state of {_words(s.element)}}}"
        for s in space.states
    ]
    lines += [f"{pretty(n)} &:= {_tex(shown)} && \\text{{output}}" for n, shown, _ in space.outputs]
    return _aligned(lines)


def _tex(expression: sp.Expr) -> str:
    return str(_Printer().doprint(expression.xreplace({ONE: sp.S.One})))


def _rate(state: sp.Symbol) -> str:
    return rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}}t}}\, {_tex(state)}"


def _aligned(lines: list[str]) -> str:
    return "\n".join([r"\begin{aligned}", " \\\\\n".join(lines), r"\end{aligned}"])


def _words(reason: str) -> str:
    return "".join(_SPECIAL.get(ch, ch) for ch in reason)
