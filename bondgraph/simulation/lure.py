"""System -> numbers: the linear rest as matrices of the parameters, the laws as ports.

Most models of the language are a linear system closed by scalar laws::

    dx/dt = A x + B u + E w       s = Cs x + Ds u + Dsw w
    y     = Cy x + Dy u + Dyw w   w = law.deviation(s, memory)

so that the linear part, stiff or not, can be integrated exactly.
Sizes: n_x states, n_u inputs, n_w laws, n_y outputs, n_p parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.equations.codegen import Evaluation
from bondgraph.equations.derivation import displaced_equations
from bondgraph.equations.refusals import AlgebraicLoop, DerivativeCausality, NotLinearUpToLaws
from bondgraph.equations.relation import LawUse, Relation
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.modulation import TIME
from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import CALLED_FROM, NEWTON_STEPS, Law, split
from bondgraph.laws.watching import Gauge
from bondgraph.support.arrays import Array
from bondgraph.support.errors import real_number, require_known
from bondgraph.support.ops import CASADI


@dataclass(frozen=True)
class Compiled:
    """A system that is linear up to scalar laws, with its CasADi functions; `lure_of` makes it.

    Attributes
    ----------
    model : System
        In coordinates in which no store is dependent.
    inputs : tuple of str
        Those of the model, rates of recorded integrals, and ``one`` where there is a constant.
    laws : tuple of LawUse
        The ports: a law that watches a signal is followed by the gauge of that signal.
    observed : tuple of str
        Signals given out after the sensors' readings.
    """

    model: System
    inputs: tuple[str, ...]
    laws: tuple[LawUse, ...]
    observed: tuple[str, ...] = ()

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.model.states

    @property
    def n_x(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def n_u(self) -> int:
        """Number of inputs, pseudo-inputs (``one``, ``ramp``) included."""
        return len(self.inputs)

    @property
    def n_w(self) -> int:
        """Number of laws."""
        return len(self.laws)

    @property
    def n_y(self) -> int:
        """Number of sensor readings (observed signals not counted)."""
        return len(self.model.readings)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters, in the order of the vector `p`."""
        return tuple(self.model.parameters)

    @cached_property
    def law_parameters(self) -> tuple[int, ...]:
        """Positions in `p` of the parameters of all laws, law by law."""
        index = {n: i for i, n in enumerate(self.parameter_names)}
        return tuple(index[n] for port in self.laws for n in port.parameters)

    @cached_property
    def _block(self) -> tuple[ca.SX, ca.SX]:
        """Parameters, and the matrices in them."""
        model, w = self.model, ca.SX.sym("w", self.n_w)
        calls = [w[i] for i, port in enumerate(self.laws) if port.role != "gauge"]
        made = Evaluation(model, calls)
        wanted = [s.rate for s in model.stored] + [port.argument for port in self.laws]
        wanted += [s for _, s, _ in model.readings]
        wanted += [model.called(n) for n in self.observed]
        out = ca.vertcat(*(made.value[n] for n in wanted))
        x, z, u, p = (made.columns[k] for k in "xzup")
        if z.numel():
            residual = ca.vertcat(*made.residuals)
            slope = ca.jacobian(residual, z)
            rest = ca.substitute(residual, z, ca.SX.zeros(*z.shape))
            if ca.sprank(slope) < z.numel():
                raise AlgebraicLoop(
                    f"{model.name}: the linear part of {model.algebraic[0].reason} is singular; "
                    "give its laws a linear part, or put a small inertia beside them"
                )
            out = ca.substitute(out, z, ca.solve(slope, -rest))
        v = ca.vertcat(x, u, w)
        block = ca.densify(ca.jacobian(out, v))
        if self.n_u > u.numel():
            constant = ca.substitute(out, v, ca.SX.zeros(*v.shape))
            at = x.numel() + u.numel()
            block = ca.horzcat(block[:, :at], ca.densify(constant), block[:, at:])
        return p, block

    @cached_property
    def matrices(self) -> ca.Function:
        """``p -> [[A, B, E], [Cs, Ds, Dsw], [Cy, Dy, Dyw]]``."""
        p, block = self._block
        return ca.Function("matrices", [p], [block], ["p"], ["block"])

    @cached_property
    def matrices_jacobian(self) -> ca.Function:
        """Derivative of the column-major block with respect to `p`."""
        p = ca.SX.sym("p", len(self.parameter_names))
        block = ca.vec(self.matrices(p))
        return ca.Function("dmatrices", [p], [ca.densify(ca.jacobian(block, p))])

    def block(self, p: Array) -> Array:
        """Return the numbers of `matrices` at parameters `p`, shape (n_p,)."""
        return _numbers(self.matrices, p)

    def block_by_parameters(self, p: Array) -> Array:
        """Return their derivatives, along a first axis of the parameters."""
        rows, columns = self.matrices.size_out(0)
        moved = _numbers(self.matrices_jacobian, p)
        return moved.T.reshape(-1, columns, rows).swapaxes(1, 2)

    @cached_property
    def showing_states(self) -> Compiled:
        """The model with every state among its outputs."""
        return replace(self, observed=self.states)

    def nominal(self) -> np.ndarray:
        """Parameter vector of the declared values, shape (n_p,)."""
        return np.array([q.value for q in self.model.parameters.values()])

    def vector(self, values: Mapping[str, float]) -> np.ndarray:
        """Parameter vector with some values changed by name."""
        p = self.nominal()
        for name, v in values.items():
            require_known("parameter", self.model.name, self.parameter_names, name)
            p[self.parameter_names.index(name)] = real_number(name, v)
        return p


def _numbers(f: ca.Function, p: Array) -> Array:
    """Return what a function of one vector gives; written where it is wanted, without a copy."""
    out, p = np.zeros(f.numel_out(0)), np.ascontiguousarray(p, float)
    if out.size:
        buffer, run = f.buffer()
        buffer.set_arg(0, p.data)  # type: ignore[call-arg]
        buffer.set_res(0, out.data)  # type: ignore[call-arg]
        run()
    return out.reshape(f.size_out(0), order="F")


def compile_model(graph: BondGraph, observed: Sequence[str] = ()) -> Compiled:
    """Derive and compile `graph`; `observed` signals follow the sensors in the outputs.

    Raises
    ------
    BondsightError
        It has no equations, or they are not linear up to scalar laws; one line says why.
    """
    return replace(lure_of(displaced_equations(graph)), observed=tuple(observed))


def exact_form(model: BondGraph | Compiled, observed: Sequence[str] = ()) -> Compiled | None:
    """Return the exact-step form of a model; None if it needs the general integrator."""
    if isinstance(model, Compiled):
        return model
    found = model.kept(_exact_form)
    return replace(found, observed=tuple(observed)) if found is not None and observed else found


def _exact_form(graph: BondGraph) -> Compiled | None:
    try:
        return compile_model(graph)
    except (AlgebraicLoop, DerivativeCausality, NotLinearUpToLaws):
        return None


def lure_of(model: System) -> Compiled:
    """Return the linear rest of a system without dependent stores, scalar laws around it.

    Raises
    ------
    AlgebraicLoop, NotLinearUpToLaws
        There is none; the message names the element.
    """
    _refuse_products(model)
    laws: list[LawUse] = []
    for use in model.laws:
        laws.append(use)
        for name in use.ports[1:]:
            # a law without output makes the signal known at the end of every step
            beside = model.called(use.law.watched)
            laws.append(LawUse(name, "gauge", Gauge(), beside, 0, ()))
    relations = (*model.relations, *(a.residual for a in model.algebraic))
    read = {s for r in relations for _, s in r.terms} | {use.argument for use in laws}
    read |= {s.rate for s in model.stored} | {s for _, s, _ in model.readings}
    named = {s for r in relations for s in r.reads} - read  # coefficients
    constant = any(r.expression is not None and r.target not in named for r in relations)
    inputs = (*model.inputs, *model.recorded, *(("one",) if constant else ()))
    made = Compiled(model, inputs, tuple(laws))
    if model.algebraic:
        _ = made._block  # refuses a singular one
    return made


def _refuse_products(model: System) -> None:
    """Refuse coefficients and expressions of what moves; named ones of parameters stand still."""
    if extra := [n for n in model.input_rates if n not in model.recorded]:
        why = next(r.reason for r in model.relations if any(s in extra for _, s in r.terms))
        raise NotLinearUpToLaws(
            f"{model.name}: {why.removeprefix('rate read by ')} reads the rate of a signal that "
            f"{extra[0].partition('_')[2]} moves at once; its equations and simulate know it"
        )
    moving = {str(TIME), *model.states, *model.inputs, *model.recorded}
    moving |= {a.name for a in model.algebraic}

    def product(r: Relation) -> bool:
        own = None if r.law is None else model.laws[r.law].argument
        return any(s in moving and s != own for s in r.reads)

    for r in (*model.relations, *(a.residual for a in model.algebraic)):
        if product(r):
            raise NotLinearUpToLaws(
                f"{model.name}: {r.reason} multiplies or transforms signals, so the model is not "
                "linear up to scalar laws; its equations and simulate take it as it is"
            )
        if r.law is not None or not moving.isdisjoint(r.sources):
            moving.add(r.target)


def law_slices(compiled: Compiled) -> tuple[tuple[LawUse, slice, slice], ...]:
    """For each law: the port, its part of the memory, its part of the law parameters."""
    found = []
    m = q = 0
    for port in compiled.laws:
        n_m, n_q = port.law.n_memory, len(port.parameters)
        found.append((port, slice(m, m + n_m), slice(q, q + n_q)))
        m, q = m + n_m, q + n_q
    return tuple(found)


def solve_laws(
    compiled: Compiled,
    free: ca.SX,
    gain: ca.SX,
    memory: ca.SX,
    q: ca.SX,
    w_last: ca.SX,
    step: Any = 0.0,
) -> ca.SX:
    """Deviations that satisfy ``s = free + gain w``, ``w_j = law_j(s_j)``; sweeps if several.

    `q` are the parameters of the laws, law by law; `step` is the time since the memory, s: at 0 the
    memory stands still. All steps are written out; `bondgraph.simulation.lure_march` stops where
    nothing changes any more.
    """
    laws = law_slices(compiled)
    if solved_together(compiled):
        return ca.SX(together(laws, memory, q, step).solved(free, gain, w_last))
    w = w_last if len(laws) else ca.SX(0, 1)
    for _ in range(sweeps(compiled)):
        for j, (port, ms, qs) in enumerate(laws):
            others = others_at(free, gain, w, j)
            w = with_entry(
                w, j, scalar_solution(port, others, gain[j, j], memory[ms], q[qs], w[j], step)
            )
    return w


SWEEPS = 4
"""Over laws that share a loop, where one of them has a formula."""


def sweeps(compiled: Compiled) -> int:
    """Return the sweeps that are always enough."""
    return SWEEPS if _acting(compiled) > 1 else 1


def solved_together(compiled: Compiled) -> bool:
    """Whether Newton's method takes all laws at once: none has a formula of its own."""
    return _acting(compiled) > 1 and not any(port.law.closed for port in compiled.laws)


def _acting(compiled: Compiled) -> int:
    return sum(not isinstance(port.law, Gauge) for port in compiled.laws)


def others_at(free: ca.SX, gain: ca.SX, w: ca.SX, j: int) -> ca.SX:
    """Argument of law `j` without what it adds itself."""
    return free[j] + sum((gain[j, k] * w[k] for k in range(w.numel()) if k != j), ca.SX(0.0))


def with_entry(w: ca.SX, j: int, value: Any) -> ca.SX:
    """Return a column with another entry."""
    entries = ca.vertsplit(w)
    return ca.vertcat(*entries[:j], value, *entries[j + 1 :])


def together(
    laws: tuple[tuple[LawUse, slice, slice], ...], memory: ca.SX, q: ca.SX, step: Any
) -> Iteration:
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

    def newton(s: ca.SX, free: ca.SX, gain: ca.SX) -> ca.SX:
        w, slope = values(s)
        matrix = ca.SX.eye(n) - gain * ca.repmat(slope.T, n, 1)
        return s - ca.solve(matrix, s - free - gain @ w)

    return Iteration(
        lambda free, gain, w_last: free + gain @ w_last,
        newton,
        lambda s: values(s)[0],
        n, n, NEWTON_STEPS,
    )  # fmt: skip


def scalar_solution(
    port: LawUse, free: Any, gain: Any, memory: ca.SX, q: ca.SX, w_last: Any, step: Any
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
