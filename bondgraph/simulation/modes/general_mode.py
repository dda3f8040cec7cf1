"""Any other mode: it takes the general step, see `bondgraph.simulation.radau.native`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from bondgraph.equations.codegen import with_signals
from bondgraph.equations.relation import FINE
from bondgraph.simulation.exact_run import Memories
from bondgraph.simulation.modes.inputs import Inputs
from bondgraph.simulation.modes.mode_run import ModeRun, ModeState, Moment, Passage
from bondgraph.simulation.modes.states import Mode
from bondgraph.simulation.posing import consistent_start
from bondgraph.simulation.radau.jumping import stepping_program
from bondgraph.simulation.radau.native import (
    GeneralRun,
    PreparedGeneral,
    inputs_between,
    run_general,
)
from bondgraph.simulation.radau.recorder import functions_of
from bondgraph.simulation.radau.settling import settled_general, unsettled
from bondgraph.simulation.radau.start import (
    evaluated,
    inputs_of,
    least_correction,
    relaxed_rest,
)
from bondgraph.simulation.start import begun_with
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, GraphError


@final
class GeneralMode(ModeRun):
    """Radau IIA; the unknowns of loops go with the state, the time of the model is the record's."""

    def __init__(
        self, mode: Mode, inputs: Inputs, parameters: Mapping[str, float], accuracy: float
    ) -> None:
        program = stepping_program(mode.model)
        shown = mode.model.output_names
        fine = {n: f"{FINE}{n}" for n in shown if f"{FINE}{n}" in mode.model.index}
        more = (*mode.carried, *mode.states, *program.algebraic, *fine.values())
        self.program = with_signals(
            program, mode.model, tuple(n for n in dict.fromkeys(more) if n not in shown)
        )
        super().__init__(mode, inputs, accuracy, self.program.outputs)
        inputs_of(self.program, inputs.commands, inputs.grid)  # refuses what does not fit
        # a rate is that of each sub-step: what stands here is not read
        rates = {n: 0.0 * inputs.grid for n in self.program.input_rates}
        self._filled = replace(inputs, commands=rates | dict(inputs.commands))
        self.p = self.program.vector(parameters)
        # readings settle before they are rounded
        self._settling = [i for n, i in self.columns.items() if n not in fine]
        self._spans = np.zeros(len(self._settling))

    def rest(self) -> tuple[Array, Memories]:
        """Return state and memory of rest."""
        q, u = self.program, self._first(self.inputs.grid[0])
        m, kept = q.start_memory(None)
        try:
            x, _, m = relaxed_rest(q, begun_with(q.name, None, q.inputs, u), self.p, m, kept)
        except BondsightError as error:
            raise GraphError(
                f"{q.name}: no rest with all inputs at zero is found to start from; give all "
                f"states of the first mode in start= ({', '.join(q.states)})"
            ) from error
        return x, q.memory_by_law(m)

    def now(self, time: float, state: ModeState) -> Moment:
        """Solve for what a state leaves open, and read the outputs."""
        q, u, late = self.program, self._first(time), self._late(time)
        z, m = state.z, q.start_memory(state.memory)[0]
        if z is None:
            z, m = consistent_start(q, late, state.x, u, self.p, state.memory)
        state = ModeState(state.x, q.memory_by_law(m), z)
        found = self._reading(late, np.concatenate([state.x, z]), u, self.p, m)
        y, sizes = (np.asarray(a.full()).ravel() for a in found)
        return Moment(y, sizes, state)

    def settled(self, times: Array, state: ModeState) -> Passage:
        """Run until the outputs settle, relative to the range that they have had so far."""
        state = self._complete(float(times[0]), state)
        u, step = self._inputs(times), self._step(times)

        def run_with(n_sub: int) -> GeneralRun:
            return self._run(u, float(times[0]), step, state, n_sub)

        n_sub, run = settled_general(run_with, self._settling, self.accuracy, self._spans)
        if run.reached < times.size:
            if times.size == 2:
                raise unsettled(self.program, run, float(times[0]), step)
            return self.settled(times[: max(run.reached // 2, 2)], state)
        if not run.settled:
            self._warn(n_sub)
        self._spans = np.maximum(self._spans, np.ptp(run.y[:, self._settling], axis=0))
        return _passage(times, run, n_sub)

    def stepped(self, times: Array, step: float, state: ModeState, n_sub: int) -> Passage:
        """Run the compiled step."""
        begin = float(times[0])
        state = self._complete(begin, state)
        run = self._run(self._inputs(times), begin, step, state, n_sub)
        if not run.settled:
            raise unsettled(self.program, run, begin, step)
        return _passage(times, run, n_sub)

    def jumped(self, made: Passage) -> Array | None:
        """Let the unknowns follow the inputs by one step of Newton's method."""
        u = self._inputs(made.times)
        if self.inputs.hold != "hold" or not np.diff(u[:-1], axis=0).any():
            return None
        q, functions = self.program, functions_of(self.program)
        n_x = len(q.states)
        v = made.y[1:-1, [self.columns[n] for n in (*q.states, *q.algebraic)]]
        m = q.start_memory(made.end.memory)[0]
        late = (made.times[1:-1] - self.inputs.grid[0])[:, None]
        at = (u[1:-1], self.p, m, np.zeros(1))
        if q.algebraic:
            value, slope = evaluated(functions.stage, late, v, *at)
            v = v.copy()
            v[:, n_x:] -= least_correction(value[:, n_x:, 0], slope[:, n_x:, n_x:])[0]
        (y,) = evaluated(functions.reading, late, v, *at)
        return np.asarray(y[:, :, 0])

    @cached_property
    def _reading(self) -> ca.Function:
        """``(t, v, u, p, m) -> y``, and the sum of the magnitudes that each is made of."""
        functions = functions_of(self.program)
        arguments = functions.reading.sx_in()[:-1]
        y = functions.reading(*arguments, 0.0)
        moving = ca.vertcat(*arguments[1:3])
        sizes = ca.fabs(ca.jacobian(y, moving)) @ ca.fabs(moving)
        return ca.Function("outputs", arguments, [ca.densify(y), ca.densify(sizes)])

    def _complete(self, time: float, state: ModeState) -> ModeState:
        return state if state.z is not None else self.now(time, state).state

    def _late(self, time: float) -> float:
        """Return the time of the model, s."""
        return float(time - self.inputs.grid[0])

    def _inputs(self, times: Array) -> Array:
        q = self.program
        return self._filled.at(q.name, q.inputs, q.recorded, times)

    def _first(self, time: float) -> Array:
        """Return the inputs from a time on, shape (n_u,), with their rates."""
        step = self.inputs.step
        ready = PreparedGeneral(self.program, self.p, step, 1, (), False, False)
        u = self._inputs(np.array([time, time + step]))
        return np.asarray(inputs_between(ready, u, self.inputs.hold)[0][0])

    def _run(self, u: Array, begin: float, step: float, state: ModeState, n_sub: int) -> GeneralRun:
        # unchecked: a law that jumps is tried, too, for the motion may never reach its jump
        ready = PreparedGeneral(self.program, self.p, step, n_sub, (), False, False)
        return run_general(
            ready, u, state.x, self.inputs.hold,
            memory=state.memory, time=self._late(begin), unknowns=state.z,
        )  # fmt: skip


def _passage(times: Array, run: GeneralRun, n_sub: int) -> Passage:
    return Passage(times, run.y, ModeState(run.x, run.memory, run.z), n_sub)
