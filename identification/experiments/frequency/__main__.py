"""Print the response of the steering mirror: ``python -m identification.experiments.frequency``.

Needs the recordings folder. For each level of the drive: gain, noise and total standard deviation
of the path from the first piezo to the first sensor below 310 Hz.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.datasets import FOLDER_VARIABLE
from identification.experiments.frequency.bla import best_linear_approximation

LEVELS = (100, 200, 300)


def _runs(stored: dict[str, np.ndarray], level: int) -> list[Recording]:
    """All realisations of a level, periods one after the other."""
    found = []
    for part in ("train", "test"):
        u, y = (stored[f"{c}_{level}mV_{part}"].astype(float) for c in "uy")
        for m in range(u.shape[2]):
            channels = {f"u{i}[V]": u[:, i, m].ravel(order="F") for i in range(u.shape[1])}
            channels |= {f"y{i}[m]": y[:, i, m].ravel(order="F") for i in range(y.shape[1])}
            name = f"steering mirror, {level} mV"
            found.append(Recording.from_arrays(name, channels, fs=float(stored["fs_hz"])))
    return found


def main() -> None:
    """Print one line a level."""
    file = Path(os.environ.get(FOLDER_VARIABLE, "")) / "piezo-steering-mirror" / "fsm.npz"
    if not file.is_file():
        raise UnusableInput(f"steering mirror: set {FOLDER_VARIABLE} to the recordings folder")
    with np.load(file) as stored:
        tables = dict(stored)
    for level in LEVELS:
        runs = _runs(tables, level)
        begin = time.perf_counter()
        found = best_linear_approximation(runs, ("u0", "u1", "u2"), ("y0", "y1", "y2"))
        took = time.perf_counter() - begin
        low = found.band(0.0, 310.0)
        gain = float(np.abs(low.entry("y0", "u0")[0]).mean())
        noise, total = (100 * float(low.spread(k)[0, 0]) for k in ("noise", "total"))
        print(
            f"{level} mV: gain {gain:.3e} m/V, noise {noise:.2f} %, total {total:.2f} % "
            f"({took:.2f} s); all paths: {found!r}"
        )


if __name__ == "__main__":
    main()
