"""Whether what the last fit leaves has memory, and what that means for the intervals."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from bondgraph.support.errors import UnusableInput
from identification.diagnosis.evidence.remaining import level_of, remaining
from identification.estimation.single_record import Fit
from identification.report.words import listed
from identification.statistics.whiteness import EITHER, whiteness

SURE = 1e-3
"""Chance of calling white noise coloured."""
SEEN = 0.05
"""Share of what is left that its own past must foretell: of long records any trace is sure."""
NOISE = 2.0
"""Times the noise, rms, below which what is left may be noise with a memory."""
WELL_BELOW = 0.2
"""Times the noise below which what is left is nothing to speak of, whatever its colour."""
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
        if not WELL_BELOW <= level[c] < NOISE:
            continue
        try:
            seen = whiteness(left[:, c], data.dt, scored, level=SURE)
        except UnusableInput:
            continue
        if not seen.white and seen.predictable >= SEEN:
            found[n] = seen.predictable
    return found


def colour_notes(last: Fit, given: Collection[str] = ()) -> tuple[str, ...]:
    """Say that residuals have memory, and what the intervals make of it.

    Parameters
    ----------
    given : collection of str
        Readings whose noise the user has stated: what is left within it is noise.
    """
    found, level = coloured(last), dict(zip(last.problem.data.names, level_of(last), strict=True))
    within = {n: v for n, v in found.items() if n in given and level[n] <= WITHIN}
    open_ones = {n: v for n, v in found.items() if n not in within}
    notes = []
    if within:
        notes.append(
            f"{COLOURED}, not white: its own past foretells {_shares(within)}. It is within the "
            "noise you gave, so it is taken for noise with a memory; the 95 % intervals allow for "
            "it"
        )
    if open_ones:
        more = [n for n in open_ones if n not in given and level[n] > LOUDER]
        are = "are" if len(more) > 1 else "is"
        state = (
            f". If {listed(more)} {are} known to be as noisy, say so with noise={{SENSOR: VALUE}}"
        )
        notes.append(
            f"{COLOURED}, not white: its own past foretells {_shares(open_ones)}. It is {EITHER}. "
            "The 95 % intervals allow for such noise, but not for a law that is slightly wrong: "
            "then they are too narrow"
            f"{state if more else ''}"
        )
    return tuple(notes)


def too_narrow(last: Fit) -> tuple[str, ...]:
    """Say that intervals are too narrow where a law leaves more than noise with a memory."""
    level = remaining(last).over_noise
    loud = [f"{v:.3g} times the noise of {n}" for n, v in level.items() if v >= NOISE]
    if not loud:
        return ()
    return (
        f"what is left is {listed(loud)}, more than noise as a rule: what was named is "
        "slightly wrong, or more is missing. The 95 % intervals do not allow for that, and are too "
        "narrow then",
    )


WITHIN = 1.1
"""Times a noise up to which what is left is within it: slow noise is louder now and then."""
LOUDER = 1.1
"""Times a noise that was read off the recording, from which it is worth a word to state it."""


def _shares(found: Mapping[str, float]) -> str:
    return listed([f"{100 * v:.0f} % of that of {n}" for n, v in found.items()])
