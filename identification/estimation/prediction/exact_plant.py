"""Models linear up to scalar laws behind a filter: exact linear part, exact process noise."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from bondgraph.laws.law import Law
from bondgraph.signals.recorded_rates import with_rates
from bondgraph.simulation.exact_run import prepare, relax_memories
from bondgraph.simulation.first_order_hold import Continuous, blocks, continuous
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.start import fine_inputs
from bondgraph.support.arrays import Array
from identification.estimation.prediction.diffusion import added_covariance
from identification.estimation.prediction.exact_steps import ExactPlaces, exact_steps
from identification.estimation.prediction.plant import FilterPlant, FilterSteps, Operating


class ExactPlant(FilterPlant):
    """The exact step of `bondgraph.simulation.lure` with a covariance."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled

    @cached_property
    def places(self) -> ExactPlaces:
        """Where its numbers stand."""
        return ExactPlaces.of(self.compiled)

    @cached_property
    def structure(self) -> tuple[object, ...]:
        """Sizes and laws, and `feedthrough`."""
        c = self.compiled
        laws = tuple((port.law, len(port.parameters)) for port in c.laws)
        sizes = (c.n_x, c.n_u, c.n_w, c.n_y, c.law_parameters, len(c.parameter_names))
        return (sizes, laws, self.feedthrough)

    @cached_property
    def feedthrough(self) -> bool:
        """Whether a reading contains the deviation of a law."""
        nominal = self.compiled.nominal()
        dy = blocks(self.compiled, self.compiled.block(np.where(nominal == 0.0, 1.0, nominal))).dy
        return bool(np.any(dy[:, self.compiled.n_u :]))

    @property
    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Elements with a law, and it."""
        return tuple((port.element, port.law) for port in self.compiled.laws)

    def build(self) -> FilterSteps:
        """Build the functions of the filter."""
        return exact_steps(self.compiled, self.feedthrough)

    def fine(self, u: Array, n_sub: int, step: float, hold: str) -> Array:
        """Return the inputs at both ends of each sub-step."""
        c, fine = self.compiled, fine_inputs(u, n_sub, hold)
        return with_rates(c.inputs, c.model.recorded, u, fine, step)[1]

    def body(self, at: Operating, h: float) -> tuple[Array, Array]:
        """Return matrices of a step, direct gain, added covariance and parameters of the laws."""
        compiled, places = self.compiled, self.places
        m, dm = np.zeros(places.size), np.zeros((places.size, at.n_d))
        wanted = at.wanted if at.derivatives else at.wanted[:0]
        slopes, k = at.slopes[: wanted.size], wanted.size
        factor = places.factors(at.x, at.y)
        model = continuous(compiled, at.p, wanted)
        ready = prepare(compiled, at.p, h, directions=wanted.tolist(), model=model)
        (packed, dpacked), (still, dstill) = ready.moving, ready.still
        m[places.packed] = packed * factor
        dm[places.packed, :k] = dpacked * factor[:, None] * slopes
        m[places.direct] = still[places.piece(5)]
        dm[places.direct, :k] = dstill[places.piece(5)] * slopes
        m[places.laws], dm[places.laws, :k] = ready.q, ready.dq * slopes
        if h and at.sigma.size and compiled.n_x:
            self._added(at, h, model, m, dm)
        return m, dm

    def _added(self, at: Operating, h: float, model: Continuous, m: Array, dm: Array) -> None:
        """Process noise of a step; the curvature of the laws within the step is left out of it."""
        n, parts, moved = self.compiled.n_x, model.parts, model.tangents
        k = len(moved)
        change = at.x[None, :] / at.x[:, None]
        da, ds, s = np.zeros((at.n_d, n, n)), np.zeros((at.n_d, n, n)), np.zeros((n, n))
        for i, t in enumerate(moved):
            da[i] = t.a * change * at.slopes[i]
        for j, (d, sigma) in enumerate(zip(at.diffusions, at.sigma, strict=True)):
            if d is None:
                continue
            g = (parts.b[:, d.index] if d.at_source else np.eye(n)[d.index]) / at.x * sigma
            s += np.outer(g, g)
            if at.derivatives:
                ds[k + j] = 2.0 * np.outer(g, g)
            for i, t in enumerate(moved if d.at_source else ()):
                dg = t.b[:, d.index] / at.x * sigma * at.slopes[i]
                ds[i] += np.outer(dg, g) + np.outer(g, dg)
        q, dq = added_covariance(parts.a * change, s, h, da, ds)
        rows, columns = np.triu_indices(n)  # a symmetric matrix: its lower triangle by columns
        m[self.places.added] = q[rows, columns]
        dm[self.places.added] = dq[:, rows, columns].T

    def tail(
        self, at: Operating, u: Array, x: Array, dx: Array, numbers: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return no deviations, and the memory of each law at rest at its argument."""
        lay, n_x = self.places.lay, self.places.lay.n_x
        z = np.zeros((lay.n_z, 1 + dx.shape[1]))
        z[:n_x, 0], z[:n_x, 1:] = x, dx
        still, dstill = (n[self.places.packed] for n in numbers)
        relax_memories(self.compiled, lay, still, dstill, u, z)
        return z[n_x:, 0], z[n_x:, 1:]
