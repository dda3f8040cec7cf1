"""A law that was found as a line of text in the symbols of its fit, and what its numbers are."""

from __future__ import annotations

from math import hypot, pi
from typing import Any

import sympy as sp
from sympy.printing.str import StrPrinter

from bondgraph.export.latex import tex
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, R, Source
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Odometer, Overflow, Parametrised, Periodic, Polynomial, Tone
from bondgraph.laws.law import Law, said_of
from bondgraph.laws.stepwise import Stepwise
from bondgraph.support.errors import BondsightError
from bondgraph.support.ops import SYMPY
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.lacking_element import LackingElement
from identification.diagnosis.catalogue.places import law_of, modulated_ratio
from identification.diagnosis.catalogue.words import formula
from identification.diagnosis.localisation.recording.variables import variables_beside, variables_of
from identification.diagnosis.search.candidates import Candidate
from identification.report.numbers import quantity

LONGEST = 420
"""Characters of LaTeX from which an equation says nothing any more."""


def in_symbols(trial: Candidate) -> str:
    """Return the inserted law as text, such as ``torque of b = b*v + F_c_b*sign(v)``.

    A law with memory, or of many pieces, is told in its own words; so is an effect that is no law
    at its element.
    """
    graph = trial.fit.problem.graph
    e = graph.elements.get(trial.element)
    if e is not None and (gain := gain_of(trial)) is not None:
        level = _level(trial)
        beside = f" {'-' if level < 0 else '+'} {abs(level):.4g}" if level else ""
        return f"reading of {e.name} = {gain:.4g}*s{beside}, where s is the true value at {e.name}"
    changed = modulated_ratio(e)
    if changed is not None and {*trial.insertion.strengths} & {*map(str, changed.free_symbols)}:
        return _ratio(graph, trial.element, changed)
    law = None if e is None else law_of(e)
    found = None if law is None else deviation_of(trial)
    if e is None or law is None or found is None:
        return _in_words(trial)
    s, (_, _, argument, output) = argument_of(e), variable_names(graph, e.name)
    slope = sp.sympify(graph.slope(e)) if isinstance(e, C | I | R) else sp.Integer(1)
    left = output if e.name in output.split() else f"{output} of {e.name}"
    beside = f", {law.watched} is read beside it" if law.watched else ""
    # a law that takes the straight line away is written without it
    own = slope.xreplace({n: symbol(str(n)) for n in slope.free_symbols})
    added = own * sp.Symbol(s) + found
    if found.has(Clip):
        beside = f"{beside}; {CLIPPED}"
        # what is taken away of a line is read beside it
        added = sp.Mul(own, sp.Symbol(s) + sp.expand(found / own), evaluate=False)
    whole = _Text().doprint(added).replace("**", "^")
    return f"{left} = {whole}, where {s} is the {argument}{beside}"


def in_numbers(trial: Candidate) -> str:
    """Return a law that is a power series with its fitted numbers; empty of any other.

    Such as ``force of k = 200*s - 3.1e+04*s^3, s in m, force in N``: about zero, whatever the
    middle is that the fit counts from.
    """
    graph = trial.fit.problem.graph
    e = graph.elements.get(trial.element)
    found = None if e is None or law_of(e) is None else deviation_of(trial)
    if not isinstance(e, C | R) or found is None:
        return ""
    s = sp.Symbol(argument_of(e))
    whole = sp.sympify(graph.slope(e)) * s + found
    known = trial.fit.values
    numbers = {p: known[str(p)] for p in whole.free_symbols if p != s and str(p) in known}
    whole = whole.subs(numbers)
    if whole.free_symbols != {s} or not whole.is_polynomial(s):
        return ""
    powers = {k: float(c) for (k,), c in sp.Poly(sp.expand(whole), s).terms()}
    if max(powers, default=0) < 2:
        return ""
    sizes = [abs(known[n]) for n in trial.insertion.strengths if n in known]
    if abs(powers.get(0, 0.0)) <= 1e-9 * max(sizes, default=0.0):  # zero but for rounding
        powers.pop(0, None)
    argument, unit, _, output = variable_names(graph, e.name)
    said = " ".join(
        f"{'-' if c < 0 else '+'} {abs(c):.4g}{f'*{s}' if k else ''}{f'^{k}' if k > 1 else ''}"
        for k, c in sorted(powers.items())
    )
    units = f", {s} in {argument}, {output} in {unit}" if argument and unit else ""
    return f"{output} of {e.name} = {said.removeprefix('+ ')}{units}"


def _ratio(graph: BondGraph, name: str, changed: sp.Expr) -> str:
    """Return a ratio that changes, and what the signals are that it changes with."""
    signals = sorted({str(s) for s in changed.free_symbols} - {*graph.parameters})
    said = " and ".join(f"{s} is the {signal_words(graph, s)}" for s in signals)
    return f"ratio of {name} = {_Text().doprint(changed).replace('**', '^')}, where {said}"


def signal_words(graph: BondGraph, signal: str) -> str:
    """Say what a displacement or a flow of the graph is, such as ``position of k``."""
    kind, _, name = signal.partition("_")
    e = graph[name]
    if isinstance(law_of(e), Odometer):  # it has no unit, what it counts has
        node = graph.neighbour(name)
        return f"{variables_beside(graph, node).displacement} counted at {node}"
    if kind == "q":
        return variable_names(graph, name)[2]
    return f"{variables_beside(graph, name).flow} at {name}"


def gain_of(trial: Candidate) -> float | None:
    """Return the whole gain of a sensor whose calibration is off, as a number; else None."""
    graph, (name, *_) = trial.fit.problem.graph, (*trial.insertion.strengths, "")
    if trial.effect != "sensor_gain" or name not in trial.fit.values:
        return None
    e = graph[trial.element]
    if law_of(e) is not None:
        return 1.0 + trial.fit.values[name]
    own = graph.channel_value(e, "gain") if isinstance(e, Sensor) else None
    return None if own is None else _at(own, trial)


def _at(expr: sp.Expr, trial: Candidate) -> float:
    known = trial.fit.values
    return float(expr.subs({s: known[str(s)] for s in expr.free_symbols if str(s) in known}))


def _level(trial: Candidate) -> float:
    """Return what a line adds to a reading of zero, the offset of the sensor with it."""
    law = law_of(trial.fit.problem.graph[trial.element])
    added = None if law is None else deviation_of(trial)
    level = 0.0 if added is None else _at(added.subs(sp.Symbol("s"), 0.0), trial)
    return level + sum(e.value for e in trial.fit.nuisances if e.name == f"offset {trial.element}")


class Clip(sp.Function):  # type: ignore[misc]
    """A value that is held between two ends."""

    nargs = 3

    def _latex(self, printer: Any, **_: Any) -> str:
        return rf"\operatorname{{clip}}\left({', '.join(map(printer.doprint, self.args))}\right)"

    def _sympystr(self, printer: Any) -> str:
        return f"clip({', '.join(map(printer.doprint, self.args))})"


CLIPPED = "clip(z, a, b) is z, held between a and b"


def _clipped(expr: sp.Expr) -> sp.Expr:
    """Return it with what is held between two ends written as ``clip``."""
    if not expr.args:
        return expr
    made = expr.func(*map(_clipped, expr.args))
    inner = [a for a in made.args if isinstance(a, sp.Min)] if isinstance(made, sp.Max) else []
    if len(made.args) != 2 or len(inner) != 1 or len(inner[0].args) != 2:
        return made
    (low,) = (a for a in made.args if a is not inner[0])
    if -low not in inner[0].args:
        return made
    (held,) = (a for a in inner[0].args if a != -low)
    turned = held.could_extract_minus_sign() and not held.is_Add
    return -Clip(-held, low, -low) if turned else Clip(held, low, -low)


class _Text(StrPrinter):  # type: ignore[misc]
    """Lines of text, with strokes for sizes; a sum begins with what is not taken away."""

    def _print_Add(self, expr: sp.Add, order: str | None = None) -> str:
        terms = self._as_ordered_terms(expr, order=order)
        if expr.has(Clip):  # what does not move comes last
            terms.sort(key=lambda t: (t.could_extract_minus_sign(), -len(t.free_symbols)))
        first = next((t for t in terms if not t.could_extract_minus_sign()), None)
        if first is None or (first is terms[0] and not expr.has(Clip)):
            return str(super()._print_Add(expr, order=order))
        said = (
            f"- {self._print(-t)}" if t.could_extract_minus_sign() else f"+ {self._print(t)}"
            for t in terms
            if t is not first
        )
        return " ".join([self._print(first), *said])

    def _print_Max(self, expr: sp.Max) -> str:
        return f"max({self.stringify(expr.args, ', ')})"

    def _print_Min(self, expr: sp.Min) -> str:
        return f"min({self.stringify(expr.args, ', ')})"

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
            return _plain(held.words)
    try:
        return _plain(formula(by_name(trial.effect)))
    except BondsightError:
        return ""


def _plain(text: str) -> str:
    return text.replace("`", "").rstrip(".")


def meaning_of(name: str, trial: Candidate) -> str:
    """Return what a parameter is that an effect brought in, in the words of its effect or law."""
    try:
        effect = by_name(trial.effect)
        own = effect.meanings
    except BondsightError:
        effect, own = None, {}
    if said := said_of(name.rstrip("_").removesuffix(f"_{trial.element}"), own):
        graph, gain = trial.fit.problem.graph, gain_of(trial)
        if isinstance(effect, LackingElement) and effect.whichever:
            thing = effect.thing(graph, graph[trial.element])
            said = said.replace(effect.whichever, thing or effect.whichever)
        return said if gain is None else f"{said}; the gain is {gain:.4g}"
    for e in trial.fit.problem.graph.elements.values():
        law = law_of(e)
        if law is not None and any(p.name == name for p in law.parameters(e.name)):
            said = law.meaning(name.removesuffix(f"_{e.name}"))
            more = (
                _flow_into(e, law, name, trial) + _rim(e, law, name, trial)
                if isinstance(e, C)
                else ""
            )
            return said + _whole_wave(e, law, name, trial) + more
    return ""


def own_value(trial: Candidate) -> str:
    """Say what an element's own value means beside a series about the middle of its range.

    Empty where there is no such series.
    """
    graph = trial.fit.problem.graph
    e = graph.elements.get(trial.element)
    law = None if e is None else law_of(e)
    inner = law.inner if isinstance(law, Parametrised) else law
    ratio = modulated_ratio(e)
    if ratio is not None and f"a_1_{trial.element}" in trial.insertion.strengths:
        named = trial.element in map(str, ratio.free_symbols)
        return f"{trial.element} itself is the ratio in the middle" if named else ""
    if not isinstance(e, C | R) or not isinstance(inner, Polynomial):
        return ""
    own = [str(s) for s in graph.coefficient(e).free_symbols]
    where = "in the middle of the range" if inner.centre else "at zero"
    return f"{own[0]} itself is the value {where}, by the slope of the law there" if own else ""


def _whole_wave(e: Element, law: Law, name: str, trial: Candidate) -> str:
    """Say how large a wave is in all, beside its first part: where it begins divides it in two."""
    if not isinstance(law, Periodic | Tone) or name != f"a_{e.name}":
        return ""
    size = hypot(*(trial.fit.values[f"{part}_{e.name}"] for part in "ab"))
    return f"; with the cosine, the amplitude of the wave is {quantity(size, law.unit)}"


def _flow_into(store: C, law: Law, name: str, trial: Candidate) -> str:
    """Say what flows into a store whose effort something from outside changes; of a size only."""
    steps = isinstance(law, Stepwise) and law.ramp and name == f"h_{store.name}"
    hums = isinstance(law, Tone) and name in (f"a_{store.name}", f"b_{store.name}")
    if not (steps or hums):
        return ""
    values, v = trial.fit.values, variables_of(store)
    rate = values[name] * (2.0 * pi * values[f"freq_{store.name}"] if hums else 1.0)
    flow = f"{rate / _at(trial.fit.problem.graph.slope(store), trial):.4g} {v.flow_unit}".strip()
    return f", {flow} of {v.flow} into {store.name}"


def _rim(store: C, law: Law, name: str, trial: Candidate) -> str:
    """Say at what effort a store overflows; empty of anything else."""
    if not isinstance(law, Overflow) or name != f"depth_{store.name}":
        return ""
    values, v = trial.fit.values, variables_of(store)
    content = values[f"top_{store.name}"] - values[name]
    rim = content * _at(trial.fit.problem.graph.slope(store), trial)
    return f"; that is a {v.effort} of {rim:.4g} {v.effort_unit}".rstrip()


def deviation_of(trial: Candidate) -> sp.Expr | None:
    """Return what a law without memory adds, from the law itself; None where that says little."""
    e = trial.fit.problem.graph[trial.element]
    law = law_of(e)
    watched = (symbol(law.watched),) * 2 if law is not None and law.watched else ()
    if law is None or law.timed or law.n_memory != len(watched):
        return None
    names = [symbol(p.name) for p in law.parameters(trial.element)]
    made = sp.sympify(law.deviation(SYMPY, sp.Symbol(argument_of(e)), watched, names))
    if sp.count_ops(made) > LONGEST:
        return None
    made = made.xreplace({f: _round(f) for f in made.atoms(sp.Float)})
    made = _clipped(min(made, sp.factor_terms(made), key=sp.count_ops))
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
            behind = "" if e.gain is None else " behind its gain"
            return unit, unit, f"{first} {element}{behind}", second
        return unit, unit, f"true value at {element}", "reading"
    v = variables_of(e)
    if isinstance(e, C):
        return v.displacement_unit, v.effort_unit, f"{v.displacement} of {element}", v.effort
    if isinstance(e, I) and e.law is not None:
        return v.momentum_unit, v.flow_unit, f"{v.momentum} of {element}", v.flow
    return v.flow_unit, v.effort_unit, f"{v.flow} of {element}", v.effort
