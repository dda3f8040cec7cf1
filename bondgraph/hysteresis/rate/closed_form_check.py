"""Whether the fast inverse of rate-dependent plays is exact for a motion, and if not, why.

Sizes: n plays with a width, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record, numbers
from bondgraph.hysteresis.rate.rate import rate_record
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.support.ops import NUMPY, Expression


@final
@dataclass(frozen=True, slots=True)
class ClosedFormCheck:
    """Answer of `closed_form_check`; true if the fast inverse is exact.

    Parameters
    ----------
    exact : bool
        Whether it is.
    reason : str
        One sentence.
    gap : int or None
        i of the first gap r_(i+1) - r_i that shrinks.
    sample : int or None
        First sample at which it is narrower than before, if a record was given.
    """

    exact: bool
    reason: str
    gap: int | None = None
    sample: int | None = None

    def __bool__(self) -> bool:
        """Whether the fast inverse is exact."""
        return self.exact


def closed_form_check(
    operator: RateDependentPrandtlIshlinskii,
    x: ArrayLike | None = None,
    memory: Sequence[Expression] | None = None,
    *,
    step: float | None = None,
) -> ClosedFormCheck:
    """Say whether `RateDependentPrandtlIshlinskii.closed_form_inverse` is exact.

    It is if no gap ``r_(i+1) - r_i`` with i >= 1 shrinks in time. The first one, r_1 itself, is
    free. For every motion that needs one rate gain common to all plays; for one motion the gaps
    along it are looked at. Shrinking gaps need not always do harm, so a "no" is a warning.

    Parameters
    ----------
    operator : RateDependentPrandtlIshlinskii
        With numbers for its parameters.
    x : array, optional
        Input record, shape (N,), N >= 1. Default: any motion.
    memory : sequence of float, optional
        Memory before the record, shape (n + 2,). Default: virgin at ``x[0]``.
    step : float, optional
        Time between the samples of the record, s.

    Returns
    -------
    ClosedFormCheck
        With the first gap that shrinks.

    Raises
    ------
    BadInput
        If the record is not finite or its step is missing.
    BadMemory
        If the memory is not one of the operator.
    BadParameter
        If a parameter is symbolic.

    References
    ----------
    aljanaideh2013

    Examples
    --------
    >>> operator = RateDependentPrandtlIshlinskii((0, 1, 2), (0, 0.5, 0.7), (1, 1, 1))
    >>> closed_form_check(operator).gap
    1
    >>> bool(closed_form_check(operator, [0.0, 1.0, 3.0], step=1.0))
    True
    """
    a = np.array(numbers("thresholds", operator.thresholds))[1:]
    b = np.array(numbers("rate_gains", operator.rate_gains))[1:]
    unequal = np.flatnonzero(np.diff(b) != 0.0)
    if unequal.size == 0:
        return ClosedFormCheck(True, "all plays have one rate gain, so no gap ever shrinks")
    if x is None:
        i = int(unequal[0])
        when = "falls" if b[i + 1] > b[i] else "rises"
        return ClosedFormCheck(
            False,
            f"gap {i + 1}, r_{i + 2} - r_{i + 1}, shrinks whenever the speed {when}: rate_gains"
            f"[{i + 2}] = {b[i + 1]:.6g} differs from rate_gains[{i + 1}] = {b[i]:.6g}; give the "
            "record to check one motion, or use inverse()",
            i + 1,
        )
    record, seconds = finite_record(x), operator._seconds(step)
    start = operator.initial_memory(float(record[0])) if memory is None else memory
    last, before = (float(v) for v in operator._states(start)[:2])
    (smoothing,) = numbers("smoothing", (operator.smoothing,))
    # The widths in a step come from the rate known before it; the last rate meets no step.
    known = np.append(before, rate_record(record, last, before, seconds, smoothing)[:-1])
    gaps = np.diff(a) + np.diff(b) * NUMPY.absolute(known)[:, None]
    slack = 1e-12 * float(np.max(np.abs(gaps)))
    shrinking = np.argwhere(np.diff(gaps, axis=0) < -slack)
    crossed = np.argwhere(gaps[:1] < 0.0)
    if shrinking.size == 0 and crossed.size == 0:
        return ClosedFormCheck(True, "no gap shrinks along this record")
    if crossed.size:
        i = int(crossed[0, 1])
        return ClosedFormCheck(
            False, f"gap {i + 1}, r_{i + 2} - r_{i + 1}, is negative at the start", i + 1, 0
        )
    k, i = (int(v) for v in shrinking[0])
    return ClosedFormCheck(
        False,
        f"gap {i + 1}, r_{i + 2} - r_{i + 1}, shrinks at sample {k + 1} from {gaps[k, i]:.6g} to "
        f"{gaps[k + 1, i]:.6g}; use inverse(), which needs no condition on the gaps",
        i + 1,
        k + 1,
    )
