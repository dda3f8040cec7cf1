"""Ctrl-C heard as a flag, for solvers that swallow the exception it would raise."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Interrupts:
    """Whether Ctrl-C was pressed since the block began."""

    heard: bool = False


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Keep Ctrl-C as a flag within the block; in other threads than the main one do nothing."""
    flag = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield flag
        return

    def hear(number: int, frame: FrameType | None) -> None:
        flag.heard = True

    before = signal.signal(signal.SIGINT, hear)
    try:
        yield flag
    finally:
        signal.signal(signal.SIGINT, before)
