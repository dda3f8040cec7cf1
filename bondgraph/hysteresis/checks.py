"""Turn what the caller passes into plain floats or untouched expressions, or say what is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.errors import BadInput, BadMemory, BadParameter
from bondgraph.support.ops import Expression, FloatArray


def is_number(value: Expression) -> bool:
    """Tell whether a stored parameter is a number, as opposed to an expression.

    Examples
    --------
    >>> is_number(1.0)
    True
    """
    return isinstance(value, float)


def all_numbers(values: Iterable[Expression]) -> bool:
    """Tell whether every stored parameter is a number.

    Examples
    --------
    >>> all_numbers((0.0, 1.0))
    True
    """
    return all(is_number(value) for value in values)


def entries(values: Any) -> list[Expression]:
    """List the entries of a sequence, an array or a CasADi vector.

    A CasADi matrix is iterated through its own indexing because it is not a Python sequence.

    Examples
    --------
    >>> entries((1, 2))
    [1, 2]
    """
    if callable(getattr(values, "numel", None)):
        return [values[i] for i in range(values.numel())]
    return list(values)


def _plain(value: Expression) -> Expression:
    """Return a Python float for a number, the value itself otherwise.

    NumPy scalars must not meet CasADi expressions (NumPy would take over the arithmetic), hence
    Python floats.
    """
    if type(value) is float:
        return value
    if isinstance(value, Real):
        return float(value)
    if type(value).__name__ == "DM" and value.numel() == 1:
        return float(value)
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype != object:
        return float(value)
    return value


def parameter(name: str, value: Any) -> Expression:
    """Return a parameter as a finite float, or unchanged if it is an expression.

    Parameters
    ----------
    name : str
        Name used in the error.
    value : number or expression
        The parameter, scalar.

    Raises
    ------
    BadParameter
        If it is a flag, text, a collection, or not finite.

    Examples
    --------
    >>> parameter("c", 2)
    2.0
    """
    if value is None or isinstance(value, bool | np.bool_ | str | bytes | list | tuple | dict):
        raise BadParameter(f"{name} = {value!r} must be a number or a symbolic expression")
    plain = _plain(value)
    if isinstance(plain, np.ndarray):
        raise BadParameter(f"{name} must be a scalar, not an array of shape {plain.shape}")
    if is_number(plain) and not math.isfinite(plain):
        raise BadParameter(f"{name} = {plain} must be finite")
    return plain


def parameters(name: str, values: Any) -> tuple[Expression, ...]:
    """Return a sequence of parameters, each through `parameter`.

    Examples
    --------
    >>> parameters("weights", [1, 2])
    (1.0, 2.0)
    """
    if isinstance(values, str | bytes | dict) or isinstance(values, Real):
        raise BadParameter(f"{name} = {values!r} must be a sequence of numbers or expressions")
    return tuple(parameter(f"{name}[{i}]", v) for i, v in enumerate(entries(values)))


def positive(name: str, value: Expression, *, or_zero: bool = False) -> None:
    """Check one parameter if it is a number.

    Raises
    ------
    BadParameter
        If it is negative, or zero without ``or_zero``.

    Examples
    --------
    >>> positive("c", 1.0)
    """
    if is_number(value) and (value < 0.0 or (value == 0.0 and not or_zero)):
        raise BadParameter(f"{name} = {value} must be {'zero or ' * or_zero}positive")


def count_of(name: str, value: object, least: int) -> None:
    """Check that a parameter is an integer, ``least`` or more.

    Raises
    ------
    BadParameter
        If it is not.

    Examples
    --------
    >>> count_of("count", 2, 1)
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise BadParameter(f"{name} = {value!r} must be an integer, {least} or more")


def from_zero(name: str, values: Sequence[Expression], part: str) -> None:
    """Check that the first entry is the number 0, that of a part with no width; none is negative.

    Raises
    ------
    BadParameter
        If it is missing or another one, or with the index of the first negative entry.

    Examples
    --------
    >>> from_zero("thresholds", (0.0, 1.0), "linear")
    """
    if not values or not is_number(values[0]) or values[0] != 0.0:
        raise BadParameter(
            f"{name}[0] = {values[0] if values else 'missing'} must be 0, the {part} part; give it "
            "weight 0 if there is none"
        )
    non_negative(name, values)


def same_length(name: str, values: Sequence[object], other: str, others: Sequence[object]) -> None:
    """Check that two parameter sequences pair up.

    Raises
    ------
    BadParameter
        If the lengths differ, with both lengths.

    Examples
    --------
    >>> same_length("thresholds", (0.0,), "weights", (1.0,))
    """
    if len(values) != len(others):
        raise BadParameter(
            f"{name} has {len(values)} entries but {other} has {len(others)}; one of each per "
            "operator is needed"
        )


def strictly_increasing(name: str, values: Sequence[Expression]) -> None:
    """Check neighbours that are both numbers; expressions are taken on trust.

    Raises
    ------
    BadParameter
        With the index of the first entry not above its predecessor.

    Examples
    --------
    >>> strictly_increasing("thresholds", (0.0, 1.0))
    """
    for i in range(1, len(values)):
        low, high = values[i - 1], values[i]
        if is_number(low) and is_number(high) and not high > low:
            raise BadParameter(
                f"{name}[{i}] = {high} is not above {name}[{i - 1}] = {low}; sort {name} "
                "(with their weights) and merge equal ones"
            )


def non_negative(name: str, values: Sequence[Expression], *, strict: bool = False) -> None:
    """Check that the entries that are numbers are not negative (``strict``: positive).

    Raises
    ------
    BadParameter
        With the index of the first offender.

    Examples
    --------
    >>> non_negative("thresholds", (0.0, 1.0))
    """
    for i, value in enumerate(values):
        positive(f"{name}[{i}]", value, or_zero=not strict)


def numbers(name: str, values: Sequence[Expression]) -> list[float]:
    """Return parameters as floats where only numbers make sense.

    Raises
    ------
    BadParameter
        With the index of the first symbolic entry.

    Examples
    --------
    >>> numbers("weights", (1.0, 2.0))
    [1.0, 2.0]
    """
    for i, value in enumerate(values):
        if not is_number(value):
            raise BadParameter(
                f"{name}[{i}] = {value} is symbolic; substitute numbers first (use value() and "
                "advance() with symbols)"
            )
    return [float(value) for value in values]


def finite_record(x: ArrayLike) -> FloatArray:
    """Return an input record as float array of shape (N,), N >= 1.

    Raises
    ------
    BadInput
        If it is empty, not one-dimensional, or holds NaN or infinity (with the first index).

    Examples
    --------
    >>> finite_record([1, 2]).tolist()
    [1.0, 2.0]
    """
    record = np.asarray(x, dtype=np.float64)
    if record.ndim != 1 or record.size == 0:
        raise BadInput(f"the input record must have shape (N,) with N >= 1, not {record.shape}")
    require_finite("x", record)
    return record


def require_finite(name: str, value: Expression) -> None:
    """Check a number or numeric array before it can enter a memory.

    Raises
    ------
    BadInput
        With the place of the first entry that is NaN or infinite.

    Examples
    --------
    >>> require_finite("x", 1.0)
    """
    bad = ~np.isfinite(np.asarray(value, dtype=np.float64))
    if bad.any():
        where = np.argwhere(np.atleast_1d(bad))[0]
        place = "" if np.ndim(value) == 0 else f"[{', '.join(str(int(i)) for i in where)}]"
        entry = np.atleast_1d(value)[tuple(where)]
        raise BadInput(f"{name}{place} = {entry} is not finite; cut or interpolate the gap first")


def memory_states(kind: str, n_memory: int, memory: Any) -> tuple[Expression, ...]:
    """Return a memory as a tuple of ``n_memory`` states.

    Raises
    ------
    BadMemory
        If the length is wrong or a state is NaN or infinite.

    Examples
    --------
    >>> memory_states("play", 2, [1, 2])
    (1.0, 2.0)
    """
    states = tuple(_plain(state) for state in entries(memory))
    if len(states) != n_memory:
        raise BadMemory(
            f"{kind} has {n_memory} memory states, the memory given has {len(states)}; it belongs "
            "to another operator"
        )
    for i, state in enumerate(states):
        if is_number(state) and not math.isfinite(state):
            raise BadMemory(f"memory[{i}] = {state} of {kind} is not finite")
    return states
