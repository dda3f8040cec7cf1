"""Answers owed from before are counted off, none is left."""

from __future__ import annotations

import pytest

from hardware.devices.transport import resynchronise


class Device:
    """Answers in order; an answer comes when its turn has come."""

    def __init__(self, pending: list[bytes], quiet: int = 0) -> None:
        self.pending = pending
        self.quiet = quiet

    def ask(self) -> None:
        self.pending.append(b"ME")

    def receive(self, seconds: float) -> bytes | None:
        if self.quiet:
            self.quiet -= 1
            return None
        return self.pending.pop(0) if self.pending else None


@pytest.mark.parametrize(
    ("pending", "quiet", "owed"),
    [
        ([], 0, 0),
        ([b"late"], 0, 0),
        ([b"late", b"0"], 2, 0),
        ([b"ME"], 0, 1),
        ([b"ME", b"late"], 1, 1),
    ],
)
def test_nothing_is_left(pending: list[bytes], quiet: int, owed: int) -> None:
    device = Device(list(pending), quiet)
    assert resynchronise(device.ask, device.receive, lambda a: a == b"ME", 0.03, owed=owed)
    assert device.pending == []


def test_gives_up() -> None:
    device = Device([], quiet=1000)
    assert not resynchronise(device.ask, device.receive, lambda a: a == b"ME", 0.03)
    other = Device([b"a"] * 5)
    assert not resynchronise(other.ask, other.receive, lambda a: a == b"YOU", 0.03)


def test_an_identity_that_never_came_is_not_forgotten() -> None:
    device = Device([])
    # one of two asked for is missing: the next answer might be it
    assert not resynchronise(device.ask, device.receive, lambda a: a == b"ME", 0.03, owed=1)
