"""Read a Maxwell resistive capacitor off its loading curve, the first rise from rest.

From rest every element carries ``k_i q`` until q reaches its slip point, so the loading curve is a
polygon: concave, and as steep in segment i as the springs i..n that still stick.

Sizes: N samples, n segments, as many elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import non_negative, parameters, same_length, strictly_increasing
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.fitting.least_squares import fit_linear_blocks
from bondgraph.hysteresis.fitting.maxwell import elements_with_stiffness
from bondgraph.hysteresis.fitting.records import paired_records, require_rising
from bondgraph.hysteresis.fitting.result import LinearFit
from bondgraph.hysteresis.plays.maxwell import MaxwellResistiveCapacitor
from bondgraph.support.ops import FloatArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class LoadingCurveFit:
    """A Maxwell resistive capacitor fitted to a loading curve.

    Attributes
    ----------
    operator : MaxwellResistiveCapacitor
        The elements with positive stiffness.
    memory : tuple of float
        Its memory at rest: every anchor at the first sample, unit of the input.
    ends : array
        Ends of the segments, measured from the first sample, shape (n,), unit of the input.
    slopes : array
        Slope of every segment, shape (n,), not increasing, effort per displacement.
    solution : LinearFit
        Stiffnesses of all segments as weights, errors, unexcited segments; scored on the loading
        samples only.
    """

    operator: MaxwellResistiveCapacitor
    memory: tuple[float, ...]
    ends: FloatArray
    slopes: FloatArray
    solution: LinearFit

    @property
    def offset(self) -> float:
        """Fitted effort at rest; 0 if none was asked for."""
        return self.solution.offset

    @property
    def rms(self) -> float:
        """Root mean square of the misfit over the loading samples, effort."""
        return self.solution.rms


def elements_from_slopes(
    slopes: Sequence[float] | FloatArray, ends: Sequence[float] | FloatArray
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffnesses and breakaways of the elements behind a polygonal loading curve.

    With ``s_i = k_i + ... + k_n`` on segment i, ``k_i = s_i - s_(i+1)`` and ``k_n = s_n``: eq.
    (5.12) of the stack actuator thesis, A the upper triangle of ones. Element i lets go at the END
    of segment i, so ``f_i = k_i x_(i+1)`` with x_1 = 0; the thesis prints ``f_i = k_i x_i`` in
    (5.11) and (5.13), but its Table 6.4 follows the form used here.

    Parameters
    ----------
    slopes : sequence of float
        s_i, shape (n,), effort per displacement.
    ends : sequence of float
        x_(i+1), ends of the segments, shape (n,), positive, strictly increasing, displacement.

    Returns
    -------
    tuple of float
        Stiffnesses k_i, shape (n,); negative where the curve is not concave.
    tuple of float
        Breakaways f_i, shape (n,), effort.

    Raises
    ------
    BadParameter
        If the lengths differ or an end is not positive or out of order; names the entry.

    References
    ----------
    goldfarb1997

    Examples
    --------
    >>> elements_from_slopes((3.0, 1.0), (1.0, 4.0))
    ((2.0, 1.0), (2.0, 4.0))
    """
    s, x = parameters("slopes", slopes), _segment_ends(ends)
    same_length("slopes", s, "ends", x)
    k = tuple(a - b for a, b in zip(s, (*s[1:], 0.0), strict=True))
    return k, tuple(k_i * end for k_i, end in zip(k, x, strict=True))


def loading_samples(x: ArrayLike) -> np.ndarray:
    """Tell which samples lie on the loading curve of an operator that starts from rest.

    Those at least as far from the first sample as every one before: there the past is wiped out
    and the operator is on its virgin curve, on either side (it is odd).

    Parameters
    ----------
    x : array
        Input, shape (N,).

    Returns
    -------
    array of bool
        Shape (N,).

    Examples
    --------
    >>> loading_samples([0.0, 2.0, 1.0, 3.0, -3.5]).tolist()
    [True, True, False, True, True]
    """
    away = np.abs(np.asarray(x, dtype=np.float64) - np.asarray(x, dtype=np.float64)[0])
    return np.asarray(away >= np.maximum.accumulate(away))


def fit_loading_curve(
    q: ArrayLike,
    v: ArrayLike,
    segments: int | Sequence[float] | FloatArray,
    *,
    offset: bool = False,
) -> LoadingCurveFit:
    """Fit a continuous concave polygon to the loading curve and return its elements.

    The polygon is ``v = sum k_i min(q, x_(i+1))``, fitted by least squares over the samples of the
    loading curve with k_i >= 0 (which is concavity); differences of noisy samples are not taken.

    Parameters
    ----------
    q : array
        Charge (displacement), shape (N,), starting from rest: no element stretched. Later loops
        may follow, they are not used.
    v : array
        Voltage (effort), shape (N,).
    segments : int or sequence of float
        Number of segments of equal length up to the largest excursion, or the ends of the segments
        measured from the first sample, positive, strictly increasing, unit of ``q``.
    offset : bool, optional
        Fit an unknown constant in ``v`` as well.

    Returns
    -------
    LoadingCurveFit
        Operator, slopes, ends.

    Raises
    ------
    BadInput
        If a record is constant, not finite (names the first sample) or of another length, has fewer
        loading samples than segments, or v does not rise with q.
    BadParameter
        If ``segments`` is not positive or out of order; names the entry.

    References
    ----------
    goldfarb1997, lawson1995

    Examples
    --------
    >>> q = np.linspace(0.0, 4.0, 41)
    >>> fit = fit_loading_curve(q, 2.0 * np.minimum(q, 1.0) + q, (1.0, 4.0))
    >>> fit.slopes.round(9).tolist(), [round(v, 9) for v in fit.operator.breakaways]
    ([3.0, 1.0], [2.0, 4.0])
    """
    charge, effort = paired_records(q, v, ("q", "v"))
    there = loading_samples(charge)
    away = (charge - charge[0])[there]
    require_rising(away, effort[there], ("q", "v"))
    farthest = float(np.abs(away).max())
    ends = np.array(_ends(segments, farthest))
    starts = (0.0, *ends[:-1])
    names = [
        f"segment {i} ({a:g} to {b:g})" for i, (a, b) in enumerate(zip(starts, ends, strict=True))
    ]
    polygon = np.clip(away[:, None], -ends, ends)
    solution = fit_linear_blocks(
        ((polygon, effort[there]),), "non_negative", offset=offset, names=names
    )
    operator = elements_with_stiffness(solution.weights, ends)
    slopes = np.cumsum(solution.weights[::-1])[::-1]
    rest = (float(charge[0]),) * operator.n_memory
    return LoadingCurveFit(operator, rest, ends, slopes, solution)


def _ends(segments: int | Sequence[float] | FloatArray, farthest: float) -> tuple[float, ...]:
    if isinstance(segments, bool) or (isinstance(segments, int | np.integer) and segments < 1):
        raise BadParameter(f"segments = {segments} must be at least 1")
    if isinstance(segments, int | np.integer):
        return tuple(farthest * (i + 1) / int(segments) for i in range(segments))
    return _segment_ends(segments)


def _segment_ends(ends: Sequence[float] | FloatArray) -> tuple[float, ...]:
    checked = parameters("ends", ends)
    non_negative("ends", checked, strict=True)
    strictly_increasing("ends", checked)
    return checked
