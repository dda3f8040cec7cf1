"""Where the drive repeats: what of a residual is noise, and what is even or odd distortion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.experiments.frequency import Distortions, distortions
from identification.validation.validation_data import ValidationRecord


@dataclass(frozen=True, eq=False)
class Separated:
    """Readings and residuals of one record, line by line.

    Attributes
    ----------
    reading : Distortions
        Of the readings: excited lines, noise, even and odd detection lines.
    residual : ndarray, shape (F, n_y), SI
        Peak amplitude of the residual, mean over the periods, at the same lines; NaN where the
        simulation does not cover the periods.
    """

    record: str
    reading: Distortions
    residual: Array

    def left(self, channel: str) -> float:
        """Root mean square amplitude that the model leaves at the excited lines, SI."""
        c = self.reading.outputs.index(channel)
        return float(np.sqrt(np.mean(self.residual[self.reading.kind == "excited", c] ** 2)))

    def words(self, channel: str) -> str:
        """One sentence on a reading: levels, and what the model leaves at the excited lines."""
        level, left = self.reading.level(channel), self.left(channel)
        said = str(level)
        if np.isfinite(left) and level.linear > 0:
            said += f"; the model leaves {100 * left / level.linear:.3g} % at the excited lines"
        return said


def separate(record: ValidationRecord) -> Separated | None:
    """Separate noise and distortion; None where the drive does not repeat or does not move.

    The periods are those of the first moving input; all of the record is used.
    """
    moving = [n for n, u in record.inputs.items() if np.ptp(u) > 0]
    if not moving:
        return None
    kept = np.nan_to_num(record.residual)
    channels = {n: np.asarray(record.inputs[n], float) for n in moving[:1]}
    units = dict.fromkeys(channels, "1")
    for c, (n, u) in enumerate(zip(record.names, record.units, strict=True)):
        channels |= {n: record.measured[:, c], f"{n}_left": kept[:, c]}
        units |= {n: u or "1", f"{n}_left": u or "1"}
    try:
        made = Recording(record.name, record.time, channels, units)
        reading = distortions(made, moving[:1], record.names)
        if reading.periods < 2:
            return None
        left = distortions(
            made, moving[:1], [f"{n}_left" for n in record.names],
            highest=int(reading.frequency.size),
        )  # fmt: skip
    except BondsightError:
        return None
    whole = np.isfinite(record.residual).all(axis=0)
    amplitude = left.amplitude[: reading.frequency.size]
    return Separated(record.name, reading, np.where(whole, amplitude, np.nan))
