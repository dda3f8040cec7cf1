"""System -> Program: the one place where exact equations become CasADi functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, overload

import casadi as ca
import sympy as sp

from bondgraph.equations.casadi_printer import to_casadi
from bondgraph.equations.derivation import equations
from bondgraph.equations.program import LawCall, Program, ProgramStep
from bondgraph.equations.relation import Relation
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.modulation import TIME
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.laws.law import Law, split
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import CASADI

# the operators of Python look for the fitting overload first, which takes seven times as long
_binary = ca.SX.binary
_ZERO, _ONE = ca.SX(0), ca.SX(1)


def program(graph: BondGraph) -> Program:
    """Derive `graph` and return its executable form.

    Raises
    ------
    UnusableInput
        A source or a sensor has a dead time, which no state and no memory can carry, a sensor has a
        clock of its own, or a law reads a signal beside its argument.
    """
    late = [e.name for e in graph.of_type(Source) if e.drive and e.drive.delay]
    late += [e.name for e in graph.of_type(Sensor) if e.delay]
    if late:
        raise UnusableInput(
            f"{graph.name}: {', '.join(late)} has a dead time, which the exported equations cannot "
            "carry; take it out (delay=None) and shift the signal in the target"
        )
    clocks = [e.name for e in graph.of_type(Sensor) if e.clock]
    if clocks:
        raise UnusableInput(
            f"{graph.name}: {', '.join(clocks)} has a clock of its own, which the exported "
            "equations do not have; take it out (clock=None) and resample in the target"
        )
    return exported(equations(graph))


def exported(model: System) -> Program:
    """Return the executable form of a system, to be written for another tool.

    Raises
    ------
    UnusableInput
        A law reads a signal beside its argument.
    """
    for use in model.laws:
        if use.law.watched:
            raise UnusableInput(
                f"{model.name}: the law of {use.element} reads {use.law.watched} beside its "
                "argument, which the exported equations cannot carry; give it a law of its "
                "argument alone"
            )
    return program_of(model)


def law_functions(law: Law, n_q: int) -> tuple[ca.Function, ca.Function]:
    """Return ``(s, m, q, h) -> deviation`` and ``(s, m, q, h) -> memory``."""
    s, h = ca.SX.sym("s"), ca.SX.sym("h")
    m, q = ca.SX.sym("m", law.n_memory), ca.SX.sym("q", n_q)
    arguments = (*split(q), h) if law.timed else split(q)
    value = ca.SX(law.deviation(CASADI, s, split(m), arguments))
    new = law.advance(CASADI, s, split(m), arguments) if law.n_memory else ()
    column = ca.vertcat(*new) if new else ca.SX(0, 1)
    return (
        ca.Function("value", [s, m, q, h], [value], ["s", "m", "q", "h"], ["w"]),
        ca.Function("advance", [s, m, q, h], [column], ["s", "m", "q", "h"], ["m_next"]),
    )


class Evaluation:
    """CasADi values of every signal of a system, in one pass over its relations.

    Laws are not called where their `deviations` are given, one a law. Those at the positions `held`
    are not called either: their deviations are further unknowns, see `held_residual`.
    """

    def __init__(
        self,
        model: System,
        deviations: Sequence[ca.SX] | None = None,
        held: tuple[int, ...] = (),
    ) -> None:
        self.model, self.deviations, self.held = model, deviations, held
        self.names = {
            "x": model.states,
            "z": (*(a.name for a in model.algebraic), *(held_name(model, i) for i in held)),
            "u": (*model.inputs, *model.input_rates),
            "p": tuple(model.parameters),
        }
        self.t, self.h = ca.SX.sym("t"), ca.SX.sym("h")
        self.columns = {k: ca.SX.sym(k, len(v)) for k, v in self.names.items()}
        self.value: dict[str, Any] = {str(TIME): self.t}
        for k in ("x", "z", "u"):
            self.value.update(zip(self.names[k], ca.vertsplit(self.columns[k]), strict=True))
        # `one` is an input of an offset; as the rate of time it is the number
        self.value.setdefault("one", ca.SX(1))
        values = ca.vertsplit(self.columns["p"])
        self.parameter = dict(zip(self.names["p"], values, strict=True))
        self.coefficients: dict[Any, Any] = {}
        self.calls = self._calls() if deviations is None else ()
        self.m = ca.SX.sym("m", sum(c.law.n_memory for c in self.calls))
        for r in model.relations:
            self.value[r.target] = self.of(r)
        self.residuals = [self.of(a.residual) for a in model.algebraic]
        self.residuals += [self._held_residual(i) for i in held]

    @cached_property
    def _table(self) -> dict[sp.Symbol, Any]:
        return {q.symbol: self.parameter[n] for n, q in self.model.parameters.items()}

    def _calls(self) -> tuple[LawCall, ...]:
        found, at = [], 0
        for use in self.model.laws:
            if use.law.watched:
                raise UnusableInput(
                    f"{self.model.name}: the law of {use.element} reads {use.law.watched} beside "
                    "its argument, which only a model that is linear up to its laws can; take "
                    "modulated elements and fields out, or give it a law of its argument alone"
                )
            value, advance = law_functions(use.law, len(use.parameters))
            memory = slice(at, at + use.law.n_memory)
            at = memory.stop
            argument = symbol(use.argument)
            found.append(
                LawCall(
                    use.element,
                    use.law,
                    argument,
                    use.slope,
                    memory,
                    use.parameters,
                    value,
                    advance,
                )
            )
        return tuple(found)

    def _coefficient(self, c: Any, reads: dict[sp.Symbol, Any]) -> Any:
        if reads and c.free_symbols & reads.keys():
            return to_casadi(c, {**self._table, **reads})
        simple = self._simple(c)
        if simple is not None:
            return simple
        if c not in self.coefficients:
            self.coefficients[c] = to_casadi(c, self._table)
        return self.coefficients[c]

    def _simple(self, c: Any) -> Any:
        """Return a parameter or its inverse, the coefficients of nearly all relations."""
        if c.is_Symbol:
            return self.parameter.get(c.name)
        if c.is_Pow and c.exp is sp.S.NegativeOne and c.base.is_Symbol:
            base = self.parameter.get(c.base.name)
            return None if base is None else _binary(ca.OP_DIV, _ONE, base)
        return None

    def of(self, r: Relation) -> Any:
        """Return what a relation gives, or its residual."""
        reads = {symbol(s): self.value[s] for s in r.reads} if r.reads else {}
        total: Any = _ZERO
        for c, s in r.terms:
            value = self.value[s]
            if not isinstance(c, int):
                value = _binary(ca.OP_MUL, self._coefficient(c, reads), value)
            total = _binary(ca.OP_SUB if isinstance(c, int) and c != 1 else ca.OP_ADD, total, value)
        if r.expression is not None:
            total = total + to_casadi(r.expression, {**self._table, **reads})
        if r.law is not None:
            total = total + self._deviation(r.law)
        return total

    def _deviation(self, position: int) -> Any:
        if position in self.held:
            return self.value[held_name(self.model, position)]
        return self.law(position, "value") if self.deviations is None else self.deviations[position]

    def gain(self, position: int) -> Any:
        """Return what a deviation that is held adds to its own argument within the time `h`.

        Only its size matters: by first order, and by the other unknowns only where all goes there.
        """
        n = len(self.model.algebraic)
        x, z = self.columns["x"], self.columns["z"]
        w, others = self.value[held_name(self.model, position)], z[:n]
        s = ca.SX(self.value[self.model.laws[position].argument])
        rates = ca.vertcat(ca.SX(0, 1), *(self.value[q.rate] for q in self.model.stored))
        both = ca.vertcat(s, rates)
        slope = ca.jacobian(both, w)
        by_x = ca.jacobian(s, x)
        gain = slope[0] + self.h * (by_x @ slope[1:])
        if n and not gain.nnz():
            rest = ca.vertcat(*self.residuals[:n])
            moved = -ca.solve(ca.jacobian(rest, others), ca.densify(ca.jacobian(rest, w)))
            slope = slope + ca.jacobian(both, others) @ moved
            gain = slope[0] + self.h * (by_x @ slope[1:])
        return gain

    def _held_residual(self, position: int) -> Any:
        """Return what vanishes where a deviation solves its law, whatever the (negative) gain.

        A deviation ``w`` at an argument ``s`` belongs to the law if the law closed over any gain
        ``g``, at ``s - g w`` without it, gives ``w`` again: at rest anything up to its level.
        """
        call, use = self.calls[position], self.model.laws[position]
        w, s = self.value[held_name(self.model, position)], self.value[use.argument]
        gain, memory = self.gain(position), split(self.m[call.memory])
        q = [self.parameter[n] for n in call.parameters]
        given = (*q, self.h) if use.law.timed else tuple(q)
        return w - use.law.solve(s - gain * w, gain, memory, given, w)

    def law(self, position: int, what: str) -> Any:
        """Return the ``value`` of a law, or what its memory becomes."""
        call, use = self.calls[position], self.model.laws[position]
        q = ca.vertcat(*[self.parameter[n] for n in call.parameters])
        function = call.value if what == "value" else call.advance
        return function(self.value[use.argument], self.m[call.memory], q, self.h)

    @property
    def arguments(self) -> tuple[list[ca.SX], list[str]]:
        """What functions of the signals take, and how it is called."""
        c = self.columns
        return (
            [self.t, c["x"], c["z"], c["u"], c["p"], self.m, self.h],
            ["t", "x", "z", "u", "p", "m", "h"],
        )


def held_name(model: System, position: int) -> str:
    """Return the name of a deviation as an unknown."""
    return f"w_{model.laws[position].element}"


def program_of(model: System, held: tuple[int, ...] = ()) -> Program:
    """Return the executable form of a system.

    The deviations of the laws at the positions `held` become unknowns: a step then finds the force
    of a contact that sticks, which no value of the law tells.
    """
    made = Evaluation(model, held=held)
    ins, labels = made.arguments
    rates = ca.vertcat(*[made.value[s.rate] for s in model.stored])
    readings = ca.vertcat(*[made.value[s] for _, s, _ in model.readings])
    kept = [made.law(i, "advance") for i, c in enumerate(made.calls) if c.law.n_memory]
    columns = [
        ca.densify(ca.SX(v)) if v is not None else ca.SX(0, 1)
        for v in (
            rates,
            readings,
            ca.vertcat(*made.residuals) if made.residuals else ca.SX(0, 1),
            ca.vertcat(*kept) if kept else ca.SX(0, 1),
        )
    ]
    units = {s.name: s.unit for s in model.stored}
    units |= {n: q.unit for n, q in model.parameters.items()}
    units |= {n: unit for n, _, unit in model.readings}
    memory = [f"{c.element}_m{i}" for c in made.calls for i in range(c.law.n_memory)]
    virgin = [v for c in made.calls for v in c.law.initial_memory(0.0)]
    readable = _Readable(model, made.calls, held)
    return Program(
        name=model.name,
        states=model.states,
        algebraic=made.names["z"],
        inputs=made.names["u"],
        parameters=made.names["p"],
        memory=tuple(memory),
        outputs=model.output_names,
        input_rates=model.input_rates,
        recorded=model.recorded,
        units=units,
        nominal=tuple(q.value for q in model.parameters.values()),
        start=(0.0,) * model.order,
        guess=(0.0,) * len(made.names["z"]),
        virgin=tuple(virgin),
        steps=readable.steps,
        laws=made.calls,
        rates=_Late(lambda: tuple(symbol(s.rate) for s in model.stored)),
        readings=tuple(symbol(s) for _, s, _ in model.readings),
        residuals=readable.residuals,
        rhs=ca.Function("rhs", ins, columns[:2], labels, ["dx", "y"]),
        residual=ca.Function("residual", ins, columns[2:3], labels, ["g"]),
        advance=ca.Function("advance", ins, columns[3:], labels, ["m_next"]),
        model=model,
        held=held,
    )


def signal_function(
    model: System, names: tuple[str, ...], held: tuple[int, ...] = ()
) -> ca.Function:
    """Return ``(t, x, z, u, p, m, h) -> signals`` for any signals of a system; see `program_of`."""
    made = Evaluation(model, held=held)
    own = {held_name(model, i) for i in held}
    found = []
    for n in names:
        found.append(made.value[n if n in own else model.called(n)])
    ins, labels = made.arguments
    column = ca.vertcat(ca.SX(0, 1), *found)
    return ca.Function("signals", ins, [ca.densify(ca.SX(column))], labels, ["s"])


def law_arguments(program: Program) -> ca.Function:
    """Return ``(t, x, z, u, p, m, h) -> arguments`` of the laws with memory, in their order."""
    assert program.model is not None
    uses = (use for use in program.model.laws if use.law.n_memory)
    return signal_function(program.model, tuple(u.argument for u in uses), program.held)


def with_signals(program: Program, model: System, names: tuple[str, ...]) -> Program:
    """Return the program of a system with more outputs: any of its signals."""
    if not names:
        return program
    signals = signal_function(model, names, program.held)
    ins, labels = signals.sx_in(), signals.name_in()
    rates, readings = program.rhs(*ins)
    columns = [rates, ca.vertcat(readings, signals(*ins))]
    return replace(
        program,
        outputs=(*program.outputs, *names),
        readings=(*program.readings, *(symbol(n) for n in names)),
        rhs=ca.Function("rhs", ins, columns, labels, ["dx", "y"]),
    )


class _Readable:
    """The steps of a program as SymPy assignments, each law called just before it is needed."""

    def __init__(
        self, model: System, calls: tuple[LawCall, ...], held: tuple[int, ...] = ()
    ) -> None:
        self.model, self.calls, self.held = model, calls, held
        self.steps = _Late(lambda: self._made[0])
        self.residuals = _Late(lambda: self._made[1])

    @cached_property
    def _made(self) -> tuple[tuple[ProgramStep, ...], tuple[sp.Expr, ...]]:
        called: set[int] = set(self.held)
        steps: list[ProgramStep] = []

        def call(r: Relation) -> None:
            if r.law is not None and r.law not in called:
                called.add(r.law)
                element = self.calls[r.law].element
                steps.append(ProgramStep(f"w_{element}", None, r.law, f"law of {element}"))

        for r in self.model.relations:
            call(r)
            steps.append(ProgramStep(r.target, self._expression(r), None, r.reason))
        residuals = []
        for a in self.model.algebraic:
            call(a.residual)
            residuals.append(self._expression(a.residual))
        return tuple(steps), tuple(residuals)

    def _expression(self, r: Relation) -> sp.Expr:
        parts = [sp.Mul(c, symbol(s)) for c, s in r.terms]
        if r.expression is not None:
            parts.append(r.expression)
        if r.law is not None:
            parts.append(symbol(f"w_{self.calls[r.law].element}"))
        return sp.Add(*parts)


class _Late(Sequence[Any]):
    """A sequence made when it is first read: readable steps cost more than all functions."""

    def __init__(self, make: Callable[[], Sequence[Any]]) -> None:
        self._make = make

    @overload
    def __getitem__(self, at: int) -> Any: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[Any]: ...
    def __getitem__(self, at: int | slice) -> Any:
        """Return an entry."""
        return self._make()[at]

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self._make())
