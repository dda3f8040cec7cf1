"""Drive and sensor on one time base."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.synchrony.alignment import Alignment
from hardware.synchrony.between import between
from hardware.synchrony.held import HeldColumns
from hardware.synchrony.stream import VOLTAGE, Stream

STILL_EVEN = 1e-3
"""Of a sample: instants that leave an even grid by less need no interpolation."""


@dataclass(frozen=True, slots=True, eq=False)
class Merged:
    """One record by the drive's clock.

    Attributes
    ----------
    time : ndarray
        (n,), even (s, by the drive's clock).
    channels : mapping of str to ndarray
        (n,) each: the sensor's channels, and the drive's command as it stood at these instants
        (held, behind the amplifier's lag where one is known; never smoothed). NaN is missing.
    flags : ndarray
        (n,).
    errors : mapping of str to float
        What interpolation may have changed, at most, by channel; 0 where nothing was interpolated.
    alignment : Alignment
    sentence : str
        What was done.
    """

    time: Array
    channels: Mapping[str, Array]
    flags: NDArray[np.uint16]
    errors: Mapping[str, float]
    alignment: Alignment
    sentence: str

    def __str__(self) -> str:
        """Say what was done."""
        return f"{self.sentence}\n{self.alignment}"


def merged(
    drive: Stream,
    sensor: Stream,
    alignment: Alignment,
    *,
    base: Literal["sensor", "drive"] = "sensor",
    rate: float | None = None,
) -> Merged:
    """Put both on one even time base, the drive's clock.

    Parameters
    ----------
    drive, sensor : Stream
    alignment : Alignment
    base : {"sensor", "drive"}
        The sensor's own instants (nothing measured is interpolated, unless the ratio drifts or
        samples are missing), or the grid of the drive, in the middle of its steps.
    rate : float, optional
        Of the time base (Hz); by default that of the base.

    Raises
    ------
    UnusableInput
        If the streams share no time, or `base` is unknown.
    """
    if base not in ("sensor", "drive"):
        raise UnusableInput(f"merging: no base {base!r}; take 'sensor' or 'drive'")
    numbers = sensor.numbers.copy()
    flags = sensor.flags.copy()
    for gap in alignment.gaps:
        numbers[gap.first :] += gap.missing
        flags[gap.first] |= np.uint16(Flag.LOST_BEFORE)
    full = np.arange(numbers[0], numbers[-1] + 1)
    where = numbers - numbers[0]
    s = alignment.map.to_drive(full / sensor.rate)
    begin, end = _common(drive, s)
    step = 1.0 / rate if rate else _step(drive, s, base)
    first = s[0] if base == "sensor" else (np.floor(begin * drive.rate) + 0.5) / drive.rate
    count = int(np.floor((end - first) / step + 1e-6)) + 1
    skip = int(max(np.ceil((begin - first) / step - 1e-6), 0))
    if count - skip < 2:
        raise UnusableInput("merging: drive and sensor have no time in common")
    time = first + step * np.arange(skip, count)
    position = alignment.map.to_sensor(time) * sensor.rate - full[0]
    near = np.rint(position)
    if float(np.abs(position - near).max()) < STILL_EVEN:
        position = near
    even_flags = np.zeros(full.size, np.uint16)
    even_flags[where] = flags
    columns: dict[str, Array] = {}
    errors: dict[str, float] = {}
    marks = np.zeros(time.size, np.uint16)
    for name, values in sensor.channels.items():
        even = np.full(full.size, np.nan)
        even[where] = values
        got = between(even, even_flags, position)
        columns[name], errors[name] = got.values, got.error
        marks |= got.flags
    volts, drive_marks = _driven(drive, alignment, time)
    columns[VOLTAGE], errors[VOLTAGE] = volts, 0.0
    marks |= drive_marks | np.uint16(alignment.flag)
    kept = bool(np.array_equal(position, near))
    sentence = (
        f"{time.size} samples of {1.0 / step:.9g} Hz by the drive's clock; "
        + ("no sample of the sensor was interpolated" if kept else
           "the sensor was interpolated (error at most "
           + ", ".join(f"{e:.2g} in {k}" for k, e in errors.items() if k != VOLTAGE) + ")")
        + f"; the drive is the {alignment.hold}-order hold"
        + (f" behind {1e6 * alignment.lag:.4g} us" if alignment.lag else "")
    )  # fmt: skip
    return Merged(time, columns, marks, errors, alignment, sentence)


def _common(drive: Stream, s: Array) -> tuple[float, float]:
    """Return the first and the last instant by the drive's clock that both have (s)."""
    first, last = drive.numbers[0] / drive.rate, (drive.numbers[-1] + 1) / drive.rate
    return float(max(first, s[0])), float(min(last, s[-1]))


def _step(drive: Stream, s: Array, base: str) -> float:
    return float(s[-1] - s[0]) / (s.size - 1) if base == "sensor" else 1.0 / drive.rate


def _driven(drive: Stream, alignment: Alignment, time: Array) -> tuple[Array, NDArray[np.uint16]]:
    """Return the voltage at instants of the drive's clock, and the flags of its samples."""
    full = np.arange(drive.numbers[0], drive.numbers[-1] + 1)
    where = drive.numbers - drive.numbers[0]
    flags = np.full(full.size, np.uint16(Flag.LOST_BEFORE))
    flags[where] = drive.flags
    held = HeldColumns(
        drive.filled(VOLTAGE)[:, None], 1.0 / drive.rate, alignment.hold, alignment.lag
    )
    local = time - full[0] / drive.rate
    k = np.clip(np.floor(local * drive.rate).astype(np.intp), 0, full.size - 1)
    marks = flags[k]
    if alignment.hold == "linear":
        marks = marks | flags[np.minimum(k + 1, full.size - 1)]
    return held.at(local)[0][:, 0], marks
