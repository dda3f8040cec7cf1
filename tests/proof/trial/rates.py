"""A rate with its exact interval and bounds, and how surely it keeps a limit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binom, binomtest


@dataclass(frozen=True, slots=True)
class Rate:
    """`hits` of `total`; intervals and bounds are those of Clopper and Pearson.

    Examples
    --------
    >>> r = Rate(0, 149)
    >>> r.value, round(r.upper, 4), round(r.p_at_most(0.02), 4)
    (0.0, 0.0199, 0.0493)
    """

    hits: int
    total: int

    @property
    def value(self) -> float:
        """Point estimate; nan if there is nothing to count."""
        return self.hits / self.total if self.total else float("nan")

    @property
    def exact(self) -> tuple[float, float]:
        """95 % interval; everything if there is nothing to count."""
        return self._between(0.95)

    @property
    def upper(self) -> float:
        """One-sided upper 95 % bound."""
        return self._between(0.90)[1]

    @property
    def lower(self) -> float:
        """One-sided lower 95 % bound."""
        return self._between(0.90)[0]

    def p_at_most(self, limit: float) -> float:
        """Probability of so few hits if the true rate were the limit; 1 without a count."""
        return float(binom.cdf(self.hits, self.total, limit)) if self.total else 1.0

    def p_at_least(self, limit: float) -> float:
        """Probability of so many hits if the true rate were the limit; 1 without a count."""
        return float(binom.sf(self.hits - 1, self.total, limit)) if self.total else 1.0

    def _between(self, level: float) -> tuple[float, float]:
        if not self.total:
            return 0.0, 1.0
        found = binomtest(self.hits, self.total).proportion_ci(level, method="exact")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        """Text with the interval, such as ``2/150  1.3 % (0.2-4.7)``."""
        if not self.total:
            return "0/0"
        low, high = self.exact
        return (
            f"{self.hits}/{self.total}  {100 * self.value:.1f} % ({100 * low:.1f}-{100 * high:.1f})"
        )


def rate(outcomes: Iterable[bool]) -> Rate:
    """Count the true ones."""
    found = list(outcomes)
    return Rate(sum(found), len(found))
