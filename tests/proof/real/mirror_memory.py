"""``python -m tests.proof.real.mirror_memory``: what a memory could explain of the steering mirror.

No model and no diagnosis: of the lines below `steering_mirror.BAND`, that part of each reading is
taken which no linear filter of the three commands gives; plays of the commands or of the readings,
all lines of them, and odd powers of the commands are then fitted beside the filter on the training
realisations and judged on the test realisation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bondgraph.hysteresis import play_record
from bondgraph.signals.recording import Recording
from identification.datasets import protocol
from tests.proof.real.steering_mirror import AXES, BAND, FACTOR, PERIOD

__all__ = ["left_by_forms"]

FloatArray = NDArray[np.float64]
Form = Callable[[FloatArray, FloatArray], FloatArray]
"""Commands and readings of a period over their largest swings, shape (N, 3), to columns."""

REACH = (4, 8)
"""Samples of the thinned record that the filter looks ahead and back."""
LEVELS = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.65])


def plays(x: FloatArray) -> FloatArray:
    """Return plays of settled periodic signals (N, k), shape (N, k * levels)."""
    rest = np.zeros(LEVELS.size)
    return np.hstack([play_record(np.tile(c, 2), LEVELS, rest)[c.size :] for c in x.T])


def powers(x: FloatArray) -> FloatArray:
    """Return odd powers of signals (N, k) between the first and the third."""
    return np.hstack([np.sign(x) * np.abs(x) ** (1 + 3 * level) for level in LEVELS])


FORMS: Mapping[str, Form] = MappingProxyType(
    {
        "linear filter alone": lambda u, y: u[:, :0],
        "plays of the commands": lambda u, y: plays(u),
        "plays of the readings": lambda u, y: plays(y),
        "odd powers of the commands": lambda u, y: powers(u),
    }
)


def band(x: FloatArray, rate: float) -> FloatArray:
    """Return the lines below `BAND` of whole periods (N, k), at the rate over `FACTOR`."""
    lines = np.fft.rfft(x, axis=0)[: PERIOD // FACTOR // 2 + 1] / FACTOR
    lines[int(BAND * PERIOD / rate) + 1 :] = 0.0
    return np.asarray(np.fft.irfft(lines, PERIOD // FACTOR, axis=0))


def filtered(u: FloatArray) -> FloatArray:
    """Return the columns of a linear filter of settled periodic commands."""
    ahead, back = REACH
    moved = [np.roll(u, lag, axis=0) for lag in range(-ahead, back + 1)]
    return np.hstack([*moved, np.ones((len(u), 1))])


def left_by_forms(level: str, recordings: str | None = None) -> dict[str, FloatArray]:
    """Standard deviation of each test reading and of what each form leaves of it, shape (3,)."""
    found = protocol("steering_mirror", recordings)
    train = [r for r in found.train if f"/{level}_" in r.name]
    test = next(r for r in found.tests.values() if f"/{level}" in r.name)
    u, y = _settled(train[0])
    swings = np.abs(u).max(axis=0), np.abs(y).max(axis=0)

    def rows(r: Recording, form: Form) -> tuple[FloatArray, FloatArray]:
        """Columns of the filter and of a form, and the readings."""
        u, y = _settled(r)
        more = band(form(u / swings[0], y / swings[1]), r.fs)
        return np.hstack([filtered(band(u, r.fs)), more]), band(y, r.fs)

    judged = {"reading": band(_settled(test)[1], test.fs).std(axis=0)}
    for name, form in FORMS.items():
        known = [rows(r, form) for r in train]
        columns, seen = (np.vstack(parts) for parts in zip(*known, strict=True))
        weights = np.linalg.lstsq(columns, seen, rcond=None)[0]
        columns, seen = rows(test, form)
        judged[name] = np.asarray((seen - columns @ weights).std(axis=0))
    return judged


def _settled(r: Recording) -> tuple[FloatArray, FloatArray]:
    """Commands and readings of the second period, shape (PERIOD, 3) each."""
    u, y = (np.column_stack([r[f"{c}{a}"][PERIOD:] for a in AXES]) for c in "uy")
    return u, y


def main() -> int:
    """Print the table."""
    for level in ("100mV", "200mV", "300mV"):
        found = left_by_forms(level)
        alone = found["linear filter alone"]
        for name, left in found.items():
            sizes = "  ".join(f"{1e9 * v:7.2f}" for v in left)
            over = "  ".join(f"{100 * v:4.0f} %" for v in left / alone)
            print(f"{level}  {name:28s}{sizes} nm   of the filter's {over}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
