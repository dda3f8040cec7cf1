"""Getting back in step with a device whose answer came late, in pieces or as garbage."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from hardware.contracts import Transport
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut

TRIES = 3
"""How often the identity is asked for while nothing comes."""
_T = TypeVar("_T")


def resynchronise(
    ask: Callable[[], None],
    receive: Callable[[float], bytes | None],
    right: Callable[[bytes], bool],
    patience: float,
    owed: int = 0,
) -> bool:
    """Ask for the identity until nothing older can still be on its way.

    Devices answer in the order in which they are asked. So once every identity asked for has
    come, each answer to an older query has come (and been thrown away) or never will.

    Parameters
    ----------
    ask : callable
        Send the identity query.
    receive : callable
        Return the next answer, or None if none comes within the given time (s).
    right : callable
        Whether an answer is the identity.
    patience : float
        Time for all tries together (s), real time.
    owed : int
        Identity queries sent before whose answers are still owed.

    Returns
    -------
    bool
        Whether the next answer will belong to the next query.
    """
    seen, sent = 0, 0
    while sent < TRIES:
        ask()
        sent += 1
        deadline = time.monotonic() + patience / TRIES
        while (left := deadline - time.monotonic()) > 0.0:
            answer = receive(left)
            if answer is None:
                break
            seen += right(answer)
            if seen >= sent + owed:
                return True
    return False


def back_in_step(
    transport: Transport,
    error: HardwareError,
    ask: Callable[[], None],
    right: Callable[[bytes], bool],
    patience: float,
    end: bytes,
    then: Callable[[], _T],
    close: Callable[[], None],
    owed: int = 0,
) -> _T:
    """Get back in step after `error` and return what `then` asks, or close the link.

    Raises
    ------
    LinkLost
        The link is gone, or the sides do not find together.
    """

    def late(seconds: float) -> bytes | None:
        try:
            return transport.read_until(end, seconds)
        except TimedOut:
            return None

    try:
        transport.drain()
        if resynchronise(ask, late, right, patience, owed=owed):
            return then()
    except (TimedOut, ProtocolFault, ValueError):
        pass
    except LinkLost as lost:
        raise lost.carrying(error.partial) from error
    close()
    raise LinkLost(
        f"{transport.address}: out of step and the identity does not come within {patience:g} s, "
        f"so the link is closed (began with: {error}); check the device and open the link again",
        error.partial,
    ) from error
