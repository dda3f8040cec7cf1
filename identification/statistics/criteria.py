"""Information criteria and the likelihood-ratio test, with the samples that coloured residuals are.

The likelihood is that of white noise of unknown level in each reading. Residuals with memory are
counted as ``N / tau`` samples, tau their integrated autocorrelation time: exact where the
sensitivities change slowly beside the residual, cautious elsewhere. Akaike, IEEE Trans. Autom.
Control 19 (1974) 716; Hurvich and Tsai, Biometrika 76 (1989) 297; Schwarz, Ann. Stat. 6 (1978) 461.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True)
class ResidualLevel:
    """Training residual of one reading of one record.

    Attributes
    ----------
    mean_square : float
        In any unit, the same for all fits that are compared.
    n : int
        Samples.
    memory : float
        Integrated autocorrelation time, samples.
    """

    mean_square: float
    n: int
    memory: float = 1.0

    @property
    def effective(self) -> float:
        """Samples of white noise that say as much."""
        return self.n / max(self.memory, 1.0)


@dataclass(frozen=True)
class Criteria:
    """Criteria of one fit; smaller is better, and only differences mean something.

    Attributes
    ----------
    n, effective : float
        Samples over all readings, and what they are worth.
    parameters : int
        Fitted numbers, one noise level a reading included.
    aic, aicc, bic : float
        With the effective number of samples.
    """

    n: float
    effective: float
    parameters: int
    aic: float
    aicc: float
    bic: float


def criteria(
    levels: Sequence[ResidualLevel], n_free: int, memories: Sequence[float] | None = None
) -> Criteria:
    """Information criteria of a fit.

    Parameters
    ----------
    levels : sequence of ResidualLevel
    n_free : int
        Numbers fitted, noise levels apart.
    memories : sequence of float, optional
        Memories to count with in place of the fit's own: the same for all fits compared.

    Raises
    ------
    UnusableInput
        A level without samples or without residual.

    Examples
    --------
    >>> found = criteria([ResidualLevel(1e-6, 1000)], n_free=3)
    >>> round(found.bic - found.aic, 3)
    19.631
    """
    own = [v.memory for v in levels] if memories is None else list(memories)
    if len(own) != len(levels) or not levels:
        raise UnusableInput(f"{len(levels)} levels and {len(own)} memories; give one each")
    for v in levels:
        if v.n < 1 or not v.mean_square > 0:
            raise UnusableInput(
                f"a residual of {v.mean_square:.3g} over {v.n} samples has no likelihood; "
                "criteria need scored samples that the model does not meet exactly"
            )
    k = n_free + len(levels)
    worth = np.array([v.n / max(t, 1.0) for v, t in zip(levels, own, strict=True)])
    total, fall = float(worth.sum()), float(worth @ np.log([v.mean_square for v in levels]))
    left = total - k - 1
    more = 2.0 * k * (k + 1) / left if left > 0 else float("inf")
    aic, bic = fall + 2.0 * k, fall + k * float(np.log(total))
    return Criteria(float(sum(v.n for v in levels)), total, k, aic, aic + more, bic)


@dataclass(frozen=True)
class LikelihoodRatio:
    """Whether a richer model fits better than a special case of it would by chance.

    Attributes
    ----------
    statistic : float
        Twice the logarithm of the ratio, with the effective samples.
    degrees : int
        Further parameters of the richer model.
    p : float
        Chance of a larger statistic if the simpler model is true.
    """

    statistic: float
    degrees: int
    p: float

    @property
    def words(self) -> str:
        """One sentence."""
        one = self.degrees == 1
        who = "the further parameter" if one else f"the {self.degrees} further parameters"
        if self.p < 0.05:
            word = "earns its place" if one else "earn their place"
        else:
            word = "is not needed" if one else "are not needed"
        return f"{who} {word} (p = {self.p:.2g})"


def likelihood_ratio(
    simpler: Sequence[ResidualLevel], richer: Sequence[ResidualLevel], degrees: int
) -> LikelihoodRatio:
    """Test a simpler fit against a richer one on the same samples (Wilks, 1938).

    The memory is that of the richer fit, whose residual is nearer to the noise. Where a further
    parameter lies at a bound under the simpler model, p is too large (cautious).

    Raises
    ------
    UnusableInput
        Different samples, or no further parameter.
    """
    from scipy.stats import chi2

    if [v.n for v in simpler] != [v.n for v in richer]:
        raise UnusableInput("the two fits do not score the same samples; fit both to the same data")
    if degrees < 1:
        raise UnusableInput(f"the richer fit has {degrees} further parameters; give nested fits")
    statistic = sum(
        b.effective * float(np.log(a.mean_square / b.mean_square))
        for a, b in zip(simpler, richer, strict=True)
    )
    statistic = max(statistic, 0.0)
    return LikelihoodRatio(statistic, degrees, float(chi2.sf(statistic, degrees)))
