"""What a latent signal at any port of the fitted model would do to the readings.

The graph is probed with a source at every port, all derived once; a latent signal is then one run
of the compiled kernel. Linear models are exact by superposition; others are run beside the fitted
trajectory with a small share of the signal.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.fractional_delay import delayed_values
from bondgraph.simulation.dynamics import Dynamics, dynamics_of
from bondgraph.simulation.exact_run import KernelRun
from bondgraph.support.arrays import Array
from identification.diagnosis.screening.latent_input import probed_graph
from identification.diagnosis.screening.observation import channel_number, observed
from identification.estimation.single_record import Fit
from identification.study.factors import drives
from identification.study.problem import Problem
from identification.study.residual import (
    by_step,
    output_delays,
    parameters_at,
    read_out,
    time_memories,
    windows,
)

EARLY = 32
"""Samples before the one input of a linear model's answer: what lags of sensors may reach."""
SILENT = 1e-12
"""Part of the largest answer below which it has died away."""
SMALL = 1e-3
"""Share of the readings' spread that a latent signal may move in a model that is not linear."""


@dataclass(frozen=True, eq=False)
class Probes:
    """The fitted model with a source at every port.

    Attributes
    ----------
    fit : Fit
        The fitted model.
    graph : BondGraph
        The probed graph.
    dynamics : Dynamics
        Its dynamics.
    ports : dict of str to (str, float)
        Source that stands for a latent addition at each element, and the factor on it.
    flows : dict of str to (str, float)
        The same for the other side of two-ports.
    """

    fit: Fit
    graph: BondGraph
    dynamics: Dynamics
    ports: dict[str, tuple[str, float]]
    flows: dict[str, tuple[str, float]]

    @property
    def problem(self) -> Problem:
        """Problem of the fit."""
        return self.fit.problem

    @cached_property
    def _vector(self) -> Array:
        values = dict(zip(
            self.problem.dynamics.parameter_names,
            map(float, parameters_at(self.problem, self.fit.point.theta)), strict=True,
        ))  # fmt: skip
        known = self.dynamics.parameters
        return self.dynamics.vector({n: v for n, v in values.items() if n in known})

    @cached_property
    def _ready(self) -> Callable[[float], Any]:
        return by_step(
            lambda h: self.dynamics.prepare(self._vector, h, self.problem.steps, [], False)
        )

    @cached_property
    def _base_inputs(self) -> Array:
        data = self.problem.data
        extra = {name: np.zeros(data.n) for name in self._sources}
        return self.dynamics.inputs({**data.commands, **extra}, data.time, data.starts)

    @cached_property
    def _sources(self) -> tuple[str, ...]:
        return tuple(n for n, _ in (*self.ports.values(), *self.flows.values()))

    @cached_property
    def _columns(self) -> dict[str, int]:
        """Where each source sits in the inputs, found by moving it."""
        data = self.problem.data
        names = [*self._sources, *(s.name for s in drives(self.problem.graph))]
        short = {n: np.zeros(4) for n in (*names, *data.commands)}
        still = self.dynamics.inputs(short, data.time[:4])
        found = {}
        for n in names:
            moved = self.dynamics.inputs({**short, n: np.ones(4)}, data.time[:4])
            hit = np.flatnonzero(np.abs(moved - still).max(axis=0))
            if hit.size == 1:
                found[n] = int(hit[0])
        return found

    @cached_property
    def _states(self) -> Array:
        """Initial states of the windows in the order of the probed model."""
        names = self.problem.dynamics.state_names
        known = {n: self.fit.point.states[:, i] for i, n in enumerate(names)}
        rows = self.fit.point.states.shape[0]
        return (
            np.stack([known.get(n, np.zeros(rows)) for n in self.dynamics.state_names], axis=1)
            if self.dynamics.n_x
            else np.zeros((rows, 0))
        )

    @cached_property
    def _still(self) -> Array:
        return self._run(self._base_inputs, self._states)

    def _run(self, u: Array, states: Array) -> Array:
        """Return the readings of all windows, shape (N, n_y)."""
        problem = self.problem
        y = np.zeros((problem.data.n, len(problem.data.names)))
        for w, x0 in zip(windows(problem), states, strict=True):
            step = problem.data.step(w)
            run: KernelRun = self.dynamics.run(
                self._ready(step), u[w], x0, self.fine(u[w]), every_substep=bool(problem.delays),
                memory=time_memories(problem, w.start), after=problem.data.reads_after,
            )  # fmt: skip
            theta, stretch = self.fit.point.theta, problem.data.dt / step
            y[w] = read_out(problem, run, theta, derivatives=False, stretch=stretch).y
        return y

    def fine(self, u: Array) -> Array:
        """Return inputs at both ends of each sub-step; additions run straight in any case."""
        steps, hold = self.problem.steps, self.problem.data.between
        made = self.dynamics.fine_inputs(u, steps, hold)
        if hold == "linear":
            return made
        added, made = self._added, made.copy()
        made[:, :, added] = self.dynamics.fine_inputs(u, steps, "linear")[:, :, added]
        return made

    @cached_property
    def _added(self) -> list[int]:
        """Columns of the inputs that are additions, no commands."""
        return [self._columns[n] for n in self._sources if n in self._columns]

    def knows(self, element: str) -> bool:
        """Whether `respond` has an answer for `element`."""
        g = self.problem.graph
        return (
            (element in self.ports and self.ports[element][0] in self._columns)
            or isinstance(g.elements.get(element), Sensor)
            or element in self._columns
        )

    def respond(self, element: str, columns: Array, flow: Array | None = None) -> Array:
        """Return what latent signals at an element change in the readings.

        Parameters
        ----------
        element : str
            Name of an element of the fitted graph.
        columns : ndarray, shape (N, k), SI
            Additions as `identification.diagnosis.catalogue.effect.Signature` describes them.
        flow : ndarray, shape (N, k), optional
            The other side of a two-port.

        Returns
        -------
        ndarray, shape (N, n_y, k)
        """
        problem = self.problem
        n, n_y = problem.data.n, len(problem.data.names)
        out = np.zeros((columns.shape[1], n_y, n)).T  # time is contiguous
        if element in problem.data.names:
            out[:, problem.data.names.index(element)] = columns
            return out
        source, factor = self.ports.get(element, (element, self._before(element)))
        parts = [(self._columns[source], factor, columns)]
        if flow is not None and element in self.flows:
            other, by = self.flows[element]
            parts.append((self._columns[other], by, flow))
        if self.dynamics.exact_step and not problem.clock:
            for at, by, c in parts:
                self._convolved(at, by * c, out)
            return out
        for k in range(columns.shape[1]):
            out[:, :, k] = self._one([(at, by, c[:, k]) for at, by, c in parts])
        return out

    def _before(self, element: str) -> float:
        """Return the factor by which an addition behind the gain of a source is one before it."""
        s = self.problem.graph.elements.get(element)
        gain = channel_number(self.fit, s, "gain") if isinstance(s, Source) else None
        return 1.0 / gain if gain else 1.0

    def observed(
        self, names: Collection[str], driven: Mapping[str, Array]
    ) -> tuple[Array, dict[str, Array]]:
        """Run the model while some of its sources act.

        Parameters
        ----------
        names : collection of str
            Signals to be observed; those that the model does not have are left out.
        driven : mapping of str to ndarray, shape (N,), SI
            What is added by source.

        Returns
        -------
        moved : ndarray, shape (N, n_y)
            What this changes in the readings.
        traces : dict of str to ndarray, shape (N,)
        """
        problem, u = self.problem, self._base_inputs.copy()
        for source, values in driven.items():
            u[:, self._columns[source]] += values
        moved = self._run(u, self._states) - self._still
        states = self._states
        return moved, observed(problem, self.dynamics, self._vector, u, states, names, self.fine)

    def _convolved(self, at: int, columns: Array, out: Array) -> None:
        """Add the response of a linear model, by convolution with its answer to one sample."""
        for w in windows(self.problem):
            n, h = w.stop - w.start, self.problem.data.step(w)
            size = next_fast_len(n + min(n + EARLY, self._answers(at, h).shape[0]), real=True)
            spectrum = rfft(np.ascontiguousarray(columns[w].T), size)
            for c, answer in enumerate(self._spectra(at, h, n, size)):
                out[w, c] += irfft(spectrum * answer, size)[:, EARLY : EARLY + n].T

    def _spectra(self, at: int, h: float, n: int, size: int) -> Array:
        """Return the spectra of `_answers` over `n` samples, shape (n_y, size // 2 + 1)."""
        if (at, h, n) not in self._known_spectra:
            answer = self._answers(at, h)[: n + EARLY]
            made = rfft(np.ascontiguousarray(answer.T), size)
            self._known_spectra[at, h, n] = made
            return np.asarray(made)
        return self._known_spectra[at, h, n]

    def _answers(self, at: int, h: float) -> Array:
        """Return the outputs after one input of 1 at sample `EARLY`, shape (N + EARLY, n_y).

        What comes when all has died away is left out. `h` is the time between samples, s.
        """
        if (at, h) not in self._known:
            problem = self.problem
            longest = max(w.stop - w.start for w in windows(problem))
            u = np.zeros((longest + EARLY, self._base_inputs.shape[1]))
            u[EARLY, at] = 1.0
            n_y = len(problem.data.names)
            straight = at in self._added  # nothing else moves
            fine = (
                self.dynamics.fine_inputs(u, problem.steps, "linear") if straight else self.fine(u)
            )
            run = self.dynamics.run(
                self._ready(h), u, np.zeros(self.dynamics.n_x), fine, after=problem.data.reads_after
            )
            y = run.y[:, :n_y].copy()
            lags = output_delays(problem, self.fit.point.theta) * (problem.data.dt / h)
            for c in np.flatnonzero(lags):
                y[:, c] = delayed_values(np.ascontiguousarray(y[:, c]), float(lags[c]))
            # what is no number stays: who reads it has to see that
            silent = (np.abs(y) <= SILENT * np.abs(y).max(axis=0)).all(axis=1)
            heard = np.flatnonzero(~silent)
            y = y[: max(heard[-1] + 1 if heard.size else 0, EARLY + 1)]
            self._known[at, h] = y
            return y
        return self._known[at, h]

    @cached_property
    def _known(self) -> dict[tuple[int, float], Array]:
        return {}

    @cached_property
    def _known_spectra(self) -> dict[tuple[int, float, int], Array]:
        return {}

    def _one(self, parts: Sequence[tuple[int, float, Array]]) -> Array:
        # twice: the first run tells how large a share keeps the change small
        spread = self.problem.data.readings.std(axis=0) + self.problem.data.floor
        share = 1e-3
        for _ in range(2):
            u = self._base_inputs.copy()
            for at, by, c in parts:
                u[:, at] += share * by * c
            change = (self._run(u, self._states) - self._still) / share
            size = float(np.nanmax(np.abs(change).max(axis=0) / spread, initial=0.0))
            if not np.isfinite(size) or size <= 0 or SMALL / 30 < share * size < 30 * SMALL:
                break
            share = SMALL / size
        return np.asarray(np.nan_to_num(change, posinf=0.0, neginf=0.0))


def probes(fit: Fit, plain: BondGraph | None = None) -> Probes:
    """Probe the fitted model at every storage, resistor, inertia and two-port.

    Parameters
    ----------
    plain : BondGraph, optional
        Probe this graph with the fitted values instead: the model before effects were inserted,
        which is linear where the repaired one is not, and near enough to rank what is left.
    """
    graph = fit.problem.with_chain if plain is None else plain
    known = {n: v for n, v in fit.values.items() if n in graph.parameters}
    probed = probed_graph(graph.with_values(known))
    dynamics = dynamics_of(probed.graph)
    return Probes(fit, probed.graph, dynamics, dict(probed.ports), dict(probed.flows))
