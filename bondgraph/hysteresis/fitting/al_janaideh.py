"""Fit Al Janaideh's operator: eq. (5.7) of the stack actuator thesis, in the numbers that count.

Sizes: J plays with a width, M samples.
"""

from __future__ import annotations

import numpy as np

from bondgraph.hysteresis.errors import BadInput, BadParameter
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.hysteresis.fitting.numbered import NumberedFit, intervals, lowered
from bondgraph.hysteresis.plays.al_janaideh import AlJanaideh
from bondgraph.support.ops import FloatArray

_REACHES = (0.3, 0.5, 0.7, 0.9, 1.1)
_DECAYS = (-1.0, 0.0, 1.0, 2.0, 4.0, 8.0)


def fit_al_janaideh(records: LoopRecords, count: int) -> NumberedFit[AlJanaideh]:
    """Fit q, sigma, alpha and beta by least squares; c = 1, because only four of five count.

    For given sigma and beta the operator is linear in q and alpha, so a small grid of these two
    gives the start of a descent in all four.

    Parameters
    ----------
    records : LoopRecords
    count : int
        J >= 1.

    Raises
    ------
    BadParameter
        If `count` is below 1.
    BadInput
        If no start gives an operator that rises.

    References
    ----------
    aljanaideh2011; stack actuator thesis, eq. (5.6) and (5.7)

    Examples
    --------
    >>> truth = AlJanaideh(q=2.0, c=1.0, sigma=0.5, alpha=0.4, beta=0.3, count=4)
    >>> x = 5.0 * np.sin(np.linspace(0.0, 9.0, 400))
    >>> fit = fit_al_janaideh(LoopRecords.of([(x, truth.run(x)[0])]), 4)
    >>> [round(n.value, 6) for n in fit.numbers]
    [2.0, 0.5, 0.4, 0.3]
    """
    if count < 1:
        raise BadParameter(f"count = {count}; Al Janaideh's operator needs at least one play")
    y, j, half = records.target, np.arange(1, count + 1), 0.5 * records.swing

    def grown(sigma: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Input, plays and their derivatives, counted from the start of their record."""
        now, then = records.plays(sigma * j)
        columns, sides = now.columns - then.columns, now.sides - then.sides
        return columns[:, 0], columns[:, 1:], sides[:, 1:]

    def residual(p: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        q, sigma, alpha, beta = p
        if not (sigma > 0.0 and abs(beta) * sigma * count < 50.0 and q > 0.0):
            return None
        if not (q + np.cumsum(alpha * np.exp(-beta * sigma * j)) > 0.0).all():
            return None
        x, plays, sides = grown(sigma)
        e = np.exp(-beta * sigma * j)
        by_sigma = alpha * (sides @ (e * j) - beta * (plays @ (e * j)))
        by_beta = -alpha * sigma * (plays @ (e * j))
        jacobian = np.column_stack((x, by_sigma, plays @ e, by_beta))
        return q * x + alpha * (plays @ e) - y, jacobian

    starts = []
    for reach in _REACHES:
        sigma = reach * half / count
        x, plays, _ = grown(sigma)
        for decay in _DECAYS:
            beta = decay / (sigma * count)
            columns = np.column_stack((x, plays @ np.exp(-beta * sigma * j)))
            (q, alpha), *_ = np.linalg.lstsq(columns, y, rcond=None)
            rms = float(np.linalg.norm(columns @ (q, alpha) - y))
            starts.append((rms, (float(q), sigma, float(alpha), beta)))
    found = [lowered(residual, np.array(s)) for _, s in sorted(starts)[:3]]
    best = min((p for p in found if p is not None), key=lambda p: p.cost, default=None)
    if best is None:
        raise BadInput(f"no operator of {count} plays rises with this record; take fewer plays")
    q, sigma, alpha, beta = map(float, best.numbers)
    numbers = intervals(best, ("q", "sigma_r", "alpha", "beta"))
    return NumberedFit(AlJanaideh(q, 1.0, sigma, alpha, beta, count), numbers, best.cost)
