"""Fit Ang's operator: eq. (5.9) and (5.10) of the stack actuator thesis, with all its numbers.

Sizes: J plays with a width, m dead zones with a threshold, M samples.
"""

from __future__ import annotations

import numpy as np

from bondgraph.hysteresis.errors import BadInput, BadParameter, NotInvertible
from bondgraph.hysteresis.fitting.least_squares import fit_linear_blocks
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.hysteresis.fitting.numbered import NumberedFit, NumberedPoint, intervals, lowered
from bondgraph.hysteresis.plays.ang import Ang
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import FloatArray

_SHARES = (0.04, 0.08, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85)
"""Where the first threshold may start, in the range of the output."""
_TRIED = 2
_FEW, _SHORT = 800, 10
"""Samples and steps by which starts are compared."""


def fit_ang(
    records: LoopRecords, count: int, zones: int = 1, *, reach: float | None = None
) -> NumberedFit[Ang]:
    """Fit w_f, w_s, d_1 and sigma_d by least squares; w_s0 = 1, because stages trade one factor.

    The play thresholds are even from 0 to `reach`, those of the dead zones even from d_1 on, as in
    the thesis. Wider plays move in a virgin rise only; where a record has one, J/3 are added, which
    else would be taken for dead zones. For given thresholds d' of the inverse output stage
    ``P[x] = S'[y]`` is linear in all weights; rows of d' are starts of a descent in
    the error of the output itself, which also moves the thresholds. Both stages stay invertible.

    Parameters
    ----------
    records : LoopRecords
        Outputs not negative for the most part, as the dead zones are one-sided.
    count : int
        J >= 1.
    zones : int
        m >= 0.
    reach : float, optional
        r_J, unit of the input; half the largest swing when not given.

    Raises
    ------
    BadParameter
        If a count is out of its domain or the reach is not positive.
    BadInput
        If nothing that can be inverted follows the record, or with dead zones no output lies
        above 0.

    References
    ----------
    ang2007, kuhnen2003; stack actuator thesis, eq. (5.8) to (5.10)

    Examples
    --------
    >>> truth = Ang(PrandtlIshlinskii((0, 1, 2), (1, 0.5, 0.5)), DeadZones((0, 2), (1, -0.5)))
    >>> x = 2.0 - 2.0 * np.cos(np.linspace(0.0, 9.0, 400))
    >>> fit = fit_ang(LoopRecords.of([(x, truth.run(x)[0])]), 2)
    >>> [round(n.value, 3) for n in fit.numbers]
    [1.0, 0.5, 0.5, -0.5, 2.0]
    """
    if count < 1 or zones < 0:
        raise BadParameter(f"count = {count}, zones = {zones}; give at least one play and 0 zones")
    widest = 0.5 * records.swing if reach is None else float(reach)
    if not widest > 0.0:
        raise BadParameter(f"reach = {widest} must be positive")
    r = widest * np.arange(1, count + 1) / count
    virgin = records.virgin_reach
    if virgin > widest:
        wide = count // 3
        beyond = widest + (virgin - widest) * np.arange(1, wide + 1) / (wide + 1)
        r = np.concatenate((r, beyond))
    now, then = (plays.columns for plays in records.plays(r))
    y = records.target
    found: list[NumberedPoint] = []
    for start in _starts(now, then, y, zones):
        point = lowered(lambda p: _residual(now, then, y, p, zones), start)
        if point is not None:
            found.append(point)
    if not found:
        raise BadInput(
            f"no operator of {count} plays and {zones} dead zones that can be inverted follows "
            "this record; take fewer, or check that the output rises with the input"
        )
    best = min(found, key=lambda p: p.cost)
    names = (
        *(f"wf_{i}" for i in range(r.size + 1)), *(f"ws_{j}" for j in range(1, zones + 1)),
        *("d_1", "sigma_d")[: min(zones, 2)],
    )  # fmt: skip
    plays = PrandtlIshlinskii((0.0, *r.tolist()), tuple(best.numbers[: r.size + 1].tolist()))
    bends, d = _zones(best.numbers[r.size + 1 :], zones)
    stage = DeadZones((0.0, *d.tolist()), (1.0, *bends.tolist()))
    return NumberedFit(Ang(plays, stage), intervals(best, names), best.cost)


def _zones(p: FloatArray, zones: int) -> tuple[FloatArray, FloatArray]:
    """Return weights and thresholds of the dead zones."""
    step = p[zones + 1] if zones > 1 else 0.0
    return p[:zones], (p[zones] + step * np.arange(zones) if zones else p[:0])


def _stages(bank: FloatArray, p: FloatArray, zones: int) -> tuple[FloatArray, FloatArray]:
    """Return output (M,) and Jacobian (M, numbers) of both stages."""
    n = bank.shape[1]
    weights, (bends, d) = p[:n], _zones(p[n:], zones)
    inner = bank @ weights
    beyond = np.maximum(inner[:, None] - d, 0.0)
    past = beyond > 0.0
    rate = 1.0 + past @ bends
    by_d = np.where(past, -bends, 0.0)
    columns = [rate[:, None] * bank, beyond]
    if zones:
        columns.append(by_d.sum(axis=1)[:, None])
    if zones > 1:
        columns.append((by_d @ np.arange(zones))[:, None])
    return inner + beyond @ bends, np.hstack(columns)


def _residual(
    now: FloatArray, then: FloatArray, y: FloatArray, p: FloatArray, zones: int
) -> tuple[FloatArray, FloatArray] | None:
    n = now.shape[1]
    bends, d = _zones(p[n:], zones)
    slopes, bent = np.cumsum(p[:n]), 1.0 + np.cumsum(bends)
    if not ((slopes > 0.0).all() and (bent > 0.0).all() and (np.diff(d, prepend=0.0) > 0.0).all()):
        return None
    (z, jacobian), (z0, by_start) = _stages(now, p, zones), _stages(then, p, zones)
    return z - z0 - y, jacobian - by_start


def _ends(zones: int) -> list[tuple[float, float]]:
    """Return shares of the output at which the dead zones may begin and end."""
    if zones == 0:
        return [(0.0, 0.0)]
    if zones == 1:
        return [(share, share) for share in _SHARES]
    return [(a, b) for a in _SHARES for b in (*_SHARES, 0.97) if b > a]


def _starts(now: FloatArray, then: FloatArray, grown: FloatArray, zones: int) -> list[FloatArray]:
    """Return numbers to start from, those that end lowest first."""
    plain, *_ = np.linalg.lstsq(now - then, grown, rcond=None)
    y = grown + then @ plain
    top, n = float(y.max()), now.shape[1]
    if zones and not top > 0.0:
        raise BadInput(
            f"the output never lies above 0 (at most {top:.4g}), where alone the dead zones bend; "
            "fit the record with both signs turned, or take zones = 0"
        )
    floor = 1e-3 * float(np.ptp(y)) / float(np.ptp(now[:, 0]))
    few = slice(None, None, max(1, y.size // _FEW))
    found = []
    for first, last in _ends(zones):
        bends = top * np.linspace(first, last, max(zones, 1))[:zones]
        beyond = np.maximum(y[:, None] - bends, 0.0)
        linear, *_ = np.linalg.lstsq(np.hstack((now, -beyond)), y, rcond=None)
        stage = DeadZones((0.0, *bends.tolist()), (1.0, *linear[n:].tolist()))
        try:
            forward = stage.inverse()
        except NotInvertible:
            forward = stage = DeadZones(stage.thresholds, (1.0, *(0.0 for _ in bends)))
        # the plays that this output stage asks for, with slopes that can be inverted
        bent = stage.run(y)[0]
        weights = fit_linear_blocks([(now, bent)], "prefix_sums", minimum=floor).weights
        d = np.array(forward.thresholds[1:], float)
        even = [*d[:1], *([np.mean(np.diff(d))] if zones > 1 else [])]
        p = np.array([*weights, *map(float, forward.weights[1:]), *even])
        # a few steps on a few samples tell the valleys apart
        near = lowered(lambda q: _residual(now[few], then[few], grown[few], q, zones), p, _SHORT)
        if near is not None:
            found.append((near.cost, near.numbers))
    return [p for _, p in sorted(found, key=lambda pair: pair[0])[:_TRIED]]
