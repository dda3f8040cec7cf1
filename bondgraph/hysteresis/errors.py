"""What can be wrong with an operator or with what is fed to it; every message names the culprit."""

from __future__ import annotations

from bondgraph.support.errors import BondsightError


class HysteresisError(BondsightError, ValueError):
    """Base of the errors of this package."""


class BadParameter(HysteresisError):
    """A parameter of an operator is out of its domain, or symbolic where a number is needed."""


class BadInput(HysteresisError):
    """An input record is empty, not one-dimensional or not finite."""


class BadMemory(HysteresisError):
    """A memory does not belong to the operator it was given to."""


class NotInvertible(HysteresisError):
    """An operator has no inverse because a slope (partial sum of weights) is not positive.

    Parameters
    ----------
    message : str
        What, where, why and what to try.
    index : int
        Index, in the operator's own order, of the weight where the slope stops being positive.
    """

    def __init__(self, message: str, index: int) -> None:
        super().__init__(message)
        self.index = index

    def __reduce__(self) -> tuple[type[NotInvertible], tuple[str, int]]:
        """Let the error cross a process border with its index."""
        return type(self), (str(self.args[0]), self.index)
