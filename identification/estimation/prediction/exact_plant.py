"""Models linear up to scalar laws behind a filter: exact linear part, exact process noise."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from bondgraph.laws.law import Law
from bondgraph.signals.recorded_rates import with_rates
from bondgraph.simulation.first_order_hold import blocks, continuous, discretise, standing
from bondgraph.simulation.lure import Compiled, law_slices
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

    def linear(self, p: Array, x: Array, u: Array) -> tuple[Array, Array, Array]:
        """Return the linear part."""
        parts = blocks(self.compiled, self.compiled.block(p))
        return parts.a, parts.b[:, : self.compiled.n_u], parts.cy

    def body(self, at: Operating, h: float) -> tuple[Array, Array]:
        """Return matrices of a step, direct gain, added covariance and parameters of the laws."""
        compiled, places = self.compiled, self.places
        m, dm = np.zeros(places.size), np.zeros((places.size, at.n_d))
        wanted = at.wanted if at.derivatives else at.wanted[:0]
        slopes, k = at.slopes[: wanted.size], wanted.size
        factor = places.factors(at.x, at.y)
        matrices = continuous(compiled, at.p, wanted)
        made = discretise(matrices, h)
        m[places.packed] = made.packed * factor
        dm[places.packed, :k] = made.derivative * factor[:, None] * slopes
        if places.lay.n_w:
            now = made if h == 0.0 else standing(matrices, made)
            m[places.direct] = now.packed[places.piece(5)]
            dm[places.direct, :k] = now.derivative[places.piece(5)] * slopes
        if h and at.sigma.size and compiled.n_x:
            self._added(at, h, m, dm)
        laws = np.asarray(compiled.law_parameters, int)
        m[places.laws] = at.p[laws]
        for column, i in enumerate(wanted):
            dm[places.laws.start + np.flatnonzero(laws == i), column] = slopes[column]
        return m, dm

    def _added(self, at: Operating, h: float, m: Array, dm: Array) -> None:
        """Process noise of a step; the curvature of the laws within the step is left out of it."""
        n, k = self.compiled.n_x, at.wanted.size if at.derivatives else 0
        parts = blocks(self.compiled, self.compiled.block(at.p))
        moved = continuous(self.compiled, at.p, at.wanted[:k]).tangents
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
        lay, (still, dstill) = self.places.lay, numbers
        found = np.zeros(lay.n_w + lay.n_m)
        moved = np.zeros((found.size, dx.shape[1]))
        if not lay.n_m:
            return found, moved
        cut = slice(self.places.piece(3).start, self.places.piece(4).stop)
        shape = (lay.n_w, lay.n_x + lay.n_u)
        c, known = still[cut].reshape(shape, order="F"), np.concatenate([x, u])
        s, ds = c @ known, c[:, : lay.n_x] @ dx
        for d in range(dx.shape[1]):
            ds[:, d] += dstill[cut, d].reshape(shape, order="F") @ known
        for j, (port, ms, _) in enumerate(law_slices(self.compiled)):
            if port.law.n_memory:
                rows = slice(lay.n_w + ms.start, lay.n_w + ms.stop)
                found[rows] = port.law.initial_memory(float(s[j]))
                moved[rows] = np.outer(port.law.memory_sensitivity(float(s[j])), ds[j])
                if port.law.watched:
                    found[rows.stop - 2 : rows.stop] = s[j + 1]
                    moved[rows.stop - 2 : rows.stop] = ds[j + 1]
        return found, moved
