"""A record through the compiled step of a model that is linear up to scalar laws.

The linear part is exact, laws are implicit, memory changes on accepted steps only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.equations.relation import FINE
from bondgraph.signals.recorded_rates import with_rates
from bondgraph.simulation.start import fine_inputs
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, require_known

if TYPE_CHECKING:
    from bondgraph.laws.law import Law
    from bondgraph.simulation.first_order_hold import Continuous, Discrete
    from bondgraph.simulation.lure import Compiled
    from bondgraph.simulation.lure_kernel import ManyRuns, March
    from bondgraph.simulation.lure_layout import KernelLayout

# discrete and kernel need CasADi; they are imported when something is simulated

Memories = Mapping[str, Sequence[float]]
LARGEST = 256
"""Sub-steps between two samples."""


@dataclass(frozen=True)
class KernelRun:
    """One pass of the kernel: values and derivatives.

    Attributes
    ----------
    y : ndarray, shape (N, n_y)
    dy : ndarray, shape (N, n_y, n_d)
    s, w : ndarray, shape (N, n_w)
        Arguments and deviations of the laws.
    x : ndarray, shape (n_x,)
        State at the last sample.
    memory : dict of str to tuple of float
        Memory of each law that has one, at the last sample, by element.
    settled : bool
        See `Trajectory.settled`.
    dx : ndarray, shape (n_x, n_d)
        Derivatives of the last state.
    """

    y: Array
    dy: Array
    s: Array
    w: Array
    x: Array
    memory: dict[str, tuple[float, ...]]
    settled: bool = True
    dx: Array = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class Prepared:
    """A model at one parameter vector, ready to run over any inputs.

    Attributes
    ----------
    still, moving : tuple of ndarray
        Packed matrices and their derivatives for a step of zero and for a sub-step.
    """

    compiled: Compiled
    n_p: int
    n_d: int
    n_sub: int
    q: Array
    dq: Array
    still: tuple[Array, Array]
    moving: tuple[Array, Array]

    @cached_property
    def layout(self) -> KernelLayout:
        """Sizes of the kernel."""
        from bondgraph.simulation.lure_layout import layout

        return layout(self.compiled, self.n_d)

    @cached_property
    def march(self) -> March:
        """Takes sub-steps, and one of zero at the start and where inputs jump."""
        from bondgraph.simulation.lure_kernel import runner

        return runner(self.compiled, self.n_d)(self.moving, self.still, self.q, self.dq)

    @cached_property
    def many(self) -> ManyRuns | None:
        """Runs many short records in one call; None where nothing does."""
        from bondgraph.simulation.lure_kernel import many_runs

        if self.compiled.model.recorded:
            return None
        made = many_runs(self.compiled, self.n_d)
        return None if made is None else made(self.moving, self.still, self.q, self.dq)

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float(self.moving[0][-1]) * self.n_sub  # behind the matrices stands the sub-step


def prepare(
    compiled: Compiled,
    p: Array,
    step: float,
    n_sub: int = 1,
    directions: Sequence[int] = (),
    state_directions: bool = False,
    *,
    model: Continuous | None = None,
) -> Prepared:
    """Discretise `compiled` at parameters `p` (SI, shape (n_p,)) for samples `step` (s) apart.

    `model` are its matrices at `p`, where they are known.
    """
    from bondgraph.simulation.first_order_hold import continuous, discretise, standing

    wanted = np.asarray(directions, int)
    n_p = wanted.size
    n_d = n_p + (compiled.n_x if state_directions else 0)
    law_positions = np.asarray(compiled.law_parameters, int)
    dq = np.zeros((law_positions.size, n_d))
    for column, i in enumerate(wanted):
        dq[law_positions == i, column] = 1.0

    model = model or continuous(compiled, p, wanted)

    moving = discretise(model, step / n_sub)

    def packed(d: Discrete) -> tuple[Array, Array]:
        return d.packed, np.hstack([d.derivative, np.zeros((d.packed.size, n_d - n_p))])

    still = standing(model, moving)
    return Prepared(compiled, n_p, n_d, n_sub, p[law_positions], dq, packed(still), packed(moving))


def run_prepared(
    ready: Prepared,
    u: Array,
    x0: Array,
    hold: str = "linear",
    fine: Array | None = None,
    *,
    every_substep: bool = False,
    memory: Memories | None = None,
    after: bool = False,
) -> KernelRun:
    """Simulate inputs `u` (shape (N, n_u)) from state `x0`; `fine` are their sub-step values.

    With `every_substep` the result has ``(N - 1) * n_sub + 1`` rows instead of N. `memory` replaces
    the virgin memory of the laws it names. Outputs are taken before inputs jump, or `after`.
    """
    u, fine, z = begun(ready, u, x0, hold, fine, memory)
    n_sub, last = 1 if every_substep else ready.n_sub, u[-1] if after else None
    return as_run(ready, *ready.march(fine, z, n_sub, u[0], True, last))


def begun(
    ready: Prepared,
    u: Array,
    x0: Array,
    hold: str,
    fine: Array | None = None,
    memory: Memories | None = None,
) -> tuple[Array, Array, Array]:
    """Return inputs at samples and sub-steps, and the carried numbers at the start."""
    compiled, n_p, n_x = ready.compiled, ready.n_p, ready.compiled.n_x
    if fine is None:
        fine = fine_inputs(u, ready.n_sub, hold)
    if recorded := compiled.model.recorded:
        u, fine = with_rates(compiled.inputs, recorded, u, fine, ready.step)
    lay = ready.layout
    z = np.zeros((lay.n_z, 1 + ready.n_d))
    z[:n_x, 0] = x0
    if ready.n_d > n_p:
        z[:n_x, 1 + n_p :] = np.eye(n_x)
    relax_memories(compiled, lay, *ready.still, u[0], z)
    _given_memory(compiled, lay, memory or {}, z)
    return u, fine, z


def run_many(
    ready: Prepared, u: Sequence[Array], x0: Array, fine: Sequence[Array]
) -> tuple[Array, Array]:
    """Simulate many short records, each from a state of its own; see `run_prepared`.

    Only where `Prepared.many` is there.

    Parameters
    ----------
    u : sequence of ndarray, shape (N_r, n_u) each
    x0 : ndarray, shape (n_records, n_x)
    fine : sequence of ndarray, shape ((N_r - 1) * n_sub, 2, n_u) each

    Returns
    -------
    tuple of ndarray, shapes (sum of N_r, n_y) and (sum of N_r, n_y, n_d)
    """
    n_x, n_p = ready.compiled.n_x, ready.n_p
    z = np.zeros((len(u), ready.layout.n_z, 1 + ready.n_d))
    z[:, :n_x, 0] = x0
    if ready.n_d > n_p:
        z[:, :n_x, 1 + n_p :] = np.eye(n_x)
    first, samples = np.stack([v[0] for v in u]), np.array([v.shape[0] for v in u])
    assert ready.many is not None
    y, _ = ready.many(np.concatenate(fine), z, ready.n_sub, first, samples)
    return y[:, :, 0], y[:, :, 1:]


def as_run(ready: Prepared, y: Array, seen: Array, z: Array) -> KernelRun:
    """Return what a march gave as a run."""
    compiled, lay, n_x = ready.compiled, ready.layout, ready.compiled.n_x
    return KernelRun(
        y[:, :, 0],
        y[:, :, 1:],
        seen[:, : lay.n_w],
        seen[:, lay.n_w :],
        z[:n_x, 0].copy(),
        {e: tuple(z[rows, 0].tolist()) for e, rows, _ in _memories(compiled, lay)},
        dx=z[:n_x, 1:].copy(),
    )


def run_record(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    *,
    n_sub: int = 1,
    hold: str = "linear",
    directions: Sequence[int] = (),
    state_directions: bool = False,
    memory: Memories | None = None,
) -> KernelRun:
    """Simulate a record and, if asked, its derivatives.

    Parameters
    ----------
    p : ndarray, shape (n_p,), SI
    u : ndarray, shape (N, n_u), SI
        Inputs at the samples, pseudo-inputs included.
    step : float
        Time between samples, s.
    x0 : ndarray, shape (n_x,)
        State at the first sample.
    directions : sequence of int
        Parameters (positions in `p`) to differentiate by.
    state_directions : bool
        Differentiate by the initial state too (last n_x columns of ``dy``).
    memory : dict of str to sequence of float, optional
        Memory to start from, by element; virgin where not given.
    """
    ready = prepare(compiled, p, step, n_sub, directions, state_directions)
    return run_prepared(ready, u, x0, hold, memory=memory)


def settle(
    compiled: Compiled,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    accuracy: float,
    largest: int = LARGEST,
    memory: Memories | None = None,
    loud: bool = False,
) -> tuple[int, KernelRun]:
    """Find steps in which the outputs settle; returns how many a sample and the last run.

    Sub-steps are doubled, and halved where a law switches, see `located`. A run that does not
    settle says so in `KernelRun.settled`.

    Raises
    ------
    BondsightError
        If `loud`: they are not finite.
    """

    def run_with(n_sub: int) -> KernelRun:
        return run_record(compiled, p, u, step, x0, n_sub=n_sub, hold=hold, memory=memory)

    # one sub-step and two may end at rest alike where the motion has turned: a law that jumps is
    # always followed to where it does
    jumps = any(port.law.set_valued for port in compiled.laws)
    rough = min(2 if jumps else LOCATED, largest)
    n_sub, run = settled_run(compiled, run_with, hold, accuracy, rough)
    if run.settled and not jumps:
        return n_sub, run
    if largest > LOCATED:
        from bondgraph.simulation.located import located

        found = located(compiled, p, u, step, x0, hold, accuracy, memory, run)
        if found is not None:
            return found
    return settled_run(compiled, run_with, hold, accuracy, largest, loud)


LOCATED = 16
"""Sub-steps a sample from which steps are halved only where a law switches or bends."""


def settled_run(
    compiled: Compiled,
    run_with: Callable[[int], KernelRun],
    hold: str,
    accuracy: float,
    largest: int = LARGEST,
    loud: bool = False,
) -> tuple[int, KernelRun]:
    """Do what `settle` does with any way to run so many sub-steps a sample."""
    # where laws remember, one sub-step and two may miss the same turning points, and agree
    remembers = any(port.law.n_memory for port in compiled.laws)
    n_sub = 2 if remembers or hold == "band-limited" else 1
    run = run_with(n_sub)
    if compiled.n_w == 0 and hold != "band-limited":
        return n_sub, run
    change = float("inf")
    while n_sub < largest:
        finer = run_with(2 * n_sub)
        change = unrounded_change(compiled, run, finer)
        run, n_sub = finer, 2 * n_sub
        if change < accuracy:
            return n_sub, run
    if loud and not np.isfinite(run.y).all():
        first = int(np.argmin(np.isfinite(run.y).all(axis=1)))
        raise BondsightError(
            f"{compiled.model.name}: the outputs are not finite from sample {first} on, at "
            f"{largest} sub-steps a sample; check parameters and start, or sample faster"
        )
    run = replace(run, settled=False)
    return n_sub, run


def unrounded_change(compiled: Compiled, before: KernelRun, after: KernelRun) -> float:
    """Return by how much the readings of two runs differ before they are rounded."""
    return relative_change(_unrounded(compiled, before), _unrounded(compiled, after))


def _unrounded(compiled: Compiled, run: KernelRun) -> Array:
    """Return readings as they are before rounding, which would make jumps of small changes."""
    y = run.y.copy()
    rounded = {p.argument: j for j, p in enumerate(compiled.laws) if p.role == "rounding"}
    for i, name in enumerate(compiled.model.output_names):
        if (j := rounded.get(f"{FINE}{name}")) is not None:
            y[:, i] = run.s[:, j]
    return y


def relative_change(before: Array, after: Array, spans: Array | None = None) -> float:
    """Return the largest root mean square of a change, relative to the range of its column.

    `spans` are ranges that the columns have had already, shape (n_columns,).
    """
    floor = np.maximum(1e-12 * np.abs(after).max(axis=0, initial=0.0), 1e-150)
    span = np.maximum(np.ptp(after, axis=0), floor if spans is None else np.maximum(floor, spans))
    with np.errstate(over="ignore"):  # of a run that breaks off
        return float(np.sqrt(np.mean(((after - before) / span) ** 2, axis=0)).max(initial=0.0))


def _memories(compiled: Compiled, lay: Any) -> list[tuple[str, slice, Law]]:
    """Element, rows among the carried numbers and law of each memory."""
    from bondgraph.simulation.lure import law_slices

    at = lay.n_x + lay.n_w
    return [
        (port.element, slice(at + ms.start, at + ms.stop), port.law)
        for port, ms, _ in law_slices(compiled)
        if port.law.n_memory
    ]


def _given_memory(compiled: Compiled, lay: Any, memory: Memories, z: Array) -> None:
    """Replace virgin memories by those given; they do not depend on the parameters."""
    known = {element: (rows, law) for element, rows, law in _memories(compiled, lay)}
    for element, states in memory.items():
        require_known("law with memory", compiled.model.name, known, element)
        rows, law = known[element]
        z[rows, 0] = law.checked_memory(states)
        z[rows, 1:] = 0.0


def relax_memories(
    compiled: Compiled, lay: Any, packed: Array, dpacked: Array, u: Array, z: Array
) -> None:
    """Relax the memories at the initial arguments (and their derivatives)."""
    if not lay.n_m:
        return
    at = sum(r * c for r, c in lay.pieces[:3])
    end = at + lay.n_w * (lay.n_x + lay.n_u)
    known = np.concatenate([z[: lay.n_x, 0], u])
    c = packed[at:end].reshape(lay.n_w, known.size, order="F")
    s = c[:, : lay.n_x] @ z[: lay.n_x]
    s[:, 0] += c[:, lay.n_x :] @ u
    for d in range(dpacked.shape[1]):
        s[:, 1 + d] += dpacked[at:end, d].reshape(c.shape, order="F") @ known
    place = {port.element: j for j, port in enumerate(compiled.laws)}
    for element, rows, law in _memories(compiled, lay):
        j = place[element]
        z[rows, 0] = law.initial_memory(float(s[j, 0]))
        if z.shape[1] > 1:
            z[rows, 1:] = np.outer(law.memory_sensitivity(float(s[j, 0])), s[j, 1:])
        if law.watched:
            z[rows.stop - 2 : rows.stop] = s[j + 1]
