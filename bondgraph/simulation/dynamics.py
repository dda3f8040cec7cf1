"""What runs a model over a record with derivatives: the exact step, or the general one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np

from bondgraph.equations.program import FunctionNames, Program
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.simulation.exact_run import KernelRun, Memories, prepare, run_prepared
from bondgraph.simulation.first_order_hold import Blocks, blocks, continuous
from bondgraph.simulation.law_rest import law_rest
from bondgraph.simulation.located import DifferenceSteps, followed
from bondgraph.simulation.lure import Compiled, exact_form
from bondgraph.simulation.radau.native import PreparedGeneral, prepare_general, run_general
from bondgraph.simulation.radau.start import evaluated, relaxed_rest
from bondgraph.simulation.radau.start import inputs_of as general_inputs
from bondgraph.simulation.small_signal import SmallSignal, of_program, slopes_of_program
from bondgraph.simulation.start import fine_inputs, inputs_of, own_input
from bondgraph.support.arrays import Array, ComplexArray
from bondgraph.support.errors import BondsightError

STRETCHES = 200


class Dynamics(ABC):
    """A compiled model that fits can run; abstract.

    Parameters enter as vectors in the order of `parameter_names`, states in that of `state_names`.
    """

    @property
    @abstractmethod
    def names(self) -> FunctionNames:
        """Names of states, inputs, parameters and readings, in the order of their vectors."""

    @property
    @abstractmethod
    def parameters(self) -> Mapping[str, Parameter]:
        """Declared parameters, in order."""

    @property
    def lure(self) -> Compiled | None:
        """Linear rest with scalar laws, None where the model is not of that form."""
        return None

    @property
    def implicit(self) -> Program | None:
        """Program of the general step, None where the exact one runs."""
        return None

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.names.name

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs, rates and pseudo-inputs among them."""
        return self.names.inputs

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the readings, in their order."""
        return self.names.outputs

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.names.states

    @property
    def input_rates(self) -> tuple[str, ...]:
        """The inputs that are time derivatives of others."""
        return self.names.input_rates

    @property
    def commands(self) -> tuple[str, ...]:
        """The inputs that somebody can choose."""
        own = {n for n in self.input_names if own_input(n, 1) is not None}
        return tuple(n for n in self.input_names if n not in {*own, *self.input_rates})

    def vector(self, values: Mapping[str, float]) -> Array:
        """Parameter vector with some values changed by name."""
        return self.names.vector(values)

    @abstractmethod
    def inputs(
        self, commands: Mapping[str, Array], time: Array, breaks: Sequence[int] = ()
    ) -> Array:
        """Input matrix, shape (N, n_u); other recordings begin at `breaks`."""

    def fine_inputs(self, u: Array, n_sub: int, hold: str) -> Array:
        """Return the inputs at both ends of each sub-step, shape ((N - 1) n_sub, 2, n_u)."""
        return fine_inputs(u, n_sub, hold)

    @abstractmethod
    def at_rest(self, p: Array, u: Array) -> Array:
        """State at rest under constant inputs `u`, shape (n_u,); an error where none is found."""

    def rest(self, p: Array, u: Array) -> Array:
        """State at rest under constant inputs `u`, shape (n_u,); the declared start without one."""
        return self.at_rest(p, u)

    def prepare(
        self, p: Array, step: float, n_sub: int, directions: Sequence[int], states: bool
    ) -> Any:
        """Make ready to run at one parameter vector; `states`: differentiate by the start too."""
        return self._prepare(p, step, n_sub, directions, states)

    @property
    @abstractmethod
    def _prepare(self) -> Callable[..., Any]: ...

    def run(
        self,
        ready: Any,
        u: Array,
        x0: Array,
        fine: Array,
        *,
        every_substep: bool = False,
        memory: Memories | None = None,
        after: bool = False,
    ) -> KernelRun:
        """Run over inputs `u` (N, n_u) with their sub-step values `fine`, from `memory`.

        Outputs are taken before inputs jump at a sample, or `after`; in a general model what jumps
        with them is then that of small motions about the rest.
        """
        return self._run(
            ready, u, x0, fine=fine, every_substep=every_substep, memory=memory, after=after
        )

    @abstractmethod
    def _run(self, ready: Any, u: Array, x0: Array, **options: Any) -> KernelRun: ...

    def followed(
        self,
        p: Array,
        u: Array,
        step: float,
        x0: Array,
        hold: str,
        memory: Memories | None,
        seen: KernelRun,
        reach: DifferenceSteps | None = None,
        accuracy: float = 1e-6,
        *,
        after: bool = False,
    ) -> tuple[Array, Array] | None:
        """Return readings followed to where laws jump, (N, n_y), and derivatives within `reach`.

        None where no law of the exact form jumps, or they do not settle soon; `seen` is a run in
        whole steps, `accuracy` over the range of the readings.
        """
        if self.lure is None or not self.jumps or not np.isfinite(seen.s).all():
            return None
        return followed(self.lure, p, u, step, x0, hold, memory, seen, reach, accuracy, after=after)

    @abstractmethod
    def spreads(self, p: Array, u: Array, step: float, x0: Array, n_sub: int, hold: str) -> Array:
        """Spread of each state in a simulation, shape (n_x,)."""

    @abstractmethod
    def small_signal(self, p: Array, u: Array) -> SmallSignal:
        """Return the model about its rest under inputs `u`; a stack for p of shape (S, n_p)."""

    @abstractmethod
    def small_signal_slopes(
        self, p: Array, u: Array, wanted: Sequence[int]
    ) -> Sequence[SmallSignal]:
        """Return the exact derivatives of `small_signal`, how the rest moves included."""

    def drive(self, commands: Sequence[str], s: ComplexArray) -> ComplexArray:
        """Return the inputs for one command ``exp(s t)`` each, rates too, (F, n_u, n_m)."""
        made = np.zeros((s.size, len(self.input_names), len(commands)), complex)
        for k, command in enumerate(commands):
            made[:, self.input_names.index(command), k] = 1.0
            for order, prefix in enumerate(("d_", "d2_", "d3_"), start=1):
                if prefix + command in self.input_rates:
                    made[:, self.input_names.index(prefix + command), k] = s**order
        return made

    @property
    def exact_step(self) -> bool:
        """Whether sub-steps change nothing: a linear model with the exact step."""
        return False

    @property
    @abstractmethod
    def jumps(self) -> bool:
        """Whether a law jumps: half the step is wrong by half as much there, up or down."""

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the vector."""
        return tuple(self.parameters)

    @property
    def n_x(self) -> int:
        """Number of states."""
        return len(self.state_names)


@dataclass(frozen=True)
class ExactDynamics(Dynamics):
    """Models linear up to scalar laws: exact linear part, see `bondgraph.simulation.lure`."""

    compiled: Compiled

    @property
    def lure(self) -> Compiled:
        """The compiled model."""
        return self.compiled

    @cached_property
    def names(self) -> FunctionNames:
        """Names of the state space."""
        c, model = self.compiled, self.compiled.model
        return FunctionNames(
            model.name, c.states, (), c.inputs, c.parameter_names, (), model.output_names,
            model.recorded, {s.name: s.unit for s in model.stored}, tuple(c.nominal().tolist()),
            (), (), (),
        )  # fmt: skip

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Declared parameters, in order."""
        return self.compiled.model.parameters

    @property
    def exact_step(self) -> bool:
        """Whether there is no law between the steps."""
        return not self.compiled.laws

    @property
    def jumps(self) -> bool:
        """Whether a law is set-valued."""
        return any(port.law.set_valued for port in self.compiled.laws)

    def inputs(
        self, commands: Mapping[str, Array], time: Array, breaks: Sequence[int] = ()
    ) -> Array:
        """Input matrix; rates of inputs and pseudo-inputs are filled in."""
        return inputs_of(self.compiled, commands, time, breaks)

    def at_rest(self, p: Array, u: Array) -> Array:
        """Equilibrium of the whole model, laws and all; of its linear part where there is none."""
        return law_rest(self.compiled, p, u, quiet=True)

    @property
    def _prepare(self) -> Callable[..., Any]:
        return partial(prepare, self.compiled)

    def _run(self, ready: Any, u: Array, x0: Array, **options: Any) -> KernelRun:
        return run_prepared(ready, u, x0, **options)

    def small_signal(self, p: Array, u: Array) -> SmallSignal:
        """Return the linear rest; laws count with their linear slope, wherever the rest is."""
        (made,) = evaluated(self.compiled.matrices, np.atleast_2d(p))
        return self._linear(blocks(self.compiled, made.reshape(*p.shape[:-1], *made.shape[1:])))

    def small_signal_slopes(
        self, p: Array, u: Array, wanted: Sequence[int]
    ) -> Sequence[SmallSignal]:
        """Return the derivatives of the linear rest."""
        made = continuous(self.compiled, p, np.asarray(wanted, int))
        return [self._linear(t) for t in made.tangents]

    def _linear(self, parts: Blocks) -> SmallSignal:
        n = self.compiled.n_u
        return SmallSignal(parts.a, parts.b[..., :n], parts.cy, parts.dy[..., :n])

    def spreads(self, p: Array, u: Array, step: float, x0: Array, n_sub: int, hold: str) -> Array:
        """Spread of the states, observed in a simulation."""
        ready = prepare(self.compiled.showing_states, p, step, n_sub)
        run = run_prepared(ready, u, x0, hold)
        moved = run.y[:, self.compiled.n_y :]
        return np.asarray(np.where(np.isfinite(moved), moved, 0.0).std(axis=0))


@dataclass(frozen=True, eq=False)
class GeneralDynamics(Dynamics):
    """Any other model of the language: L-stable steps, see `bondgraph.simulation.radau.native`."""

    program: Program
    declared: Mapping[str, Parameter]

    @property
    def implicit(self) -> Program:
        """The program."""
        return self.program

    @property
    def names(self) -> FunctionNames:
        """Names of the program."""
        return self.program

    @property
    def jumps(self) -> bool:
        """Whether a law is held."""
        return bool(self.program.held)

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:
        """Declared parameters, in the order of the program."""
        return {n: self.declared[n] for n in self.program.parameters}

    def inputs(
        self, commands: Mapping[str, Array], time: Array, breaks: Sequence[int] = ()
    ) -> Array:
        """Input matrix; rates of inputs and pseudo-inputs are filled in."""
        return general_inputs(self.program, commands, time, breaks)

    def at_rest(self, p: Array, u: Array) -> Array:
        """Equilibrium of the whole model, laws with memory relaxed."""
        memory, kept = self.program.start_memory(None)
        return relaxed_rest(self.program, u, p, memory, kept, quiet=True)[0]

    def rest(self, p: Array, u: Array) -> Array:
        """Equilibrium of the whole model; where there is none, its start."""
        try:
            return self.at_rest(p, u)
        except BondsightError:
            return np.array(self.program.start, float)

    @property
    def _prepare(self) -> Callable[..., Any]:
        return partial(prepare_general, self.program)

    def _run(
        self, ready: Any, u: Array, x0: Array, *, after: bool = False, **options: Any
    ) -> KernelRun:
        made = run_general(ready, u, x0, relaxed=options["memory"] is None, **options)
        return self._jumped(ready, u, options["fine"], made) if after else made

    def _jumped(self, ready: PreparedGeneral, u: Array, fine: Array, made: KernelRun) -> KernelRun:
        """Add what the jumps of inputs make of outputs about the rest."""
        n = u.shape[0] - 1
        n_sub, rows = fine.shape[0] // max(n, 1), (made.y.shape[0] - 1) // max(n, 1)
        jumps = np.concatenate([fine[n_sub::n_sub, 0], u[-1:]])[:n] - fine[n_sub - 1 :: n_sub, 1]
        if not jumps.any():
            return made
        y, dy = made.y.copy(), made.dy.copy()
        y[rows::rows] += jumps @ self.small_signal(ready.p, u[0]).d.T
        for k, slope in enumerate(self.small_signal_slopes(ready.p, u[0], ready.directions)):
            dy[rows::rows, :, k] += jumps @ slope.d.T
        return replace(made, y=y, dy=dy)

    def small_signal(self, p: Array, u: Array) -> SmallSignal:
        """Linearise about the rest, laws and all; about the start where nothing rests."""
        return of_program(self.program, p, u)

    def small_signal_slopes(
        self, p: Array, u: Array, wanted: Sequence[int]
    ) -> Sequence[SmallSignal]:
        """Return the derivatives of the linearisation, how its rest moves included."""
        return slopes_of_program(self.program, p, u, wanted)

    def spreads(self, p: Array, u: Array, step: float, x0: Array, n_sub: int, hold: str) -> Array:
        """Spread of the states where stretches of a simulation end."""
        ready = prepare_general(self.program, p, step, n_sub)
        edges = np.unique(np.linspace(0, u.shape[0] - 1, STRETCHES + 1).astype(int))
        seen, memory = [x0], None
        for a, b in pairwise(edges):
            made = run_general(
                ready, u[a : b + 1], seen[-1], hold, memory=memory, relaxed=memory is None
            )
            memory = made.memory or None
            seen.append(made.x)
        found = np.array(seen)
        return np.asarray(np.where(np.isfinite(found), found, 0.0).std(axis=0))


Model = BondGraph | Compiled | Dynamics


def dynamics_of(model: Model) -> Dynamics:
    """Return the exact dynamics where a graph allows it, else the general one.

    Raises
    ------
    BondsightError
        The graph has no equations; one line says why.
    """
    if isinstance(model, Dynamics):
        return model
    if isinstance(model, Compiled):
        return ExactDynamics(model)
    if (compiled := exact_form(model)) is not None:
        return ExactDynamics(compiled)
    from bondgraph.equations.derivation import equations
    from bondgraph.simulation.radau.jumping import stepping_program

    return GeneralDynamics(stepping_program(equations(model)), model.parameters)
