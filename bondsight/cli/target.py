"""What a loop is to follow, from what the user types."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.arguments import fitting

MOST = 2e6
"""Ticks of a run."""


def target_of(text: str, rate: float, unit: str) -> FloatArray:
    """Return the reference (N,) at a rate (Hz) that a text or a file gives, SI.

    Parameters
    ----------
    text : str
        ``sine:HZ:LOW:HIGH:SECONDS``, ``steps:SECONDS:VALUE:VALUE...``, ``thesis`` (eq. 7.3), or a
        file with one channel of the unit.
    rate : float
    unit : str
        "m", "V", ...

    Raises
    ------
    UnusableInput
        The text is no target.
    """
    kind, _, rest = text.partition(":")
    numbers = [real_number(f"--target {text}", p) for p in rest.split(":")] if rest else []
    if kind == "sine" and len(numbers) == 4:
        hz, low, high, seconds = numbers
        t = _ticks(text, seconds, rate)
        return low + 0.5 * (high - low) * (1.0 - np.cos(2.0 * np.pi * hz * t))
    if kind == "steps" and len(numbers) >= 2:
        n = _ticks(text, numbers[0], rate).size
        return np.repeat(np.array(numbers[1:]), n)
    if kind == "thesis" and not rest and unit == "m":
        from actuators.compensation import thesis_reference

        return np.asarray(thesis_reference(_ticks(text, 2.0, rate)).x)
    if Path(text).suffix or Path(text).exists():
        return _from_file(Path(text), rate, unit)
    raise UnusableInput(
        f"--target {text}: give sine:HZ:LOW:HIGH:SECONDS, steps:SECONDS:VALUE:..., "
        f"{'thesis, ' if unit == 'm' else ''}in SI, or a file with one channel in {unit}"
    )


def _ticks(text: str, seconds: float, rate: float) -> FloatArray:
    if not 2.0 <= seconds * rate <= MOST:
        raise UnusableInput(
            f"--target {text}: {seconds:g} s at {rate:g} Hz are {seconds * rate:.4g} ticks; give 2 "
            f"to {MOST:g}"
        )
    return np.arange(round(seconds * rate)) / rate


def _from_file(file: Path, rate: float, unit: str) -> FloatArray:
    try:
        recording = Recording.read(file)
    except UnusableInput as error:
        raise fitting(error, unit=unit) from None
    values = only_channel(recording, unit, file.name)
    time = np.asarray(recording.time) - recording.time[0]
    t = _ticks(file.name, float(time[-1]), rate)
    return np.interp(t, time, values)


def only_channel(recording: Recording, unit: str, where: str) -> FloatArray:
    """Return the one channel of a file that is in a unit.

    Raises
    ------
    UnusableInput
        There is none, or there are several.
    """
    found = [n for n in recording.channels if recording.units[n] == unit]
    if not found:
        has = ", ".join(f"{n} in {recording.units[n]}" for n in recording.channels)
        raise UnusableInput(
            f"{where}: no channel is in {unit} ({has}); it takes one, its header such as x[{unit}]"
        )
    if len(found) > 1:
        raise UnusableInput(
            f"{where}: has {len(found)} channels in {unit} ({', '.join(found)}); leave one"
        )
    return np.asarray(recording[found[0]])
