"""How far the model misses what it was and was not fitted to, beside the noise floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.statistics.bootstrap import mean_interval
from identification.validation.validation_data import ValidationRecord


@dataclass(frozen=True)
class Error:
    """Error of one reading of one record on one part.

    Attributes
    ----------
    part : str
        ``train`` or ``test``.
    n : int
        Samples scored; 0 leaves the rest NaN.
    rmse : float, SI
        Root mean square of measured less simulated.
    rmse_ci : (float, float), SI
        95 % interval from a block bootstrap of the squares; NaN if the part is shorter than
        eight blocks.
    fit : float
        100 % less `rmse` in per cent of the standard deviation of the reading on the part.
    bias : float, SI
        Mean of the residual.
    chi2, chi2_ci
        Mean square residual over the squared noise floor: 1 is the noise.
    worst : float, SI
        Largest absolute residual.
    """

    record: str
    channel: str
    unit: str
    part: str
    n: int
    floor: float
    rmse: float
    rmse_ci: tuple[float, float]
    fit: float
    bias: float
    chi2: float
    chi2_ci: tuple[float, float]
    worst: float

    @property
    def at_floor(self) -> bool:
        """Whether nothing but noise is left: the interval reaches down to 1.1 times the floor."""
        low = self.chi2_ci[0]
        return bool((low if np.isfinite(low) else self.chi2) <= 1.1)

    @property
    def misread(self) -> bool:
        """Whether so little is left that the floor was read off something else than noise."""
        high = self.chi2_ci[1]
        return bool((high if np.isfinite(high) else self.chi2) < MISREAD)


MISREAD = 0.25
"""Mean square over the floor below which that was no noise: half of it."""


def error(record: ValidationRecord, column: int, part: str) -> Error:
    """Error of one reading; samples where nothing was simulated do not count."""
    r = record.residual[:, column]
    use = record.part(part) & np.isfinite(r)
    residual, measured = r[use], record.measured[use, column]
    labels = record.name, record.names[column], record.units[column], part
    n, floor, nan = residual.size, float(record.floor[column]), float("nan")
    if n == 0:
        none = (nan, nan)
        return Error(*labels, 0, floor, nan, none, nan, nan, nan, none, nan)
    square = residual**2
    mean = float(square.mean())
    low, high = mean_interval(square)
    low = max(low, 0.0) if np.isfinite(low) else low
    rmse, spread = float(np.sqrt(mean)), float(measured.std())
    nrmse = rmse / spread if spread > 0 else float("inf")
    return Error(
        *labels, n, floor, rmse, (float(np.sqrt(low)), float(np.sqrt(high))),
        100.0 * (1.0 - nrmse), float(residual.mean()), mean / floor**2,
        (low / floor**2, high / floor**2), float(np.abs(residual).max()),
    )  # fmt: skip
