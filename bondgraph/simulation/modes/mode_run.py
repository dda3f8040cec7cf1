"""One mode at given parameters, ready to run over any stretch."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.signals.recorded_rates import LEAST
from bondgraph.simulation.exact_run import KernelRun, Prepared, prepare, run_prepared, settled_run
from bondgraph.simulation.modes.states import Mode
from bondgraph.simulation.simulate import require_finite
from bondgraph.simulation.start import missing, own_input
from bondgraph.support.arrays import Array
from bondgraph.support.errors import unknown_name

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from bondgraph.simulation.first_order_hold import Blocks

SHORT = 1e-9
"""Share of a sample below which two times are one."""

Signals = Mapping[str, Array]
Memory = Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class Inputs:
    """What all sources do along the record.

    Attributes
    ----------
    grid : ndarray, shape (N,), s
    commands : dict of str to ndarray, shape (N,), SI
    hold : {"hold", "linear"}
    """

    grid: Array
    commands: Signals
    hold: str

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float((self.grid[-1] - self.grid[0]) / (self.grid.size - 1))

    @property
    def slack(self) -> float:
        """Times so close (s) are one."""
        return SHORT * self.step

    def at(self, mode: Mode, times: Array) -> Array:
        """Return the inputs of `mode` at rising times; what is held ends with its last value."""
        compiled = mode.compiled
        index = self._before(times) if self.hold == "hold" else None
        u = np.empty((times.size, compiled.n_u))
        for i, name in enumerate(compiled.inputs):
            way = name.partition("_")[2] if name in compiled.model.recorded else name
            if way != name and way in self._splines:
                u[:, i] = self._splines[way](times, 1)
            elif f"d_{name}" in compiled.model.recorded and name in self._splines:
                u[:, i] = self._splines[name](times)
            else:
                values = self._values(compiled.model.name, name)
                u[:, i] = np.interp(times, self.grid, values) if index is None else values[index]
        return u

    def _values(self, model: str, name: str) -> Array:
        """Return an input at the samples; a sensor drifts along the whole record, not a piece."""
        values = self.commands.get(name, own_input(name, self.grid.size))
        if values is None:
            raise missing(model, name, self.commands)
        return values

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        """Splines through commands, of which the rates of recorded integrals are the slopes."""
        from scipy.interpolate import CubicSpline

        if self.grid.size < LEAST:
            return {}
        return {n: CubicSpline(self.grid, v) for n, v in self.commands.items()}

    def _before(self, times: Array) -> Array:
        """Return the samples whose values are held at rising times."""
        index = np.searchsorted(self.grid, times + self.slack, side="right") - 1
        index[-1] = max(index[0], np.searchsorted(self.grid, times[-1] - self.slack) - 1)
        return np.clip(index, 0, None)


class ModeRun:
    """A mode at parameters; its step from sample to sample is discretised once."""

    def __init__(
        self, mode: Mode, inputs: Inputs, parameters: Mapping[str, float], accuracy: float
    ) -> None:
        from bondgraph.simulation.first_order_hold import continuous

        self.mode, self.inputs, self.accuracy = mode, inputs, accuracy
        compiled = mode.compiled
        for name in inputs.commands:
            if name not in compiled.inputs:
                raise unknown_name("input", name, compiled.model.name, compiled.inputs)
        self.p = compiled.vector(parameters)
        require_finite(compiled, self.p)
        self._matrices = continuous(compiled, self.p)
        self._ready: dict[int, Prepared] = {}
        self._loud = True
        self.columns = {
            n: i for i, n in enumerate((*compiled.model.output_names, *compiled.observed))
        }

    @property
    def parts(self) -> Blocks:
        """The continuous matrices."""
        return self._matrices.parts

    def settled(self, times: Array, x: Array, memory: Memory) -> tuple[Array, int, KernelRun]:
        """Run along evenly rising times; returns inputs, sub-steps and the run."""
        u, step = self.inputs.at(self.mode, times), self._step(times)

        def run_with(n_sub: int) -> KernelRun:
            return self.run(u, step, x, memory, n_sub)

        compiled = self.mode.compiled
        n_sub, run = settled_run(compiled, run_with, self.inputs.hold, self.accuracy, loud=True)
        if not run.settled and self._loud:
            self._loud = False
            warnings.warn(
                f"{compiled.model.name}: at {n_sub} sub-steps a sample the outputs still change by "
                f"more than {self.accuracy:g} of their range; sample faster, or ask for less "
                "accuracy",
                stacklevel=2,
            )
        return u, n_sub, run

    def run(self, u: Array, step: float, x: Array, memory: Memory, n_sub: int = 1) -> KernelRun:
        """Run over inputs `u`, shape (N, n_u), `step` (s) apart."""
        own = {n: m for n, m in memory.items() if n in self.mode.remembering}
        return run_prepared(self._prepared(step, n_sub), u, x, self.inputs.hold, memory=own)

    def now(self, time: float, x: Array, memory: Memory) -> KernelRun:
        """Return the outputs in a state at one time, in the first row."""
        u = self.inputs.at(self.mode, np.array([time, time + self.inputs.step]))
        return self.run(u, self.inputs.step, x, memory)

    def _prepared(self, step: float, n_sub: int) -> Prepared:
        if n_sub in self._ready and step == self.inputs.step:
            return self._ready[n_sub]
        made = prepare(self.mode.compiled, self.p, step, n_sub, model=self._matrices)
        if step == self.inputs.step:
            self._ready[n_sub] = made
        return made

    def _step(self, times: Array) -> float:
        step = float((times[-1] - times[0]) / (times.size - 1))
        whole = self.inputs.step
        return whole if abs(step - whole) <= SHORT * whole else step
