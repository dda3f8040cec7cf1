"""When commands are taken to behave otherwise between samples than they usually do."""

from __future__ import annotations

CLEARLY = 0.97
"""Part of the misfit (mean square) that another behaviour leaves at most: half a sample more or
less of a lag changes nearly as much."""


def clearly_better(other: float, usual: float) -> bool:
    """Whether the misfit under another behaviour speaks against the usual one.

    Examples
    --------
    >>> clearly_better(0.9, 1.0), clearly_better(0.99, 1.0)
    (True, False)
    """
    return other < CLEARLY * usual
