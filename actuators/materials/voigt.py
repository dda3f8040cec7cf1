"""Voigt notation: symmetric tensors as vectors of six, and how a rotation acts on them.

The order is 11, 22, 33, 23, 31, 12 (IEEE Std 176; stack actuator thesis, eq. 2.4). Strain vectors
hold the engineering shear ``2 S_23, 2 S_31, 2 S_12``, so that stress times strain is work.

Arrays of floats and arrays of SymPy expressions (dtype object) are treated alike.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.errors import UnusableInput

Array: TypeAlias = NDArray[Any]
"""Float64, or object with SymPy expressions."""

_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))
_ROWS = [p[0] for p in _PAIRS]
_COLUMNS = [p[1] for p in _PAIRS]
_TOLERANCE = 1e-9


def is_symbolic(values: Array) -> bool:
    """Tell whether an array holds expressions instead of floats."""
    return values.dtype == object


def entries(what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return `values` as an array of floats or of expressions whose last axes are `shape`.

    Raises
    ------
    UnusableInput
        The shape is wrong or an entry is not finite; names the entry.
    """
    array = np.array(values)
    if array.shape[-len(shape) :] != shape:
        raise UnusableInput(
            f"{what} has shape {array.shape}, it must end in {shape}; give one number (or "
            "expression) for every component"
        )
    if is_symbolic(array):
        _require_expressions(what, array)
        return array
    try:
        array = array.astype(np.float64)
    except (TypeError, ValueError):
        raise UnusableInput(f"{what} holds {array.dtype} values; give real numbers") from None
    if not np.isfinite(array).all():
        where = tuple(int(i) + 1 for i in np.argwhere(~np.isfinite(array))[0])
        raise UnusableInput(f"{what} is not finite at entry {where}; give a number there")
    return array


def _require_expressions(what: str, array: Array) -> None:
    import sympy as sp

    for at, value in np.ndenumerate(array):
        if not isinstance(value, int | float | sp.Expr):
            where = tuple(i + 1 for i in at)
            raise UnusableInput(
                f"{what} holds {value!r} at entry {where}; give a number or a SymPy expression"
            )


def _symmetric(what: str, tensor: ArrayLike) -> Array:
    array = entries(what, tensor, (3, 3))
    if is_symbolic(array):
        return array
    skew = np.abs(array - np.swapaxes(array, -1, -2))
    if (skew > _TOLERANCE * np.abs(array).max(initial=0.0)).any():
        *_, i, j = (int(n) for n in np.argwhere(skew > 0)[0])
        raise UnusableInput(
            f"{what} is not symmetric: entry ({i + 1}, {j + 1}) = {array[..., i, j].flat[0]:g}, "
            f"({j + 1}, {i + 1}) = {array[..., j, i].flat[0]:g}; Voigt notation keeps only one"
        )
    return array


def _matrix(vector: Array) -> Array:
    tensor = np.empty((*vector.shape[:-1], 3, 3), dtype=vector.dtype)
    tensor[..., _ROWS, _COLUMNS] = vector
    tensor[..., _COLUMNS, _ROWS] = vector
    return tensor


def _shear(vector: Array, numerator: int, denominator: int) -> Array:
    out = vector.copy()
    out[..., 3:] = numerator * out[..., 3:] / denominator
    return out


def stress_to_voigt(tensor: ArrayLike) -> Array:
    """Return symmetric stress tensors, shape (..., 3, 3), Pa, as vectors, shape (..., 6).

    Raises
    ------
    UnusableInput
        Wrong shape, not finite or not symmetric.

    Examples
    --------
    >>> stress_to_voigt([[1, 6, 5], [6, 2, 4], [5, 4, 3]]).tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    """
    return _symmetric("stress", tensor)[..., _ROWS, _COLUMNS]


def stress_from_voigt(vector: ArrayLike) -> Array:
    """Return stress vectors, shape (..., 6), Pa, as symmetric tensors, shape (..., 3, 3)."""
    return _matrix(entries("stress vector", vector, (6,)))


def strain_to_voigt(tensor: ArrayLike) -> Array:
    """Return symmetric strain tensors, shape (..., 3, 3), as vectors with engineering shear.

    Raises
    ------
    UnusableInput
        Wrong shape, not finite or not symmetric.

    Examples
    --------
    >>> strain_to_voigt([[1, 6, 5], [6, 2, 4], [5, 4, 3]]).tolist()
    [1.0, 2.0, 3.0, 8.0, 10.0, 12.0]
    """
    return _shear(_symmetric("strain", tensor)[..., _ROWS, _COLUMNS], 2, 1)


def strain_from_voigt(vector: ArrayLike) -> Array:
    """Return strain vectors with engineering shear, shape (..., 6), as tensors (..., 3, 3)."""
    return _matrix(_shear(entries("strain vector", vector, (6,)), 1, 2))


def check_rotation(rotation: ArrayLike) -> Array:
    """Return a rotation (or reflection) matrix, shape (3, 3); symbolic ones are taken on trust.

    Raises
    ------
    UnusableInput
        The rows are not orthonormal.
    """
    r = entries("rotation", rotation, (3, 3))
    if r.shape != (3, 3):
        raise UnusableInput(f"rotation has shape {r.shape}; give one matrix of shape (3, 3)")
    if not is_symbolic(r) and np.abs(r @ r.T - np.eye(3)).max() > 1e-8:
        i, j = np.unravel_index(np.abs(r @ r.T - np.eye(3)).argmax(), (3, 3))
        raise UnusableInput(
            f"rotation is not orthonormal: rows {i + 1} and {j + 1} have the product "
            f"{(r @ r.T)[i, j]:.6g}; give unit vectors of the new axes as rows"
        )
    return r


def rotation_about(axis: int, angle: Any) -> Array:
    """Return the rotation whose rows are the axes turned by `angle` (rad) about axis 1, 2 or 3.

    Examples
    --------
    >>> rotation_about(3, np.pi / 2).round(12).tolist()
    [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    if axis not in (1, 2, 3):
        raise UnusableInput(f"axis {axis!r} does not exist; rotate about axis 1, 2 or 3")
    if isinstance(angle, int | float):
        r = np.eye(3)
        cosine: Any = np.cos(angle)
        sine: Any = np.sin(angle)
    else:
        import sympy as sp

        r = np.array(sp.eye(3).tolist(), dtype=object)
        cosine, sine = sp.cos(angle), sp.sin(angle)
    i, j = axis % 3, (axis + 1) % 3
    r[i, i], r[i, j], r[j, i], r[j, j] = cosine, sine, -sine, cosine
    return r


def stress_rotation(rotation: ArrayLike) -> Array:
    """Return the Bond matrix ``M``, shape (6, 6): stress vectors turn as ``T' = M T``.

    Parameters
    ----------
    rotation : array, shape (3, 3)
        Unit vectors of the new axes as rows.
    """
    r = check_rotation(rotation)
    bases = stress_from_voigt(np.eye(6, dtype=int).astype(r.dtype))
    return np.stack([(r @ b @ r.T)[_ROWS, _COLUMNS] for b in bases], axis=1)


def strain_rotation(rotation: ArrayLike) -> Array:
    """Return ``N``, shape (6, 6): strain vectors turn as ``S' = N S``, with ``N^T M = 1``.

    ``M`` of the inverse rotation is the inverse of ``M``, so N is its transpose.
    """
    return stress_rotation(check_rotation(rotation).T).T
