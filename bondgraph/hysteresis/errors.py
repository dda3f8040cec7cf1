"""What can be wrong with an operator or with what is fed to it; every message names the culprit."""

from __future__ import annotations

from bondgraph.support.errors import BondsightError


class HysteresisError(BondsightError, ValueError):
    """Base of the errors of this package.

    Examples
    --------
    >>> issubclass(HysteresisError, ValueError)
    True
    """


class BadParameter(HysteresisError):
    """A parameter of an operator is out of its domain, or symbolic where a number is needed.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> try:
    ...     PrandtlIshlinskii((0.0, -1.0), (1.0, 0.5))
    ... except BadParameter as error:
    ...     print(error)
    thresholds[1] = -1.0 must be zero or positive
    """


class BadInput(HysteresisError):
    """An input record is empty, not one-dimensional or not finite.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> try:
    ...     PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5)).run([])
    ... except BadInput as error:
    ...     print(error)
    the input record must have shape (N,) with N >= 1, not (0,)
    """


class BadMemory(HysteresisError):
    """A memory does not belong to the operator it was given to.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> try:
    ...     PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5)).run([0.0, 1.0], (0.0, 0.0, 0.0))
    ... except BadMemory as error:
    ...     print(error)
    prandtl_ishlinskii has 1 memory states, the memory given has 3; it belongs to another operator
    """


class NotInvertible(HysteresisError):
    """An operator has no inverse because a slope (partial sum of weights) is not positive.

    Parameters
    ----------
    message : str
        What, where, why and what to try.
    index : int
        Index, in the operator's own order, of the weight where the slope stops being positive.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> try:
    ...     PrandtlIshlinskii((0.0, 1.0), (1.0, -2.0)).inverse()
    ... except NotInvertible as error:
    ...     print(error)
    no inverse: with weights[1] = -2 the slope S_1 = w_0 + ... + w_1 = -1 is not ...
    """

    def __init__(self, message: str, index: int) -> None:
        super().__init__(message)
        self.index = index

    def __reduce__(self) -> tuple[type[NotInvertible], tuple[str, int]]:
        """Let the error cross a process border with its index."""
        return type(self), (str(self.args[0]), self.index)
