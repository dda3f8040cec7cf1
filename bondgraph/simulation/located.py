"""A record whose steps are halved where a law switches or bends, and are whole elsewhere.

Doubling all sub-steps of a record brings an error where a spring meets its stop, or a mass begins
to slide, down by a half only. Here every step is compared with its two halves, and goes on in
halves where they differ, down to a millionth of a sample: the moment of a switch is found by
bisection, with the exact step of each size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
FOLLOWED = 32
"""Steps a sample that a run with derivatives may take on the average."""


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
    if not _can(compiled, hold):
        return None
    march = _Ladder(compiled, p, step).march(u, hold, memory)
    found = _halved(compiled, march, x0, u.shape[0], _quiet(compiled, seen), accuracy, MOST)
    return None if found is None else found[:2]


@dataclass(frozen=True, eq=False)
class DifferenceSteps:
    """What derivatives are taken by: small moves of parameters and of the state at the start.

    Attributes
    ----------
    directions : sequence of int
        Positions of the parameters.
    by_p : ndarray, shape (n_p,)
        How far each of them is moved, SI.
    by_x : ndarray, shape (n_x,), or of none
        How far each state is moved, SI.
    """

    directions: Sequence[int]
    by_p: Array
    by_x: Array


def followed(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    memory: Memories | None,
    seen: KernelRun,
    reach: DifferenceSteps | None = None,
    accuracy: float = 1e-6,
    *,
    after: bool = False,
) -> tuple[Array, Array] | None:
    """Return the outputs of `located`, and their derivatives by central differences.

    Each difference is one of runs with the same tolerance. Matrices are moved along their
    derivatives, which leaves central differences right to the same order.

    Returns
    -------
    tuple of ndarray, shapes (N, n_y) and (N, n_y, n_p + n_x), or None
    """
    if not _can(compiled, hold):
        return None
    ladder = _Ladder(compiled, p, step, () if reach is None else tuple(reach.directions))
    own, quiet = ladder.march(u, hold, memory, after=after), _quiet(compiled, seen)
    found = _halved(compiled, own, x0, u.shape[0], quiet, accuracy, FOLLOWED)
    if found is None:
        return None
    _, run, allowed = found

    if reach is None:
        return run.y, np.zeros((*run.y.shape, 0))

    def moved(march: March, start: Array) -> Array:
        within = Within(allowed, np.array([FOLLOWED * u.shape[0]]), np.zeros((2, allowed.size)))
        y = march(start, within, quiet).y
        return y if within.left[0] > 0 else np.full_like(y, np.nan)

    columns = []
    for k, h in enumerate(reach.by_p):
        ends = [
            moved(ladder.march(u, hold, memory, (k, s * h), after=after), x0) for s in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    for x, h in zip(np.diag(reach.by_x), reach.by_x, strict=True):
        columns.append((moved(own, x0 + x) - moved(own, x0 - x)) / (2.0 * h))
    slopes = np.stack(columns, axis=2)
    return (run.y, slopes) if np.isfinite(slopes).all() else None


def _can(compiled: Compiled, hold: str) -> bool:
    """Whether a model has such a march, between inputs that are lines."""
    lines = hold != "band-limited" and not compiled.model.recorded
    return lines and located_runner(compiled) is not None


class _Ladder:
    """A model at one parameter vector, discretised for a step, its half, quarter and so on."""

    def __init__(
        self, compiled: Compiled, p: Array, step: float, directions: Sequence[int] = ()
    ) -> None:
        model = continuous(compiled, p, np.asarray(directions, int))
        self.compiled = compiled
        self.ready = prepare(compiled, p, step, 1, directions, model=model)
        halves = (discretise(model, step / 2**k) for k in range(1, DEPTH))
        self.halves = [(d.packed, d.derivative) for d in halves]

    def march(
        self,
        u: Array,
        hold: str,
        memory: Memories | None,
        along: tuple[int, float] | None = None,
        *,
        after: bool = False,
    ) -> March:
        """Return what runs the record, one parameter moved `along` its direction if given."""
        runner = located_runner(self.compiled)
        assert runner is not None

        def there(m: Array, dm: Array) -> tuple[Array, Array]:
            return (m if along is None else m + along[1] * dm[:, along[0]]), dm[:, :0]

        r, (q, dq) = self.ready, there(self.ready.q, self.ready.dq)
        plain = replace(r, n_p=0, n_d=0, q=q, dq=dq, still=there(*r.still), moving=there(*r.moving))
        run = runner(plain.moving, plain.still, q, dq, [there(*h) for h in self.halves])

        def marched(x0: Array, within: Within, quiet: Array) -> KernelRun:
            inputs, fine, start = begun(plain, u, x0, hold, None, memory)
            if not within.ends.any():
                within.ends[:] = start[:, 0]
            return as_run(
                plain,
                *run(fine, start, 1, inputs[0], True, inputs[-1] if after else None, within, quiet),
            )

        return marched


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
    lay, allowed = layout(compiled, 0), []

    def run_with(within: Within) -> KernelRun:
        allowed.append(within.allowed)
        return march(x0, within, quiet)

    counted = np.ones(lay.n_z, bool)
    counted[lay.n_x : lay.n_x + lay.n_w] = False  # what laws answer follows from the rest
    found = halved(
        run_with, lambda a, b: unrounded_change(compiled, a, b), np.zeros(lay.n_z), counted,
        samples, accuracy, most,
    )  # fmt: skip
    return None if found is None else (*found, allowed[-1])
