"""The figure of the quadrature signals while the reference mirror vibrates, nothing driven."""

from __future__ import annotations

from collections.abc import Callable

from bondgraph.support.errors import UnusableInput, real_number
from hardware.contracts import Chunk
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.streaming import NORMAL_RATE, Streaming

POLL = 0.01
"""Pause between polls (s)."""


def vibrating(device: Interferometer, seconds: float, write: Callable[[Chunk], None]) -> Streaming:
    """Stream the quadrature signals while the reference mirror vibrates.

    Parameters
    ----------
    device : Interferometer
        Its object must be at rest. It has no zero afterwards: the vibration is no displacement.
    seconds : float
        Several periods of the vibration (s).
    write : callable
        Takes every chunk as it arrives.

    Returns
    -------
    Streaming
        Ended; who measured, and how fast.
    """
    if real_number("seconds", seconds) <= 0.0:
        raise UnusableInput(f"reference mirror: {seconds:g} s; give more than 0")
    device.vibrate_reference(True)
    try:
        device.zero()
        count = max(round(seconds * NORMAL_RATE), 1)
        stream = Streaming(device, NORMAL_RATE, count, extras=("sin", "cos"))
        stream.kickoff()
        try:
            while not stream.done:
                for chunk in stream.poll():
                    write(chunk)
                device.clock.sleep(POLL)
            stream.finish()
        finally:
            stream.abort()
    finally:
        device.vibrate_reference(False)
    return stream
