"""Whatever happens in a block, its outputs are parked when it is left."""

from __future__ import annotations

import atexit
import signal
import threading
import time
from types import FrameType, TracebackType
from typing import Any, Protocol, Self, final

from bondgraph.support.errors import UnusableInput

BOUNCE = 0.05
"""A second signal within this time is the same one (s, real time)."""

_SIGNALS = tuple(
    s
    for s in (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"))
    if s is not None
)


class Parkable(Protocol):
    """What can be parked."""

    def stop(self) -> None:
        """Go to the safe value."""
        ...


@final
class parked:
    """Context manager that parks outputs on leaving, by whatever way.

    Covers the end of the block, errors, Ctrl-C (also again during the way down, which is then
    finished first), SIGTERM, a closed terminal (SIGHUP), and the exit of the interpreter. Not
    SIGKILL and not a power cut: only a watchdog of the device helps there. Signals reach the main
    thread of Python only; in another one the block is parked on leaving and at exit.

    Parameters
    ----------
    *outputs : Parkable
        Parked in this order, each even if one before fails.

    Notes
    -----
    An error that leaves the block stays the one that is raised; if the way down fails it gets a
    note. May be entered again, one time after the other.

    Examples
    --------
    >>> class Lamp:
    ...     def stop(self) -> None:
    ...         print("off")
    >>> with parked(Lamp()):
    ...     print("on")
    on
    off
    """

    def __init__(self, *outputs: Parkable) -> None:
        self._outputs = outputs
        self._previous: dict[int, Any] = {}
        self._entered = False
        self._leaving = False
        self._held: list[int] = []
        self._recent = -BOUNCE

    def __enter__(self) -> Self:
        """Take over the signals.

        Raises
        ------
        UnusableInput
            It has been entered and not left.
        """
        if self._entered:
            raise UnusableInput("parked: this one was entered already; make another one")
        self._entered = True
        self._leaving = False
        self._held = []
        self._recent = -BOUNCE
        atexit.register(self._at_exit)
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                before = signal.getsignal(number)
                # ignored by whoever started the program (nohup), or not Python's to handle
                if before is not signal.SIG_IGN and before is not None:
                    self._previous[number] = signal.signal(number, self._received)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Park, restore the signals, and let those that were held back act."""
        self._leaving = True
        failure = self._park(error)
        atexit.unregister(self._at_exit)
        previous, self._previous = self._previous, {}
        for number, handler in previous.items():
            signal.signal(number, handler)
        held, self._held = self._held, []
        self._entered = self._leaving = False
        if failure is not None and error is None:
            raise failure
        # whoever wants the program to end gets it, unless it is ending so already
        if held and not isinstance(error, KeyboardInterrupt | SystemExit):
            _act(held[0], previous[held[0]], None)

    def _park(self, error: BaseException | None) -> BaseException | None:
        """Park all; return the first failure, noted on `error` if there is one."""
        failures = []
        for output in self._outputs:
            try:
                _stop(output)
            except BaseException as failure:
                status = getattr(output, "status", "output unknown")
                failure.add_note(f"the output could not be parked: {status}")
                if error is not None:
                    error.add_note(f"and the output could not be parked: {failure}; {status}")
                failures.append(failure)
        return failures[0] if failures else None

    def _received(self, number: int, frame: FrameType | None) -> None:
        """Hold a signal back while parking, else let it end the block."""
        now = time.monotonic()
        again = now - self._recent < BOUNCE
        self._recent = now
        if self._leaving:
            self._held.append(number)
            return
        if again:
            return
        _act(number, self._previous[number], frame)

    def _at_exit(self) -> None:
        """Park at the exit of the interpreter what was never left."""
        self._leaving = True
        self._park(None)


def _stop(output: Parkable) -> None:
    """Stop, and once more if something interrupted even that."""
    try:
        output.stop()
    except (KeyboardInterrupt, SystemExit):
        output.stop()


def _act(number: int, before: Any, frame: FrameType | None) -> None:
    """Do what the handler of before would; end the program in order where it would just die."""
    if callable(before):
        before(number, frame)
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise SystemExit(128 + number)
