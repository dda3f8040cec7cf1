"""The way down: from wherever an output is to its safe value, against everybody else."""

from __future__ import annotations

import math

from hardware.envelope.line import OutputLine
from hardware.envelope.state import OutputState
from hardware.errors import ProtocolFault


def park(line: OutputLine) -> None:
    """Park, and return when that is done; commands are refused until then.

    A second call, of another thread or of a signal handler, takes over; the first one returns
    when the output is parked all the same. A signal handler that has come within anything that
    its own thread does at the device (a write, a question, a load, a power-up, the end of a
    waveform) returns at once, and the way down begins when that is over.

    Raises
    ------
    Exception
        Of the device, at two attempts; the output is unknown then.
    """
    if line.defer(close if line.closed else park):
        return
    token = object()
    try:
        # before the lock, which a thread of commands might never leave to others
        line.parkers.add(token)
        try:
            _park(line)
        except Exception as first:
            try:
                if isinstance(first, ProtocolFault):
                    # it answers and refuses: it wants to be powered up anew
                    line.span = None
                    line.proven = False
                _park(line)
            except Exception as second:
                first.add_note(f"a second attempt to park failed too: {second}")
                raise first from None
    finally:
        line.parkers.discard(token)


def close(line: OutputLine) -> None:
    """Refuse all commands, park, let go of the device."""
    line.closed = True
    if line.defer(close):
        return
    try:
        if line.touched and not line.released:
            park(line)
    except Exception:
        line.release()
        raise
    line.release()


def _park(line: OutputLine) -> None:
    epoch: int | None = line.take_charge()
    parks = line.parks
    while epoch is not None and not _go_down(line, epoch):
        epoch = _await(line, parks)


def _go_down(line: OutputLine, epoch: int) -> bool:
    """Ramp and write the safe value; False if another call has taken over."""
    safe, why = line.envelope.safe, "stop"
    try:
        with line.lock:
            if line.released:
                return True
            if epoch != line.epoch:
                return False
            line.judge_silence()
            if line.state is OutputState.UNKNOWN:
                found = line.whole(lambda: _find(line, epoch))
                why = "; ".join(filter(None, ("stop", found)))
        done = line.walk(safe, line.envelope.ramp_rate, epoch, why, always=True)
        with line.lock:
            if done:
                line.parks += 1
                if line.doubt:
                    line.forget_quietly(f"{line.doubt}; the command of {safe:g} V was given")
        return done
    finally:
        with line.lock:
            if line.charge == epoch:
                line.charge = None


def _await(line: OutputLine, parks: int) -> int | None:
    """Wait for the call that took over; None if it has parked, else the number to go on with."""
    while True:
        with line.lock:
            if line.parks != parks:
                return None
            if line.charge is None:
                return line.take_charge()
        line.clock.sleep(line.envelope.update_period)


def _find(line: OutputLine, epoch: int) -> str:
    """Learn where an unknown output stands; return what has to be said about it.

    A read-back near the last commands is believed. One far from them is believed only if it was
    proven, lies where the device stands after a restart (`rest` if its watchdog parked it, `cold`
    if it lost its supply), and the link was what failed. Any other one is not, and some devices
    have none: the way down then begins at the last command. Only where none is known, or it
    cannot be given again, the device is powered up anew.
    """
    if epoch != line.epoch:
        return ""
    try:
        reading = line.raw.read()
    except Exception:
        reading = None
    if reading is None or math.isnan(reading):
        if line.span is not None and not line.may_rest() and _stays(line, line.span):
            return "taken for the last command, it cannot be read back"
        line.power_up(epoch)
        return ""
    allowed = line.plausible
    span = line.span
    if span is None:
        margin = 0.5 * line.envelope.largest_step(line.low, line.high)
        if not line.proven or not line.low - margin <= reading <= line.high + margin:
            line.power_up(epoch)
            return ""
        _stands(line, reading)
        return "found by its read-back"
    if span[0] - allowed <= reading <= span[1] + allowed:
        _stands(line, reading)
        return "found by its read-back"
    commanded = 0.5 * (span[0] + span[1])
    anew = any(abs(reading - v) <= allowed for v in (line.rest, line.cold))
    if line.proven and line.restarted and anew:
        _stands(line, reading)
        return (
            f"its read-back was {reading:g} V where {commanded:g} V were commanded: taken for a "
            "restart of the device"
        )
    remark = (
        f"its read-back of {reading:g} V contradicts the {commanded:g} V last commanded and was "
        "not believed; check the monitor"
    )
    line.faults.append(remark)
    line.revoke(remark)
    line.reached(commanded, "taken for the last command")
    # the way down begins by writing this value
    line.interrupted = True
    return remark


def _stays(line: OutputLine, span: tuple[float, float]) -> bool:
    """Give the last command again; False if it cannot be given."""
    line.reached(0.5 * (span[0] + span[1]), "taken for the last command")
    line.interrupted = True
    try:
        line.settle(line.epoch)
    except Exception:
        return False
    return True


def _stands(line: OutputLine, reading: float) -> None:
    line.interrupted = False
    line.reached(min(max(float(reading), line.low), line.high), "found by its read-back")
