"""Seconds of closed forms, of a step of a kernel, and of a fit of weights."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from actuators.models.catalogue import MODELS
from bondgraph.equations.codegen import program
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis.fitting import fit_weights
from bondgraph.simulation.radau.native import prepare_general, run_general
from tests.benchmarks.bounds import Measured, best, judged
from tests.bondgraph.hysteresis.test_fitting_weights import random_truth, sweep
from tests.bondgraph.simulation.test_general_kernel import (
    STEP,
    duffing,
    inputs,
    point,
    silverbox,
    start,
)


def measured() -> Iterator[Measured]:
    """Every stack of the catalogue; 0.5 and 0.7 us a step; 0.07 s for forty weights."""
    for name in (n for n in MODELS if n.startswith("stack_")):
        graph = MODELS[name]()
        yield Measured(f"closed form of {name}", best(lambda g=graph: equations(g).rates), 0.1)  # type: ignore[misc]
    for make in (duffing, silverbox):
        made = program(make())
        ready = prepare_general(made, point(made), STEP, 1, range(7), True)
        u, x0 = inputs(made, 20001), start(made)
        seconds = best(lambda r=ready, u=u, x0=x0: run_general(r, u, x0), 3) / 20000.0  # type: ignore[misc]
        yield Measured(f"step with all directions of {made.name}", seconds, 3e-6)
    x, truth = sweep(32768), random_truth(np.random.default_rng(0), 39)
    y, _ = truth.run(x)
    yield Measured("forty weights on 32768 samples", best(lambda: fit_weights(truth, x, y)), 0.5)


def main() -> int:
    """Print; 1 beyond a bound."""
    return judged(measured())


if __name__ == "__main__":
    sys.exit(main())
