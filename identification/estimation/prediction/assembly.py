"""Numbers of one filter pass, in scaled units, with their derivatives by theta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.plant import Operating
from identification.study.residual import offset_scale, parameters_at, rest_under, slots


@dataclass(frozen=True, slots=True)
class Numbers:
    """What a runner needs for a record; directions are columns.

    Attributes
    ----------
    where : ndarray of int, shape (n_d,)
        Directions as positions in theta: what the record depends on and what may move.
    m, still : ndarray, shape (n_m,)
        Parameter vector for a sub-step and for a step of no length.
    z : ndarray, shape (n_z,)
        Start of the filter.
    dm, dstill, dz : ndarray, shape (n_m or n_z, n_d)
    """

    where: Array
    m: Array
    dm: Array
    still: Array
    dstill: Array
    z: Array
    dz: Array


def assemble(kalman: KalmanFilter, theta: Array, record: int, derivatives: bool) -> Numbers:
    """Put together the numbers of a record."""
    problem, plant = kalman.problems[record], kalman.plants[record]
    where = kalman.slots.of_record(kalman.stack.columns[record], record)
    lower, upper = kalman.bounds
    alive = np.flatnonzero((upper > lower)[where]) if derivatives else np.arange(0)
    local = kalman.local(theta, record)
    at = Operating(
        parameters_at(problem, local), np.array(problem.directions, int), problem.slopes(local),
        np.exp(theta[kalman.slots.sigma]), kalman.diffusions(record),
        kalman.state_scale[record], kalman.reading_scale(record), derivatives,
    )  # fmt: skip
    pairs = []
    for h in (problem.data.dt / kalman.n_sub, 0.0):
        m, dm = _readings(kalman, theta, record, where.size if derivatives else 0)
        body, moved = plant.body(at, h)
        m[plant.steps.body] = body
        if derivatives:
            k, sigma = at.wanted.size, local.size
            dm[plant.steps.body, :k] = moved[:, :k]
            dm[plant.steps.body, sigma : sigma + at.sigma.size] = moved[:, k:]
        pairs.append((m, dm[:, alive]))
    (m, dm), (still, dstill) = pairs
    z, dz = np.zeros(plant.steps.n_z), np.zeros((plant.steps.n_z, alive.size))
    n, tail = plant.steps.n_x, plant.steps.tail
    z[:n] = kalman.initial(theta, record) / at.x
    first = where.size - kalman.slots.n_states[record]
    for column, i in enumerate(alive):
        if i >= first:
            dz[i - first, column] = 1.0
    if problem.initial == "rest" and derivatives:
        _, by_p = rest_under(problem.dynamics, at.p, problem.inputs[0], problem.directions)
        resting = np.zeros((n, where.size))
        resting[:, : at.slopes.size] = by_p * at.slopes / at.x[:, None]
        dz[:n] += resting[:, alive]
    numbers = still[plant.steps.body], dstill[plant.steps.body]
    z[tail], dz[tail] = plant.tail(at, problem.inputs[0], z[:n], dz[:n], numbers)
    return Numbers(where[alive], m, dm, still, dstill, z, dz)


def _readings(kalman: KalmanFilter, theta: Array, record: int, n_d: int) -> tuple[Array, Array]:
    """Variances of the readings' noise, and their offsets, at the end of ``m``."""
    problem, at, y = kalman.problems[record], kalman.slots, kalman.reading_scale(record)
    place, n_joint = slots(problem).offsets, kalman.stack.columns[record].size
    m = np.zeros(kalman.plants[record].steps.n_m)
    dm = np.zeros((m.size, n_d))
    noise, offset = m.size - 2 * y.size, m.size - y.size
    for j, name in enumerate(problem.data.names):
        sd = kalman.floors[record][j]
        if name in kalman.estimated:
            i = kalman.estimated.index(name)
            sd = np.exp(theta[at.noise.start + i])
            if n_d:
                dm[noise + j, n_joint + at.n_sigma + i] = 2.0 * (sd / y[j]) ** 2
        m[noise + j] = (sd / y[j]) ** 2
    m[offset:] = kalman.offsets(theta, record) / y
    if n_d:
        dm[offset:, place] = np.diag(offset_scale(problem) / y)
    return m, dm
