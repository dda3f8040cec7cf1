"""All regions of a fit, ranked by how much misfit they gather, without saying one thing twice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.axes import MisfitAxis, port_axes, time_axis
from identification.diagnosis.localisation.recording.bands import bands
from identification.diagnosis.localisation.recording.region import Region
from identification.diagnosis.localisation.recording.scan import stretches
from identification.diagnosis.screening.port_history import PortHistory
from identification.estimation.single_record import Fit

MOST = 12
CERTAIN = 4.0
DENSE = 1.2
ALIKE = 0.5
MOSTLY = 0.9
"""Part of a wider band's misfit in a narrower one with which the wider says nothing more."""
PREFERRED = 1.1


@dataclass(frozen=True, eq=False)
class _Found:
    region: Region
    inside: Array | None
    weight: float


def where(
    fit: Fit,
    past: Mapping[str, PortHistory] | None = None,
    places: Iterable[str] = (),
    most: int = MOST,
) -> tuple[Region, ...]:
    """Rank the regions in which `fit` fails.

    Every reading is scanned along time, along amplitude, velocity and history of every port, and
    along frequency. A region counts if its misfit exceeds that of the rest by 4 standard errors
    (the ends are searched for, some 500 pairs an axis) and is 1.2 times as dense.

    Parameters
    ----------
    past : mapping of str to PortHistory, optional
        Variables of the ports by element; the commands of the recording when not given.
    places : iterable of str
        Elements under suspicion: at equal evidence a region is told in their variables.

    Returns
    -------
    tuple of Region
        Most concentrated first; two that hold mostly the same samples are one.
    """
    data = fit.problem.data
    scored = (data.mask("train") | data.mask("test")) & np.isfinite(fit.simulated).all(axis=1)
    if scored.sum() < 64:
        return ()
    if past is None:
        past = {n: PortHistory(u, u, data.dt) for n, u in data.commands.items() if np.ptp(u) > 0}
    preferred = tuple(places)
    ports = port_axes(fit.problem.graph, past.items(), preferred, data.read_in)
    axes = (time_axis(data.time), *ports)
    residual = (data.readings - fit.simulated)[scored]
    found: list[_Found] = []
    for c, name in enumerate(data.names):
        floor = float(data.floor[c])
        square = (residual[:, c] / floor) ** 2
        for axis in axes:
            found += _along(axis, name, square, scored, preferred)
        for b in bands(residual[:, c], floor, data.dt):
            r = Region(
                "frequency", b.low, b.high, b.share, b.share / b.part, "Hz", name, "frequency", "",
                b.times, b.z,
            )  # fmt: skip
            found.append(_Found(r, None, r.gain))
    return distinct([f for f in found if _counts(f.region)])[:most]


def _along(
    axis: MisfitAxis, channel: str, square: Array, scored: Array, preferred: tuple[str, ...]
) -> list[_Found]:
    values = axis.values[scored]
    if not np.isfinite(values).all() or not np.ptp(values) > 0:
        return []
    timed = axis.kind == "time"
    found = []
    for s in stretches(values, square, 3 if timed else 2, even=timed, bins=40 if timed else 32):
        r = Region(
            axis.name, s.low, s.high, s.share, s.share / max(s.part, 1e-12), axis.unit, channel,
            axis.kind, axis.element, s.times, s.z,
        )  # fmt: skip
        weight = r.gain * (PREFERRED if axis.element in preferred else 1.0)
        found.append(_Found(r, s.inside, weight))
    return found


def _counts(r: Region) -> bool:
    return r.z > CERTAIN and r.density > DENSE and r.times > 1.0


def distinct(found: Iterable[_Found]) -> tuple[Region, ...]:
    """Rank; a region that holds mostly the samples (or the band) of a better one is left out."""
    kept: list[_Found] = []
    for f in sorted(found, key=lambda f: -f.weight):
        if not any(_alike(f, k) for k in kept):
            kept.append(f)
    return tuple(f.region for f in kept)


def _alike(a: _Found, b: _Found) -> bool:
    if a.inside is None or b.inside is None:
        if a.inside is not b.inside:
            return False
        low, high = max(a.region.low, b.region.low), min(a.region.high, b.region.high)
        span = max(a.region.high, b.region.high) - min(a.region.low, b.region.low)
        return high - low > ALIKE * span or _adds_little(a.region, b.region)
    both = float(np.sum(a.inside & b.inside))
    either = float(np.sum(a.inside | b.inside))
    return either > 0 and both / either > ALIKE


def _adds_little(a: Region, b: Region) -> bool:
    """Whether of two bands of one reading the wider has hardly more misfit than the other in it."""
    wide, narrow = (a, b) if a.high - a.low > b.high - b.low else (b, a)
    within = wide.low <= narrow.low and narrow.high <= wide.high
    return a.channel == b.channel and within and narrow.share > MOSTLY * wide.share
