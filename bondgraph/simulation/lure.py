"""StateSpace -> numbers: the linear rest as matrices of the parameters, the laws as ports.

Every model of the language is a linear system closed by scalar laws::

    dx/dt = A x + B u + E w       s = Cs x + Ds u + Dsw w
    y     = Cy x + Dy u + Dyw w   w = law.deviation(s, memory)

so that the linear part, stiff or not, can be integrated exactly.
Sizes: n_x states, n_u inputs, n_w laws, n_y outputs, n_p parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import sympy as sp

from bondgraph.equations.casadi_printer import to_casadi
from bondgraph.equations.state_space import LawPort, StateSpace, derive
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import symbol
from bondgraph.laws.law import CALLED_FROM, NEWTON_STEPS, Law, split
from bondgraph.laws.watching import Gauge
from bondgraph.support.errors import real_number, unknown_name
from bondgraph.support.ops import CASADI


@dataclass(frozen=True)
class Compiled:
    """A state space with its CasADi functions.

    Attributes
    ----------
    space : StateSpace
        The symbolic model.
    observed : tuple of str
        Signals given out after the sensors' readings.
    """

    space: StateSpace
    observed: tuple[str, ...] = ()

    @property
    def n_x(self) -> int:
        """Number of states."""
        return len(self.space.states)

    @property
    def n_u(self) -> int:
        """Number of inputs, pseudo-inputs (``one``, ``ramp``) included."""
        return len(self.space.inputs)

    @property
    def n_w(self) -> int:
        """Number of laws."""
        return len(self.space.laws)

    @property
    def n_y(self) -> int:
        """Number of sensor readings (observed signals not counted)."""
        return len(self.space.outputs)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters, in the order of the vector `p`."""
        return tuple(self.space.parameters)

    @cached_property
    def law_parameters(self) -> tuple[int, ...]:
        """Positions in `p` of the parameters of all laws, law by law."""
        index = {n: i for i, n in enumerate(self.parameter_names)}
        return tuple(index[n] for port in self.space.laws for n in port.parameters)

    @cached_property
    def _signals(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
        space = self.space
        x, u = ca.SX.sym("x", self.n_x), ca.SX.sym("u", self.n_u)
        w, p = ca.SX.sym("w", self.n_w), ca.SX.sym("p", len(self.parameter_names))
        table: dict[sp.Symbol, Any] = {}
        for i, s in enumerate(space.states):
            table[s.symbol] = x[i]
        for i, s in enumerate(space.inputs):
            table[s] = u[i]
        for i, port in enumerate(space.laws):
            table[port.w] = w[i]
        for i, par in enumerate(space.parameters.values()):
            table[par.symbol] = p[i]
        for a in space.assignments:
            table[a.target] = to_casadi(a.expression, table)
        outputs = [to_casadi(s, table) for _, s, _ in space.outputs]
        for name in self.observed:
            if symbol(name) not in table:
                raise unknown_name("signal", name, space.name, [str(t) for t in table])
            outputs.append(table[symbol(name)])
        rates = ca.vertcat(*[to_casadi(s.rate, table) for s in space.states])
        arguments = ca.vertcat(*[to_casadi(port.argument, table) for port in space.laws])
        return x, u, w, p, rates, arguments, ca.vertcat(*outputs)

    @cached_property
    def matrices(self) -> ca.Function:
        """``p -> [[A, B, E], [Cs, Ds, Dsw], [Cy, Dy, Dyw]]``."""
        x, u, w, p, rates, arguments, outputs = self._signals
        z = ca.vertcat(x, u, w)
        block = ca.densify(ca.jacobian(ca.vertcat(rates, arguments, outputs), z))
        return ca.Function("matrices", [p], [block], ["p"], ["block"])

    @cached_property
    def matrices_jacobian(self) -> ca.Function:
        """Derivative of the column-major block with respect to `p`."""
        p = ca.SX.sym("p", len(self.parameter_names))
        block = ca.vec(self.matrices(p))
        return ca.Function("dmatrices", [p], [ca.densify(ca.jacobian(block, p))])

    @cached_property
    def rhs(self) -> ca.Function:
        """``(t, x, u, p, m) -> (dx/dt, y)`` with the laws at memory `m`.

        The continuous right-hand side for other integrators and exports; laws that depend on
        their own output through an algebraic path are solved by their closed form or Newton steps.
        """
        x, u, w, p, rates, _, outputs = self._signals
        t = ca.SX.sym("t")
        memory = ca.SX.sym("m", sum(port.law.n_memory for port in self.space.laws))
        block = self.matrices(p)
        n, m = self.n_x, self.n_u
        rows = slice(n, n + self.n_w)
        free = block[rows, :n] @ x + block[rows, n : n + m] @ u
        values = solve_laws(self, free, block[rows, n + m :], memory, p, ca.SX.zeros(self.n_w))
        put = [(w, values)] if self.n_w else []
        rates, outputs = (ca.substitute(v, *put[0]) if put else v for v in (rates, outputs))
        return ca.Function(
            "rhs", [t, x, u, p, memory], [rates, outputs], ["t", "x", "u", "p", "m"], ["dx", "y"]
        )

    def nominal(self) -> np.ndarray:
        """Parameter vector of the declared values, shape (n_p,)."""
        return np.array([q.value for q in self.space.parameters.values()])

    def vector(self, values: Mapping[str, float]) -> np.ndarray:
        """Parameter vector with some values changed by name."""
        p = self.nominal()
        for name, v in values.items():
            if name not in self.parameter_names:
                raise unknown_name("parameter", name, self.space.name, self.parameter_names)
            p[self.parameter_names.index(name)] = real_number(name, v)
        return p


def compile_model(graph: BondGraph, observed: Sequence[str] = ()) -> Compiled:
    """Derive and compile `graph`; `observed` signals follow the sensors in the outputs."""
    return Compiled(derive(graph), tuple(observed))


def law_slices(compiled: Compiled) -> tuple[tuple[LawPort, slice, slice], ...]:
    """For each law: the port, its part of the memory, its part of the law parameters."""
    found = []
    m = q = 0
    for port in compiled.space.laws:
        n_m, n_q = port.law.n_memory, len(port.parameters)
        found.append((port, slice(m, m + n_m), slice(q, q + n_q)))
        m, q = m + n_m, q + n_q
    return tuple(found)


def solve_laws(
    compiled: Compiled,
    free: ca.SX,
    gain: ca.SX,
    memory: ca.SX,
    p: ca.SX,
    w_last: ca.SX,
    step: Any = 0.0,
) -> ca.SX:
    """Deviations that satisfy ``s = free + gain w``, ``w_j = law_j(s_j)``; sweeps if several.

    `step` is the time since the memory, s; at 0 the memory stands still.
    """
    laws = law_slices(compiled)
    q = ca.vertcat(*[p[i] for i in compiled.law_parameters]) if compiled.law_parameters else ca.SX()
    w = list(ca.vertsplit(w_last)) if len(laws) else []
    acting = sum(not isinstance(port.law, Gauge) for port, _, _ in laws)
    if acting > 1 and not any(port.law.closed for port, _, _ in laws):
        return _solve_together(laws, free, gain, memory, q, w_last, step)
    for _ in range(1 if acting == 1 else 4):
        for j, (port, ms, qs) in enumerate(laws):
            others = free[j]
            for k, wk in enumerate(w):
                if k != j:
                    others = others + gain[j, k] * wk
            w[j] = scalar_solution(port, others, gain[j, j], memory[ms], q[qs], w[j], step)
    return ca.vertcat(*w) if w else ca.SX(0, 1)


def _solve_together(
    laws: tuple[tuple[LawPort, slice, slice], ...],
    free: ca.SX,
    gain: ca.SX,
    memory: ca.SX,
    q: ca.SX,
    w_last: ca.SX,
    step: Any,
) -> ca.SX:
    """Newton's method for laws that have a slope: sweeps diverge where stiff laws share a loop."""
    n = len(laws)
    functions = []
    for port, ms, qs in laws:
        s, m = ca.SX.sym("s"), ca.SX.sym("m", ms.stop - ms.start)
        p, h = ca.SX.sym("q", qs.stop - qs.start), ca.SX.sym("h")
        w = ca.SX(port.law.deviation(CASADI, s, split(m), law_arguments(port.law, p, h)))
        options = {"never_inline": True} if port.law.n_memory >= CALLED_FROM else {}
        slope = ca.densify(ca.jacobian(w, s))
        functions.append(ca.Function("law", [s, m, p, h], [w, slope], options))

    def values(s: ca.SX) -> tuple[ca.SX, ca.SX]:
        pairs = [
            f(s[j], memory[ms], q[qs], step)
            for j, (f, (_, ms, qs)) in enumerate(zip(functions, laws, strict=True))
        ]
        return ca.vertcat(*(w for w, _ in pairs)), ca.vertcat(*(d for _, d in pairs))

    s = free + gain @ w_last
    for _ in range(NEWTON_STEPS):
        w, slope = values(s)
        matrix = ca.SX.eye(n) - gain * ca.repmat(slope.T, n, 1)
        s = s - ca.solve(matrix, s - free - gain @ w)
    return values(s)[0]


def scalar_solution(
    port: LawPort, free: Any, gain: Any, memory: ca.SX, q: ca.SX, w_last: Any, step: Any
) -> Any:
    """One law closed over its own gain."""
    return port.law.solve(free, gain, split(memory), law_arguments(port.law, q, step), w_last)


def law_arguments(law: Law, q: ca.SX, step: Any) -> Sequence[Any]:
    """Parameters of a law; a timed one takes the time since its memory as the last."""
    return (*split(q), step) if law.timed else split(q)


def advance_laws(compiled: Compiled, s: ca.SX, memory: ca.SX, p_laws: ca.SX, step: Any) -> ca.SX:
    """Memory after the arguments `s` have been accepted, `step` seconds later."""
    new: list[Any] = []
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        if port.law.n_memory:
            q = law_arguments(port.law, p_laws[qs], step)
            after = port.law.advance(CASADI, s[j], split(memory[ms]), q)
            if port.law.watched:  # its gauge follows it
                after = (*after[:-2], memory[ms][-1], s[j + 1])
            new.extend(after)
    return ca.vertcat(*new) if new else ca.SX(0, 1)


Progress = Callable[[str, float], None]
