"""Print samples and final states of simulations: linear, with dry friction, with hysteresis."""

from __future__ import annotations

import numpy as np
from models import positioner  # type: ignore[import-not-found]
from vocabulary import (  # type: ignore[import-not-found]
    Coulomb,
    Hysteretic,
    PrandtlIshlinskii,
    simulate,
)

LAWS = {
    "linear": (None, None),
    "coulomb": (Coulomb(0.8), None),
    "hysteresis": (None, Hysteretic(PrandtlIshlinskii((0.0, 1e-3, 3e-3), (2e3, -3e2, -2e2)))),
}

t = np.arange(3000) * 1e-3
force = 8.0 * np.sin(2 * np.pi * (1.0 + 1.5 * t) * t)
for name, (resistor, spring) in LAWS.items():
    run = simulate(positioner(resistor, spring), t, {"F": force})
    print(name, "steps per sample", run.steps_per_sample, "settled", run.settled)
    for k in range(0, t.size, 250):
        print(f"  x({t[k]:.3f}) = {run['x'][k]:.12g}")
    print("  rms", f"{np.sqrt(np.mean(run['x'] ** 2)):.12g}")
    print("  state", *(f"{v:.12g}" for v in run.state))
    for element, memory in sorted(run.memory.items()):
        print("  memory", element, *(f"{v:.12g}" for v in memory))
