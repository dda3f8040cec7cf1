"""Whether what the last fit leaves has memory, and what that means for the intervals."""

from __future__ import annotations

from bondgraph.support.errors import UnusableInput
from identification.diagnosis.evidence.remaining import level_of
from identification.estimation.single_record import Fit
from identification.report.words import listed
from identification.statistics.whiteness import whiteness

SURE = 1e-3
"""Chance of calling white noise coloured."""
SEEN = 0.05
"""Share of what is left that its own past must foretell: of long records any trace is sure."""
NOISE = 2.0
"""Times the noise, rms, below which what is left may be noise with a memory."""
COLOURED = "what is left is coloured"
"""How the note begins."""


def coloured(last: Fit) -> dict[str, float]:
    """Return the share of what is left that its own past foretells, of readings where that shows.

    Intervals of a fit allow for it already: of the inverse information and the block sandwich they
    take the wider one. A law that is slightly wrong they cannot allow for.
    """
    data, found, level = last.problem.data, {}, level_of(last)
    scored = data.mask("train") | data.mask("held-out")
    left = data.readings - last.simulated
    for c, n in enumerate(data.names):
        if not level[c] < NOISE:
            continue
        try:
            seen = whiteness(left[:, c], data.dt, scored, level=SURE)
        except UnusableInput:
            continue
        if not seen.white and seen.predictable >= SEEN:
            found[n] = seen.predictable
    return found


def colour_notes(last: Fit) -> tuple[str, ...]:
    """Say that residuals have memory, and what the intervals make of it."""
    found = coloured(last)
    if not found:
        return ()
    shares = listed([f"{100 * v:.0f} % of that of {n}" for n, v in found.items()])
    return (
        f"{COLOURED}, not white: its own past foretells {shares}. It is noise with a memory, or "
        "something small is still missing. The 95 % intervals allow for such noise, but not for a "
        "law that is slightly wrong: then they are too narrow",
    )
