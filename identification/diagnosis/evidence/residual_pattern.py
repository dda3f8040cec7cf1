"""What a residual still hides: the linear screening once more, with every generic dependence.

A residual in which nothing of the catalogue and no generic function of any port's variables finds
a pattern is noise, whatever its level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from identification.diagnosis.screening.score_test import Screened


@dataclass(frozen=True, eq=False)
class ResidualPattern:
    """The pattern that explains most of a residual.

    Attributes
    ----------
    share : float
        Part of the training misfit that one linear step with it would remove.
    z : float
        Standard errors by which that shows in stretches it was not fitted on.
    label : str
    """

    share: float
    z: float
    label: str

    def words(self) -> str:
        """One sentence."""
        return (
            f"a pattern is left in the residual: one like {self.label} would remove "
            f"{100 * self.share:.0f} % of it (z {self.z:.1f})"
        )


def strongest(ranked: Sequence[Screened], sure: float = 2.5) -> ResidualPattern:
    """Return the pattern with the largest share among those that show at all, else the surest."""
    known = [s for s in ranked if s.hint is not None]
    if not known:
        return ResidualPattern(0.0, 0.0, "nothing")
    clear = [s for s in known if s.z > sure]
    best = max(clear, key=lambda s: s.share) if clear else max(known, key=lambda s: s.z)
    return ResidualPattern(best.share, best.z, best.label)
