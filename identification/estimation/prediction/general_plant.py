"""Any other program behind a filter: its own stiff step, see `general_steps`."""

from __future__ import annotations

import numpy as np

from bondgraph.equations.program import Program
from bondgraph.laws.law import Law
from bondgraph.simulation.radau.jumping import jumping_laws
from bondgraph.simulation.radau.native import inputs_between, prepare_general, run_general
from bondgraph.simulation.radau.recorder import Key
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.prediction.general_steps import GeneralPlaces, general_steps
from identification.estimation.prediction.plant import FilterPlant, FilterSteps, Operating


class GeneralPlant(FilterPlant):
    """The step of `bondgraph.simulation.radau` with a covariance."""

    def __init__(self, program: Program) -> None:
        if jumps := [program.laws[i].element for i in jumping_laws(program)]:
            raise UnusableInput(
                f"{program.name}: {', '.join(jumps)} has a law that jumps, about which the filter "
                "has no line beside products of signals; use LuGre, Sliding or a smooth law there, "
                "or another method"
            )
        self.program = program
        self.places = GeneralPlaces.of(program)

    @property
    def structure(self) -> Key:
        """The program itself."""
        return Key(self.program)

    @property
    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Elements with a law, and it."""
        return tuple((call.element, call.law) for call in self.program.laws)

    def build(self) -> FilterSteps:
        """Build the functions of the filter."""
        return general_steps(self.program)

    def fine(self, u: Array, n_sub: int, step: float, hold: str) -> Array:
        """Return the inputs at both ends of each sub-step, behind them the time, s."""
        ready = prepare_general(self.program, np.array(self.program.nominal), step, n_sub)
        _, between = inputs_between(ready, u, hold)
        begin = step / n_sub * np.arange(between.shape[0])
        time = np.stack([begin, begin + step / n_sub], axis=1)[:, :, None]
        return np.concatenate([between, time], axis=2)

    def body(self, at: Operating, h: float) -> tuple[Array, Array]:
        """Return parameters, sizes, intensities and the step."""
        place = self.places
        q, dq = np.zeros(place.step + 1), np.zeros((place.step + 1, at.n_d))
        q[place.p], q[place.x], q[place.y], q[place.step] = at.p, at.x, at.y, h
        k = at.wanted.size
        if at.derivatives:
            dq[place.p.start + at.wanted, np.arange(k)] = at.slopes
        for j, (d, sigma) in enumerate(zip(at.diffusions, at.sigma, strict=True)):
            if d is None:
                continue
            row = place.force.start + d.index if d.at_source else place.diffusion.start + d.index
            q[row] = sigma if d.at_source else sigma / at.x[d.index]
            if at.derivatives:
                dq[row, k + j] = q[row]
        return q, dq

    def tail(
        self, at: Operating, u: Array, x: Array, dx: Array, numbers: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return the unknowns to begin with, which have no tangents, and the memory at rest."""
        ready = prepare_general(self.program, at.p, 1.0, 1, at.wanted.tolist(), True)
        run = run_general(ready, u[None], x * at.x, relaxed=True)
        memory = [v for values in run.memory.values() for v in values]
        moved = np.zeros((run.z.size + len(memory), dx.shape[1]))
        if memory:
            by_p, by_x = run.dmemory[:, : at.wanted.size], run.dmemory[:, at.wanted.size :]
            dp = numbers[1][self.places.p][at.wanted]
            moved[run.z.size :] = by_p @ dp + by_x @ (at.x[:, None] * dx)
        return np.concatenate([run.z, memory]), moved
