"""When commands are taken to behave otherwise between samples than they usually do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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


def chosen(costs: Mapping[str, float], usual: str) -> str:
    """Return the behaviour with the least misfit if that speaks against the usual one.

    Parameters
    ----------
    costs : mapping of str to float
        Mean square misfit of a fit with each behaviour.
    usual : str
        Kept unless another is clearly better; where it is not possible, linear is.

    Examples
    --------
    >>> chosen({"hold": 1.0, "linear": 0.9}, "hold"), chosen({"hold": 1.0, "linear": 0.99}, "hold")
    ('linear', 'hold')
    """
    best = min(costs, key=lambda hold: costs[hold])
    usual = usual if usual in costs else "linear" if "linear" in costs else best
    return best if costs[best] < CLEARLY * costs[usual] else usual
