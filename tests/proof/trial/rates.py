"""A rate with its 95 % interval."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest


@dataclass(frozen=True, slots=True)
class Rate:
    """`hits` of `total`.

    Examples
    --------
    >>> r = Rate(1, 10)
    >>> r.value, [round(x, 4) for x in r.interval]
    (0.1, [0.0179, 0.4042])
    """

    hits: int
    total: int

    @property
    def value(self) -> float:
        """Point estimate; nan if there is nothing to count."""
        return self.hits / self.total if self.total else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval; everything if there is nothing to count."""
        if not self.total:
            return 0.0, 1.0
        found = binomtest(self.hits, self.total).proportion_ci(0.95, method="wilson")
        return float(found.low), float(found.high)

    @property
    def exact(self) -> tuple[float, float]:
        """Exact 95 % interval (Clopper and Pearson); everything if there is nothing to count."""
        if not self.total:
            return 0.0, 1.0
        found = binomtest(self.hits, self.total).proportion_ci(0.95, method="exact")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        """Text such as ``2/150 = 1.3 % (0.4 to 4.7)``."""
        if not self.total:
            return "0/0"
        low, high = self.interval
        return (
            f"{self.hits}/{self.total} = {100 * self.value:.1f} % "
            f"({100 * low:.1f} to {100 * high:.1f})"
        )


def rate(outcomes: Iterable[bool]) -> Rate:
    """Count the true ones."""
    found = list(outcomes)
    return Rate(sum(found), len(found))
