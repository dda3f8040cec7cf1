"""The executable form of a model that every export and integrator reads.

Sizes: n_x states, n_z algebraic unknowns, n_u inputs, n_p parameters, n_m memory states, n_y
outputs. Memory is constant within a step and replaced by `Program.advance` once it is accepted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from bondgraph.support.arrays import Array
from bondgraph.support.errors import real_number, require_known

if TYPE_CHECKING:
    import casadi as ca

    from bondgraph.equations.system import System
    from bondgraph.laws.law import Law


@dataclass(frozen=True, slots=True)
class LawCall:
    """A nonlinear law called by a step: ``value(argument, memory, parameters)``.

    Attributes
    ----------
    element : str
        Whose law it is; also the name to give a generated function.
    law : Law
        With its operator, claims and energy.
    argument : sympy.Expr
        Of targets of earlier steps, states, inputs, parameters, algebraic unknowns.
    slope : sympy.Expr
        Linear slope: the value of the law is ``slope * argument + deviation``.
    memory : slice
        Its part of the memory vector (empty if it has none).
    parameters : tuple of str
        Names of its parameters.
    value : casadi.Function
        ``(s, m, q, h) -> deviation``, scalars and columns, SX; h is the time since the memory
        (it matters only if ``law.timed``).
    advance : casadi.Function
        ``(s, m, q, h) -> m`` after s has been accepted.
    """

    element: str
    law: Law
    argument: sp.Expr
    slope: sp.Expr
    memory: slice
    parameters: tuple[str, ...]
    value: Any
    advance: Any


@dataclass(frozen=True, slots=True)
class ProgramStep:
    """``target := expression``, or ``target := law(argument)`` where `law` is a position."""

    target: str
    expression: sp.Expr | None
    law: int | None
    comment: str


@dataclass(frozen=True)
class FunctionNames:
    """Names and values that belong to the vectors x, z, u, p, m and y, in their order.

    Attributes
    ----------
    name : str
    states, algebraic, inputs, parameters, memory, outputs : tuple of str
        Names, in the order of the vectors x, z, u, p, m, y.
    input_rates : tuple of str
        The inputs (among `inputs`) that are time derivatives ``d_NAME`` of another input NAME.
    units : mapping of str to str
        SI units of all names that have one.
    nominal : tuple of float, shape (n_p,)
        Parameters, SI.
    start, guess, virgin : tuple of float
        x at the start (0), a guess for z, memory at the start.
    """

    name: str
    states: tuple[str, ...]
    algebraic: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    memory: tuple[str, ...]
    outputs: tuple[str, ...]
    input_rates: tuple[str, ...]
    units: Mapping[str, str]
    nominal: tuple[float, ...]
    start: tuple[float, ...]
    guess: tuple[float, ...]
    virgin: tuple[float, ...]

    def vector(self, values: Mapping[str, float]) -> Array:
        """Return the nominal parameters with some values changed by name, SI, shape (n_p,)."""
        p = np.array(self.nominal, float)
        for name, value in values.items():
            require_known("parameter", self.name, self.parameters, name)
            p[self.parameters.index(name)] = real_number(name, value)
        return p


@dataclass(frozen=True)
class Program(FunctionNames):
    """``dx/dt = f(t, x, z, u, p, m)``, ``0 = g(..)``, ``y = h(..)``, ``m+ = advance(.., h)``.

    Attributes
    ----------
    steps : sequence of ProgramStep
        Readable assignments in order of evaluation.
    laws : tuple of LawCall
    rates, readings, residuals : sequence of sympy.Expr
        dx/dt, y and g in targets of the steps.
    rhs : casadi.Function
        ``(t, x, z, u, p, m, h) -> (dx, y)``, SX.
    residual : casadi.Function
        ``(t, x, z, u, p, m, h) -> g``, SX; n_z rows.
    advance : casadi.Function
        ``(t, x, z, u, p, m, h) -> m`` after acceptance, SX; h is the time since the memory, s.
    recorded : tuple of str
        Those of `input_rates` whose input is recorded as their integral, see
        `bondgraph.signals.recorded_rates`.
    model : System or None
        What it was made of, unless it was changed since; further outputs are signals of that.
    held : tuple of int
        Laws whose deviations are the last of `algebraic`; `residuals` are those of the others.
    """

    steps: Sequence[ProgramStep]
    laws: tuple[LawCall, ...]
    rates: Sequence[sp.Expr]
    readings: Sequence[sp.Expr]
    residuals: Sequence[sp.Expr]
    rhs: ca.Function
    residual: ca.Function
    advance: ca.Function
    recorded: tuple[str, ...] = ()
    model: System | None = None
    held: tuple[int, ...] = ()

    @property
    def has_memory(self) -> bool:
        """Whether any law remembers."""
        return bool(self.memory)

    def start_memory(
        self, memory: Mapping[str, Sequence[float]] | None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return the memory at the start, that of the laws named replaced, and which these are."""
        m, kept = np.array(self.virgin, float), np.zeros(len(self.virgin), bool)
        rows = {c.element: c for c in self.laws if c.law.n_memory}
        for element, states in (memory or {}).items():
            require_known("law with memory", self.name, rows, element)
            m[rows[element].memory] = rows[element].law.checked_memory(states)
            kept[rows[element].memory] = True
        return m, kept

    def memory_by_law(self, m: Array) -> dict[str, tuple[float, ...]]:
        """Return the memory of each law that has one, by element."""
        return {c.element: tuple(m[c.memory].tolist()) for c in self.laws if c.law.n_memory}
