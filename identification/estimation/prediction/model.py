"""A model with process noise, its recordings, and the numbers that are fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Parameter
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.simulation.start import equilibrium, fine_inputs, inputs_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.estimation.prediction.scaling import state_scale
from identification.estimation.prediction.slots import Diffusion, FilterSlots
from identification.study.problem import Data
from identification.study.scaled import Free, free_parameter

SMALLEST = 1e-7
"""Diffusion, against the one that alone explains the spread of its state, that counts as none."""

INITIAL = ("free", "wide", "rest")


@dataclass(frozen=True)
class PredictionModel:
    """A bond graph whose states are disturbed, seen through noisy readings.

    Attributes
    ----------
    graph : BondGraph
        Linear up to scalar laws.
    records : tuple of Data
        Only samples of the training part count; a reading that is not finite is missing.
    diffusion : tuple of str
        Where process noise enters: a state (``p_M``), the element that holds it (``M``), or a
        source (``F``: a random force where the command acts).
    starts : dict of str to float
        Start values of parameters that differ from the nominal ones.
    fixed : tuple of str
        Parameters that are not fitted beside those the graph declares as fixed.
    sigma : dict of str to float
        Start values of diffusions, SI; otherwise the one that over a record walks as far as the
        state moves.
    noise : dict of str to float
        Standard deviations of readings that are known, SI; the others are estimated from the
        recording's floor.
    initial : {"free", "wide", "rest"} or dict of str to float
        The state at the first sample: estimated; Gaussian about rest, ten spreads wide; at rest;
        or known by name (SI) and the others estimated.
    offsets : bool
        Estimate an offset for every reading of every record.
    priors : dict of str to tuple of float
        Centre (as theta) and weight (one over its standard deviation) of parameters that have a
        prior; a weak one holds the others.
    overrides : dict of str to Parameter
        Parameters with other bounds and scales than the graph declares.
    n_sub : int
        Sub-steps of a sample, for nonlinear laws.
    """

    graph: BondGraph
    records: tuple[Data, ...]
    diffusion: tuple[str, ...] = ()
    starts: Mapping[str, float] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    sigma: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    initial: str | Mapping[str, float] = "free"
    offsets: bool = False
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    overrides: Mapping[str, Parameter] = field(default_factory=dict)
    n_sub: int = 1

    def __post_init__(self) -> None:
        """Check names once; the rest follows from them."""
        if not self.records:
            raise UnusableInput(f"{self.graph.name}: no recording is given; give at least one")
        if isinstance(self.initial, str) and self.initial not in INITIAL:
            raise unknown_name("initial state", self.initial, self.graph.name, INITIAL)
        for names, known, kind in (
            (self.sigma, self.diffusion, "diffusion"),
            (self.noise, self.names, "reading"),
            (self.starts, self.compiled.parameter_names, "parameter"),
            (self.priors, self.compiled.parameter_names, "parameter"),
            (self.fixed, self.compiled.parameter_names, "parameter"),
            (self.overrides, self.compiled.parameter_names, "parameter"),
        ):
            for n in names:
                if n not in known:
                    raise unknown_name(kind, n, self.graph.name, known)
        if isinstance(self.initial, Mapping):
            for n in self.initial:
                if n not in self.state_names:
                    raise unknown_name("state", n, self.graph.name, self.state_names)
        for r in self.records:
            if r.names != self.names:
                raise UnusableInput(
                    f"{r.name} reads {', '.join(r.names)}, the model {', '.join(self.names)}; "
                    "bring the sensors in the model's order"
                )
        seen = [np.isfinite(r.readings[r.mask("train")]).any(axis=0) for r in self.records]
        for n, some in zip(self.names, np.any(seen, axis=0), strict=True):
            if not some:
                raise UnusableInput(f"{n} has no finite sample in the training part of any record")
        _ = self.diffusions

    def __getstate__(self) -> dict[str, object]:
        """Only the fields travel to other processes; compiled functions are rebuilt there."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled model."""
        return compile_model(self.graph)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the readings."""
        return self.compiled.space.output_names

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(str(s.symbol) for s in self.compiled.space.states)

    @cached_property
    def free(self) -> tuple[Free, ...]:
        """Fitted model parameters, in the order of the compiled vector."""
        known = {n: self.overrides.get(n, p) for n, p in self.compiled.space.parameters.items()}
        return tuple(
            free_parameter(p, self.starts.get(n))
            for n, p in known.items()
            if not p.fixed and n not in self.fixed
        )

    @cached_property
    def diffusions(self) -> tuple[Diffusion, ...]:
        """The diffusions by place."""
        return tuple(self._diffusion(n) for n in self.diffusion)

    def _diffusion(self, place: str) -> Diffusion:
        states = self.compiled.space.states
        for i, s in enumerate(states):
            if place in (str(s.symbol), s.element):
                return Diffusion(place, i, False, f"{s.unit or 'SI'}/s^0.5")
        inputs = self.compiled.space.input_names
        if place in inputs:
            unit = str(getattr(self.graph[place], "unit", "") or "1")
            return Diffusion(place, inputs.index(place), True, f"{unit}*s^0.5")
        known = [*self.state_names, *(s.element for s in states), *inputs]
        raise unknown_name("place for process noise", place, self.graph.name, known)

    @cached_property
    def estimated_noise(self) -> tuple[int, ...]:
        """Positions of readings whose noise is estimated."""
        return tuple(i for i, n in enumerate(self.names) if n not in self.noise)

    @cached_property
    def slots(self) -> FilterSlots:
        """Layout of theta."""
        return FilterSlots(
            len(self.free),
            len(self.diffusions),
            len(self.estimated_noise),
            len(self.names) if self.offsets else 0,
            0 if self.initial in ("rest", "wide") else self.compiled.n_x,
            len(self.records),
        )

    @cached_property
    def start_vector(self) -> Array:
        """Parameter vector with the start values, shape (n_p,)."""
        return self.compiled.vector(dict(self.starts))

    @cached_property
    def inputs(self) -> tuple[Array, ...]:
        """Inputs of each record at its samples, shape (N, n_u)."""
        return tuple(inputs_of(self.compiled, r.commands, r.n) for r in self.records)

    @cached_property
    def fine(self) -> tuple[Array, ...]:
        """Inputs at both ends of each sub-step, the first sample held before it."""
        found = []
        for u, r in zip(self.inputs, self.records, strict=True):
            before = np.broadcast_to(u[0], (self.n_sub, 2, u.shape[1]))
            found.append(np.concatenate([before, fine_inputs(u, self.n_sub, r.hold)]))
        return tuple(found)

    @cached_property
    def rest(self) -> tuple[Array, ...]:
        """Equilibrium of each record at its first inputs and the start values; known states."""
        found = [equilibrium(self.compiled, self.start_vector, u[0]) for u in self.inputs]
        for i, n in enumerate(self.state_names):
            if isinstance(self.initial, Mapping) and n in self.initial:
                for x in found:
                    x[i] = float(self.initial[n])
        return tuple(found)

    @cached_property
    def reading_scale(self) -> Array:
        """Spread of each reading, shape (n_y,); its noise where it does not move."""
        spread = np.zeros(len(self.names))
        for r in self.records:
            seen = np.where(np.isfinite(r.readings), r.readings, np.nan)
            for j, column in enumerate(seen[r.mask("train")].T):
                if np.isfinite(column).any():
                    spread[j] = max(spread[j], float(np.nanstd(column)))
        floor = np.max([r.floor for r in self.records], axis=0)
        return np.where(spread > 0, spread, np.where(floor > 0, floor, 1.0))

    @cached_property
    def state_scale(self) -> Array:
        """Size of each state, shape (n_x,)."""
        return state_scale(
            self.compiled, self.start_vector, self.inputs, self.records, self.reading_scale
        )

    @cached_property
    def feedthrough(self) -> bool:
        """Whether a reading contains the deviation of a law."""
        block = np.asarray(self.compiled.matrices(self.start_vector).full())
        dy = blocks(self.compiled, block).dy
        return bool(np.any(dy[:, self.compiled.n_u :]))

    @cached_property
    def sigma_reference(self) -> Array:
        """Diffusion that over the longest record walks as far as its states move."""
        duration = max(r.dt * max(r.n - 1, 1) for r in self.records)
        block = np.asarray(self.compiled.matrices(self.start_vector).full())
        b = np.abs(blocks(self.compiled, block).b)
        found = []
        for d in self.diffusions:
            reach = self.state_scale[d.index]
            if d.at_source:
                acts = b[:, d.index] > 0
                reach = (self.state_scale[acts] / b[acts, d.index]).min() if acts.any() else 1.0
            found.append(reach / np.sqrt(duration))
        return np.array(found)

    def start(self) -> Array:
        """Theta of the start values."""
        at, theta = self.slots, np.zeros(self.slots.size)
        usual = self.sigma_reference
        given = [self.sigma.get(d.place, s) for d, s in zip(self.diffusions, usual, strict=True)]
        theta[at.sigma] = np.log(np.maximum(given, SMALLEST * usual))
        floor = np.max([r.floor for r in self.records], axis=0)
        level = np.where(floor > 0, floor, 0.05 * self.reading_scale)
        theta[at.noise] = np.log(level[list(self.estimated_noise)])
        lower, upper = self.bounds()
        return np.clip(theta, lower, upper)

    def bounds(self) -> tuple[Array, Array]:
        """Bounds on theta."""
        at = self.slots
        lower, upper = np.full(at.size, -np.inf), np.full(at.size, np.inf)
        for i, f in enumerate(self.free):
            lower[i], upper[i] = f.bounds()
        shortest = min(r.dt for r in self.records)
        duration = max(r.dt * max(r.n - 1, 1) for r in self.records)
        most = 100.0 * np.sqrt(duration / shortest)
        lower[at.sigma] = np.log(SMALLEST * self.sigma_reference)
        upper[at.sigma] = np.log(most * self.sigma_reference)
        scale = self.reading_scale[list(self.estimated_noise)]
        lower[at.noise], upper[at.noise] = np.log(1e-6 * scale), np.log(10.0 * scale)
        if isinstance(self.initial, Mapping):
            known = [n in self.initial for n in self.state_names]
            for r in range(at.n_records):
                lower[at.states(r)] = np.where(known, 0.0, -np.inf)
                upper[at.states(r)] = np.where(known, 0.0, np.inf)
        return lower, upper

    def vector(self, theta: Array) -> Array:
        """Parameter vector, SI, shape (n_p,)."""
        p, names = self.start_vector.copy(), self.compiled.parameter_names
        for f, t in zip(self.free, theta, strict=False):
            p[names.index(f.parameter.name)] = f.value(float(t))
        return p
