"""Whether residuals are noise without memory.

Ljung and Box, Biometrika 65 (1978) 297; runs test of Wald and Wolfowitz, Ann. Math. Stat. 11
(1940) 147.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.report.numbers import percent, quantity
from identification.statistics.autoregression import autoregression
from identification.statistics.correlation import autocorrelation, pieces_of
from identification.statistics.memory import memory

LONGEST = 2000
EITHER = "noise with a memory, or something small is still missing"
"""What residuals are that are coloured and small: fits and diagnoses say the same."""


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Memory of one residual.

    Attributes
    ----------
    n : int
        Samples.
    dt : float, s
    correlations : ndarray, shape (lags + 1,)
        Autocorrelation; 1 at lag 0.
    band : float
        95 % of the correlations of white noise lie within +- this.
    q, degrees, p : float, int, float
        Ljung-Box statistic, its degrees of freedom, and the chance of a larger one from white
        noise.
    runs_z : float
        Runs above and below the median: negative z is fewer, longer runs than noise has.
    coloured_to : int
        Last lag of the first unbroken run of lags outside of the band; 0 if lag 1 is inside.
    memory : float
        Integrated autocorrelation time, samples, at least 1.
    predictable : float
        Share of the power that a linear predictor from its own past would remove.
    level : float
        Chance of calling white noise coloured.
    """

    n: int
    dt: float
    correlations: Array
    band: float
    q: float
    degrees: int
    p: float
    runs_z: float
    coloured_to: int
    memory: float
    predictable: float
    level: float = 0.05

    @property
    def white(self) -> bool:
        """Whether the Ljung-Box test does not reject white noise at `level`."""
        return self.p >= self.level

    @property
    def effective(self) -> float:
        """Samples of white noise that say as much about a slow quantity."""
        return self.n / self.memory

    @property
    def words(self) -> str:
        """One phrase.

        Examples
        --------
        >>> r = np.random.default_rng(0).normal(size=500)
        >>> whiteness(r, dt=1e-3).words
        'white'
        """
        if self.white:
            return "white"
        share = f"{percent(self.predictable)} of it predictable from its own past"
        if self.coloured_to == 0:
            lag = int(np.argmax(np.abs(self.correlations[1 : self.degrees + 1]))) + 1
            return f"coloured, most at lag {lag} ({quantity(lag * self.dt, 's', 3)}); {share}"
        k = self.coloured_to
        to = "beyond lag" if k >= self.correlations.size - 1 else "up to lag"
        return f"coloured {to} {k} ({quantity(k * self.dt, 's', 3)}); {share}"


def whiteness(
    residual: Array,
    dt: float = 1.0,
    usable: Array | None = None,
    *,
    predictor_parameters: int = 0,
    lags: int | None = None,
    level: float = 0.05,
) -> Whiteness:
    """Judge the memory of one residual.

    Parameters
    ----------
    residual : ndarray, shape (N,)
        Gaps may be NaN; pairs are never formed across a gap.
    dt : float, s
    usable : ndarray of bool, shape (N,), optional
    predictor_parameters : int
        Fitted numbers that act on past readings or past residuals: the noise model of a
        prediction-error fit. They take one degree of freedom each. Parameters of a simulation
        take none: its sensitivities depend on the inputs alone, so that the residuals keep the
        correlations of the noise up to terms of order p / N (Pierce, Biometrika 59 (1972) 349).
    lags : int, optional
        Lags of the Ljung-Box sum; ``10 log10 N`` if not given.
    level : float
        Chance of calling white noise coloured.

    Raises
    ------
    UnusableInput
        Fewer than eight samples.
    """
    pieces = pieces_of(residual, usable)
    n = sum(p.size for p in pieces)
    m = lags if lags is not None else round(10 * np.log10(n))
    m = int(max(predictor_parameters + 1, min(m, n // 4)))
    r = autocorrelation(pieces, min(n - 1, max(m, min(n // 4, LONGEST))))
    q, p = ljung_box(r, n, m, predictor_parameters)
    band = 1.96 / np.sqrt(n)
    return Whiteness(
        n, dt, r, float(band), q, m - predictor_parameters, p,
        runs(pieces), _coloured_to(r, band), memory(r, n),
        1.0 - autoregression(r, n).innovation, level,
    )  # fmt: skip


def ljung_box(correlations: Array, n: int, lags: int, parameters: int = 0) -> tuple[float, float]:
    """Return the Ljung-Box statistic and the chance of a larger one from white noise.

    Parameters
    ----------
    correlations : ndarray, shape (lags + 1,) or longer
        Autocorrelation, 1 at lag 0, of `n` samples.
    parameters : int
        Degrees of freedom that a fitted predictor took.
    """
    from scipy.stats import chi2

    k = np.arange(1, lags + 1)
    q = float(n * (n + 2) * np.sum(correlations[1 : lags + 1] ** 2 / (n - k)))
    return q, float(chi2.sf(q, lags - parameters))


def white_p(e: Array, lags: int = 20) -> float:
    """p-value of the hypothesis that `e` (shape (N,), NaN where missing) is white; 1 if too short.

    Examples
    --------
    >>> e = np.random.default_rng(1).standard_normal(2000)
    >>> white_p(e) > 0.01, white_p(np.cumsum(e)) < 1e-6
    (True, True)
    """
    seen = np.isfinite(e)
    n = int(seen.sum())
    lags = min(lags, n // 5)
    if lags < 1:
        return 1.0
    # missing samples leave out their products
    filled = np.where(seen, e - e[seen].mean(), 0.0)
    return ljung_box(autocorrelation([filled], lags), n, lags)[1]


def runs(pieces: list[Array]) -> float:
    """Standardised number of runs above and below the median."""
    both = np.concatenate(pieces)
    above = both > np.median(both)
    n1, n2 = int(above.sum()), int((~above).sum())
    if n1 == 0 or n2 == 0:
        return float("-inf")
    starts = np.cumsum([0, *(p.size for p in pieces)])[:-1]
    change = np.concatenate([[True], above[1:] != above[:-1]])
    # the joint of two stretches counts as any other pair: it is no more alike than noise
    count = int(change.sum()) if starts.size else 0
    n = n1 + n2
    mean = 2 * n1 * n2 / n + 1
    variance = (mean - 1) * (mean - 2) / (n - 1)
    return float((count - mean) / np.sqrt(variance)) if variance > 0 else 0.0


def _coloured_to(r: Array, band: float) -> int:
    """Lag before the first three lags in a row inside of the band."""
    inside = np.abs(r[1:]) <= band
    if inside.size < 3:
        return 0 if inside[:1].all() else int(inside.size)
    quiet = inside[:-2] & inside[1:-1] & inside[2:]
    first = np.flatnonzero(quiet)
    return int(first[0]) if first.size else int(inside.size)
