"""What can go wrong on the way of an answer; in real time, because time-outs are real."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from typing import final


@dataclass(frozen=True, slots=True)
class Fault:
    """What happens to one answer.

    Parameters
    ----------
    delay : float
        Wait before it (s, real time); what is asked meanwhile waits behind it.
    chunk : int
        Bytes sent at once; 0 for all.
    pause : float
        Wait between such pieces (s, real time).
    drop_after : int, optional
        Bytes after which the link is cut.
    garbage : bytes
        Sent before it.
    terminator : bytes, optional
        Sent instead of its own terminator.
    silent : bool
        It is never sent.
    """

    delay: float = 0.0
    chunk: int = 0
    pause: float = 0.0
    drop_after: int | None = None
    garbage: bytes = b""
    terminator: bytes | None = None
    silent: bool = False


SOUND = Fault()


@final
class FaultQueue:
    """Faults of the answers to come; may be filled from another thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._next: deque[Fault] = deque()
        self._otherwise = SOUND
        self.refuse = False
        """Whether connections are refused."""

    def next(self, *faults: Fault) -> None:
        """Let the next answers suffer these, one each."""
        with self._lock:
            self._next.extend(faults)

    def always(self, fault: Fault) -> None:
        """Let all other answers suffer this; `SOUND` ends it."""
        with self._lock:
            self._otherwise = fault

    def clear(self) -> None:
        """Let all answers to come be sound."""
        with self._lock:
            self._next.clear()
            self._otherwise = SOUND

    def take(self) -> Fault:
        """Return the fault of the answer that is about to be sent."""
        with self._lock:
            return self._next.popleft() if self._next else self._otherwise
