"""What must be said of samples that are not what they should be: lost, flagged, out of step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import Flag
from hardware.storage import StreamData
from hardware.synchrony import Alignment

Words = NDArray[np.uint16]

STEP = 0.4
"""Of a period: a lasting step between two clocks from which on an edge is too many or too few."""
WINDOW = 33
"""Samples over which a step must last; single instants that are noted late are no step."""


def of_losses(stream: StreamData) -> tuple[str, ...]:
    """Say how many samples of a stream are missing within it, and where the first is."""
    before = np.concatenate([[-1], stream.numbers[:-1]])
    missing = stream.numbers - before - 1
    total = int(missing.sum())
    if not total:
        return ()
    at = int(np.flatnonzero(missing)[0])
    return (
        f"{stream.layout.name}: {total} samples were lost, the first is {int(before[at]) + 1}; "
        "nothing was filled in",
    )


def of_flags(flags: Mapping[str, Words]) -> tuple[str, ...]:
    """Say which flags the samples of a recording carry, from where on."""
    said = []
    for stream, words in flags.items():
        every = int(np.bitwise_or.reduce(words)) if words.size else 0
        for flag in Flag:
            if flag and every & flag:
                on = np.flatnonzero(words & np.uint16(flag))
                said.append(
                    f"{stream}: {on.size} of {words.size} samples are flagged {flag.name}, the "
                    f"first is {int(on[0])}"
                )
    return tuple(said)


def slip(written: Array, taken: Array, rate: float) -> tuple[int, float] | None:
    """Find where edges of the sample clock and samples of the sensor stop to belong together.

    An edge too many (a disturbance on the line) or one that was missed moves all later samples by
    one period, and nothing else in the record shows it.

    Parameters
    ----------
    written : ndarray
        (N,), when each sample of the output was written, by the program's clock (s).
    taken : ndarray
        (N,), when the sensor took the sample of the same number, by its own clock (s).
    rate : float
        Of the output (Hz).

    Returns
    -------
    (int, float) or None
        First sample that may be out of step, and by how many periods the sensor is behind
        (negative: it has counted edges too many).
    """
    if written.size < 4:
        return None
    apart = ((taken - taken[0]) - (written - written[0])) * rate
    steady = median_filter(apart[1:], size=min(WINDOW, apart.size - 1), mode="nearest")
    first = float(steady[0] - apart[0])
    if abs(first) > STEP:
        return 0, first
    steps = np.flatnonzero(np.abs(np.diff(steady)) > STEP)
    if not steps.size:
        return None
    # the sample at an edge too many lies somewhere between two instants
    at = max(int(steps[0]) - 1, 0)
    return at + 2, float(steady[min(at + 3, steady.size - 1)] - steady[at])


def with_jitter_judged(found: Alignment, allowed: float) -> Alignment:
    """Return the alignment, marked if single instants scatter by more than is allowed (s)."""
    if not found.jitter - 2.0 * found.jitter_error > allowed:
        return found
    note = (
        f"single instants of the sensor scatter by {1e6 * found.jitter:.3g} us, "
        f"{1e6 * allowed:.3g} us allowed"
    )
    return replace(found, over_budget=True, notes=(*found.notes, note))
