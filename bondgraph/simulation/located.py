"""A record whose steps are halved where a law switches or bends, and are whole elsewhere.

Doubling all sub-steps of a record brings an error where a spring meets its stop, or a mass begins
to slide, down by a half only. Here every step is compared with its two halves, and goes on in
halves where they differ, down to a millionth of a sample: the moment of a switch is found by
bisection, with the exact step of each size.
"""

from __future__ import annotations

import numpy as np

from bondgraph.simulation.exact_run import (
    KernelRun,
    Memories,
    as_run,
    begun,
    prepare,
    unrounded_change,
)
from bondgraph.simulation.first_order_hold import continuous, discretise
from bondgraph.simulation.halving import DEPTH, Within, halved
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_kernel import located_runner
from bondgraph.support.arrays import Array

STANDING = 1e-12
"""Share of its largest argument up to which what a law that jumps acts on stands still."""


def located(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    accuracy: float,
    memory: Memories | None,
    seen: KernelRun,
) -> tuple[int, KernelRun] | None:
    """Return steps a sample and a run whose outputs a finer tolerance changes by less.

    None where the model has no such march, inputs are no lines between samples, or the outputs do
    not settle. `seen` is a rougher run.
    """
    runner = located_runner(compiled)
    if runner is None or hold == "band-limited" or compiled.model.recorded:
        return None
    model = continuous(compiled, p)
    ready = prepare(compiled, p, step, model=model)
    halves = [discretise(model, step / 2**k) for k in range(1, DEPTH)]
    march = runner(
        ready.moving, ready.still, ready.q, ready.dq, [(d.packed, d.derivative) for d in halves]
    )
    u, fine, start = begun(ready, u, x0, hold, None, memory)
    jumps = np.array([port.law.set_valued for port in compiled.laws])
    quiet = np.where(jumps, STANDING * np.abs(seen.s).max(axis=0), -1.0)

    def run_with(within: Within) -> KernelRun:
        return as_run(ready, *march(fine, start, 1, u[0], True, within, quiet))

    lay = ready.layout
    counted = np.ones(lay.n_z, bool)
    counted[lay.n_x : lay.n_x + lay.n_w] = False  # what laws answer follows from the rest
    return halved(
        run_with,
        lambda a, b: unrounded_change(compiled, a, b),
        start[:, 0], counted, u.shape[0], accuracy,
    )  # fmt: skip
