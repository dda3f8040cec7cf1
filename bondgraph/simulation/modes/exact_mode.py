"""A mode that is linear up to scalar laws: it takes the exact step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, final

import numpy as np

from bondgraph.simulation.exact_run import (
    KernelRun,
    Memories,
    Prepared,
    prepare,
    run_prepared,
    settled_run,
)
from bondgraph.simulation.modes.inputs import Inputs
from bondgraph.simulation.modes.mode_run import ModeRun, ModeState, Moment, Passage
from bondgraph.simulation.modes.states import Mode
from bondgraph.simulation.simulate import require_finite, rested
from bondgraph.simulation.start import inputs_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import require_known

if TYPE_CHECKING:
    from bondgraph.simulation.lure import Compiled


@final
class ExactMode(ModeRun):
    """Exact linear part, implicit laws; its step from sample to sample is discretised once."""

    def __init__(
        self,
        mode: Mode,
        compiled: Compiled,
        inputs: Inputs,
        parameters: Mapping[str, float],
        accuracy: float,
    ) -> None:
        from bondgraph.simulation.first_order_hold import continuous

        super().__init__(mode, inputs, accuracy, (*compiled.model.output_names, *compiled.observed))
        self.compiled = compiled
        require_known("input", compiled.model.name, compiled.inputs, *inputs.commands)
        self.p = compiled.vector(parameters)
        require_finite(compiled, self.p)
        self._matrices = continuous(compiled, self.p)
        self._ready: dict[int, Prepared] = {}

    def rest(self) -> tuple[Array, Memories]:
        """Return state and memory of rest."""
        now = {n: v[:1] for n, v in self.inputs.commands.items()}
        u = inputs_of(self.compiled, now, np.zeros(1))
        x, memory = rested(self.compiled, self.p, u, self.inputs.step, None, None)
        return x, memory or {}

    def now(self, time: float, state: ModeState) -> Moment:
        """Return the first row of a step."""
        u = self._inputs(np.array([time, time + self.inputs.step]))
        run = self._run(u, self.inputs.step, state, 1)
        parts, last = self._matrices.parts, np.concatenate([u[0], run.w[0]])
        sizes = np.abs(parts.cy) @ np.abs(state.x) + np.abs(parts.dy) @ np.abs(last)
        return Moment(run.y[0], sizes, state)

    def settled(self, times: Array, state: ModeState) -> Passage:
        """Run until the outputs settle; a linear mode does at once."""
        u, step = self._inputs(times), self._step(times)

        def run_with(n_sub: int) -> KernelRun:
            return self._run(u, step, state, n_sub)

        hold = self.inputs.hold
        n_sub, run = settled_run(self.compiled, run_with, hold, self.accuracy, loud=True)
        if not run.settled:
            self._warn(n_sub)
        return _passage(times, run, n_sub)

    def stepped(self, times: Array, step: float, state: ModeState, n_sub: int) -> Passage:
        """Run the compiled step."""
        return _passage(times, self._run(self._inputs(times), step, state, n_sub), n_sub)

    def jumped(self, made: Passage) -> Array | None:
        """Add what the jumps of inputs make of outputs at once; laws take no part in it."""
        direct = self._matrices.parts.dy[:, : self.compiled.n_u]
        if self.inputs.hold != "hold" or not direct.any():
            return None
        u = self._inputs(made.times)
        return np.asarray(made.y[1:-1] + np.diff(u[:-1], axis=0) @ direct.T)

    def _inputs(self, times: Array) -> Array:
        model = self.compiled.model
        return self.inputs.at(model.name, self.compiled.inputs, model.recorded, times)

    def _run(self, u: Array, step: float, state: ModeState, n_sub: int) -> KernelRun:
        ready = self._prepared(step, n_sub)
        return run_prepared(ready, u, state.x, self.inputs.hold, memory=state.memory)

    def _prepared(self, step: float, n_sub: int) -> Prepared:
        if n_sub in self._ready and step == self.inputs.step:
            return self._ready[n_sub]
        made = prepare(self.compiled, self.p, step, n_sub, model=self._matrices)
        if step == self.inputs.step:
            self._ready[n_sub] = made
        return made


def _passage(times: Array, run: KernelRun, n_sub: int) -> Passage:
    return Passage(times, run.y, ModeState(run.x, run.memory), n_sub)
