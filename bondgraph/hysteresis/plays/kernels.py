"""The compiled loops over banks of plays, if the machine has a compiler.

Sizes: N samples, n plays.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.native import build
from bondgraph.support.ops import FloatArray

# -ffast-math itself would switch the whole process to flushing small numbers to zero
FLAGS = (
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-ffinite-math-only",
    "-fno-signed-zeros",
    "-fno-trapping-math",
    "-fassociative-math",
    "-fPIC",
    "-shared",
)
_TILE = 56
_DOUBLES = ctypes.POINTER(ctypes.c_double)


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL | None:
    path = build(source(), FLAGS)
    if path is None:
        return None
    library = ctypes.CDLL(str(path))
    library.turning_point_record.restype = ctypes.c_long
    for name in ("play_bank", "play_states"):
        getattr(library, name).restype = None
    return library


def source() -> str:
    """C source of the loops."""
    return play_source() + files("bondgraph.hysteresis.plays").joinpath("kernels.c").read_text()


def play_source() -> str:
    """C source of the play and of a weighted sum of plays at one input."""
    return files("bondgraph.hysteresis.plays").joinpath("play.c").read_text()


def kernels_available() -> bool:
    """Tell whether the loops could be compiled."""
    return _library() is not None


def in_eights(values: FloatArray) -> FloatArray:
    """Return a copy filled up with zeros to a whole number of eights."""
    return np.pad(values.astype(float), (0, -values.size % 8))


def _at(values: FloatArray) -> Any:
    return values.ctypes.data_as(_DOUBLES)


def _loaded() -> ctypes.CDLL:
    library = _library()
    if library is None:
        raise RuntimeError("no compiled loops; ask kernels_available() first")
    return library


def bank(
    x: FloatArray, r: FloatArray, w: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ``sum_j w_j play_j[x]``, shape (N,), and the last states, shape (n,).

    Parameters
    ----------
    x : array
        Finite input, shape (N,).
    r, w, y : array
        Half widths, weights and first states, shape (n,).
    """  # fmt: skip
    tiles = -(-r.size // _TILE)
    padded = np.zeros((3, tiles * _TILE))
    padded[:, : r.size] = r, w, y
    record, total = np.ascontiguousarray(x), np.zeros(x.size)
    _loaded().play_bank(
        _at(record), ctypes.c_long(x.size), _at(padded[0]), _at(padded[1]), ctypes.c_long(tiles),
        _at(padded[2]), _at(total),
    )  # fmt: skip
    return total, padded[2, : r.size].copy()


def states(x: FloatArray, r: FloatArray, y: FloatArray) -> FloatArray:
    """Return the states of n plays after each sample, shape (N, n).

    Parameters
    ----------
    x : array
        Finite input, shape (N,).
    r, y : array
        Half widths and first states, shape (n,).
    """
    record, out = np.ascontiguousarray(x), np.empty((x.size, r.size))
    width, now = in_eights(r), in_eights(y)
    _loaded().play_states(
        _at(record), ctypes.c_long(x.size), _at(width), ctypes.c_long(r.size), _at(now), _at(out)
    )
    return out


def swings(
    x: FloatArray,
    knots: FloatArray,
    values: FloatArray,
    slopes: FloatArray,
    extremes: FloatArray,
    outputs: FloatArray,
    direction: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the output over a record from a curve of the swing, and the turning points it left.

    Parameters
    ----------
    x : array
        Finite input, shape (N,).
    knots, values, slopes : array
        Swing, change of output and slope at the corners of the curve, shape (n + 1,); knot 0 is 0.
    extremes, outputs : array
        Turning points that still count, outermost first, then the present input, and the outputs
        there, shape (depth,).
    direction : float
        1.0 if the first of them was reached upwards, else -1.0.

    Returns
    -------
    array
        Output, shape (N,).
    array
        New turning points that still count, then the last input.
    """
    bins = 16 * knots.size
    per_bin = bins / knots[-1] if knots[-1] > 0.0 else 0.0
    # an edge is taken a rounding lower, so that a swing on it never starts behind its knot
    edges = np.arange(bins + 1) * (knots[-1] / bins) * (1.0 - 4e-16)
    found = np.maximum(np.searchsorted(knots, edges, side="right") - 1, 0)
    start: NDArray[np.int32] = np.append(found, knots.size - 1).astype(np.int32)
    start[-2] = start[-1]  # beyond the last edge
    depth = extremes.size
    stack = np.empty((2, depth + x.size + 1))
    stack[:, :depth] = extremes, outputs
    record, y, kept = np.ascontiguousarray(x), np.empty(x.size), ctypes.c_long(depth)
    top = _loaded().turning_point_record(
        _at(record), ctypes.c_long(x.size), _at(knots), _at(values), _at(slopes),
        ctypes.c_long(knots.size), start.ctypes.data_as(ctypes.POINTER(ctypes.c_int)),
        ctypes.c_double(per_bin), ctypes.c_long(bins), _at(stack[0]), _at(stack[1]),
        ctypes.c_long(depth), ctypes.c_double(direction), ctypes.byref(kept), _at(y),
    )  # fmt: skip
    return y, stack[0, kept.value : top].copy()
