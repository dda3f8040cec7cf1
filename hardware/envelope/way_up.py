"""The way up: from whatever was before to an output that may be driven."""

from __future__ import annotations

from contextlib import suppress

from hardware.envelope.line import OutputLine
from hardware.envelope.proof import prove
from hardware.envelope.readiness import require_open
from hardware.envelope.state import OutputState
from hardware.envelope.way_down import park
from hardware.errors import HardwareError


def power_up(line: OutputLine, step: float, noise: float) -> None:
    """Park what is driven, let the device come up, go to the safe value, prove the read-back.

    Parameters
    ----------
    line : OutputLine
    step, noise : float
        Of the proof (V); see `prove`.
    """
    require_open(line, "power_up")
    with line.lock:
        line.judge_silence()
    if line.state is not OutputState.UNKNOWN:
        park(line)
    elif line.span is not None:
        # commanded somewhere in this session: down from there first, as far as it can be reached
        with suppress(Exception):
            park(line)
    safe = line.envelope.safe
    with line.lock:
        require_open(line, "power_up")
        epoch = line.new_epoch()
        line.end_wave()
        line.revoke("power_up() has not ended")
        line.doubt = ""
        line.power_up(epoch)
    if not line.walk(safe, line.envelope.ramp_rate, epoch, "powered up"):
        raise HardwareError("power_up: ended on its way by another command")
    prove(line, step, noise, epoch)
