"""What is done to the samples of an interferometer before they are aligned; raw data stay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.optics import (
    HELIUM_NEON,
    Ellipse,
    displacement_per_fringe,
    find_miscounts,
    fit_ellipse,
    quadrature_displacement,
)
from hardware.optics.step_filter import HALF, step_estimates
from hardware.storage import StreamData
from hardware.synchrony import LENGTH

SHORTEST = 64
"""Samples below which nothing is looked for."""
LEAST = 0.25
"""Share of a fringe from which on a step of the command may look like a lost one."""


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedStream:
    """A stream after its corrections.

    Attributes
    ----------
    stream : StreamData
        The same samples; ``x`` from the quadrature where that was recorded, flags added.
    sentences : tuple of str
        What was done, and what was seen.
    """

    stream: StreamData
    sentences: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class HeldCommand:
    """The voltage that was commanded at every sample of a sensor, as well as it is known.

    Attributes
    ----------
    volts : ndarray
        (n,), V.
    spare : int
        Samples by which it may belong to others.
    """

    volts: NDArray[np.float64]
    spare: int = 0


def corrected(
    stream: StreamData,
    index: float,
    known: Ellipse | None = None,
    command: HeldCommand | None = None,
) -> CorrectedStream:
    """Correct the periodic error if sine and cosine are there, and look for lost fringes.

    Parameters
    ----------
    stream : StreamData
        Of the interferometer: displacement (m), perhaps ``sin`` and ``cos``.
    index : float
        Refraction index of the air.
    known : Ellipse, optional
        Of a calibration; used where the record covers too little of a fringe for a fit.
    command : HeldCommand, optional
        Where it steps, a jump of the displacement is no lost fringe.
    """
    if LENGTH not in stream.channels or stream.n < SHORTEST:
        return CorrectedStream(stream, ())
    found, said = _without_periodic_error(stream, index, known)
    marked, seen = _with_miscounts(found, index, command)
    return CorrectedStream(marked, (*said, *seen))


def _without_periodic_error(
    stream: StreamData, index: float, known: Ellipse | None
) -> tuple[StreamData, tuple[str, ...]]:
    """Take the displacement from raw quadrature by Heydemann's correction."""
    channels = dict(stream.channels)
    if not {"sin", "cos"} <= set(channels):
        return stream, ()
    cosine, sine = channels.pop("cos"), channels.pop("sin")
    layout = replace(stream.layout, units=_without(stream.layout.units, ("sin", "cos")))
    kept = replace(stream, channels=channels, layout=layout)
    try:
        fit = fit_ellipse(cosine, sine, known)
        x = quadrature_displacement(cosine, sine, fit.ellipse, HELIUM_NEON, index)
    except UnusableInput as error:
        return kept, (f"periodic error not corrected: {error}",)
    change = x - x[0] - (channels[LENGTH] - channels[LENGTH][0])
    if float(np.ptp(change)) > 0.5 * displacement_per_fringe(HELIUM_NEON, index):
        return kept, (
            "periodic error not corrected: quadrature and counter disagree by more than half a "
            "fringe; the motion is too fast for the rate of the samples",
        )
    channels[LENGTH] = x - x[0] + channels[LENGTH][0]
    e = fit.ellipse
    sentence = (
        f"periodic error corrected over {fit.arc:.2g} fringes"
        f"{', by the calibration of the station' if fit.kept else ''}: offsets "
        f"{e.offset_1 / e.radius:.2%} and {e.offset_2 / e.radius:.2%}, ratio {e.ratio:.4g}, "
        f"{np.degrees(e.skew):.3g} deg; changes of up to {1e9 * float(np.ptp(change)):.2g} nm"
    )
    return replace(kept, channels=channels), (sentence,)


def _with_miscounts(
    stream: StreamData, index: float, command: HeldCommand | None
) -> tuple[StreamData, tuple[str, ...]]:
    """Flag jumps of whole fringes; nothing is repaired."""
    flags = stream.flags.copy()
    said: list[str] = []
    where: list[str] = []
    # across lost samples the motion goes on unseen: every stretch is judged for itself
    edges = [0, *(np.flatnonzero(np.diff(stream.numbers) > 1) + 1).tolist(), stream.n]
    for a, b in pairwise(edges):
        if b - a < SHORTEST:
            continue
        try:
            fringe = displacement_per_fringe(HELIUM_NEON, index)
            x = stream.channels[LENGTH][a:b]
            found = find_miscounts(x, fringe)
            whole = [j for j in found.jumps if j.whole]
            stepped = _stepped(x, fringe, command, a, b) if whole else None
            if stepped is not None and any(stepped[j.sample] for j in whole):
                found = find_miscounts(x, fringe, stepped)
        except UnusableInput as error:
            said.append(f"lost fringes not looked for: {error}")
            continue
        if not found.able:
            said.append(
                "a lost fringe would not be seen: the motion between samples is too large for that"
            )
            continue
        whole = [j for j in found.jumps if j.whole]
        where += [f"{j.fringes:+d} at sample {stream.numbers[a + j.sample]}" for j in whole]
        if whole:
            flags[a:b] |= found.flags & np.uint16(Flag.MISCOUNT)
            flags[b:] |= np.uint16(Flag.MISCOUNT)
    if where:
        said.append(
            f"the counter seems to have jumped by whole fringes ({', '.join(where[:5])}); samples "
            "behind are flagged, nothing was repaired: hardware.optics.repaired removes the jumps"
        )
    return replace(stream, flags=flags), tuple(dict.fromkeys(said))


def _stepped(
    x: NDArray[np.float64], fringe: float, command: HeldCommand | None, a: int, b: int
) -> NDArray[np.bool_] | None:
    """Return where the command itself steps so far that a fringe may go by; None if nowhere."""
    if command is None or not (volts := float(np.ptp(command.volts[a:b]))):
        return None
    steps = np.abs(step_estimates(command.volts[a:b])) * (float(np.ptp(x)) / volts)
    reach = HALF + 2 + command.spare
    near = np.flatnonzero(steps > LEAST * fringe)
    marks = np.zeros(x.size + 1, np.int64)
    np.add.at(marks, np.maximum(near - reach, 0), 1)
    np.add.at(marks, np.minimum(near + reach + 1, x.size), -1)
    return np.cumsum(marks)[:-1] > 0


def _without(units: Mapping[str, str], names: tuple[str, ...]) -> dict[str, str]:
    return {k: u for k, u in units.items() if k not in names}
