"""Shares of effort that determine parameters best, with a proof of how good they are.

Effort is power over lines, or time over experiments: information adds, ``M = sum_k w_k M_k``.
The D criterion is ``log det`` of the information on the chosen parameters after the others are
eliminated, the A criterion the trace of their covariance, and both are averaged over samples of
the unknown true values. Multiplicative algorithm (Silvey, Titterington, Torsney, Commun. Stat. A7
(1978) 1379; Yu, Ann. Stat. 38 (2010) 1593): ``w_k`` times its dispersion. By the general
equivalence theorem (Kiefer and Wolfowitz, Can. J. Math. 12 (1960) 363) the weights are optimal
exactly if no dispersion exceeds the number of chosen parameters, so that its excess bounds what
is lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known

CRITERIA = ("D", "A")


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Shares of effort and their certificate.

    Parameters
    ----------
    shares : ndarray, shape (K,)
        Not negative; with the costs they sum to 1.
    dispersion : ndarray, shape (K,)
        Per cost, scaled so that its largest is the number of chosen parameters at the optimum.
    chosen : int
        That number.
    efficiency : float
        At least so much of the best information (D: of ``det^(1/s)``; A: of the trace) is had.
    of_even : float
        Efficiency of equal shares relative to these.
    iterations : int
    """

    shares: FloatArray
    dispersion: FloatArray
    chosen: int
    efficiency: float
    of_even: float
    iterations: int

    def __repr__(self) -> str:
        """Short text with the certificate."""
        return (
            f"Weights({int((self.shares > 1e-3 * self.shares.max()).sum())} of "
            f"{self.shares.size} in use; largest dispersion {self.dispersion.max():.5g} for "
            f"{self.chosen} chosen, so at least {100 * self.efficiency:.4g} % of the best; "
            f"even shares reach {100 * self.of_even:.3g} %)"
        )


def optimal_weights(
    information: FloatArray,
    chosen: int,
    *,
    criterion: str = "D",
    cost: ArrayLike | None = None,
    tolerance: float = 1e-3,
    largest: int = 20_000,
) -> Weights:
    """Return the shares that determine the first `chosen` parameters best.

    Parameters
    ----------
    information : ndarray, shape (S, K, n, n)
        Fisher information of unit effort in candidate k, at S samples of the parameters; the
        chosen ones first, nuisances after.
    chosen : int
        s, 1 .. n.
    criterion : {"D", "A"}
    cost : array, shape (K,), optional
        Of unit effort in each candidate; equal if not given.
    tolerance : float
        Relative excess of the largest dispersion at which to stop.
    largest : int
        Number of iterations.

    Raises
    ------
    UnusableInput
        If all candidates together do not determine the parameters.

    Examples
    --------
    >>> lines = np.array([[1.0, -1.0], [1.0, 0.0], [1.0, 1.0]])  # a straight line at -1, 0, 1
    >>> w = optimal_weights(np.einsum("ki,kj->kij", lines, lines)[None], 2)
    >>> w.shares.round(2).tolist()
    [0.5, 0.0, 0.5]
    """
    require_known("criterion", "design", CRITERIA, criterion)
    count, n = information.shape[1], information.shape[2]
    price = np.ones(count) if cost is None else np.asarray(cost, float)
    if price.shape != (count,) or not (price > 0.0).all() or not 1 <= chosen <= n:
        raise UnusableInput("design: costs must be positive, one a candidate; 1 <= chosen <= n")
    unit = information / price[None, :, None, None]
    _check(unit.mean(axis=1))
    even = np.full(count, 1.0) * price / price.sum()
    w = even.copy()
    alive = np.arange(count)
    # with the first power, criteria other than the plain determinant may swing to and fro
    power = 1.0 if criterion == "D" and chosen == n else 0.5
    iteration, excess = 0, np.inf
    for iteration in range(1, largest + 1):
        psi, _ = _dispersion(unit[:, alive], w[alive], chosen, criterion)
        excess = float(psi.max() / chosen - 1.0)
        if excess < tolerance:
            psi_all, _ = _dispersion(unit, w, chosen, criterion)
            excess = float(psi_all.max() / chosen - 1.0)
            if excess < tolerance:
                break
            alive = np.arange(count)
            w = 0.999 * w + 0.001 * even
            continue
        grown = psi / chosen
        w[alive] *= grown**power
        w[alive] /= w[alive].sum()
        if iteration % 50 == 0:
            # what is small and shrinking is left out until the end, where it is asked again
            keep = (w[alive] > 1e-7 / count) | (psi > chosen)
            w[alive[~keep]] = 0.0
            alive = alive[keep]
            w /= w.sum()
    psi, value = _dispersion(unit, w, chosen, criterion)
    _, plain = _dispersion(unit, even, chosen, criterion)
    excess = max(float(psi.max() / chosen - 1.0), 0.0)
    if criterion == "D":
        efficiency, of_even = float(np.exp(-excess)), float(np.exp((plain - value) / chosen))
    else:
        efficiency, of_even = max(0.0, 1.0 - excess), value / plain
    return Weights(w / price, psi, chosen, efficiency, of_even, iteration)


def _dispersion(
    unit: FloatArray, w: FloatArray, chosen: int, criterion: str
) -> tuple[FloatArray, float]:
    """Dispersion of each candidate, scaled to sum to `chosen` over the shares; the criterion."""
    samples, count, n = unit.shape[:3]
    flat = unit.reshape(samples, count, n * n)
    total = (w @ flat).reshape(samples, n, n)
    inverse = np.linalg.inv(total)
    if criterion == "A":
        part = inverse[:, :, :chosen]
        middle = part @ part.transpose(0, 2, 1)
        trace = float(np.mean(np.trace(inverse[:, :chosen, :chosen], axis1=1, axis2=2)))
        psi = np.mean(flat @ middle.reshape(samples, n * n, 1), axis=0)[:, 0]
        return np.asarray(psi * (chosen / trace)), trace
    value = float(np.mean(np.linalg.slogdet(total)[1]))
    if chosen < total.shape[1]:
        rest = total[:, chosen:, chosen:]
        inverse = inverse.copy()
        inverse[:, chosen:, chosen:] -= np.linalg.inv(rest)
        value -= float(np.mean(np.linalg.slogdet(rest)[1]))
    psi = np.mean(flat @ inverse.reshape(samples, n * n, 1), axis=0)[:, 0]
    return np.asarray(psi), value


def _check(total: FloatArray) -> None:
    size = np.sqrt(np.maximum(np.diagonal(total, axis1=1, axis2=2), 0.0))
    if not (np.isfinite(total).all() and (size > 0.0).all()):
        raise UnusableInput("design: a parameter shows in no candidate; fix it or add a sensor")
    scaled = total / (size[:, :, None] * size[:, None, :])
    smallest = float(np.linalg.eigvalsh(scaled)[:, 0].min())
    if smallest < 1e-12:
        raise UnusableInput(
            "design: all candidates together do not tell the parameters apart; fix one of them, "
            "add a sensor, or widen the band"
        )
