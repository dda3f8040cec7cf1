"""Does the residual still follow an input? Which lags say dynamics, which say feedback.

The input is whitened by an autoregression and the residual passes the same filter, so that a lag
of the correlation is a lag of the missing response (Box and Jenkins, Time Series Analysis, 1970,
ch. 11). The bands keep the colour of both (Bartlett, J. R. Stat. Soc. 98 (1935) 536): the variance
of a correlation of two independent series is the sum of the products of their autocorrelations
over N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz, toeplitz

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.correlation import autocorrelation, correlate, stretches
from identification.statistics.memory import memory

REGULAR = 0.5
# an input whose whitened self still correlates this much has no lags to tell apart


@dataclass(frozen=True, eq=False)
class CrossCorrelation:
    """Residual of one reading against one input.

    Attributes
    ----------
    lags : ndarray, shape (2 M + 1,)
        Samples; positive where the residual follows the input.
    correlations : ndarray, shape (2 M + 1,)
    band : float
        95 % of the correlations of independent series of these colours lie within +- this.
    causal_p, anticausal_p : float
        Chance of a larger sum over lags 0 .. M, and over -M .. -1, if they are independent; the
        lags' dependence is in it.
    regular : bool
        The input repeats or is too smooth to tell one lag from another.
    level : float
        Chance of a false alarm of each of the two tests.
    """

    channel: str
    input: str
    n: int
    dt: float
    lags: Array
    correlations: Array
    band: float
    causal_p: float
    anticausal_p: float
    regular: bool
    level: float = 0.05

    @property
    def causal(self) -> bool:
        """Whether the residual follows the input, at `level`."""
        return self.causal_p < self.level

    @property
    def anticausal(self) -> bool:
        """Whether the residual runs ahead of the input, at `level`."""
        return self.anticausal_p < self.level

    @property
    def words(self) -> str:
        """One phrase: independent, or what the lags say."""
        if not (self.causal or self.anticausal):
            return f"independent of {self.input}"
        if self.regular:
            return (
                f"follows {self.input}; the input is too regular to tell lags apart: something "
                "of the response is missing, and a less regular input would say what"
            )
        said = []
        if self.causal:
            said.append(f"follows {self.input} {self._where(self.lags >= 0)}")
        if self.anticausal:
            said.append(f"runs ahead of {self.input} {self._where(self.lags < 0)}: {self._ahead}")
        return "; ".join(said)

    @property
    def _ahead(self) -> str:
        before = self.lags < 0
        if self.lags[before][np.argmax(np.abs(self.correlations[before]))] >= -2:
            return "another course of the input between samples (hold), a shift, or feedback"
        return "feedback in the recording, or a reading stamped too early (a delay or clock)"

    def _where(self, side: Array) -> str:
        outside = np.flatnonzero(side & (np.abs(self.correlations) > self.band))
        if not outside.size:
            return "weakly over many lags"
        lags = self.lags[outside]
        top = int(self.lags[side][np.argmax(np.abs(self.correlations[side]))])
        peak = f"most at lag {top} ({top * self.dt * 1e3:.3g} ms)"
        if top < 0:
            return peak
        first, last = int(lags.min()), int(lags.max())
        if last <= 2:
            return f"{peak}, at once: gain, direct path or a shift of a sample"
        if first >= 3 and outside.size <= 3:
            return f"{peak} alone: a path delayed by {first} samples may be missing"
        return f"{peak}, lags {first} to {last}: dynamics are missing"


def cross_correlation(
    residual: Array,
    drive: Array,
    dt: float = 1.0,
    usable: Array | None = None,
    *,
    channel: str = "residual",
    name: str = "input",
    level: float = 0.05,
) -> CrossCorrelation:
    """Correlate a residual with an input.

    Training residuals of a fitted linear model are made nearly independent of the input by the
    fit, so the test is then cautious; on held-out samples it is exact for long records.

    Parameters
    ----------
    residual, drive : ndarray, shape (N,)
    dt : float, s
    usable : ndarray of bool, shape (N,), optional
    level : float
        Chance of a false alarm of each of the two tests; divide 0.05 by the number of tests made.

    Raises
    ------
    UnusableInput
        The input does not move, or fewer than 32 samples are scored.
    """
    good = np.isfinite(residual) & np.isfinite(drive)
    good = good if usable is None else good & usable
    n = int(good.sum())
    if n < 32:
        raise UnusableInput(f"{channel} and {name}: {n} samples are too few; score at least 32")
    u = np.asarray(drive, float)
    if not np.ptp(u[good]) > 0:
        raise UnusableInput(f"{name} does not move where {channel} is scored; nothing to follow")
    m = int(max(1, min(round(10 * np.log10(n)), n // 8)))
    e_pieces, u_pieces = _whitened(residual, u, good, m)
    n = sum(p.size for p in e_pieces)
    sums = correlate(e_pieces, u_pieces, m)
    power = sum(float(p @ p) for p in e_pieces) * sum(float(p @ p) for p in u_pieces)
    r = sums / np.sqrt(power) if power > 0 else np.zeros_like(sums)
    spread, regular = _bartlett(e_pieces, u_pieces, m)
    return CrossCorrelation(
        channel, name, n, dt, np.arange(-m, m + 1), r,
        float(1.96 * np.sqrt(spread[0] / n)),
        _joint(r[m:], spread, n), _joint(r[:m], spread, n), regular, level,
    )  # fmt: skip


def _whitened(e: Array, u: Array, good: Array, lags: int) -> tuple[list[Array], list[Array]]:
    """Both series through the filter that whitens the input; the filter's start is dropped."""
    parts = [s for s in stretches(good) if s.stop - s.start > 8]
    mean_e, mean_u = float(e[good].mean()), float(u[good].mean())
    inputs = [u[s] - mean_u for s in parts]
    order = int(min(20, lags))
    r = autocorrelation(inputs, order)
    damped = r.copy()
    damped[0] += 1e-4  # a deterministic input is not amplified without end
    if not order or np.abs(r[1:]).max() < 2.0 / np.sqrt(good.sum()):
        taps = np.ones(1)
    else:
        taps = np.concatenate([[1.0], -solve_toeplitz(damped[:-1], damped[1:])])
    drop = taps.size - 1
    kept = [s for s in parts if s.stop - s.start > drop + 8] or parts
    found_e = [np.convolve(e[s] - mean_e, taps, "valid") for s in kept]
    found_u = [np.convolve(u[s] - mean_u, taps, "valid") for s in kept]
    return _centred(found_e), _centred(found_u)


def _centred(pieces: list[Array]) -> list[Array]:
    mean = float(np.concatenate(pieces).mean())
    return [p - mean for p in pieces]


def _bartlett(e: list[Array], u: list[Array], m: int) -> tuple[Array, bool]:
    """Covariance of the correlations at lags apart by 0 .. m, times N; and whether u is regular.

    ``c_d = sum_k r_ee(k) r_uu(k + d)``, with r_ee tapered where only its own noise is left.
    """
    n = sum(p.size for p in e)
    r_e = autocorrelation(e, min(n - 1, max(50, n // 4)))
    reach = int(min(r_e.size - 1, max(m, np.ceil(6 * memory(np.abs(r_e), n)))))
    taper = 0.5 * (1 + np.cos(np.pi * np.arange(reach + 1) / (reach + 1)))
    half = r_e[: reach + 1] * taper
    both = np.concatenate([half[:0:-1], half])
    r_u = autocorrelation(u, min(n - 1, reach + m))
    if r_u.size < reach + m + 1:
        r_u = np.concatenate([r_u, np.zeros(reach + m + 1 - r_u.size)])
    far = np.concatenate([r_u[:0:-1], r_u])
    centre = r_u.size - 1
    c = np.array([both @ far[centre + d - reach : centre + d + reach + 1] for d in range(m + 1)])
    whole = autocorrelation(u, min(n - 1, n // 2))
    regular = bool(np.abs(whole[1:]).max(initial=0.0) > REGULAR)
    return np.maximum(c, 0.0) if c[0] <= 0 else c, regular


def _joint(r: Array, covariance: Array, n: int) -> float:
    """Chance of a larger weighted sum of squares; directions without variance are left out."""
    from scipy.stats import chi2

    if not covariance[0] > 0 or r.size == 0:
        return 1.0
    values, vectors = np.linalg.eigh(toeplitz(covariance[: r.size]))
    kept = values > 1e-2 * values[-1]
    z = vectors[:, kept].T @ r
    return float(chi2.sf(float(n * np.sum(z**2 / values[kept])), int(kept.sum())))
