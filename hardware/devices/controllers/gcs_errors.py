"""Error numbers of GCS controllers: what they mean and which of our errors they become."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import TypeVar

from hardware.errors import HardwareError, LimitViolation, Overrun, ProtocolFault

_T = TypeVar("_T")
UNKNOWN = 2
"""Number of a command that the controller does not know."""

MEANINGS = MappingProxyType(
    {
        1: "parameter not understood",
        2: "unknown command",
        3: "command too long",
        5: "move not allowed: servo off or axis without reference",
        7: "position out of limits",
        8: "velocity out of limits",
        10: "stopped by command",
        15: "no such axis",
        17: "parameter out of range",
        23: "no such axis or channel",
        24: "wrong number of arguments",
        25: "not a number",
        26: "argument missing",
        27: "soft limit out of range",
        34: "not allowed with this stage",
        53: "not allowed while the axis moves",
        54: "unknown parameter",
        57: "no such recorder table",
        58: "no such record option",
        60: "command level too low",
        63: "still starting up",
        66: "voltage out of limits",
        67: "no memory for the waveform",
        70: "arrays of different lengths",
        72: "not allowed with an analogue target",
        73: "not allowed while the wave generator runs",
        74: "no sensor or output connected to the axis",
        75: "wave generator started without a wave table",
        76: "interface buffer overrun",
        77: "fewer points recorded than asked for",
        78: "recorder table not set up",
        302: "voltage out of limits",
        303: "open-loop command while the servo is on",
        304: "command too long",
        307: "command incomplete",
        333: "hardware error inside",
        400: "no such wave generator",
        401: "wave table empty",
        402: "unknown kind of wave",
        403: "waveform too long",
        404: "wrong number of wave parameters",
        405: "wave parameter out of range",
        406: "start mode not supported",
        505: "sensor signal not valid",
        506: "servo unstable and switched off",
        508: "move not allowed by its limits",
        509: "emergency stop by an input",
    }
)
"""Meaning by number, after the public list of GCS errors."""

_LIMITS = frozenset((7, 8, 27, 66, 302, 405, 508))
_TOO_MUCH = frozenset((67, 77, 403))


def device_error(number: int, command: str, address: str) -> HardwareError:
    """Return the error that a number becomes.

    Parameters
    ----------
    number : int
        As the controller answers to ``ERR?``; not zero.
    command : str
        What was sent.
    address : str
        To whom.
    """
    meaning = MEANINGS.get(number, "see the controller's manual")
    shown = command if len(command) <= 60 else command[:57] + "..."
    text = f"{address}: refused {shown!r} with GCS error {number} ({meaning})"
    if number in _LIMITS:
        return LimitViolation(
            f"{text}; nothing was put out, check the limits of the device", number
        )
    if number in _TOO_MUCH:
        return Overrun(text, number)
    return ProtocolFault(text, number)


def forgiven(number: int, action: Callable[[], _T]) -> _T | None:
    """Return what `action` does; None if the device refused it with this number."""
    try:
        return action()
    except ProtocolFault as fault:
        if fault.partial != number:
            raise
        return None
