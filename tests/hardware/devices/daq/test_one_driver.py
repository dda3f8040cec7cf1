"""What a program had sent before it was interrupted never comes behind its way down."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import Any

import pytest

from hardware.devices.daq import SocketRegisters
from hardware.simulators.registers import CardFront, front
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, card_on
from tests.patience import HANGS

MOMENT = 0.5
"""Time (s) for which the card is late with what came first, unless it has answered the second."""


class LateOnce:
    """Lets one thread, the first that calls, wait before what it was to do."""

    def __init__(self, inner: Callable[..., Any], patience: float) -> None:
        self._inner, self._patience = inner, patience
        self._first: int | None = None
        self.reached, self.go, self.over = (threading.Event() for _ in range(3))

    def __call__(self, *arguments: Any) -> Any:
        if self._first is not None:
            return self._inner(*arguments)
        self._first = threading.get_ident()
        self.reached.set()
        self.go.wait(self._patience)
        try:
            return self._inner(*arguments)
        finally:
            self.over.set()


@pytest.mark.parametrize("late", ["batch", "drives"])
def test_a_write_of_before_an_interruption_does_not_undo_the_way_down(
    late: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(Capacitor())
    bench = CardFront(rig)
    address = bench.start()
    link = SocketRegisters(address)
    card = card_on(bench, rig, link)
    try:
        card.power_up()
        where: object = bench.registers if late == "batch" else front
        gate = LateOnce(getattr(where, late), MOMENT if late == "batch" else HANGS)
        monkeypatch.setattr(where, late, gate)
        _interrupted_write(link, gate)
        # the same program, on the connection that it makes anew
        with contextlib.closing(SocketRegisters(address)) as again:
            again.write16(2, 0x20, 0x2000)
        gate.go.set()
        assert gate.over.wait(HANGS)
        for thread in bench._threads[1:]:
            thread.join(HANGS)
        assert rig.volts == 0.0
    finally:
        link.close()
        bench.stop()


def _interrupted_write(link: SocketRegisters, gate: LateOnce) -> None:
    """Send 3.5 V and hang up before the answer, as Ctrl-C or SIGTERM do."""
    held = link._socket
    assert held is not None
    held.sendall(b"\x01\x00" + bytes((1, 2)) + (0x20).to_bytes(2, "little")
                 + (0x2000 + 144).to_bytes(4, "little"))  # fmt: skip
    assert gate.reached.wait(HANGS)
    link.close()
