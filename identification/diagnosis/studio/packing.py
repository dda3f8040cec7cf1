"""Numbers and texts put into a page so that nothing a user named can leave its place."""

from __future__ import annotations

import base64
import json
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import Array


def packed(values: ArrayLike, kind: str = "<f4") -> str:
    """Return numbers as base64 of little-endian ``float32`` (`kind` ``<f8`` for times)."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def embedded(value: Any) -> str:
    r"""Return `value` as JSON that ends no script element, whatever its texts are.

    Examples
    --------
    >>> embedded("</script>")
    '"\\u003c/script\\u003e"'
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def rolling_level(values: Array, at: Array) -> Array:
    """Root mean square around each of the samples `at`, of all `values` that are known.

    A window is a two-hundredth of the record, at least five samples; NaN where it knows nothing.

    Parameters
    ----------
    values : ndarray, shape (n,)
    at : ndarray of int

    Examples
    --------
    >>> rolling_level(np.full(8, 3.0), np.array([0, 7])).tolist()
    [3.0, 3.0]
    """
    n, half = values.size, max(2, round(values.size / 400))
    known = np.isfinite(values)
    # sums of each window for itself: differences of one running sum lose what is small
    ends = np.stack([np.maximum(at - half, 0), np.minimum(at + half + 1, n)], axis=1).ravel()
    square, count = (
        np.add.reduceat(np.append(v, 0.0), ends)[::2]
        for v in (np.where(known, values, 0.0) ** 2, known.astype(float))
    )
    return np.asarray(np.sqrt(np.divide(square, count, np.full(at.size, np.nan), where=count > 0)))


def kept(n: int, most: int, *values: Array) -> Array:
    """Positions of about `most` of `n` samples: smallest and largest of every piece of each trace.

    All of them where they are no more than `most`.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN where nothing is known.
    """
    if n <= most:
        return np.arange(n)
    edges = np.linspace(0, n, most // (2 * max(1, len(values))) + 1).astype(int)
    pieces = list(pairwise(edges.tolist()))
    found = [*edges[:-1].tolist(), n - 1]
    for v in values:
        low, high = np.nan_to_num(v, nan=np.inf), np.nan_to_num(v, nan=-np.inf)
        found += [a + int(np.argmin(low[a:b])) for a, b in pieces]
        found += [a + int(np.argmax(high[a:b])) for a, b in pieces]
    return np.unique(found)


BEGUN, ABSURD = 0.02, 20.0
"""Part of a record at its beginning, and widths beyond all else from which it is left out."""


def typical(values: Array) -> Array:
    """Return which values are drawn: not a beginning that lies far beyond all that comes after.

    There a model that its fit has bent starts from a state that nothing tells.

    Examples
    --------
    >>> import numpy as np
    >>> typical(np.append(1e6, np.linspace(-1.0, 1.0, 1000)))[[0, -1]].tolist()
    [False, True]
    """
    first = int(BEGUN * values.size)
    rest = values[first:]
    near = np.ones(values.size, bool)
    if first and np.isfinite(rest).any():
        low, high = float(np.nanmin(rest)), float(np.nanmax(rest))
        wide = ABSURD * (high - low)
        if wide > 0:
            near[:first] = (values[:first] >= low - wide) & (values[:first] <= high + wide)
    return near
