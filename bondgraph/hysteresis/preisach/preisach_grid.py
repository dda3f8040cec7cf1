"""Preisach operators from relays or from an Everett function on a grid of turning points.

Sizes: m + 1 levels, m steps between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.preisach.preisach import Preisach
from bondgraph.support.ops import FloatArray


def preisach_from_everett(levels: ArrayLike, everett: ArrayLike) -> Preisach:
    """Return the Preisach operator with a given Everett function on a uniform grid.

    Exact: `Preisach.everett` equals the table at all pairs of levels, so the output
    is exact wherever the input and its turning points are levels. Between levels each
    relay of a grid cell is spread along its line: the switch becomes a ramp one step long.

    The second mixed difference of E over one grid cell is the weight of the relays in it. With the
    step d, cell (i, j) lies on the line r = (j - i) d/2 and its ramp is d long, from
    v = (a_i + a_j)/2 to v + d; its slope is 2/d times the weight.

    Parameters
    ----------
    levels : array
        Turning points a_0 < ... < a_m, shape (m + 1,), m >= 1, equally spaced; unit of the input.
    everett : array
        E, shape (m + 1, m + 1), row i for the lower and column j for the upper turning point; only
        j > i is read. Half of the output change along the branch from a_j down to a_i, unit of the
        output.

    Returns
    -------
    Preisach
        With m lines and 2 m cells each; output 0 at rest before the first input.

    Raises
    ------
    BadInput
        If the levels are not finite.
    BadParameter
        If the levels are not equally spaced or the table has another shape or holds no number.

    References
    ----------
    mayergoyz2003, krejci1996

    Examples
    --------
    >>> operator = preisach_from_everett([0.0, 1.0, 2.0], [[0, 1, 3], [0, 0, 1], [0, 0, 0]])
    >>> float(operator.everett(0.0, 2.0))
    3.0
    """
    grid, step = _uniform(levels)
    table = _square("everett", everett, grid.size)
    # The diagonal is 0 by definition, so that the cells next to it need no case of their own.
    table = np.triu(table, 1)
    weights = table[:-1, 1:] - table[:-1, :-1] - table[1:, 1:] + table[1:, :-1]
    return _from_cells(grid, step, weights)


def preisach_from_relays(levels: ArrayLike, weights: ArrayLike) -> Preisach:
    """Return the Preisach operator that stands for relays with outputs -1 and 1 on a grid.

    Exact wherever the input and its turning points are levels, up to a constant: the operator is 0
    at rest, the sum of relays is not. Between levels a switch becomes a ramp one step long, so the
    outputs differ by at most the weight that switches within that step, twice.

    Parameters
    ----------
    levels : array
        As of `preisach_from_everett`.
    weights : array
        Shape (m, m): entry [i, j], j >= i, is the weight of the relays that switch down between
        a_i and a_(i+1) and up between a_j and a_(j+1); only j >= i is read. Unit of the output.

    Returns
    -------
    Preisach
        With m lines and 2 m cells each.

    References
    ----------
    mayergoyz2003, krejci1996

    Examples
    --------
    >>> operator = preisach_from_relays([0.0, 1.0, 2.0], [[1.0, 1.0], [0.0, 1.0]])
    >>> operator.run([0.0, 2.0, 1.0, 0.0])[0].tolist()
    [0.0, 6.0, 4.0, 0.0]
    """
    grid, step = _uniform(levels)
    return _from_cells(grid, step, _square("weights", weights, grid.size - 1))


def _from_cells(grid: FloatArray, step: float, weights: FloatArray) -> Preisach:
    m = grid.size - 1
    densities = np.zeros((m, 2 * m))
    for i in range(m):
        for j in range(i, m):
            # on the line j - i the cell starts at v = (a_i + a_j)/2, the knot i + j
            densities[j - i, i + j : i + j + 2] = 2.0 * weights[i, j] / step
    knots = grid[0] + 0.5 * step * np.arange(2 * m + 1)
    thresholds = 0.5 * step * np.arange(m)
    return Preisach(tuple(thresholds), tuple(knots), tuple(densities.ravel()))


def _uniform(levels: ArrayLike) -> tuple[FloatArray, float]:
    grid = finite_record(levels)
    if grid.size < 2:
        raise BadParameter(f"levels has {grid.size} entries; at least two are needed")
    step = float(grid[-1] - grid[0]) / (grid.size - 1)
    off = np.abs(grid - (grid[0] + step * np.arange(grid.size)))
    if step <= 0.0 or off.max() > 1e-9 * step * grid.size:
        k = int(off.argmax())
        raise BadParameter(
            f"levels[{k}] = {grid[k]} is off an increasing, equally spaced grid: only there do the "
            "cells share lines; interpolate the table onto such a grid"
        )
    return grid, step


def _square(name: str, values: ArrayLike, size: int) -> FloatArray:
    table = np.asarray(values, dtype=np.float64)
    if table.shape != (size, size):
        raise BadParameter(f"{name} has the shape {table.shape}; the levels need ({size}, {size})")
    used = np.triu(table)
    if not np.isfinite(used).all():
        i, j = np.argwhere(~np.isfinite(used))[0]
        raise BadParameter(f"{name}[{i}, {j}] = {table[i, j]} must be finite")
    return used
