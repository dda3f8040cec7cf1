"""Whether a line may take a command now."""

from __future__ import annotations

import threading

from bondgraph.signals.quantity import engineering
from hardware.envelope.limits import Dwell
from hardware.envelope.line import OutputLine
from hardware.envelope.state import OutputState
from hardware.errors import LimitViolation


def require_open(line: OutputLine, what: str) -> None:
    """Refuse what comes after `close`, while a stop is on its way down, or within an action."""
    if line.closed:
        raise LimitViolation(f"{what}: the output is closed; open the device anew")
    if threading.get_ident() in line.inside:
        raise LimitViolation(
            f"{what}: given within another command of this thread, by a signal handler; there "
            "only stop() and close() may be called"
        )
    if line.parkers:
        raise LimitViolation(
            f"{what}: stop() is on its way to {line.envelope.safe:g} V; wait until it has ended"
        )


def require_rest(line: OutputLine, what: str) -> None:
    """Refuse what does not go beside a waveform that plays."""
    if line.halt is not None:
        raise LimitViolation(f"{what}: a waveform is playing; end it with stop() first")


def require_ready(line: OutputLine, what: str) -> None:
    """Refuse a command in a state that does not allow it; callers hold the lock."""
    require_open(line, what)
    line.judge_silence()
    if line.state is OutputState.UNKNOWN:
        raise LimitViolation(
            f"{what}: the output is unknown ({line.reason}); call stop() or power_up()"
        )
    if not line.cleared:
        raise LimitViolation(f"{what}: {line.hindrance}; call power_up() first")
    require_rest(line, what)


def overstay(line: OutputLine, dwell: Dwell, seconds: float) -> LimitViolation:
    """Make the error of an output that was beyond a level for too long (s)."""
    return LimitViolation(
        f"output: {engineering(seconds, 's')} beyond {dwell.level:g} V, allowed are "
        f"{engineering(dwell.seconds, 's')}; it was ramped to {line.envelope.safe:g} V"
    )


def refuse_again(guard: object) -> None:
    """Refuse to set up a guard for a second time: its device would be without one."""
    if hasattr(guard, "_line") or hasattr(guard, "_output"):
        raise TypeError(f"{type(guard).__name__}: set up already; make another one")
