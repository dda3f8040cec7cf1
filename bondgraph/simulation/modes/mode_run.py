"""One mode at given parameters, ready to run over any stretch, whichever step it takes."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bondgraph.simulation.exact_run import Memories
from bondgraph.simulation.modes.inputs import SHORT, Inputs
from bondgraph.simulation.modes.states import Mode
from bondgraph.support.arrays import Array
from bondgraph.support.errors import require_known


@dataclass(frozen=True)
class ModeState:
    """Where a mode stands.

    Attributes
    ----------
    x : ndarray, shape (n_x,)
        In the order of `Mode.states`.
    memory : dict of str to sequence of float
        Of its laws, by element; those that are not there are relaxed where they are first asked.
    z : ndarray, shape (n_z,), optional
        Algebraic unknowns that belong to it, once they are known.
    """

    x: Array
    memory: Memories
    z: Array | None = None


@dataclass(frozen=True)
class Moment:
    """A mode at one time.

    Attributes
    ----------
    y : ndarray, shape (n_y,)
        Outputs, see `ModeRun.columns`.
    sizes : ndarray, shape (n_y,)
        What each is summed of: rounding makes a share of this.
    state : ModeState
    """

    y: Array
    sizes: Array
    state: ModeState


@dataclass(frozen=True)
class Passage:
    """A run of a mode.

    Attributes
    ----------
    times : ndarray, shape (N,), s
    y : ndarray, shape (N, n_y)
    end : ModeState
        At the last time.
    n_sub : int
        Sub-steps from one time to the next.
    """

    times: Array
    y: Array
    end: ModeState
    n_sub: int


class ModeRun(ABC):
    """A mode that runs; abstract.

    Attributes
    ----------
    mode : Mode
    inputs : Inputs
    accuracy : float
        See `bondgraph.simulate`.
    columns : dict of str to int
        Where an output stands: sensors, what guards watch, what is carried over a switch.
    """

    def __init__(
        self, mode: Mode, inputs: Inputs, accuracy: float, outputs: tuple[str, ...]
    ) -> None:
        self.mode, self.inputs, self.accuracy = mode, inputs, accuracy
        self.columns = {n: i for i, n in enumerate(outputs)}
        self._loud = True

    @abstractmethod
    def rest(self) -> tuple[Array, Memories]:
        """Return state and memory of rest with all inputs at zero until the first sample."""

    @abstractmethod
    def now(self, time: float, state: ModeState) -> Moment:
        """Return the outputs in a state at one time (s)."""

    @abstractmethod
    def settled(self, times: Array, state: ModeState) -> Passage:
        """Run along evenly rising times, in as many sub-steps as the accuracy asks for.

        It may end earlier, where the equations have no solution later on.
        """

    @abstractmethod
    def stepped(self, times: Array, step: float, state: ModeState, n_sub: int) -> Passage:
        """Run along times that are `step` (s) apart, in so many sub-steps from one to the next."""

    @abstractmethod
    def jumped(self, made: Passage) -> Array | None:
        """Return the outputs just behind the inner times of a run, shape (N - 2, n_y).

        They differ from those of the run where held inputs jump; None where no output does. This is
        a first look, to some digits.
        """

    def begun(self, start: Mapping[str, float]) -> ModeState:
        """Return the state at the first sample: at rest, but for what is given by name."""
        states = self.mode.states
        require_known("state", f"mode {self.mode.text}", states, *start)
        if start and all(n in start for n in states):
            return ModeState(np.array([float(start[n]) for n in states]), {})
        x, memory = self.rest()
        x = np.array([start.get(n, v) for n, v in zip(states, x, strict=True)], float)
        return ModeState(x, {} if start else memory)  # where states are given, laws relax at these

    def along(self, times: Array, state: ModeState, n_sub: int) -> Passage:
        """Run along evenly rising times."""
        return self.stepped(times, self._step(times), state, n_sub)

    def part(self, begin: float, span: float, rows: int, state: ModeState, n_sub: int) -> Passage:
        """Run over a part of a step: from `begin` for `span` (s), in so many rows."""
        times = begin + np.linspace(0.0, span, rows + 1)
        return self.stepped(times, span / rows, state, n_sub)

    def _step(self, times: Array) -> float:
        step = float((times[-1] - times[0]) / (times.size - 1))
        whole = self.inputs.step
        return whole if abs(step - whole) <= SHORT * whole else step

    def _warn(self, n_sub: int) -> None:
        """Say once that outputs do not settle."""
        if self._loud:
            self._loud = False
            warnings.warn(
                f"{self.mode.name}: at {n_sub} sub-steps a sample the outputs still change by "
                f"more than {self.accuracy:g} of their range; sample faster, or ask for less "
                "accuracy",
                stacklevel=3,
            )
