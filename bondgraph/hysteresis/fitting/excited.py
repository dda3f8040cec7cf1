"""Which operators a record says anything about, and why the others are silent.

Sizes: n operators.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from bondgraph.hysteresis.fitting.bounded import column_norms
from bondgraph.support.ops import FloatArray

Action = Literal["dropped", "kept"]
"""What a fit did: weight 0; weight fitted, on thin evidence."""

# Regressors are exact to rounding; a column closer than this to its neighbours is one of them.
_RANK_TOLERANCE = 1e-9
_CONSTANT = 1e-13


@final
@dataclass(frozen=True, slots=True)
class Unexcited:
    """An operator whose weight the record does not determine, or hardly.

    Attributes
    ----------
    index : int
        Index of its weight.
    name : str
        What it is, such as ``"play 3 (r = 12.5)"``.
    reason : str
        Why, in words.
    action : {"dropped", "kept"}
        What the fit did with it.
    """

    index: int
    name: str
    reason: str
    action: Action

    def __str__(self) -> str:
        """Return one line."""
        return f"{self.name} {self.action}: {self.reason}"


def independent_columns(
    matrix: FloatArray, order: Sequence[int], before: FloatArray
) -> tuple[list[int], dict[int, list[int]]]:
    """Split columns into independent ones and combinations of those taken earlier.

    Gram-Schmidt, each column orthogonalised twice; earlier ones are preferred.

    Parameters
    ----------
    matrix : array
        Shape (m, n).
    order : sequence of int
        Columns to look at, in order of preference.
    before : array
        Columns that are there anyway, shape (m, any).

    Returns
    -------
    list of int
        Independent columns, ascending.
    dict of int to list of int
        For every other column of ``order`` the columns it is a combination of.

    Examples
    --------
    >>> independent_columns(np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]), (0, 1, 2), np.eye(2, 0))
    ([0, 2], {1: [0]})
    """
    basis = np.linalg.qr(before)[0]
    scaled = matrix / column_norms(matrix)
    kept: list[int] = []
    same: dict[int, list[int]] = {}
    for j in order:
        rest = scaled[:, j]
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > _RANK_TOLERANCE:
            kept.append(j)
            basis = np.column_stack((basis, rest / size))
        else:
            there = np.column_stack((scaled[:, kept], before))
            shares = np.linalg.lstsq(there, scaled[:, j], rcond=None)[0][: len(kept)]
            same[j] = [k for k, share in zip(kept, shares, strict=True) if abs(share) > 1e-6]
    return sorted(kept), same


def unexcited_columns(
    matrix: FloatArray,
    lowest: FloatArray,
    highest: FloatArray,
    names: Sequence[str],
    advice: str,
    *,
    offset: FloatArray,
    first: int = 0,
) -> tuple[list[int], tuple[Unexcited, ...]]:
    """Return the columns worth fitting and the reasons against the others.

    A column that never moves says nothing, or only shifts the level: without an offset in the
    fit the first such column takes that part.

    Parameters
    ----------
    matrix : array
        Reduced regressors, shape (m, n).
    lowest, highest : array
        Range of every column over the record, shape (n,).
    names : sequence of str
        Shape (n,).
    advice : str
        Added to the reason of a column that never moves; may be empty.
    offset : array
        Reduced column of ones, shape (m, 1), or (m, 0) without an offset in the fit.
    first : int, optional
        The column to prefer among dependent ones; then the others in their order.

    Returns
    -------
    list of int
        Columns to fit, ascending; empty if none moves.
    tuple of Unexcited
        The others (``"dropped"``), and kept ones with thin evidence.
    """
    size = np.maximum(abs(lowest), abs(highest))
    still = highest - lowest <= _CONSTANT * size
    levels = [int(j) for j in np.flatnonzero(still & (size > 0.0))]
    moving = sorted((int(j) for j in np.flatnonzero(~still)), key=lambda j: (j != first, j))
    if not moving:
        return [], ()
    kept, same = independent_columns(matrix, (*moving, *levels), offset)
    found: list[Unexcited] = []
    for j in range(matrix.shape[1]):
        if still[j]:
            reason = "never moves on this record" + (f"; {advice}" if advice else "")
            if j in kept:
                reason += "; its constant output stands for an offset: fit with offset=True instead"
            found.append(Unexcited(j, names[j], reason, "kept" if j in kept else "dropped"))
        elif j not in kept:
            others = ", ".join(names[k] for k in same[j]) or "the offset"
            reason = f"on this record its output is a combination of {others}"
            found.append(Unexcited(j, names[j], reason, "dropped"))
    return kept, tuple(found)
