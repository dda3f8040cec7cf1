"""A law that was found as a line of text in the symbols of its fit, and what its numbers are."""

from __future__ import annotations

import sympy as sp
from sympy.printing.str import StrPrinter

from bondgraph.export.latex import tex
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, R, Source
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.laws.law import Law, law_words, said_of
from bondgraph.support.errors import BondsightError
from bondgraph.support.ops import SYMPY
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.catalogue.words import formula
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.search.candidates import Candidate

LONGEST = 420
"""Characters of LaTeX from which an equation says nothing any more."""


def in_symbols(trial: Candidate) -> str:
    """Return the inserted law as text, such as ``torque of b = b*v + F_c_b*sign(v)``.

    A law with memory, or of many pieces, is told in its own words; so is an effect that is no law
    at its element.
    """
    graph = trial.fit.problem.graph
    e = graph.elements.get(trial.element)
    law = None if e is None else law_of(e)
    found = None if law is None else deviation_of(trial)
    if e is None or law is None or found is None:
        return _in_words(trial)
    s, (_, _, argument, output) = argument_of(e), variable_names(graph, e.name)
    slope = sp.sympify(graph.slope(e)) if isinstance(e, C | I | R) else sp.Integer(1)
    left = output if e.name in output.split() else f"{output} of {e.name}"
    beside = f", {law.watched} is read beside it" if law.watched else ""
    whole = _Text().doprint(slope * sp.Symbol(s) + found).replace("**", "^")
    return f"{left} = {whole}, where {s} is the {argument}{beside}"


class _Text(StrPrinter):  # type: ignore[misc]
    """Lines of text, with strokes for sizes."""

    def _print_Float(self, expr: sp.Float) -> str:
        return f"{float(expr):.4g}"

    def _print_Abs(self, expr: sp.Abs) -> str:
        return f"|{self._print(expr.args[0])}|"


def _in_words(trial: Candidate) -> str:
    """Return the words of the law that holds the effect's strengths, at its element or a new one.

    Without one those of the effect as a whole.
    """
    strengths = set(trial.insertion.strengths)
    for e in trial.fit.problem.graph.elements.values():
        law = law_of(e)
        if law is not None and strengths & {p.name for p in law.parameters(e.name)}:
            held: Law = getattr(law, "inner", law)
            return _plain(law_words(type(held)))
    try:
        return _plain(formula(by_name(trial.effect)))
    except BondsightError:
        return ""


def _plain(text: str) -> str:
    return text.replace("`", "").rstrip(".")


def meaning_of(name: str, trial: Candidate) -> str:
    """Return what a parameter is that an effect brought in, in the words of its law or effect."""
    for e in trial.fit.problem.graph.elements.values():
        law = law_of(e)
        if law is not None and any(p.name == name for p in law.parameters(e.name)):
            return law.meaning(name.removesuffix(f"_{e.name}"))
    try:
        own = by_name(trial.effect).meanings
    except BondsightError:
        return ""
    return said_of(name.removesuffix(f"_{trial.element}"), own)


def deviation_of(trial: Candidate) -> sp.Expr | None:
    """Return what a law without memory adds, from the law itself; None where that says little."""
    e = trial.fit.problem.graph[trial.element]
    law = law_of(e)
    watched = (symbol(law.watched),) * 2 if law is not None and law.watched else ()
    if law is None or law.timed or law.n_memory != len(watched):
        return None
    names = [symbol(p.name) for p in law.parameters(trial.element)]
    made = sp.sympify(law.deviation(SYMPY, sp.Symbol(argument_of(e)), watched, names))
    made = made.xreplace({f: _round(f) for f in made.atoms(sp.Float)})
    made = min(made, sp.factor_terms(made), key=sp.count_ops)
    short = not made.atoms(sp.Piecewise, sp.floor) and len(tex(made)) < LONGEST
    return made if short else None


def _round(number: sp.Float) -> sp.Expr:
    """Return a plain fraction of 1 or of pi where a number is one."""
    for unit in (sp.Integer(1), sp.pi):
        share = sp.nsimplify((number / unit).evalf(), rational=True)
        if share.is_Rational and share.q < SMALL:
            return share * unit
    return number


SMALL = 9
"""Denominators below this are no measured number."""


def argument_of(e: Element) -> str:
    """Return the letter of what a law at an element is a function of."""
    kinds = {Source: "u", R: "v", I: "p"}
    return next((letter for kind, letter in kinds.items() if isinstance(e, kind)), "s")


def argument_words(graph: BondGraph, e: Element) -> str:
    """Say what that letter stands for."""
    return f"{argument_of(e)} is the {variable_names(graph, e.name)[2]}"


def variable_names(graph: BondGraph, element: str) -> tuple[str, str, str, str]:
    """SI units of argument and output as far as the element's own unit tells, and their words."""
    e = graph[element]
    if isinstance(e, Source | Sensor):
        unit = str(e.unit or "")
        if isinstance(e, Source):
            first, second = ("input", "at the port") if e.measured else ("command", "drive output")
            return unit, unit, f"{first} {element}", second
        return unit, unit, f"true value at {element}", "reading"
    v = variables_of(e)
    if isinstance(e, C):
        return v.displacement_unit, v.effort_unit, f"{v.displacement} of {element}", v.effort
    if isinstance(e, I) and e.law is not None:
        return v.momentum_unit, v.flow_unit, f"{v.momentum} of {element}", v.flow
    return v.flow_unit, v.effort_unit, f"{v.flow} of {element}", v.effort
