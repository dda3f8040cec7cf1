"""The Kalman filter of a study: its records, process noise, and the numbers that are fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName
from identification.estimation.prediction.plant import FilterPlant, plant_of
from identification.estimation.prediction.scaling import state_scale
from identification.estimation.prediction.slots import FilterSlots
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Problem
from identification.study.process_noise import Diffusion, diffusion_at
from identification.study.residual import offset_scale, parameters_at, slots, start_point
from identification.study.study import SettledSetting, Study

SMALLEST = 1e-7
"""Diffusion, against the one that alone explains the spread of its state, that counts as none."""


@dataclass(frozen=True, eq=False)
class KalmanFilter:
    """A study seen through a filter; see `kalman_filter`.

    Attributes
    ----------
    stack : JointProblem
        A reading that is not finite is missing; only samples of the training parts count.
    floors : tuple of ndarray, shape (n_y,) each
        Noise of the readings, SI, record by record: where known, and to start from.
    sigma : dict of str to (float or None)
        Places of process noise with their start values; None: what over a record walks as far as
        the state moves.
    n_sub : int
        Sub-steps of a sample.
    """

    study: Study
    stack: JointProblem
    floors: tuple[Array, ...]
    sigma: Mapping[str, float | None]
    n_sub: int = 1

    @property
    def problems(self) -> tuple[Problem, ...]:
        """One a record."""
        return self.stack.problems

    @property
    def first(self) -> Problem:
        """The first record's."""
        return self.problems[0]

    @cached_property
    def plants(self) -> tuple[FilterPlant, ...]:
        """What the filter needs to know of each record's model."""
        return tuple(plant_of(p.dynamics) for p in self.problems)

    @property
    def coarse(self) -> bool:
        """Whether sub-steps change something: laws that bend, or a step that is not exact."""
        laws = [law for _, law in self.plants[0].laws]
        return self.first.dynamics.lure is None or any(not law.slides_level for law in laws)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the readings of all records."""
        return tuple(dict.fromkeys(n for p in self.problems for n in p.data.names))

    @cached_property
    def estimated(self) -> tuple[str, ...]:
        """Readings whose noise is estimated."""
        known = () if isinstance(self.study.noise, str) else self.study.noise
        return tuple(n for n in self.names if n not in known)

    def diffusions(self, record: int = 0) -> tuple[Diffusion | None, ...]:
        """Return the diffusions by place; None for a state of a sensor that the record lacks."""
        p = self.problems[record]
        found: list[Diffusion | None] = []
        for place in self.sigma:
            try:
                found.append(diffusion_at(p.dynamics, self.study.graph, place))
            except UnknownName:
                if not record:
                    raise
                found.append(None)
        return tuple(found)

    @cached_property
    def slots(self) -> FilterSlots:
        """Layout of theta."""
        states = tuple(0 if p.initial == "rest" else p.dynamics.n_x for p in self.problems)
        return FilterSlots(self.stack.n, len(self.sigma), len(self.estimated), states)

    def local(self, theta: Array, record: int) -> Array:
        """Return the record's own unknowns of the joint problem."""
        return np.asarray(theta[self.stack.columns[record]] * self.stack.factors[record])

    def initial(self, theta: Array, record: int) -> Array:
        """Return the state that a record starts from, SI, shape (n_x,)."""
        p = self.problems[record]
        if p.initial == "rest":
            return p.dynamics.rest(parameters_at(p, self.local(theta, record)), p.inputs[0])
        x0 = self.rest[record]
        if self.slots.n_states[record]:
            x0 = x0 + theta[self.slots.states(record)] * self.state_scale[record]
        return x0

    @cached_property
    def fine(self) -> tuple[Array, ...]:
        """Inputs at both ends of each sub-step, the first sample held before it."""
        found = []
        for p, plant in zip(self.problems, self.plants, strict=True):
            between = plant.fine(p.inputs, self.n_sub, p.data.dt, p.data.between)
            before = np.broadcast_to(between[0, 0], (self.n_sub, 2, between.shape[2]))
            found.append(np.concatenate([before, between]))
        return tuple(found)

    @cached_property
    def rest(self) -> tuple[Array, ...]:
        """Equilibrium of each record at its first inputs and the start values; known states."""
        return tuple(start_point(p).states[0] for p in self.problems)

    @cached_property
    def reading_spread(self) -> dict[str, float]:
        """Spread of each reading by name; its noise where it is still."""
        spread = dict.fromkeys(self.names, 0.0)
        for p in self.problems:
            for n, column in zip(
                p.data.names, p.data.readings[p.data.mask("train")].T, strict=True
            ):
                seen = column[np.isfinite(column)]
                spread[n] = max(spread[n], float(np.std(seen)) if seen.size else 0.0)
        return {n: s or self.level(n) or 1.0 for n, s in spread.items()}

    def reading_scale(self, record: int) -> Array:
        """Spread of the readings of one record in all of them, shape (n_y,)."""
        return np.array([self.reading_spread[n] for n in self.problems[record].data.names])

    def offsets(self, theta: Array, record: int) -> Array:
        """Return what the sensors of a record add, SI, shape (n_y,)."""
        problem = self.problems[record]
        return np.asarray(self.local(theta, record)[slots(problem).offsets] * offset_scale(problem))

    def level(self, name: str) -> float:
        """Largest noise floor of a reading, SI."""
        return max(
            float(floor[p.data.names.index(name)])
            for p, floor in zip(self.problems, self.floors, strict=True)
            if name in p.data.names
        )

    @cached_property
    def state_scale(self) -> tuple[Array, ...]:
        """Size of each state, shape (n_x,), record by record."""
        each = []
        for r, p in enumerate(self.problems):
            sizes = state_scale(p, self.reading_scale(r))
            each.append(dict(zip(p.dynamics.state_names, sizes, strict=True)))
        return tuple(np.array([max(e.get(n, 0.0) for e in each) for n in own]) for own in each)

    @property
    def duration(self) -> float:
        """Of the longest record, s."""
        return max(p.data.dt * max(p.data.n - 1, 1) for p in self.problems)

    @cached_property
    def sigma_reference(self) -> Array:
        """Diffusion that over the longest record walks as far as its states move."""
        p, scale, found = self.first, self.state_scale[0], []
        b = np.abs(p.dynamics.small_signal(p.start_vector, p.inputs[0]).b)
        for d in self.diffusions():
            assert d is not None
            reach = scale[d.index]
            if d.at_source:
                acts = b[:, d.index] > 0
                reach = (scale[acts] / b[acts, d.index]).min() if acts.any() else 1.0
            found.append(reach / np.sqrt(self.duration))
        return np.array(found)

    def start(self, begin: JointPoint | None = None) -> Array:
        """Theta of the start values, or of where another fit stands."""
        at, theta = self.slots, np.zeros(self.slots.size)
        begin = self.stack.start() if begin is None else begin
        theta[at.joint] = begin.theta
        given = [
            s or usual for s, usual in zip(self.sigma.values(), self.sigma_reference, strict=True)
        ]
        theta[at.sigma] = np.log(np.maximum(given, SMALLEST * self.sigma_reference))
        levels = [self.level(n) or 0.05 * self.reading_spread[n] for n in self.estimated]
        theta[at.noise] = np.log(levels)
        for r, states in enumerate(begin.states):
            if at.n_states[r] and np.isfinite(states[0]).all():
                theta[at.states(r)] = (states[0] - self.rest[r]) / self.state_scale[r]
        return np.clip(theta, *self.bounds)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds on theta; lags, which a filter does not know, and known states stay at zero."""
        at = self.slots
        lower, upper = np.full(at.size, -np.inf), np.full(at.size, np.inf)
        lower[at.joint], upper[at.joint] = self.stack.bounds
        for p, columns in zip(self.problems, self.stack.columns, strict=True):
            lower[columns[slots(p).lags]] = upper[columns[slots(p).lags]] = 0.0
        shortest = min(p.data.dt for p in self.problems)
        most = 100.0 * np.sqrt(self.duration / shortest)
        lower[at.sigma] = np.log(SMALLEST * self.sigma_reference)
        upper[at.sigma] = np.log(most * self.sigma_reference)
        scale = np.array([self.reading_spread[n] for n in self.estimated])
        lower[at.noise], upper[at.noise] = np.log(1e-6 * scale), np.log(10.0 * scale)
        for r, p in enumerate(self.problems):
            if at.n_states[r]:
                known = np.setdiff1d(np.arange(p.dynamics.n_x), p.free_states) + at.states(r).start
                lower[known] = upper[known] = 0.0
        return lower, upper


def kalman_filter(
    study: Study, setting: SettledSetting | None = None, stack: JointProblem | None = None
) -> KalmanFilter:
    """Return the filter of a study; process noise at every state if it names no place.

    Parameters
    ----------
    stack : JointProblem, optional
        ``study.stack(setting)``.
    """
    fresh = study.first_setting
    setting = fresh if setting is None else setting
    stack = study.stack(setting) if stack is None else stack
    dynamics, given = stack.problems[0].dynamics, study.process_noise
    places = dynamics.state_names if given is None else given
    sigma = {n: given[n] if isinstance(given, Mapping) else None for n in places}
    made = KalmanFilter(study, stack, fresh.floors[: len(stack.problems)], sigma)
    n_sub = max(*setting.n_sub, 2 if made.coarse and study.n_sub is None else 1)
    return replace(made, n_sub=n_sub)
