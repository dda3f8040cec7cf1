"""A record whose steps are halved where a law switches or bends, and are whole elsewhere.

Doubling all sub-steps of a record brings an error where a spring meets its stop, or a mass begins
to slide, down by a half only. Here every step is compared with its two halves, and goes on in
halves where they differ, down to a millionth of a sample: the moment of a switch is found by
bisection, with the exact step of each size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

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
from bondgraph.simulation.halving import DEPTH, MOST, Within, halved
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_kernel import located_runner
from bondgraph.simulation.lure_layout import layout
from bondgraph.support.arrays import Array

STANDING = 1e-12
"""Share of its largest argument up to which what a law that jumps acts on stands still."""


March = Callable[[Array, Within, Array], KernelRun]
"""Runs from a state within what steps may differ by, shape (n_w,) what stands still."""


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
    march = _march(compiled, p, u, step, hold, memory)
    if march is None:
        return None
    found = _halved(compiled, march, x0, u.shape[0], _quiet(compiled, seen), accuracy, MOST)
    return None if found is None else found[:2]


def followed(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    memory: Memories | None,
    seen: KernelRun,
    moves: Sequence[tuple[Array | None, Array | None]] = (),
    accuracy: float = 1e-6,
    most: int = 64,
) -> tuple[Array, Array] | None:
    """Return the outputs of `located`, and their differences by small moves of what they follow.

    Parameters
    ----------
    moves : sequence of (ndarray or None, ndarray or None)
        Changes of the parameters, shape (n_p,), or of the state at the start, shape (n_x,).
    most : int
        Steps a sample that a run may take on the average.

    Returns
    -------
    tuple of ndarray, shapes (N, n_y) and (N, n_y, moves), or None
    """
    march = _march(compiled, p, u, step, hold, memory)
    if march is None:
        return None
    quiet = _quiet(compiled, seen)
    found = _halved(compiled, march, x0, u.shape[0], quiet, accuracy, most)
    if found is None:
        return None
    _, run, allowed = found
    moved = np.empty((*run.y.shape, len(moves)))
    for k, (by_p, by_x) in enumerate(moves):
        other = march if by_p is None else _march(compiled, p + by_p, u, step, hold, memory)
        assert other is not None
        start = x0 if by_x is None else x0 + by_x
        within = Within(allowed, np.array([most * u.shape[0]]), np.zeros((2, allowed.size)))
        moved[:, :, k] = other(start, within, quiet).y - run.y
        if within.left[0] <= 0:
            return None
    return run.y, moved


def _march(
    compiled: Compiled, p: Array, u: Array, step: float, hold: str, memory: Memories | None
) -> March | None:
    runner = located_runner(compiled)
    if runner is None or hold == "band-limited" or compiled.model.recorded:
        return None
    model = continuous(compiled, p)
    ready = prepare(compiled, p, step, model=model)
    halves = [discretise(model, step / 2**k) for k in range(1, DEPTH)]
    march = runner(
        ready.moving, ready.still, ready.q, ready.dq, [(d.packed, d.derivative) for d in halves]
    )

    def run(x0: Array, within: Within, quiet: Array) -> KernelRun:
        inputs, fine, start = begun(ready, u, x0, hold, None, memory)
        if not within.ends.any():
            within.ends[:] = start[:, 0]
        return as_run(ready, *march(fine, start, 1, inputs[0], True, within, quiet))

    return run


def _quiet(compiled: Compiled, seen: KernelRun) -> Array:
    jumps = np.array([port.law.set_valued for port in compiled.laws])
    return np.where(jumps, STANDING * np.abs(seen.s).max(axis=0), -1.0)


def _halved(
    compiled: Compiled,
    march: March,
    x0: Array,
    samples: int,
    quiet: Array,
    accuracy: float,
    most: int,
) -> tuple[int, KernelRun, Array] | None:
    """Halve steps until the outputs settle; what steps may differ by then comes last."""
    lay, last = layout(compiled, 0), np.zeros(0)

    def run_with(within: Within) -> KernelRun:
        nonlocal last
        last = within.allowed
        return march(x0, within, quiet)

    size = lay.n_z
    counted = np.ones(size, bool)
    counted[lay.n_x : lay.n_x + lay.n_w] = False  # what laws answer follows from the rest
    found = halved(
        run_with, lambda a, b: unrounded_change(compiled, a, b), np.zeros(size), counted,
        samples, accuracy, most,
    )  # fmt: skip
    return None if found is None else (*found, last)
