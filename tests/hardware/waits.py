"""What a thread has asked to wait for in vain, as it asked for it: no clock is read."""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from hardware.devices.transport.descriptor_link import DescriptorLink


@dataclass
class Waits:
    """Seconds slept, and seconds of every wait for bytes that none ended."""

    seconds: float = 0.0


@contextmanager
def waits() -> Iterator[Waits]:
    """Count the waits of this thread by `time.sleep`, `select.select` and our transports."""
    counted, mine = Waits(), threading.get_ident()
    sleep, choose, wait = time.sleep, select.select, DescriptorLink._wait

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

    def waiting(link: DescriptorLink, write: bool, seconds: float) -> bool:
        come = wait(link, write, seconds)
        if not come:
            add(seconds)
        return come

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(time, "sleep", sleeping)
        patch.setattr(select, "select", choosing)
        patch.setattr(DescriptorLink, "_wait", waiting)
        yield counted
