"""Numbers of one filter pass, in scaled units, with their derivatives by theta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.simulation.first_order_hold import blocks, continuous, discretise
from bondgraph.simulation.lure import law_slices
from bondgraph.support.arrays import Array
from identification.estimation.prediction.diffusion import added_covariance
from identification.estimation.prediction.model import PredictionModel
from identification.estimation.prediction.places import Places, places


@dataclass(frozen=True, slots=True)
class Numbers:
    """What a runner needs for a record; directions are columns, as in `FilterSlots.of_record`.

    Attributes
    ----------
    m, still : ndarray, shape (n_m,)
        Parameter vector for a sub-step and for a step of no length.
    z : ndarray, shape (n_z,)
        Start of the filter.
    dm, dstill, dz : ndarray, shape (n_m or n_z, n_d)
    """

    m: Array
    dm: Array
    still: Array
    dstill: Array
    z: Array
    dz: Array


def assemble(model: PredictionModel, theta: Array, record: int, derivatives: bool) -> Numbers:
    """Put together the numbers of a record."""
    compiled, at, slots = model.compiled, places(model.compiled), model.slots
    p = model.vector(theta)
    names = compiled.parameter_names
    positions = np.array([names.index(f.parameter.name) for f in model.free], int)
    slopes = np.array([f.slope(float(t)) for f, t in zip(model.free, theta, strict=False)])
    wanted = positions if derivatives else positions[:0]
    n_d = slots.of_record(record).size if derivatives else 0
    step = model.records[record].dt / model.n_sub
    pieces = []
    for h in (step, 0.0):
        m, dm = np.zeros(at.n_m), np.zeros((at.n_m, n_d))
        _matrices(model, at, p, h, wanted, slopes, m, dm)
        _noise(model, at, theta, record, m, dm)
        if h:
            _added(model, at, theta, p, h, wanted, slopes, m, dm)
        laws = np.asarray(compiled.law_parameters, int)
        m[at.laws] = p[laws]
        for column, i in enumerate(wanted):
            dm[at.laws.start + np.flatnonzero(laws == i), column] = slopes[column]
        pieces.append((m, dm))
    (m, dm), (still, dstill) = pieces
    z, dz = _start(model, at, theta, record, still, dstill)
    return Numbers(m, dm, still, dstill, z, dz)


def _factors(model: PredictionModel, at: Places) -> Array:
    """Change of units of the packed matrices."""
    x, y, lay = model.state_scale, model.reading_scale, at.lay
    v = lay.n_u + lay.n_w
    grids = (
        x[None, :] / x[:, None],
        np.repeat(1 / x[:, None], v, axis=1),
        np.repeat(1 / x[:, None], v, axis=1),
        np.repeat(x[None, :], lay.n_w, axis=0),
        np.ones((lay.n_w, lay.n_u)),
        np.ones((lay.n_w, lay.n_w)),
        x[None, :] / y[:, None],
        np.repeat(1 / y[:, None], v, axis=1),
        np.ones((1, 1)),
    )
    return np.concatenate([g.ravel(order="F") for g in grids])


def _matrices(
    model: PredictionModel, at: Places, p: Array, h: float, wanted: Array, slopes: Array,
    m: Array, dm: Array,
) -> None:  # fmt: skip
    factor = _factors(model, at)
    matrices = continuous(model.compiled, p, wanted)
    made = discretise(matrices, h)
    m[at.packed] = made.packed * factor
    dm[at.packed, : wanted.size] = made.derivative * factor[:, None] * slopes[: wanted.size]
    if at.lay.n_w:
        now = made if h == 0.0 else discretise(matrices, 0.0)
        start = sum(r * c for r, c in at.lay.pieces[:5])
        gain = slice(start, start + at.lay.n_w**2)
        m[at.direct] = now.packed[gain]
        dm[at.direct, : wanted.size] = now.derivative[gain] * slopes[: wanted.size]


def _noise(
    model: PredictionModel, at: Places, theta: Array, record: int, m: Array, dm: Array
) -> None:
    slots, y = model.slots, model.reading_scale
    sd = np.array([model.noise.get(n, 0.0) for n in model.names])
    sd[list(model.estimated_noise)] = np.exp(theta[slots.noise])
    m[at.noise] = (sd / y) ** 2
    m[at.offset][: slots.n_offset] = theta[slots.offsets(record)]
    if not dm.shape[1]:
        return
    for column, j in enumerate(model.estimated_noise, start=slots.noise.start):
        dm[at.noise.start + j, column] = 2.0 * m[at.noise.start + j]
    for j in range(slots.n_offset):
        dm[at.offset.start + j, slots.noise.stop + j] = 1.0


def _added(
    model: PredictionModel, at: Places, theta: Array, p: Array, h: float, wanted: Array,
    slopes: Array, m: Array, dm: Array,
) -> None:  # fmt: skip
    """Process noise of a step; the curvature of the laws within the step is left out of it."""
    compiled, x, slots = model.compiled, model.state_scale, model.slots
    n, n_s = compiled.n_x, slots.n_sigma
    if not n_s or not n:
        return
    block = np.asarray(compiled.matrices(p).full(), float)
    jacobian = np.asarray(compiled.matrices_jacobian(p).full(), float)[:, wanted]
    parts = blocks(compiled, block)
    moved = [blocks(compiled, c.reshape(block.shape, order="F")) for c in jacobian.T]
    count = wanted.size + (n_s if dm.shape[1] else 0)
    a, change = parts.a * x[None, :] / x[:, None], x[None, :] / x[:, None]
    da, ds = np.zeros((count, n, n)), np.zeros((count, n, n))
    for i, t in enumerate(moved):
        da[i] = t.a * change * slopes[i]
    s = np.zeros((n, n))
    for k, (d, log_sigma) in enumerate(zip(model.diffusions, theta[slots.sigma], strict=True)):
        sigma = float(np.exp(log_sigma))
        g = (parts.b[:, d.index] if d.at_source else np.eye(n)[d.index]) / x * sigma
        s += np.outer(g, g)
        if dm.shape[1]:
            ds[wanted.size + k] = 2.0 * np.outer(g, g)
        if d.at_source:
            for i, t in enumerate(moved):
                dg = t.b[:, d.index] / x * sigma * slopes[i]
                ds[i] += np.outer(dg, g) + np.outer(g, dg)
    q = added_covariance(a, s, h, da, ds)
    rows, columns = np.triu_indices(n)  # a symmetric matrix: its lower triangle by columns
    m[at.added] = q.value[rows, columns]
    if dm.shape[1]:
        dm[at.added, :count] = q.derivative[:, rows, columns].T


def _start(
    model: PredictionModel, at: Places, theta: Array, record: int, still: Array, dstill: Array
) -> tuple[Array, Array]:
    """Mean, covariance and relaxed memories at the first sample."""
    n, slots, lay = model.compiled.n_x, model.slots, at.lay
    z, dz = np.zeros(at.n_z), np.zeros((at.n_z, dstill.shape[1]))
    z[:n] = model.rest[record] / model.state_scale
    if slots.n_state:
        z[:n] += theta[slots.states(record)]
        if dz.shape[1]:
            dz[:n, -n:] = np.eye(n)
    if model.initial == "wide":
        rows, columns = np.triu_indices(n)
        z[n : n + at.n_p] = 100.0 * np.eye(n)[rows, columns]
    if lay.n_m:
        _memories(model, at, record, still, dstill, z, dz)
    return z, dz


def _memories(
    model: PredictionModel,
    at: Places,
    record: int,
    still: Array,
    dstill: Array,
    z: Array,
    dz: Array,
) -> None:
    lay, u = at.lay, model.inputs[record][0]
    start = sum(r * c for r, c in lay.pieces[:3])
    cut = slice(start, start + lay.n_w * (lay.n_x + lay.n_u))
    shape = (lay.n_w, lay.n_x + lay.n_u)
    c = still[cut].reshape(shape, order="F")
    known = np.concatenate([z[: lay.n_x], u])
    s, ds = c @ known, c[:, : lay.n_x] @ dz[: lay.n_x]
    for d in range(dz.shape[1]):
        ds[:, d] += dstill[cut, d].reshape(shape, order="F") @ known
    first = at.n_z - lay.n_m
    for j, (port, ms, _) in enumerate(law_slices(model.compiled)):
        if port.law.n_memory:
            rows = slice(first + ms.start, first + ms.stop)
            z[rows] = port.law.initial_memory(float(s[j]))
            dz[rows] = np.outer(port.law.memory_sensitivity(float(s[j])), ds[j])
