"""What a record of any graph asks of an integrator: program, inputs, parameters, start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.equations.codegen import with_signals
from bondgraph.equations.derivation import equations
from bondgraph.equations.program import Program
from bondgraph.equations.relation import FINE
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.exact_run import Memories
from bondgraph.simulation.radau.jumping import stepping_program
from bondgraph.simulation.radau.memory import relaxed_at
from bondgraph.simulation.radau.start import inputs_of, relaxed_rest, unknowns_at
from bondgraph.simulation.start import (
    begun_with,
    checked_commands,
    initial_state,
    state_by_name,
    usual_hold,
)
from bondgraph.support.arrays import Array


@dataclass(frozen=True)
class Posed:
    """A record to be simulated.

    Attributes
    ----------
    program : Program
        With observed signals behind the readings.
    wanted : frozenset of str
        Outputs to be given out.
    columns : list of int
        Outputs that must settle: readings before they are rounded, without a sensor the states.
    u : ndarray, shape (N, n_u), SI
    p : ndarray, shape (n_p,), SI
    step : float
        Between samples, s; the time of the model counts from the first one.
    usual : str
        What inputs do between samples where nobody says.
    """

    program: Program
    wanted: frozenset[str]
    columns: list[int]
    u: Array
    p: Array
    step: float
    usual: str

    def start(self, x0: object, memory: Memories | None) -> tuple[Array, Array, Array]:
        """Return state, algebraic unknowns and memory at the first sample.

        Without `x0` those of rest with inputs at zero, with ``"rest"`` under the first inputs. Laws
        that `memory` does not name are relaxed there, or else at their first arguments.
        """
        q, u = self.program, self.u[0]
        m, kept = q.start_memory(memory)
        if isinstance(x0, Mapping):
            x0 = state_by_name(q.name, x0, q.states)
        if x0 is None or isinstance(x0, str):
            begun = begun_with(q.name, x0, q.inputs, u)
            x, z, m = relaxed_rest(q, begun, self.p, m, kept)
            if np.array_equal(begun, u):
                return x, z, m
            return x, unknowns_at(q, 0.0, x, u, self.p, m), m
        x = initial_state(q.name, x0, q.states)
        return x, *consistent_start(q, 0.0, x, u, self.p, memory)

    def between(self, hold: str | None) -> str:
        """Return what inputs do between samples: as usual, unless it is said."""
        return hold or self.usual

    def outputs(self, y: Array) -> dict[str, Array]:
        """Return the outputs that are wanted by name."""
        return {n: y[:, i] for i, n in enumerate(self.program.outputs) if n in self.wanted}

    def laws(self, y: Array) -> dict[str, tuple[Array, Array]]:
        """Return argument and deviation of the laws that are held, by element."""
        column = self.program.outputs.index
        return {
            element: (y[:, column(s)], y[:, column(w)])
            for element, s, w in held_signals(self.program)
        }


def consistent_start(
    q: Program, time: float, x: Array, u: Array, p: Array, memory: Memories | None
) -> tuple[Array, Array]:
    """Return the algebraic unknowns and the memory of a state `x` at a time (s).

    Laws that `memory` does not name are relaxed at the arguments that they have there.
    """
    m, kept = q.start_memory(memory)
    z = unknowns_at(q, time, x, u, p, m)
    if kept.all():
        return z, m
    m = np.where(kept, m, relaxed_at(q, np.concatenate([x, z]), u, p, m)[0])
    return unknowns_at(q, time, x, u, p, m), m


def held_signals(program: Program) -> tuple[tuple[str, str, str], ...]:
    """Return element, argument and deviation of the laws that are held."""
    calls = [program.laws[i] for i in program.held]
    unknowns = program.algebraic[len(program.algebraic) - len(calls) :]
    return tuple((c.element, str(c.argument), w) for c, w in zip(calls, unknowns, strict=True))


def pose(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None,
    parameters: Mapping[str, float] | None,
    observed: Sequence[str],
) -> Posed:
    """Derive `graph` and put a record on an even grid `time` to it."""
    model = equations(graph)
    program = stepping_program(model)
    fine = {n: f"{FINE}{n}" for n in model.output_names if f"{FINE}{n}" in model.index}
    watched = tuple(fine.get(n, n) for n in model.output_names) or program.states
    more = tuple(n for n in watched if n not in model.output_names)
    held = (name for _, *pair in held_signals(program) for name in pair)
    program = with_signals(program, model, (*more, *observed, *held))
    return Posed(
        program,
        frozenset((*model.output_names, *observed)),
        [program.outputs.index(n) for n in watched],
        inputs_of(program, checked_commands(graph.name, commands, time), time),
        program.vector(parameters or {}),
        float(np.diff(time).mean()),
        usual_hold(graph, program.input_rates),
    )
