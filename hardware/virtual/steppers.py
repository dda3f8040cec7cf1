"""The two ways to carry a model on, step by step: exact steps, and the general integrator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, final

import numpy as np

from bondgraph.equations.derivation import equations
from bondgraph.equations.program import Program
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.exact_run import prepare, run_record
from bondgraph.simulation.law_rest import law_rest
from bondgraph.simulation.lure import Compiled, exact_form, law_slices
from bondgraph.simulation.start import own_input
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import BondsightError, UnusableInput


class March(Protocol):
    """A model with its state."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the readings."""
        ...

    @property
    def rest(self) -> Array:
        """Readings at the start, ``(n_y,)``."""
        ...

    def advance(self, command: Array) -> Array:
        """Go on by one step per value; returns the readings at their ends, ``(n, n_y)``."""
        ...

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        ...

    def restore(self, state: Any) -> None:
        """Put a state back."""
        ...


def march_of(
    graph: BondGraph, source: str, parameters: Mapping[str, float], step: float, substeps: int
) -> March:
    """Return the way that fits the model."""
    from bondgraph.simulation.radau.jumping import stepping_program

    if (compiled := exact_form(graph)) is not None:
        return ExactMarch(compiled, source, parameters, step, substeps)
    return GeneralMarch(stepping_program(equations(graph)), source, parameters, step, substeps)


def _refuse_rates(name: str, rates: Sequence[str]) -> None:
    if rates:
        raise UnusableInput(
            f"{name}: it needs the rate {', '.join(rates)}, which the steps of a converter do not "
            "have; put the resistance of the lead in series, or give a base by its velocity"
        )


@final
class ExactMarch:
    """Exact steps of the linear part with the laws solved at their ends."""

    def __init__(
        self,
        compiled: Compiled,
        source: str,
        parameters: Mapping[str, float],
        step: float,
        substeps: int,
    ) -> None:
        names = compiled.inputs
        _refuse_rates(compiled.model.name, compiled.model.recorded)
        if ramps := [n for n in names if n != "one" and own_input(n, 1) is not None]:
            raise UnusableInput(
                f"{compiled.model.name}: {', '.join(ramps)} belongs to the length of a record; a "
                "bench has none: leave the drift out"
            )
        p = compiled.vector(parameters)
        still = np.array([1.0 if n == "one" else 0.0 for n in names])
        self._input = names.index(source)
        self._still = still
        ready = prepare(compiled, p, step, substeps)
        self._march, self._substeps = ready.march, substeps
        self.outputs = tuple(n for n, *_ in compiled.model.readings)
        x0 = law_rest(compiled, p, still)
        first = run_record(compiled, p, np.stack([still, still]), step, x0, n_sub=substeps)
        memory = [
            first.memory[port.element] for port, *_ in law_slices(compiled) if port.law.n_memory
        ]
        z = np.concatenate([first.x, first.w[-1], *memory])
        self._z, self._before = z[:, None], still
        self.rest = np.asarray(first.y[-1])

    def advance(self, command: Array) -> Array:
        """Go on by one step per value."""
        u = np.tile(self._still, (command.size * self._substeps, 2, 1))
        u[:, :, self._input] = np.repeat(command, self._substeps)[:, None]
        y, _, self._z = self._march(u, self._z, self._substeps, self._before, False)
        self._before = u[-1, 1] if command.size else self._before
        return np.asarray(y[:, :, 0])

    def snapshot(self) -> Array:
        """Return a copy of the state."""
        return np.concatenate([self._z[:, 0], self._before])

    def restore(self, state: Array) -> None:
        """Put a state back."""
        self._z, self._before = state[: self._z.shape[0], None].copy(), state[self._z.shape[0] :]


@final
class GeneralMarch:
    """Implicit steps of any model in one compiled loop."""

    def __init__(
        self,
        program: Program,
        source: str,
        parameters: Mapping[str, float],
        step: float,
        substeps: int,
    ) -> None:
        from bondgraph.simulation.radau.recorder import recorder
        from bondgraph.simulation.radau.start import rest

        _refuse_rates(program.name, program.input_rates)
        p = program.vector(parameters)
        self._program, self._p = program, p
        self._run = recorder(program)
        self._step, self._substeps = step, substeps
        self._input = program.inputs.index(source)
        self._done = 0
        self.outputs = tuple(program.outputs)
        x, z = rest(program, np.zeros(len(program.inputs)), p)
        self._v, self._m = np.concatenate([x, z]), np.array(program.virgin, float)
        still = self.snapshot()
        self.rest = self.advance(np.zeros(1))[0]
        self.restore(still)

    def advance(self, command: Array) -> Array:
        """Go on by one step per value."""
        from bondgraph.simulation.radau.interpreted import Carried
        from bondgraph.simulation.radau.recorder import Order

        n = command.size
        u = np.zeros((n * self._substeps, 2, len(self._program.inputs)))
        u[:, :, self._input] = np.repeat(command, self._substeps)[:, None]
        time, h = self._done * self._step, self._step / self._substeps
        order = Order(time, h, self._substeps, self._p, (), u[0, 0], u)
        begin = Carried(self._v, self._m, np.zeros((self._v.size, 0)), np.zeros((self._m.size, 0)))
        out = np.full((n + 1, len(self.outputs)), np.nan)
        end, reached = self._run(order, begin, out)
        if reached < n + 1:
            raise BondsightError(
                f"{self._program.name}: no solution {time + reached * self._step:.6g} s after the "
                "start of the bench; a smaller step, more substeps, or a gentler voltage"
            )
        self._v, self._m = end.v, end.m
        self._done += n
        return out[1:]

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return self._v.copy(), self._m.copy(), self._done

    def restore(self, state: Any) -> None:
        """Put a state back."""
        v, m, self._done = state
        self._v, self._m = v.copy(), m.copy()
