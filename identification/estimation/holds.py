"""When commands are taken to behave otherwise between samples than they usually do."""

from __future__ import annotations

from collections.abc import Iterable

CLEARLY = 0.97
"""Part of the misfit (mean square) that another behaviour leaves at most: half a sample more or
less of a lag changes nearly as much."""


def possible(holds: Iterable[str], input_rates: Iterable[str]) -> tuple[str, ...]:
    """Return behaviours that a model allows: an input that jumps has no rate.

    Parameters
    ----------
    input_rates : iterable of str
        Rates of inputs that the equations need.

    Examples
    --------
    >>> possible(("linear", "hold"), ("d_F",))
    ('linear',)
    """
    jumps = not tuple(input_rates)
    return tuple(h for h in holds if jumps or h != "hold")


def clearly_better(other: float, usual: float) -> bool:
    """Whether the misfit under another behaviour speaks against the usual one.

    Examples
    --------
    >>> clearly_better(0.9, 1.0), clearly_better(0.99, 1.0)
    (True, False)
    """
    return other < CLEARLY * usual
