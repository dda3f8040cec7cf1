r"""Model -> a complete LaTeX file: symbols with values, ordered equations, closed equations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import sympy as sp

from bondgraph.equations.program import Program
from bondgraph.export.latex import pretty, rate_of, tex, words
from bondgraph.export.latex_lines import broken, width
from bondgraph.graph.parameter import symbol

LINE = 76.0  # letters of normal size on a line of 16 cm
REASON = 28.0  # of them, for the reasons
ROWS = 40  # rows that fit on a page; a table cannot be broken
MOST_OPERATIONS = 2000  # closed forms beyond this are no reading

_HEAD = r"""\documentclass[a4paper]{article}
\usepackage{amsmath}
\setlength{\oddsidemargin}{0pt}
\setlength{\textwidth}{16cm}
\allowdisplaybreaks
\begin{document}
"""
# left-hand side, expression, reason
Line = tuple[str, sp.Expr, str]


def document(program: Program) -> str:
    r"""Return the equations of `program` as a complete ``.tex`` file: article and amsmath only.

    Long expressions are broken, so nothing runs over the margin. Every name is listed with what it
    is, its unit and its value. Laws stand as deviations ``D`` with their memory. Whatever a name
    holds, TeX is never made to obey it.

    Returns
    -------
    str
        ASCII text.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se
    >>> from bondgraph.equations.derivation import equations
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> C("C_1", 1e-6)
    >>> text = document(equations(g).program())
    >>> text.startswith("\\documentclass"), text.endswith("\\end{document}\n")
    (True, True)
    """
    return _HEAD + "\n\n".join(_parts(program)) + "\n\\end{document}\n"


def _parts(program: Program) -> list[str]:
    values = dict(zip(program.parameters, program.nominal, strict=True))
    units = program.units
    roles = [
        ("state", [(n, units.get(n, ""), "") for n in program.states]),
        ("unknown", [(n, units.get(n, ""), "") for n in program.algebraic]),
        ("input", [(n, units.get(n, ""), "") for n in program.inputs]),
        ("output", [(n, units.get(n, ""), "") for n in program.outputs]),
        ("parameter", [(n, units.get(n, ""), _value(values[n])) for n in program.parameters]),
    ]
    lines: list[Line] = []
    for step in program.steps:
        shown = step.expression
        if step.law is not None:
            call = program.laws[step.law]
            shown = sp.Function(f"D_{call.element}")(call.argument)
        lines.append((pretty(step.target), shown, step.comment))
    rates = [
        (rate_of(symbol(n)), e, "") for n, e in zip(program.states, program.rates, strict=True)
    ]
    readings = [
        (pretty(n), e, "output") for n, e in zip(program.outputs, program.readings, strict=True)
    ]
    zeros = [
        ("0", e, f"determines {n}")
        for n, e in zip(program.algebraic, program.residuals, strict=True)
    ]
    table = {symbol(s.target): e for s, (_, e, _) in zip(program.steps, lines, strict=True)}
    closing = [(a, e) for a, e, _ in (*rates, *zeros, *readings)]
    return [
        _title(program.name),
        *_symbols(roles),
        _section("Equations in order of evaluation"),
        *_laws(program),
        *_aligned([*lines, *rates, *readings], ":="),
        *_unknowns(zeros),
        *_closed(table, closing),
    ]


def _title(name: str) -> str:
    return rf"\section*{{Equations of \texttt{{{words(name)}}}}}" + "\nAll values in SI units."


def _section(text: str) -> str:
    return rf"\subsection*{{{text}}}"


def _value(number: float) -> str:
    """Return a number as LaTeX, with a power of ten where one helps."""
    mantissa, _, power = f"{number:.6g}".partition("e")
    return rf"{mantissa} \times 10^{{{int(power)}}}" if power else mantissa


def _symbols(roles: Iterable[tuple[str, Sequence[tuple[str, str, str]]]]) -> list[str]:
    """Tables of at most `ROWS` rows: symbol, name in programs, role, value, unit."""
    rows = [
        rf"\({pretty(n)}\) & \texttt{{{words(n)}}} & {role} & "
        + (rf"\({value}\) " if value else "")
        + rf"& {words(unit)} \\"
        for role, entries in roles
        for n, unit, value in entries
    ]
    tables = [
        "\\noindent\\begin{tabular}{@{}lllll@{}}\n"
        + "\n".join([r"symbol & name & & value & unit \\ \hline", *rows[i : i + ROWS]])
        + "\n\\end{tabular}"
        for i in range(0, len(rows), ROWS)
    ]
    return [_section("Symbols"), *tables] if rows else []


def _laws(program: Program) -> list[str]:
    """Say what the deviations are."""
    found = []
    for call in program.laws:
        slope = f" plus \\({tex(call.slope)}\\) times its argument" if call.slope != 0 else ""
        n = call.law.n_memory
        memory = f"; it has {n} numbers of memory, replaced after every accepted step" if n else ""
        name = tex(sp.Function(f"D_{call.element}"))
        found.append(
            rf"\noindent\({name}\): law \emph{{{words(call.law.name)}}} of "
            rf"\texttt{{{words(call.element)}}}; the element gives this deviation{slope}{memory}."
        )
    return found


def _unknowns(zeros: Sequence[Line]) -> list[str]:
    if not zeros:
        return []
    return [_section("Algebraic equations, solved together"), *_aligned(zeros, "=")]


def _closed(table: Mapping[sp.Symbol, sp.Expr], wanted: Sequence[tuple[str, sp.Expr]]) -> list[str]:
    """Return closed forms, unless they are too large to read."""
    sizes: dict[sp.Symbol, int] = {}
    for target, e in table.items():
        sizes[target] = _size(e, sizes)
    total = sum(_size(e, sizes) for _, e in wanted)
    head = _section("Closed form")
    if total > MOST_OPERATIONS:
        return [head, f"Left out: {total} operations are no reading; the order above has them all."]
    closed: dict[sp.Symbol, sp.Expr] = {}
    for target, e in table.items():
        closed[target] = e.xreplace(closed)
    lines = [(a, e.xreplace(closed), "") for a, e in wanted]
    return [head, *_aligned(lines, "=")] if lines else []


def _size(expression: sp.Expr, sizes: Mapping[sp.Symbol, int]) -> int:
    """Operations of an expression once its symbols are put in."""
    own = int(expression.count_ops())
    return own + sum(sizes.get(s, 0) * int(expression.count(s)) for s in expression.free_symbols)


def _aligned(lines: Sequence[Line], sign: str) -> list[str]:
    """Return ``align*`` environments; reasons stand in a column of their own."""
    if not lines:
        return []
    left = max(width(a) for a, _, _ in lines)
    reasons = any(r for _, _, r in lines)
    limit = max(20.0, LINE - left - 4.0 - (REASON if reasons else 0.0))
    rows = []
    for a, expression, reason in lines:
        first, *rest = broken(expression, limit)
        note = rf" && \parbox[t]{{5cm}}{{\raggedright\footnotesize {words(reason)}}}"
        rows.append(f"{a} &{sign} {first}" + (note if reason else ""))
        rows += [rf"&\quad {more}" for more in rest]
    return [
        "\\begin{align*}\n" + " \\\\\n".join(rows[i : i + ROWS]) + "\n\\end{align*}"
        for i in range(0, len(rows), ROWS)
    ]
