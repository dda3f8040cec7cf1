"""Print the response of the steering mirror: ``python -m tests.benchmarks.responses``.

Needs the recordings folder. For each level of the drive: gain, noise and total standard deviation
of the path from the first piezo to the first sensor below 310 Hz.
"""

from __future__ import annotations

import time

import numpy as np

from identification.datasets import protocol
from identification.experiments.frequency.bla import best_linear_approximation


def main() -> None:
    """Print one line a level."""
    records = protocol("steering_mirror").records
    for level in dict.fromkeys(r.meta["level"] for r in records):
        runs = [r for r in records if r.meta["level"] == level]
        begin = time.perf_counter()
        found = best_linear_approximation(runs, ("u1", "u2", "u3"), ("y1", "y2", "y3"))
        took = time.perf_counter() - begin
        low = found.band(0.0, 310.0)
        gain = float(np.abs(low.entry("y1", "u1")[0]).mean())
        noise, total = (100 * float(low.spread(k)[0, 0]) for k in ("noise", "total"))
        print(
            f"{level}: gain {gain:.3e} m/V, noise {noise:.2f} %, total {total:.2f} % "
            f"({took:.2f} s); all paths: {found!r}"
        )


if __name__ == "__main__":
    main()
