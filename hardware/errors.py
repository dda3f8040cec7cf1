"""What can go wrong on a bench, in one tree.

Every error carries what had arrived until then in `partial`, so that nothing measured is lost with
the exception.
"""

from __future__ import annotations

from typing import Any, Self

from bondgraph.support.errors import BondsightError


class HardwareError(BondsightError):
    """Base of everything a device or its link can do wrong.

    Parameters
    ----------
    message : str
        What, where, why, what to try; one line.
    partial : object, optional
        What had arrived: chunks, or a record, as the one who raises says.
    """

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial

    def carrying(self, partial: Any) -> Self:
        """Return the same error with what had arrived."""
        self.partial = partial
        return self


class DriverMissing(HardwareError):
    """A vendor's library, an optional package or a device node that is not there."""


class LinkLost(HardwareError):
    """The cable, the socket or the device is gone; displacement needs a new zero afterwards.

    Examples
    --------
    >>> issubclass(LinkLost, BondsightError)
    True
    """


class TimedOut(HardwareError):
    """The device is there but what was waited for did not come in time."""


class ProtocolFault(HardwareError):
    """An answer that the protocol does not allow, or an error code of the device."""


class BeamLost(HardwareError):
    """The fringe counter lost its beam: every later displacement is off by unknown fringes."""


class Overrun(HardwareError):
    """Samples were lost, or more are asked for than the device can hold."""


class ClockSkewError(HardwareError):
    """Two clocks differ by more than the declared budget and nothing in the record tells how."""


class LimitViolation(HardwareError, ValueError):
    """A command outside the envelope of the actuator; nothing was sent.

    Examples
    --------
    >>> issubclass(LimitViolation, BondsightError)
    True
    """
