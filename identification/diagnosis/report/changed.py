"""The equations that the effect changed, before and after."""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import escape

import matplotlib as mpl
import sympy as sp
from matplotlib.figure import Figure

from bondgraph.equations.derivation import equations
from bondgraph.equations.system import System
from bondgraph.export.latex import deviation_name, latex, law_name, ordered, pretty, tex
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, R, Source
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.explanation.law_formula import (
    CLIPPED,
    LONGEST,
    Clip,
    argument_of,
    argument_words,
    deviation_of,
)
from identification.diagnosis.search.candidates import Candidate
from identification.report.canvas import inline
from identification.report.style import PLOT


@dataclass(frozen=True)
class Change:
    """One equation as it was and as it is; empty where there is none.

    Attributes
    ----------
    before, after : str
        LaTeX.
    why : str
        What the equation is.
    """

    before: str
    after: str
    why: str


def changes(before: BondGraph, after: BondGraph) -> tuple[tuple[Change, ...], tuple[Change, ...]]:
    """Return changed assignments, and changed closed rates and outputs."""
    try:
        old, new = equations(before), equations(after)
    except BondsightError:
        return (), ()
    return _differences(_ordered(old), _ordered(new)), _differences(_closed(old), _closed(new))


Equations = dict[str, tuple[str, str]]
"""What an equation gives -> the equation and what it is."""


def _ordered(model: System) -> Equations:
    keys = [*model.index, *(a.name for a in model.algebraic)]
    keys += [f"rate of {n}" for n in model.states] + [f"reading {n}" for n in model.output_names]
    return {
        key: (f"{left} = {tex(right)}", key if reason == "output" else reason)
        for key, (left, _, right, reason) in zip(keys, ordered(model), strict=True)
    }


def _closed(model: System) -> Equations:
    names = [f"rate of {n}" for n in model.states]
    names += [f"{a.name} solves it" for a in model.algebraic]
    names += [f"reading {n}" for n in model.output_names]
    return _named(latex(model), names)


def _named(aligned: str, names: list[str]) -> Equations:
    lines = _lines(aligned)
    return {n: (line.replace(" &= ", " = ", 1), n) for n, line in zip(names, lines, strict=True)}


def _lines(aligned: str) -> list[str]:
    body = aligned.removeprefix("\\begin{aligned}\n").removesuffix("\n\\end{aligned}")
    return [line for line in body.split(" \\\\\n") if line.strip()]


def _differences(old: Equations, new: Equations) -> tuple[Change, ...]:
    found = []
    for what in dict.fromkeys((*old, *new)):
        a, b = old.get(what), new.get(what)
        if (a and a[0]) == (b and b[0]):
            continue
        why = (b or a or ("", ""))[1]
        found.append(Change(a[0] if a else "", b[0] if b else "", why))
    return tuple(found)


def whole_law(trial: Candidate) -> str:
    """LaTeX of the inserted law as a straight line plus its deviation; empty if none."""
    graph = trial.fit.problem.graph
    e, n = graph[trial.element], law_name(trial.element)
    w = deviation_name(trial.element)
    if law_of(e) is None:
        return ""
    if isinstance(e, Source):
        return rf"{n}^{{\mathrm{{drive}}}}(u) = u + {w}"
    if isinstance(e, Sensor):
        return rf"{n}^{{\mathrm{{reading}}}}(s) = s + {w}"
    if not isinstance(e, C | I | R):
        return ""
    slope, s = sp.sympify(graph.slope(e)), argument_of(e)
    return rf"{n}({s}) = {tex(slope)}\,{s} + {w}"


def definition(trial: Candidate) -> tuple[str, str]:
    """LaTeX of the inserted law in the symbols of the fit, and words for its argument.

    Laws with memory are told by a formula of their own, if there is a short one; both are empty
    where the equations say it all.
    """
    graph = trial.fit.problem.graph
    e, n = graph[trial.element], pretty(trial.element)
    w = deviation_name(trial.element)
    found, law = deviation_of(trial), law_of(e)
    if found is not None and law is not None:
        watched = law.watched
        named = f"({argument_of(e)}, {tex(symbol(watched))})" if watched else f"({argument_of(e)})"
        also = f", {watched} is read beside it" if watched else ""
        also += f"; {CLIPPED}" if found.has(Clip) else ""
        return f"{w}{named} = {tex(found)}", argument_words(graph, e) + also
    sign = "" if isinstance(e, C) else "-"
    formulas = {
        "hysteresis": (
            rf"{w}(t) = {sign}\sum_{{i}} h_i\,\left(s - \mathcal{{P}}_{{r_i}}[s](t)\right)",
            "s is the argument, P the play of half-width r_i (its memory), h_i the heights",
        ),
        "polynomial_with_loss": (
            rf"{w}(s, \dot{{s}}) = a_2\,z^2 + a_3\,z^3 + \gamma\,(s - s_r)^2\,\dot{{s}},"
            r"\quad z = (s - s_0)/s_1",
            f"{argument_words(graph, e)}, s_0 and s_1 the centre and half-width of its range, "
            "s_r where nothing is lost",
        ),
        "creep": (
            r"\dot{q}_j = \frac{1}{\tau_j}\left(a_j\,q - q_j\right),"
            r"\quad q_{\mathrm{total}} = q + \sum_j q_j",
            "q is what it stored before, q_j what it yields later with time τ_j, a_j how much",
        ),
        "delay": (
            rf"{n}(t) \rightarrow {n}(t - \tau)",
            "a dead time does not change the equations; it shifts what comes after it",
        ),
    }
    made = trial.insertion
    return formulas.get(made.law if made.form else trial.effect, ("", ""))


def math_svg(tex: str, name: str, size: float = 13.0) -> str:
    """Equation as SVG with glyphs as paths, or an empty text when it cannot be set."""
    if not tex or len(tex) > LONGEST:
        return ""
    with mpl.rc_context({**PLOT, "svg.fonttype": "path", "svg.hashsalt": name}):
        figure = Figure(figsize=(0.1, 0.1))
        figure.text(0, 0, f"${_for_mathtext(tex)}$", fontsize=size, color="#1f2933")
        try:
            drawn = inline(figure, name, tight=True)
        except (ValueError, RuntimeError):
            return ""
    said = escape(words(tex), quote=True)
    return drawn.replace("<svg ", f'<svg role="img" aria-label="{said}" ', 1)


def _for_mathtext(tex: str) -> str:
    """Commands that matplotlib's parser spells differently."""
    tex = re.sub(r"\\operatorname\{(\w+)\}", r"\\mathrm{\1}", tex)
    tex = tex.replace(r"\frac", r"\dfrac")
    tex = tex.replace(r"\tfrac", r"\frac").replace(r"\lvert", "|").replace(r"\rvert", "|")
    # its bars of chosen size are hairs
    return tex.replace(r"\left|", r"\,|").replace(r"\right|", "|")


def words(tex: str) -> str:
    """LaTeX as plain text, for what cannot be set."""
    tex = tex.replace(r"\mathrm{d}", "d").replace(r"\left", "").replace(r"\right", "")
    return re.sub(r"\\[,;! ]", " ", tex)
