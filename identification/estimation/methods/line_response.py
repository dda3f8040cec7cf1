"""Residuals of spectral lines and their exact derivatives.

Between samples the commands are band-limited (the continuous response), linear or held (the exact
discrete response, as the simulator has it)::

    X = (s - A)^-1 (B0 + z B1) U,   Y = exp(-j w lag) (C X + D d U + C z (z - Phi)^-1 e)

with ``s = j w``, ``z`` on the unit circle, and ``e`` what a period begins with less what it ends
with, apart from the steady course.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.simulation.first_order_hold import continuous, discretise
from bondgraph.simulation.lure import Compiled
from bondgraph.support.arrays import ComplexArray
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

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _System:
    """Matrices of one parameter vector, or their derivative by one parameter."""

    a: Array
    early: Array
    late: Array
    c: Array
    d: Array
    phi: Array


def line_evaluation(
    problem: Problem, lines: Lines, point: Point, *, derivatives: bool = True
) -> ResidualEvaluation:
    """Return the residuals of the lines at `point`, real and imaginary parts over their deviation.

    ``point.states`` less the rest is the state at the first sample less the steady course there;
    it counts only if ``lines.transient``.
    """
    wanted = problem.directions if derivatives else []
    system, tangents = _systems(problem, parameters_at(problem, point.theta), wanted)
    z = np.exp(1j * lines.omega)
    y, by_free = _steady(problem, lines, system, tangents, z)
    shown, slopes = y[None], by_free[None]
    periods, n_y = lines.y.shape[0], y.shape[1]
    by_state = np.zeros((periods, z.size, n_y, 0), complex)
    if lines.transient:
        away = point.states[0] - problem.rest_state
        values, changes, by_state = _transients(lines, system, tangents, z, away)
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


def _systems(problem: Problem, p: Array, wanted: Sequence[int]) -> tuple[_System, list[_System]]:
    compiled = problem.compiled
    n_y = len(problem.data.names)
    model = continuous(compiled, p, np.asarray(wanted, int))
    found = discretise(model, problem.data.dt)
    sampled = [_cut(compiled, v, n_y) for v in (found.packed, *found.derivative.T)]
    if problem.data.hold == "linear":
        return sampled[0], sampled[1:]
    if problem.data.hold == "hold":
        held = [_System(s.a, s.early + s.late, 0.0 * s.late, s.c, s.d, s.phi) for s in sampled]
        return held[0], held[1:]
    smooth = [
        _System(v.a, v.b, 0.0 * v.b, v.cy[:n_y], v.dy[:n_y], s.phi)
        for s, v in zip(sampled, (model.parts, *model.tangents), strict=True)
    ]
    return smooth[0], smooth[1:]


def _cut(compiled: Compiled, packed: Array, n_y: int) -> _System:
    """Unpack a linear model: Phi, G0, G1, Cy, Dy column-major."""
    n, m = compiled.n_x, compiled.n_u
    rows = (packed.size - 1 - n * (n + 2 * m)) // (n + m)
    shapes = [(n, n), (n, m), (n, m), (rows, n), (rows, m)]
    edges = np.cumsum([0] + [a * b for a, b in shapes])
    phi, early, late, c, d = (
        packed[a:b].reshape(s, order="F")
        for a, b, s in zip(edges[:-1], edges[1:], shapes, strict=True)
    )
    return _System(phi, early, late, c[:n_y], d[:n_y], phi)


def _steady(
    problem: Problem, lines: Lines, system: _System, tangents: Sequence[_System], z: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Steady spectrum (F, n_y) and its derivatives (F, n_y, n)."""
    hold, u = problem.data.hold, lines.u
    s = 1j * lines.omega / problem.data.dt if hold == "band-limited" else z
    # a held command still has its old value when the next sample is read
    direct = u / z[:, None] if hold == "hold" else u

    def driven(part: _System) -> ComplexArray:
        return np.asarray(u @ part.early.T + z[:, None] * (u @ part.late.T))

    resolvent = s[:, None, None] * np.eye(system.a.shape[0]) - system.a
    x = np.linalg.solve(resolvent, driven(system)[:, :, None])[:, :, 0]
    y = x @ system.c.T + direct @ system.d.T
    by = np.empty((*y.shape, len(tangents)), complex)
    if tangents:
        left = _left(resolvent, system.c)
        for i, t in enumerate(tangents):
            inner = x @ t.a.T + driven(t)
            by[:, :, i] = x @ t.c.T + direct @ t.d.T + np.einsum("fyx,fx->fy", left, inner)
    return y, by


def _left(resolvent: NDArray[Any], c: Array) -> ComplexArray:
    """Return ``C (s - A)^-1``, shape (F, n_y, n_x)."""
    wide = np.broadcast_to(c.T.astype(complex), (resolvent.shape[0], *c.T.shape))
    return np.asarray(np.linalg.solve(resolvent.transpose(0, 2, 1), wide).transpose(0, 2, 1))


def _transients(
    lines: Lines, system: _System, tangents: Sequence[_System], z: ComplexArray, away: Array
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Spectrum of the decay in each period, its derivatives by parameters and by the state."""
    periods, n_y, n_x = lines.y.shape[0], system.c.shape[0], system.phi.shape[0]
    changes = [t.phi for t in tangents]
    over, over_by = _power(system.phi, changes, lines.period)
    lost = np.eye(n_x) - over
    gone, gone_by = np.eye(n_x), [np.zeros((n_x, n_x)) for _ in changes]
    resolvent = z[:, None, None] * np.eye(n_x) - system.phi
    left = _left(resolvent, system.c) * z[:, None, None]
    value = np.empty((periods, z.size, n_y), complex)
    by = np.zeros((periods, z.size, n_y, len(tangents)), complex)
    by_state = np.empty((periods, z.size, n_y, n_x), complex)
    for q in range(periods):
        e = lost @ gone
        by_state[q] = left @ e
        value[q] = by_state[q] @ away
        inner = np.linalg.solve(resolvent, np.broadcast_to(
            (e @ away)[:, None].astype(complex), (z.size, n_x, 1)))[:, :, 0]  # fmt: skip
        for i, t in enumerate(tangents):
            moved = (lost @ gone_by[i] - over_by[i] @ gone) @ away
            by[q, :, :, i] = (
                (inner * z[:, None]) @ t.c.T + left @ moved
                + np.einsum("fyx,fx->fy", left, inner @ t.phi.T)
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
