"""Noise that grows with the reading: a constant part and a share of what is read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.correlation import autocorrelation

SURE = 8.0
"""Standard errors of the rank correlation of sizes from which noise grows."""
COUNTS = 0.5
"""Typical growing part, over the constant one, below which it makes no difference."""
MEMORY = 0.1
"""Autocorrelation above which a rest is no noise that grows, but follows something."""
LAGS = 20
CUT = 4.0
"""Deviations beyond which an outlier counts as one there."""
FEWEST = 100


@dataclass(frozen=True)
class GrowingNoise:
    """Standard deviation ``sqrt(base^2 + (share y)^2)`` of the noise at a reading ``y``."""

    base: float
    share: float

    def at(self, y: Array) -> Array:
        """Return the standard deviation at readings."""
        return np.hypot(self.base, self.share * y)

    def of(self, name: str) -> str:
        """Say it of a reading."""
        return (
            f"the noise of {name} grows with the reading: {100 * self.share:.3g} % of it beside "
            f"{self.base:.3g} (SI)"
        )


def growing_noise(r: Array, y: Array) -> GrowingNoise | None:
    """Return the noise that a residual is, if it is one that grows with the reading, else None.

    Its size has to follow that of the reading (rank correlation), and what is left after dividing
    by the likeliest law must be without memory and no curve of the reading: physics left out grows
    with the motion too, but lasts from sample to sample. Likelihood of a variance function:
    Davidian and Carroll, J. Am. Stat. Assoc. 82 (1987) 1079.

    Parameters
    ----------
    r, y : ndarray, shape (N,), SI
        Residual and simulated reading, in the order of time.

    Raises
    ------
    UnusableInput
        They are not equally long.
    """
    from scipy.optimize import minimize_scalar
    from scipy.stats import rankdata

    if r.shape != y.shape:
        raise UnusableInput(
            f"a residual of shape {r.shape} and a reading of shape {y.shape}: give one for each"
        )
    size, most = np.abs(r), float(np.abs(y).max(initial=0.0))
    if r.size < FEWEST or not (np.ptp(size) > 0 and np.ptp(np.abs(y)) > 0):
        return None
    # Spearman's correlation; the library's own function takes its time for a p-value
    ranks = np.corrcoef(rankdata(size), rankdata(np.abs(y)))[0, 1]
    if ranks * np.sqrt(r.size - 1) < SURE:
        return None
    relative = y / most
    scale = float(2.0 ** np.floor(np.log2(size.max())))  # exact, and no square vanishes
    r = r / scale

    def base_at(ratio: float, square: Array) -> Array:
        return np.asarray(square / (1.0 + (ratio * relative) ** 2))

    square, ratio = r**2, 0.0
    for _ in range(2):  # the second time with outliers cut

        def loss(log_ratio: float, square: Array = square) -> float:
            k = float(np.exp(log_ratio))
            grown = np.log1p((k * relative) ** 2)
            return float(r.size * np.log(np.mean(base_at(k, square))) + np.sum(grown))

        ratio = float(np.exp(minimize_scalar(loss, bounds=(-3.0, 12.0), method="bounded").x))
        typical = np.mean(base_at(ratio, square)) * (1.0 + (ratio * relative) ** 2)
        square = np.minimum(r**2, CUT**2 * typical)
    base = float(np.sqrt(np.mean(base_at(ratio, square))))
    if ratio * float(np.sqrt(np.mean(relative**2))) < COUNTS:
        return None
    if not _is_noise(r / GrowingNoise(base, base * ratio).at(relative), relative):
        return None
    return GrowingNoise(scale * base, scale * base * ratio / most)


def _is_noise(u: Array, relative: Array) -> bool:
    cut = np.clip(u, -CUT, CUT)
    curve = np.stack([relative**k for k in range(4)], axis=1)
    left = cut - curve @ np.linalg.lstsq(curve, cut, rcond=None)[0]
    followed = 1.0 - float(left @ left) / float(cut @ cut)
    band = max(MEMORY, CUT / np.sqrt(u.size))
    most = float(np.abs(autocorrelation([cut], LAGS)[1:]).max())
    return bool(max(followed, most) < band)
