"""Whole records of any `Program` with exact sensitivities, in one compiled call.

The step is Radau IIA with two stages (Hairer and Wanner, Solving Ordinary Differential Equations
II, 1996, sec. IV.5): order 3, L-stable, stiffly accurate, so stiffness asks for nothing and
algebraic unknowns are exact at the end of every step. Memory is constant within a step and
advanced once it is accepted. Newton's method runs in C until its correction vanishes against the
largest value so far of every variable; then the factors solve for the tangents of the stages, by
the implicit function theorem. The interface is that of `prepare` and `run_prepared` in
`bondgraph.simulate`.

Algebra is dense: a step costs of the order of ``(n_x + n_z)^3``, so it is meant for models of up to
some thirty states and unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bondgraph.equations.program import Program
from bondgraph.signals.recorded_rates import with_rates
from bondgraph.simulation.exact_run import KernelRun, Memories
from bondgraph.simulation.halving import Within
from bondgraph.simulation.radau.interpreted import Carried
from bondgraph.simulation.radau.jumping import jumping
from bondgraph.simulation.radau.memory import relaxed_memory
from bondgraph.simulation.radau.recorder import (
    Order,
    located_recorder,
    recorder,
)
from bondgraph.simulation.radau.start import unknowns_at
from bondgraph.simulation.start import fine_inputs, initial_state
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput


@dataclass(frozen=True, kw_only=True)
class GeneralRun(KernelRun):
    """One pass over a record: a `KernelRun` that does not tell laws apart, and more of its end.

    Its ``y`` is NaN from the sample that Newton's method did not reach; it is settled if all were.

    Attributes
    ----------
    z : ndarray, shape (n_z,)
        Algebraic unknowns at the last sample.
    dmemory : ndarray, shape (n_m, n_d)
        Tangents of all memories, in the order of ``Program.memory``.
    reached : int
        Samples that are good, from the first on.
    """

    z: Array
    dmemory: Array
    reached: int


@dataclass(frozen=True)
class PreparedGeneral:
    """A program at one parameter vector, ready to run over any inputs.

    Attributes
    ----------
    program : Program
    p : ndarray, shape (n_p,), SI
    step : float
        Between samples, s.
    n_sub : int
    directions : tuple of int
        Parameters to differentiate by; then come states, then memory if wanted.
    state_directions, memory_directions : bool
    """

    program: Program
    p: Array
    step: float
    n_sub: int
    directions: tuple[int, ...]
    state_directions: bool
    memory_directions: bool

    @property
    def n_p(self) -> int:
        """Directions that are parameters."""
        return len(self.directions)

    @property
    def n_d(self) -> int:
        """All directions."""
        n_x = len(self.program.states) if self.state_directions else 0
        return self.n_p + n_x + (len(self.program.memory) if self.memory_directions else 0)


def prepare_general(
    program: Program,
    p: Array,
    step: float,
    n_sub: int = 1,
    directions: Sequence[int] = (),
    state_directions: bool = False,
    memory_directions: bool = False,
) -> PreparedGeneral:
    """Check a program at parameters `p` (SI, shape (n_p,)) for samples `step` (s) apart.

    Raises
    ------
    UnusableInput
        A law jumps and is not held (`bondgraph.simulation.radau.jumping`), so that Newton's method
        has nothing to go by; or sizes are wrong.
    """
    p = np.array(p, float)
    if p.shape != (len(program.parameters),) or not np.isfinite(p).all():
        raise UnusableInput(
            f"{program.name}: p has shape {p.shape}; it needs {len(program.parameters)} finite "
            f"numbers, one a parameter: {', '.join(program.parameters)}"
        )
    if not (step > 0.0 and np.isfinite(step)) or n_sub < 1:
        raise UnusableInput(f"{program.name}: step = {step!r} s, n_sub = {n_sub!r}; give more")
    wanted = tuple(int(i) for i in directions)
    if any(not 0 <= i < p.size for i in wanted):
        raise UnusableInput(
            f"{program.name}: directions {wanted} are no positions among {p.size} parameters"
        )
    if jumps := jumping(program):
        raise UnusableInput(
            f"{program.name}: {', '.join(jumps)} has a law that jumps, which Newton's method "
            "cannot follow; use LuGre, Sliding or a smooth law there, or a graph that is linear up "
            "to its laws"
        )
    return PreparedGeneral(
        program, p, float(step), int(n_sub), wanted, state_directions, memory_directions
    )


def run_general(
    ready: PreparedGeneral,
    u: Array,
    x0: Array,
    hold: str = "linear",
    fine: Array | None = None,
    *,
    every_substep: bool = False,
    memory: Memories | None = None,
    memory_tangent: Array | None = None,
    relaxed: bool = False,
    time: float = 0.0,
    unknowns: Array | None = None,
    within: Within | None = None,
) -> GeneralRun:
    """Simulate inputs from state `x0` at `time` (s) of the first sample.

    Parameters
    ----------
    u : ndarray, shape (N, n_u)
        At the samples, see `bondgraph.simulation.radau.start.inputs_of`. Rates of inputs are taken
        anew from the ends of each sub-step.
    x0 : ndarray, shape (n_x,)
    hold : {"linear", "hold", "band-limited"}
        What the inputs do between samples, unless `fine` has them, see
        `bondgraph.simulation.start.fine_inputs`.
    fine : ndarray, shape ((N - 1) * n_sub, 2, n_u), optional
        Inputs at both ends of each sub-step.
    every_substep : bool
        Give ``(N - 1) * n_sub + 1`` rows instead of N.
    memory : dict of str to sequence of float, optional
        To start from, by element; that of the program (virgin, at zero) where not given.
    memory_tangent : ndarray, shape (n_m, n_d), optional
        Derivatives of that memory, if it depends on parameters or states.
    relaxed : bool
        Start from laws at rest at their first arguments, as `run_prepared` does, instead of at
        zero; not those in `memory`.
    unknowns : ndarray, shape (n_z,), optional
        Those that belong to `x0`, taken as they are unless there are directions to differentiate
        by; solved for if not given. A state that inputs impose leaves some of them open at the
        start: only then must they be given.
    within : Within, optional
        What unknowns and memories of a step and its halves may differ by: see `located_recorder`.

    Raises
    ------
    UnusableInput
        Wrong shapes, or rates of an input that is held, which jumps between samples.
    """
    q = ready.program
    n_x, n_z, n_m, n_y = len(q.states), len(q.algebraic), len(q.memory), len(q.outputs)
    x0 = initial_state(q.name, x0, q.states)
    u, fine = inputs_between(ready, u, hold, fine)
    m, kept = q.start_memory(memory)
    tv, tm = np.zeros((n_x + n_z, ready.n_d)), np.zeros((n_m, ready.n_d))
    if memory_tangent is not None:
        tm += np.asarray(memory_tangent, float)
    at = ready.n_p
    if ready.state_directions:
        tv[:n_x, at : at + n_x] = np.eye(n_x)
        at += n_x
    if ready.memory_directions:
        tm[:, at:] += np.eye(n_m)
    n_sub = 1 if every_substep else ready.n_sub
    z0 = np.array(q.guess if unknowns is None else unknowns, float)
    begin = Carried(np.concatenate([x0, z0]), m, tv, tm)
    out = np.full((fine.shape[0] // n_sub + 1, n_y * (1 + ready.n_d)), np.nan)
    order = Order(
        time,
        ready.step / ready.n_sub,
        n_sub,
        ready.p,
        ready.directions,
        u[0],
        fine,
        unknowns is not None,
        within,
    )
    if relaxed and not kept.all():
        m_rest, tm_rest = relaxed_memory(q, order, begin)
        m, tm = np.where(kept, m, m_rest), np.where(kept[:, None], tm, tm_rest)
        begin = Carried(begin.v, m, tv, tm)
    record = recorder(q) if within is None else located_recorder(q)
    assert record is not None
    end, reached = record(order, begin, out)
    if reached == 0 and n_z:
        with suppress(BondsightError):  # from farther than plain Newton steps come
            z = unknowns_at(q, time, x0, u[0], ready.p, m)
            begin = Carried(np.concatenate([x0, z]), m, tv, tm)
            end, reached = record(order, begin, out)
    out[reached:] = np.nan
    settled = reached == out.shape[0]
    if not settled:
        end = Carried(*(np.full_like(a, np.nan) for a in (end.v, end.m, end.tv, end.tm)))
    empty = np.zeros((out.shape[0], 0))
    return GeneralRun(
        out[:, :n_y],
        out[:, n_y:].reshape(out.shape[0], n_y, ready.n_d),
        empty,
        empty,
        end.v[:n_x],
        q.memory_by_law(end.m),
        settled,
        end.tv[:n_x],
        z=end.v[n_x:],
        dmemory=end.tm,
        reached=reached,
    )


def inputs_between(
    ready: PreparedGeneral, u: Array, hold: str, fine: Array | None = None
) -> tuple[Array, Array]:
    """Return the inputs at the samples and at the ends of the sub-steps, rates those of these."""
    q = ready.program
    u = np.asarray(u, float)
    if u.ndim != 2 or u.shape[1] != len(q.inputs) or not u.shape[0]:
        raise UnusableInput(
            f"{q.name}: u has shape {u.shape}; it needs (N, {len(q.inputs)}), one column an input: "
            f"{', '.join(q.inputs)}"
        )
    own = fine is None
    fine = fine_inputs(u, ready.n_sub, hold) if fine is None else np.asarray(fine, float)
    if fine.shape != ((u.shape[0] - 1) * ready.n_sub, 2, u.shape[1]):
        raise UnusableInput(
            f"{q.name}: fine has shape {fine.shape}; it needs "
            f"{((u.shape[0] - 1) * ready.n_sub, 2, u.shape[1])}"
        )
    rates = [n for n in q.input_rates if n not in q.recorded]
    if rates and fine.shape[0]:
        if own and hold == "hold":
            raise UnusableInput(
                f"{q.name}: the equations need {', '.join(rates)}, but an input that is "
                "held jumps between samples; use hold='linear' or 'band-limited'"
            )
        u, fine = u.copy(), fine.copy()
        for name in rates:
            column = q.inputs.index(name)
            source = name.partition("_")[2]
            if source in q.inputs and source not in q.input_rates:
                ends = fine[:, :, q.inputs.index(source)]
                fine[:, :, column] = ((ends[:, 1] - ends[:, 0]) * ready.n_sub / ready.step)[:, None]
            else:  # a higher derivative, given: it is that of the piece that begins at the sample
                fine[:, :, column] = np.repeat(u[:-1, column], ready.n_sub)[:, None]
            u[0, column] = fine[0, 0, column]
    u, fine = with_rates(q.inputs, q.recorded, u, fine, ready.step)
    return u, np.ascontiguousarray(fine)
