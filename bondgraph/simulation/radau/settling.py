"""How many sub-steps the general step needs: doubled until the outputs settle, or why not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from bondgraph.equations.program import Program
from bondgraph.simulation.exact_run import LARGEST, relative_change
from bondgraph.simulation.radau.jumping import jumping
from bondgraph.simulation.radau.native import GeneralRun
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError


def settled_general(
    run_with: Callable[[int], GeneralRun],
    columns: Sequence[int],
    accuracy: float,
    spans: Array | None = None,
    largest: int = LARGEST,
) -> tuple[int, GeneralRun]:
    """Run in ever more sub-steps a sample; returns their number and the last run.

    A run that does not settle says so in `GeneralRun.settled`; whether Newton's method came to its
    end in `GeneralRun.reached`.

    Parameters
    ----------
    run_with : callable
        Runs in so many sub-steps a sample.
    columns : sequence of int
        Outputs that must settle.
    accuracy : float
        Of their range.
    spans : ndarray, shape (n_columns,), optional
        Ranges that they have had already.
    largest : int
        Sub-steps a sample.
    """
    last: GeneralRun | None = None
    n_sub = 1
    while True:
        made = run_with(n_sub)
        if made.settled and last is not None and last.settled:
            change = relative_change(last.y[:, columns], made.y[:, columns], spans)
            if change < accuracy:
                return n_sub, made
        if 2 * n_sub > largest:
            return n_sub, replace(made, settled=False)
        last, n_sub = made, 2 * n_sub


def unsettled(program: Program, run: GeneralRun, begin: float, step: float) -> BondsightError:
    """Return the refusal of a run that begins at `begin`, with samples `step` apart (s)."""
    what = "the outputs do not settle"
    if run.reached < run.y.shape[0]:
        at = begin + run.reached * step
        what = f"Newton's method does not converge near {at:.6g} s"
    if jumps := jumping(program):
        what += f" ({', '.join(jumps)} has a law that jumps, which a smooth step cannot follow)"
    return BondsightError(
        f"{program.name}: {what} within {LARGEST} sub-steps a sample; sample faster, start closer "
        "(x0=), or check that the model has a solution there"
    )
