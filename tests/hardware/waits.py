"""What a thread has asked to wait for in vain, as it asked for it: no clock is read."""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from hardware.devices.transport import Link


@dataclass
class Waits:
    """Seconds slept, and seconds of every wait for bytes that none ended."""

    seconds: float = 0.0


@contextmanager
def waits() -> Iterator[Waits]:
    """Count the waits of this thread by `time.sleep`, `select.select` and our transports."""
    counted, mine = Waits(), threading.get_ident()
    sleep, choose, come, sent = time.sleep, select.select, Link._come, Link._sent

    def add(seconds: float | None) -> None:
        if threading.get_ident() == mine:
            counted.seconds += float("inf") if seconds is None else max(seconds, 0.0)

    def sleeping(seconds: float) -> None:
        add(seconds)
        sleep(seconds)

    def choosing(*arguments: Any) -> Any:
        found = choose(*arguments)
        if not any(found):
            add(arguments[3] if len(arguments) > 3 else None)
        return found

    def moving(move: Callable[[], Any], seconds: float) -> Any:
        before = counted.seconds
        moved = move()
        # however a link waits within, the wait counts once
        counted.seconds = before
        if not moved:
            add(seconds)
        return moved

    def coming(link: Link, seconds: float) -> bytes:
        return bytes(moving(lambda: come(link, seconds), seconds))

    def sending(link: Link, data: memoryview, seconds: float) -> int:
        return int(moving(lambda: sent(link, data, seconds), seconds))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(time, "sleep", sleeping)
        patch.setattr(select, "select", choosing)
        patch.setattr(Link, "_come", coming)
        patch.setattr(Link, "_sent", sending)
        yield counted
