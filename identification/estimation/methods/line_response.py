"""Residuals of spectral lines and their exact derivatives.

Between samples the commands are band-limited (the continuous response), linear or held (the exact
discrete response, as the simulator has it)::

    X = (s - A)^-1 (B0 + z B1) U,   Y = exp(-j w lag) (C X + D d U + C z (z - Phi)^-1 e)

with ``s = j w``, ``z`` on the unit circle, and ``e`` what a period begins with less what it ends
with, apart from the steady course.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.simulation.first_order_hold import continuous, discretise
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.small_signal import SmallSignal
from bondgraph.support.arrays import ComplexArray
from bondgraph.support.arrays import FloatArray as Array
from identification.estimation.methods.periodic_lines import Lines
from identification.study.problem import Problem
from identification.study.residual import (
    Point,
    ResidualEvaluation,
    offset_scale,
    output_delays,
    parameters_at,
    slots,
)


def line_evaluation(
    problem: Problem, lines: Lines, point: Point, *, derivatives: bool = True
) -> ResidualEvaluation:
    """Return the residuals of the lines at `point`, real and imaginary parts over their deviation.

    ``point.states`` less the rest is the state at the first sample less the steady course there;
    it counts only if ``lines.transient``.
    """
    wanted = problem.directions if derivatives else []
    (system, *tangents), phis = _systems(problem, parameters_at(problem, point.theta), wanted)
    z = np.exp(1j * lines.omega)
    s, drive = _drive(problem, lines, z)
    y = system.response(s, drive)[:, :, 0]
    shown, slopes = y[None], system.response_slopes(tangents, s, drive)[None, :, :, 0]
    periods, n_y = lines.y.shape[0], y.shape[1]
    by_state = np.zeros((periods, z.size, n_y, 0), complex)
    if lines.transient:
        away = point.states[0] - problem.rest_state
        rows = [t.c for t in (system, *tangents)]
        values, changes, by_state = _transients(lines, phis, rows, z, away)
        shown, slopes = shown + values, slopes + changes
    turn = np.exp(-1j * lines.omega[:, None] * output_delays(problem, point.theta))
    return line_residuals(problem, lines, point, shown * turn, slopes * turn[:, :, None],
                          by_state * turn[:, :, None], derivatives=derivatives)  # fmt: skip


def line_residuals(
    problem: Problem,
    lines: Lines,
    point: Point,
    shown: ComplexArray,
    by_free: ComplexArray,
    by_state: ComplexArray,
    *,
    derivatives: bool,
) -> ResidualEvaluation:
    """Return the residuals of the lines at `point` from what the sensors show.

    Parameters
    ----------
    shown : ndarray, shape (Q, F, n_y)
        Spectra of the readings, late as they are; offsets apart.
    by_free, by_state : ndarray, shape (Q, F, n_y, ...)
        Their derivatives by the values of the free parameters and by a fitted initial state.
    """
    at, n_y, scale = slots(problem), shown.shape[2], offset_scale(problem)
    mean = lines.omega == 0.0
    offsets = point.theta[at.offsets] * scale * lines.period
    residual = line_rows(lines, lines.y - shown - mean[:, None] * offsets)
    if not derivatives:
        return ResidualEvaluation(np.zeros((0, n_y)), residual, np.zeros((residual.size, 0)), [])
    block = np.zeros((*shown.shape, at.size), complex)
    block[..., at.free] = by_free * problem.slopes(point.theta)
    by_lag = -1j * lines.omega[:, None] * shown
    for c in range(n_y):
        block[:, :, c, at.lags.start + c] = by_lag[:, :, c]
        block[:, mean, c, at.offsets.start + c] = scale[c] * lines.period
    for j, outputs in enumerate(problem.delays.values()):
        for c in outputs:
            block[:, :, c, at.delays.start + j] = by_lag[:, :, c]
    states = line_rows(lines, by_state) if by_state.size else np.zeros((residual.size, 0))
    local = [(slice(0, residual.size), states)]
    return ResidualEvaluation(np.zeros((0, n_y)), residual, line_rows(lines, block), local)


def line_rows(lines: Lines, values: ComplexArray) -> Array:
    """Return real and imaginary parts over their deviation; (Q, F, n_y, ...) to (rows, ...)."""
    extra = values.ndim - 3
    deviation = np.sqrt(lines.variance / 2.0).reshape(*lines.variance.shape, *(1,) * extra)
    scaled = values / deviation
    # the mean is real and has all of its variance there
    mean = lines.omega == 0.0
    scaled[:, mean] /= np.sqrt(2.0)
    parts = (scaled.real, scaled[:, ~mean].imag)
    return np.concatenate([v.reshape(-1, *values.shape[3:]) for v in parts])


def _systems(
    problem: Problem, p: Array, wanted: Sequence[int]
) -> tuple[list[SmallSignal], list[Array]]:
    """Return the model and its derivatives by parameters, and Phi with its own.

    The inputs are taken twice: as they are, and as `_drive` has them.
    """
    compiled, n_y = problem.compiled, len(problem.data.names)
    model = continuous(compiled, p, np.asarray(wanted, int))
    found = discretise(model, problem.data.dt)
    cuts = [_cut(compiled, v) for v in (found.packed, *found.derivative.T)]
    systems = []
    for part, (phi, early, late) in zip((model.parts, *model.tangents), cuts, strict=True):
        none, c, d = np.zeros_like(part.dy[:n_y]), part.cy[:n_y], part.dy[:n_y]
        if problem.data.hold == "linear":
            made = (phi, np.hstack([early, late]), c, np.hstack([d, none]))
        elif problem.data.between == "hold":
            through = [d, none] if problem.data.reads_after else [none, d]
            made = (phi, np.hstack([early + late, 0.0 * late]), c, np.hstack(through))
        else:
            made = (part.a, np.hstack([part.b, 0.0 * part.b]), c, np.hstack([d, none]))
        systems.append(SmallSignal(*made))
    return systems, [phi for phi, _, _ in cuts]


def _cut(compiled: Compiled, packed: Array) -> tuple[Array, Array, Array]:
    """Unpack the discrete part of a linear model: Phi, G0, G1, column-major."""
    n, m = compiled.n_x, compiled.n_u
    joined = packed[: n * (n + 2 * m)].reshape(n, n + 2 * m, order="F")
    return joined[:, :n], joined[:, n : n + m], joined[:, n + m :]


def _drive(problem: Problem, lines: Lines, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return s and the spectra of the inputs twice (F, 2 n_u, 1), see `_systems`."""
    hold, u = problem.data.between, lines.u
    # a held command still has its old value when the next sample is read
    turned = u / z[:, None] if hold == "hold" else u * z[:, None]
    s = 1j * lines.omega / problem.data.dt if hold == "band-limited" else z
    return np.asarray(s, complex), np.hstack([u, turned])[:, :, None]


def _transients(
    lines: Lines, phis: Sequence[Array], rows: Sequence[Array], z: ComplexArray, away: Array
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Spectrum of the decay in each period, its derivatives by parameters and by the state.

    `phis` and `rows` are Phi and C, each followed by its derivatives.
    """
    periods, (n_y, n_x), changes = lines.y.shape[0], rows[0].shape, phis[1:]
    over, over_by = _power(phis[0], changes, lines.period)
    lost = np.eye(n_x) - over
    gone, gone_by = np.eye(n_x), [np.zeros((n_x, n_x)) for _ in changes]
    inside = SmallSignal(phis[0], np.eye(n_x), np.eye(n_x), np.zeros((n_x, n_x)))
    resolved = inside.response(z, np.eye(n_x, dtype=complex)[None])
    left = rows[0] @ resolved * z[:, None, None]
    value = np.empty((periods, z.size, n_y), complex)
    by = np.zeros((periods, z.size, n_y, len(changes)), complex)
    by_state = np.empty((periods, z.size, n_y, n_x), complex)
    for q in range(periods):
        e = lost @ gone
        by_state[q] = left @ e
        value[q] = by_state[q] @ away
        inner = resolved @ (e @ away)
        for i, (phi, c) in enumerate(zip(changes, rows[1:], strict=True)):
            moved = (lost @ gone_by[i] - over_by[i] @ gone) @ away
            by[q, :, :, i] = (
                (inner * z[:, None]) @ c.T + left @ moved
                + np.einsum("fyx,fx->fy", left, inner @ phi.T)
            )  # fmt: skip
        gone_by = [b @ over + gone @ o for b, o in zip(gone_by, over_by, strict=True)]
        gone = gone @ over
    return value, by, by_state


def _power(phi: Array, changes: Sequence[Array], n: int) -> tuple[Array, list[Array]]:
    """Return ``Phi^n`` and its derivatives, by squaring."""
    value, by = np.eye(phi.shape[0]), [np.zeros_like(phi) for _ in changes]
    base, base_by = phi, list(changes)
    while n:
        if n & 1:
            by = [b @ base + value @ s for b, s in zip(by, base_by, strict=True)]
            value = value @ base
        base_by = [s @ base + base @ s for s in base_by]
        base = base @ base
        n >>= 1
    return value, by
