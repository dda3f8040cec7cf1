"""A model as flat Modelica, for the tools of that language.

What the text holds is the `Program`: parameters with units, inputs, outputs, ``der()`` equations,
the readable steps as equations, algebraic unknowns as ``0 = g``, input rates as ``der(input)``.
Laws become functions. The memory of a law is discrete: the engine advances it once a step, the
model in ``when sample(..)`` at every `memory_step`, so turning points between two samples are lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from bondgraph.equations.program import LawCall, Program
from bondgraph.export.modelica_language import MODELICA, Identifiers, number, quoted, unit_text
from bondgraph.export.tape import tape, tape_of, written
from bondgraph.graph.modulation import TIME
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import BondsightError, UnusableInput

WIDTH = 10_000
"""Expressions are written on one line; only what is used twice gets a name."""


def modelica(program: Program, *, memory_step: float = 1e-3) -> str:
    """Write a program as a Modelica model.

    Parameters
    ----------
    program : Program
    memory_step : float, optional
        Time between two updates of the memory of laws, s; a parameter of the model, and of no
        effect without memory.

    Returns
    -------
    str
        One model after the functions it calls, ASCII, without dependence on any library. Time is
        that of the tool: a model that reads it says so, and counts from a start at 0. Names are
        those of the program; one that Modelica reserves gets an underscore at its end, and its
        declaration says so.

    Raises
    ------
    UnusableInput
        If `memory_step` is no positive number, or a law that depends on time has no finite value
        right after its memory has been updated.
    BondsightError
        If an expression has an operation that Modelica lacks.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, R, Se, One
    >>> from bondgraph.equations.codegen import program
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V", unit="V") >> loop >> R("R_1", 1e3, unit="ohm")
    ...     _ = loop >> C("C_1", 1e-6, unit="F")
    >>> lines = modelica(program(g)).splitlines()
    >>> lines[0], [s.strip() for s in lines if "der(" in s or "R_1(" in s]  # doctest: +ELLIPSIS
    ('model rc', ['parameter Real R_1(unit="Ohm") = 1000.0;', 'der(q_C_1) = ...;'])
    """
    if not (math.isfinite(memory_step) and memory_step > 0.0):
        raise UnusableInput(f"memory_step = {memory_step} s is not a positive number of seconds")
    return _Writer(program, memory_step).text()


@dataclass
class _Writer:
    """The parts of one class while it is written."""

    program: Program
    memory_step: float
    names: Identifiers = field(default_factory=Identifiers)
    declared: list[str] = field(default_factory=list)
    functions: list[str] = field(default_factory=list)
    equations: list[str] = field(default_factory=list)
    updates: list[str] = field(default_factory=list)
    own: dict[tuple[str, str], str] = field(default_factory=dict)

    title: str = ""
    reads_time: bool = False

    def text(self) -> str:
        p = self.program
        self.title = self.names.new(p.name[:100] or "model_")
        self._declare_all()
        for step in p.steps:
            if step.law is None:
                self._equation(self.own["signal", step.target], step.expression, step.comment)
            else:
                self._law(p.laws[step.law], self.own["signal", step.target], step.comment)
        for name, rate in zip(p.states, p.rates, strict=True):
            self._equation(f"der({self.own['signal', name]})", rate)
        for residual in p.residuals:
            self._equation("0.0", residual)
        for name in p.input_rates:
            self._input_rate(name)
        for name, reading in zip(p.outputs, p.readings, strict=True):
            self._equation(self.own["output", name], reading)
        return "\n".join(self._sections(self.title)) + "\n"

    def _sections(self, title: str) -> Iterable[str]:
        yield from self.functions
        yield f"model {title}"
        note = "Generated from a bond graph" if title == self.program.name else self.program.name
        yield f"  {quoted(note)}"
        if self.reads_time or self.program.memory:
            yield "  // Time counts from the start: simulate from startTime = 0."
        yield from (f"  {line};" for line in self.declared)
        yield "equation"
        yield from (f"  {line};" for line in self.equations)
        if self.updates:
            yield "  // Memory is advanced at samples; turning points between two samples are lost."
            yield f"  when sample(0.0, {self.own['', 'memory_step']}) then"
            yield from (f"    {line};" for line in self.updates)
            yield "  end when;"
        yield f"end {title};"

    # -- declarations ---------------------------------------------------------------------
    def _declare_all(self) -> None:
        p = self.program
        for name, value in zip(p.parameters, p.nominal, strict=True):
            self._declare("parameter", name, "parameter Real", value=number(value))
        for name in p.inputs:
            rate = name in p.input_rates
            note = "rate of an input, which must be differentiable" if rate else ""
            self._declare("signal", name, "Real" if rate else "input Real", note=note)
        for name in p.outputs:
            self._declare("output", name, "output Real")
        for name, value in zip(p.states, p.start, strict=True):
            self._declare("signal", name, "Real", start=value, fixed=True)
        for name, value in zip(p.algebraic, p.guess, strict=True):
            self._declare("signal", name, "Real", start=value, note="solved with the equations")
        for step in p.steps:
            self._declare("signal", step.target, "Real")
        for name, value in zip(p.memory, p.virgin, strict=True):
            self._declare("memory", name, "discrete Real", start=value, fixed=True)
        if p.memory:
            self._declare("", "memory_step", "parameter Real", "s", value=number(self.memory_step))
        if any(call.law.timed for call in p.laws):
            note = "when the memory was advanced"
            self._declare("", "memory_time", "discrete Real", "s", start=0.0, fixed=True, note=note)

    def _declare(
        self,
        kind: str,
        name: str,
        prefix: str,
        unit: str | None = None,
        *,
        value: str = "",
        start: float | None = None,
        fixed: bool = False,
        note: str = "",
    ) -> None:
        found = self.own[kind, name] = self.names.new(name)
        plain = self.program.units.get(name, "") if unit is None else unit
        shown = unit_text(plain)
        attributes = [f"start = {number(start)}"] if start is not None else []
        attributes += ["fixed = true"] if fixed else []
        attributes += [f"unit={quoted(shown)}"] if shown else []
        line = f"{prefix} {found}" + (f"({', '.join(attributes)})" if attributes else "")
        notes = (
            f"name in the graph: {name}" if found != name else "",
            f"in {plain}" if plain and not shown else "",
            note,
        )
        comment = f" {quoted(*notes)}" if any(notes) else ""
        self.declared.append(line + (f" = {value}" if value else "") + comment)

    # -- equations ------------------------------------------------------------------------
    def _resolve(self, s: sp.Symbol) -> str:
        """Name of a symbol; a parameter and a signal of one name differ by assumption."""
        name = str(s)
        order = ("parameter", "signal") if s.is_positive else ("signal", "parameter")
        for kind in order:
            if (kind, name) in self.own and (kind == "parameter" or s == symbol(name)):
                return self.own[kind, name]
        if s == TIME:
            self.reads_time = True
            return "time"
        raise BondsightError(f"{self.program.name}: {name} is no name of the program")

    def _expression(self, expression: Any) -> str:
        """Text of an expression; a part used twice becomes an equation of its own."""
        found = written(tape_of(expression, self._resolve, prefix="part?"), MODELICA, width=WIDTH)
        renamed: dict[str, str] = {}
        for target, text in found.lines:
            renamed[target] = self.names.new("part")
            self.declared.append(f"Real {renamed[target]}")
            self.equations.append(f"{renamed[target]} = {_renamed(text, renamed)}")
        return _renamed(found.outputs[0][0], renamed)

    def _input_rate(self, name: str) -> None:
        """Write a derivative of an input, ``d_NAME`` or ``d2_NAME``, as that of the one below."""
        order, _, source = name.partition("_")
        k = int(order[1:] or 1) - 1
        below = f"d{k if k > 1 else ''}_{source}" if k else source
        self.equations.append(f"{self.own['signal', name]} = der({self.own['signal', below]})")

    def _equation(self, left: str, right: Any, comment: str = "") -> None:
        said = f" {quoted(comment)}" if comment else ""
        self.equations.append(f"{left} = {self._expression(right)}{said}")

    # -- laws -----------------------------------------------------------------------------
    def _law(self, call: LawCall, target: str, comment: str) -> None:
        _check_timed(call, self.program)
        argument = self.names.new(f"s_{call.element}")
        self.declared.append(f"Real {argument}")
        self.equations.append(f"{argument} = {self._expression(call.argument)}")
        memory = [self.own["memory", n] for n in self.program.memory[call.memory]]
        parameters = [self.own["parameter", n] for n in call.parameters]
        since = [f"time - {self.own['', 'memory_time']}"] if call.law.timed else []
        value = self._function(call, "value", call.value, ["w"])
        inputs = ", ".join([argument, *memory, *parameters, *since])
        self.equations.append(f"{target} = {value}({inputs}) {quoted(comment)}")
        if not memory:
            return
        advance = self._function(
            call, "advance", call.advance, [f"next{i}" for i in range(len(memory))]
        )
        before = [f"pre({m})" for m in memory]
        since = [f"time - pre({self.own['', 'memory_time']})"] if call.law.timed else []
        inputs = ", ".join([argument, *before, *parameters, *since])
        left = memory[0] if len(memory) == 1 else f"({', '.join(memory)})"
        self.updates.append(f"{left} = {advance}({inputs})")
        clock = f"{self.own['', 'memory_time']} = time" if call.law.timed else ""
        if clock and clock not in self.updates:
            self.updates.append(clock)

    def _function(self, call: LawCall, use: str, function: Any, outputs: Sequence[str]) -> str:
        """Write a function of the class and return its name."""
        # beside the model and not in it: readers without packages find it there; no "__", which
        # CasADi refuses in the name of a function
        wanted = re.sub("_+", "_", f"{self.title}_law_{call.element}_{use}")
        name = self.names.new(wanted)
        m, q = (int(function.numel_in(i)) for i in (1, 2))
        inputs = ["s", *(f"m{i}" for i in range(m)), *(f"q{i}" for i in range(q))]
        labels = [["s"], inputs[1 : m + 1], inputs[m + 1 :], ["h"]]
        if call.law.timed:
            inputs.append("h")
        try:
            found = written(tape(function, labels), MODELICA)
        except BondsightError as error:
            raise BondsightError(
                f"{call.element}: {error}; Modelica cannot hold this law"
            ) from None
        lines = [f"function {name} {quoted(f'{call.law.name} of {call.element}')}"]
        lines += [f"  input Real {n};" for n in inputs]
        lines += [f"  output Real {n};" for n in outputs]
        if found.lines:
            lines += ["protected", *(f"  Real {target};" for target, _ in found.lines)]
        lines.append("algorithm")
        lines += [f"  {target} := {text};" for target, text in found.lines]
        lines += [f"  {n} := {t};" for n, t in zip(outputs, found.outputs[0], strict=True)]
        self.functions.append("\n".join([*lines, f"end {name};"]))
        return name


def _renamed(text: str, names: dict[str, str]) -> str:
    # targets hold a sign that no identifier has; the longest first, as part?1 begins part?10
    for target in sorted(names, key=len, reverse=True):
        text = text.replace(target, names[target])
    return text


def _check_timed(call: LawCall, program: Program) -> None:
    """Refuse a law of time with no value right after its memory was updated (0/0, say)."""
    if not call.law.timed:
        return
    known = dict(zip(program.parameters, program.nominal, strict=True))
    q, virgin = [known[n] for n in call.parameters], list(program.virgin[call.memory])
    for s in (0.0, 1.0, -1.0):
        memory = call.advance(s, virgin, q, 1e-3)
        if not math.isfinite(float(call.value(s, memory, q, 0.0))):
            raise UnusableInput(
                f"{program.name}: the law {call.law.name} of {call.element} has no value right "
                "after its memory was updated, so a Modelica tool would stop there; simulate it "
                "with bondgraph.simulate"
            )
