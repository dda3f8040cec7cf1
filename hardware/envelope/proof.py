"""The proof that a read-back follows its commands, by a small step at the end of a power-up."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from bondgraph.support.errors import UnusableInput, real_number
from hardware.envelope.limits import Converter
from hardware.envelope.line import OutputLine
from hardware.envelope.monitor import check_monitor, doubt_of_step
from hardware.errors import HardwareError, LimitViolation, ProtocolFault

SHARE = 0.02
"""Step, as a share of the range."""
NOISE = 5e-3
"""By which a reading may be off beside the converter's own step (V)."""
REST = 2e-3
"""Shortest time from a command to its reading (s)."""


def probe_step(line: OutputLine, probe: float | None, converter: Converter | None) -> float:
    """Return the step away from the safe value (V, signed), 0 for none.

    Raises
    ------
    UnusableInput
        It leaves the limits, or is too small to be told from noise.
    """
    safe = line.envelope.safe
    up = line.high - safe >= safe - line.low
    room = line.high - safe if up else safe - line.low
    size = noise_of(converter)
    if probe is None:
        wanted = max(SHARE * (line.envelope.v_max - line.envelope.v_min), 10.0 * size)
        wanted = min(wanted, 0.5 * room)
    else:
        wanted = real_number("guard: probe", probe)
        if wanted and not 3.0 * size <= wanted <= room:
            raise UnusableInput(
                f"guard: a probe of {wanted:g} V; it must lie between {3.0 * size:.3g} V (noise) "
                f"and {room:g} V (limits), or be 0 for none"
            )
    return wanted if up else -wanted


def noise_of(converter: Converter | None) -> float:
    """Return by how much a reading may be off (V)."""
    return NOISE + (0.0 if converter is None else converter.resolution)


def prove(line: OutputLine, step: float, noise: float, epoch: int) -> None:
    """Go a step from the safe value and back, and compare what the device tells.

    Raises
    ------
    ProtocolFault
        The read-back does not follow; the output is back at the safe value but counts as unknown.
    HardwareError
        Of the device, or another command came in between.
    """
    if step == 0.0:
        line.clear(proven=False, proof="not proven: no step was asked for (probe=0)")
        return
    safe = line.envelope.safe
    begin = _told(line)
    if begin is None:
        line.clear(proven=False, proof="not proven: the device has no read-back")
        return
    _go(line, safe + step, epoch)
    there = _told(line)
    _go(line, safe, epoch)
    back = _told(line)
    if there is None or back is None:
        there = back = math.nan
    # the mean of before and after: what drifts meanwhile drops out
    change = there - 0.5 * (begin + back)
    cause = doubt_of_step(step, change, noise)
    if not cause:
        line.clear(
            proven=True, proof=f"a step of {step:g} V was read as {change:.4g} V at power-up"
        )
        return
    line.doubt = (
        f"a step of {step:g} V was read as {change:.4g} V, a factor of {change / step:.3g} where "
        f"0.8 .. 1.25 are allowed: {cause}"
    )
    line.proof = f"failed: {line.doubt}"
    line.forget(line.doubt)
    raise ProtocolFault(
        f"power_up: {line.doubt}; it is back at the command of {safe:g} V and will not be driven: "
        "correct the setting or the wire and power up again"
    )


def compare(line: OutputLine, commanded: ArrayLike, read: ArrayLike, before: int) -> int:
    """Hold readings against their commands; if they differ nothing is driven until a power-up."""
    try:
        return check_monitor(line.envelope, commanded, read, before)
    except LimitViolation as error:
        with line.lock:
            line.faults.append(str(error))
            line.revoke(str(error))
        raise


def _go(line: OutputLine, volts: float, epoch: int) -> None:
    if not line.walk(volts, line.envelope.ramp_rate, epoch, "power-up: proof of the read-back"):
        raise HardwareError("power_up: ended on its way by another command")


def _told(line: OutputLine) -> float | None:
    line.clock.sleep(max(REST, line.envelope.update_period))
    return line.read("power-up")
