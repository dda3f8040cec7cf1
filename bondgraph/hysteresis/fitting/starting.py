"""Where a fit may start: with a known memory at once, otherwise once the past is wiped out.

A play of half width r forgets its initial state as soon as the input has swung by 2 r peak to peak:
its state then hangs on the last of the two extremes. Until then it depends on the unknown past.

Sizes: N samples, n plays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, final

import numpy as np

from bondgraph.hysteresis.errors import BadInput, BadParameter
from bondgraph.hysteresis.fitting.bank import play_bank
from bondgraph.hysteresis.fitting.excited import Unexcited
from bondgraph.hysteresis.fitting.result import LinearFit
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import FloatArray

Past = Sequence[float] | Literal["unknown"] | None
"""Memory before the first sample; ``"unknown"``; or None, virgin at the first sample."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Where to start and with which plays.

    Attributes
    ----------
    sample : int
        First sample to score.
    memory : tuple of float
        Play states before it, shape (n,), unit of the input.
    known : array of bool
        Whether the state of each play is known from there on, shape (n,).
    """

    sample: int
    memory: tuple[float, ...]
    known: np.ndarray

    def bank(self, plays: PrandtlIshlinskii) -> tuple[PrandtlIshlinskii, list[float]]:
        """Return the plays whose state is known, and those states.

        They are the first ones, because a wider play forgets later.
        """
        n = int(self.known.sum())
        return play_bank(plays.thresholds[: n + 1]), list(self.memory[:n])


def forgotten_at(x: FloatArray, r: FloatArray) -> np.ndarray:
    """Return the sample from which each play no longer depends on its initial state.

    Parameters
    ----------
    x : array
        Input, shape (N,).
    r : array
        Half widths, shape (n,), unit of ``x``.

    Returns
    -------
    array of int
        Shape (n,); N for a play that never forgets.

    Examples
    --------
    >>> forgotten_at(np.array([0.0, 1.0, -1.0, 2.0]), np.array([0.5, 1.0, 9.0])).tolist()
    [1, 2, 4]
    """
    swing = np.maximum.accumulate(x) - np.minimum.accumulate(x)
    return np.searchsorted(swing, 2.0 * r)


def choose_start(plays: PrandtlIshlinskii, x: FloatArray, past: Past, scored_share: float) -> Start:
    """Choose the first sample to score and the plays whose state is known there.

    With an unknown past, plays that still remember it after ``(1 - scored_share) N`` samples are
    given up; scoring starts where the last of the others forgets.

    Parameters
    ----------
    plays : PrandtlIshlinskii
        The bank, its weights are not used.
    x : array
        Input, shape (N,).
    past : sequence of float, "unknown" or None
        Play states before the first sample, shape (n,); None for virgin.
    scored_share : float
        Between 0 and 1.

    Returns
    -------
    Start
        With ``sample = 0`` unless the past is unknown.

    Raises
    ------
    BadInput
        If no play forgets the past in time.
    BadMemory, BadParameter
        If the memory or the share is not one.
    """
    if not (0.0 < scored_share < 1.0):
        raise BadParameter(f"scored_share = {scored_share} must lie between 0 and 1")
    n = plays.n_memory
    if past is None or not isinstance(past, str):
        memory = plays.initial_memory(float(x[0]), past)
        return Start(0, tuple(float(y) for y in memory), np.ones(n, dtype=bool))
    if past != "unknown":
        raise BadParameter(f"memory = {past!r}; give the states, 'unknown' or None for virgin")
    when = forgotten_at(x, np.array(plays.thresholds[1:]))
    known = when <= (1.0 - scored_share) * x.size
    if n and not known.any():
        raise BadInput(
            f"no play forgets the unknown past within the first {1.0 - scored_share:.0%} of the "
            f"record: the smallest, r = {plays.thresholds[1]:g}, needs a swing of "
            f"{2.0 * plays.thresholds[1]:g}; give the memory, take smaller thresholds or lower "
            "scored_share"
        )
    sample = int(when[known].max(initial=0))
    memory = plays.initial_memory(float(x[0]))
    if sample:
        memory = plays.run(x[:sample], memory)[1]
    return Start(sample, tuple(float(y) for y in memory), known)


def late_plays(names: Sequence[str], first: int) -> tuple[Unexcited, ...]:
    """Return the reasons of the operators that were given up, from number ``first`` on.

    Examples
    --------
    >>> [late.name for late in late_plays(("a", "b"), 1)]
    ['b']
    """
    reason = (
        "its state still hangs on the unknown past when scoring has to begin; record a swing of "
        "2 r first, give the memory or lower scored_share"
    )
    return tuple(Unexcited(i, names[i], reason, "dropped") for i in range(first, len(names)))


def with_given_up(solution: LinearFit, names: Sequence[str]) -> LinearFit:
    """Put the operators that were given up back at the end, with weight 0 and the reason.

    Parameters
    ----------
    solution : LinearFit
        Of the first operators.
    names : sequence of str
        Of all operators.

    Returns
    -------
    LinearFit
        Of all operators.
    """
    first = solution.weights.size
    gone = len(names) - first
    return replace(
        solution,
        weights=np.append(solution.weights, np.zeros(gone)),
        lower=np.append(solution.lower, np.full(gone, -np.inf)),
        standard_errors=np.append(solution.standard_errors, np.full(gone, np.inf)),
        unexcited=(*solution.unexcited, *late_plays(names, first)),
    )
