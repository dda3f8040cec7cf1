"""A part of an axis that carries more than its share of the misfit, and the words for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from identification.report.numbers import times_noise


@dataclass(frozen=True)
class Region:
    """Part of an axis that carries more than its share of the misfit.

    Attributes
    ----------
    axis : str
        What runs along it: ``time``, ``frequency``, ``displacement of k``, ``rate of V_in``.
    low, high : float, SI
    share : float
        Part of the channel's squared residual that falls here.
    density : float
        `share` over the part of the samples (or of the spectrum) that falls here.
    unit : str
    channel : str
        Reading whose misfit this is; empty for all of them.
    kind : str
        ``time``, ``frequency``, ``amplitude``, ``velocity`` or ``history``.
    element : str
        Port whose variable the axis is; empty for time and frequency.
    times : float
        Mean square residual here over the floor's (1 is noise).
    z : float
        Standard errors by which the region lies above the rest of the axis (of the floor, for
        frequencies).
    """

    axis: str
    low: float
    high: float
    share: float
    density: float
    unit: str
    channel: str = ""
    kind: str = "time"
    element: str = ""
    times: float = math.nan
    z: float = math.nan

    @property
    def part(self) -> float:
        """Part of the axis that the region covers."""
        return self.share / self.density if self.density > 0 else 1.0

    @property
    def gain(self) -> float:
        """Concentration, `share` less `part`: what regions are ranked by."""
        return self.share - self.part

    def __str__(self) -> str:
        """Sentence."""
        return words(self)


_FRAME = {
    "time": "between {low} and {high} {unit}",
    "frequency": "from {low} to {high} {unit}",
    "history": "where {axis} is between {low} and {high} {unit}",
}


def words(r: Region, spread: tuple[str, str, str] | None = None) -> str:
    """Sentence such as "between 3.1 and 4 s the misfit of x is 5 times its noise there".

    Parameters
    ----------
    spread : tuple of str, optional
        Both ends and the unit as they shall be written; plain SI numbers when not given.

    Examples
    --------
    >>> words(Region("time", 3.1, 4.0, 0.4, 3.3, "s", "", "time", "", 25.0, 7.2))
    'between 3.1 and 4 s the misfit is 5 times the noise there (40 % of it in 12 % of the time)'
    >>> words(Region("time", 3.1, 3.2, 0.4, 200.0, "s", "", "time", "", 5.0, 0.002))[-24:]
    'it in 0.2 % of the time)'
    """
    low, high, unit = spread or (_round(r.low, r), _round(r.high, r), r.unit)
    frame = _FRAME.get(r.kind, "where {axis} is between {low} and {high} {unit}")
    where = frame.format(low=low, high=high, unit=unit, axis=r.axis).strip()
    of = {"time": "the time", "frequency": "the band"}.get(r.kind, "the samples")
    whose, noise = (f" of {r.channel}", "its noise") if r.channel else ("", "the noise")
    known = math.isfinite(r.times)
    size = f"is {multiple(times_noise(r.times))} {noise} there" if known else "is concentrated"
    return (
        f"{where} the misfit{whose} {size} ({100 * r.share:.0f} % of it in {_part(r.part)} of {of})"
    )


def _part(part: float) -> str:
    return f"{100 * part:.0f} %" if part >= 0.01 else f"{100 * part:.1g} %"


def multiple(times: float) -> str:
    """Say how often: ``5 times``, ``1.3 times``, ``2.5 million times``.

    Examples
    --------
    >>> multiple(1.34), multiple(2509000.0)
    ('1.3 times', '2.5 million times')
    """
    for size, word in ((1e9, " billion"), (1e6, " million"), (1e4, " thousand")):
        if times >= size:
            v = times / (1e3 if size == 1e4 else size)
            return f"{v:.3g}{word} times" if v >= 100 else f"{v:.2g}{word} times"
    if times >= 100:
        return f"{float(f'{times:.2g}'):.0f} times"
    return f"{times:.2g} times"


def _round(v: float, region: Region) -> str:
    """Three digits of the larger end; rounding noise reads as zero."""
    size = max(abs(region.low), abs(region.high))
    return f"{0.0 if abs(v) < 1e-3 * size else v:.3g}"
