"""``python -m tests.proof.real.mirror_memory``: what a memory could explain of the steering mirror.

No model and no diagnosis: of the lines below `steering_mirror.BAND`, that part of each reading is
taken which no linear filter of the three commands gives; plays and odd powers of the commands, all
lines of them, are then fitted beside the filter on the training realisations of one level, or of
all, and judged on the test realisation. A spring with memory turns where it moves, so the same is
asked backwards: what stops of the readings add to a filter from the readings to a command. (Plays
of the readings may not explain readings: they contain them.) Signals are periodic, and turn between
samples: plays follow them on a grid that is eight times finer, which is exact.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bondgraph.hysteresis import play_record
from bondgraph.signals.recording import Recording
from identification.datasets import protocol
from tests.proof.real.steering_mirror import AXES, BAND, FACTOR, LEVELS, PERIOD

__all__ = ["left_by_forms"]

FloatArray = NDArray[np.float64]
Form = Callable[[FloatArray], FloatArray]
"""Signals of a period over their largest swings, shape (n, 3), to columns."""

REACH = (4, 8)
"""Samples of the thinned record that the filter looks ahead and back."""
WIDTHS = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.65])
FINER = 8


def plays(x: FloatArray) -> FloatArray:
    """Return plays of settled periodic signals (n, k), shape (n, k * widths)."""
    rest = np.zeros(WIDTHS.size)
    return np.hstack([play_record(np.tile(c, 2), WIDTHS, rest)[c.size :] for c in x.T])


def powers(x: FloatArray) -> FloatArray:
    """Return odd powers of signals (n, k) between the first and the third."""
    return np.hstack([np.sign(x) * np.abs(x) ** (1 + 3 * width) for width in WIDTHS])


def nothing(x: FloatArray) -> FloatArray:
    """Return no column."""
    return x[:, :0]


FORMS: Mapping[str, tuple[Form, bool]] = MappingProxyType(
    {
        "linear filter alone": (nothing, False),
        "plays of the commands": (plays, False),
        "odd powers of the commands": (powers, False),
        "backwards, linear filter alone": (nothing, True),
        "backwards, stops of the readings": (plays, True),
    }
)
"""Forms, and whether commands are asked for from readings."""


def finer(x: FloatArray) -> FloatArray:
    """Return whole periods (n, k) between their samples too, shape (FINER * n, k)."""
    return np.asarray(np.fft.irfft(np.fft.rfft(x, axis=0) * FINER, FINER * len(x), axis=0))


def band(x: FloatArray, rate: float) -> FloatArray:
    """Return the lines below `BAND` of whole periods (n, k), at `rate` over `FACTOR`."""
    kept = PERIOD // FACTOR
    lines = np.fft.rfft(x, axis=0)[: kept // 2 + 1] * kept / len(x)
    lines[int(BAND * PERIOD / rate) + 1 :] = 0.0
    return np.asarray(np.fft.irfft(lines, kept, axis=0))


def filtered(u: FloatArray) -> FloatArray:
    """Return the columns of a linear filter of settled periodic signals."""
    ahead, back = REACH
    moved = [np.roll(u, lag, axis=0) for lag in range(-ahead, back + 1)]
    return np.hstack([*moved, np.ones((len(u), 1))])


def left_by_forms(
    level: str, recordings: str | None = None, *, train: Sequence[str] = ()
) -> dict[str, FloatArray]:
    """Standard deviation of each test reading and of what each form leaves of it, shape (3,).

    Backwards it is each command's, V. `train` names the levels that train; `level` if none.
    """
    found = protocol("steering_mirror", recordings)
    known = [r for r in found.train if any(f"/{name}_" in r.name for name in train or (level,))]
    test = next(r for r in found.tests.values() if f"/{level}" in r.name)
    judged = {"reading": band(_settled(test)[1], test.fs).std(axis=0)}
    for name, (form, back) in FORMS.items():
        rows = [_rows(r, form, back, _settled(test)) for r in known]
        columns, seen = (np.vstack(parts) for parts in zip(*rows, strict=True))
        weights = np.linalg.lstsq(columns, seen, rcond=None)[0]
        columns, seen = _rows(test, form, back, _settled(test))
        judged[name] = np.asarray((seen - columns @ weights).std(axis=0))
    return judged


def _rows(
    r: Recording, form: Form, back: bool, sizes: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Columns of the filter and of a form, and what is asked for."""
    u, y = _settled(r)[:: -1 if back else 1]
    size = np.abs(sizes[1 if back else 0]).max(axis=0)
    more = band(form(finer(u / size)), r.fs)
    return np.hstack([filtered(band(u, r.fs)), more]), band(y, r.fs)


def _settled(r: Recording) -> tuple[FloatArray, FloatArray]:
    """Commands and readings of the second period, shape (PERIOD, 3) each."""
    u, y = (np.column_stack([r[f"{c}{a}"][PERIOD:] for a in AXES]) for c in "uy")
    return u, y


def main() -> int:
    """Print the table."""
    for level in LEVELS:
        for train in ((level,), LEVELS):
            found = left_by_forms(level, train=train)
            for name, (_, back) in FORMS.items():
                alone = found["backwards, linear filter alone" if back else "linear filter alone"]
                scale, unit = (1e3, "mV") if back else (1e9, "nm")
                sizes = "  ".join(f"{scale * v:7.2f}" for v in found[name])
                over = "  ".join(f"{100 * v:4.0f} %" for v in found[name] / alone)
                who = "all levels" if len(train) > 1 else "this level"
                print(f"{level} by {who}  {name:34s}{sizes} {unit}   of the filter's {over}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
