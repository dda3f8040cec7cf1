"""A simulated card behind a TCP port, one message for several accesses.

The wire is little-endian: a request is the number of accesses (16 bits), then 8 bytes each (kind 8,
BAR 8, offset 16, value 32); the answer is the number and 32 bits each. One connection at a time may
drive the card: the answer to another one is 0xFFFF and the port of the first (32 bits), then the
end of the connection.
"""

from __future__ import annotations

import socket
import struct
from collections import deque
from typing import final

from hardware.simulators.loopback import LoopbackServer
from hardware.simulators.registers.amplifier import AmplifierData
from hardware.simulators.registers.holding import Holder, drives
from hardware.simulators.registers.model import CardFaults, Logged, RegisterModel, Wires
from hardware.simulators.rig import DeviceClock, Rig

_HEAD = struct.Struct("<H")
_ACCESS = struct.Struct("<BBHI")
_REFUSED = 0xFFFF


@final
class CardFront(LoopbackServer):
    """Serves the registers of a card.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock, model, amplifier, wires
        As of `RegisterModel`.
    """

    def __init__(
        self,
        rig: Rig,
        clock: DeviceClock | None = None,
        model: str = "MF634",
        *,
        amplifier: AmplifierData | None = None,
        wires: Wires | None = None,
    ) -> None:
        self.clock = DeviceClock() if clock is None else clock
        self.registers = RegisterModel(rig, model, amplifier, wires, self.clock)
        super().__init__()
        self._holder = Holder()

    @property
    def log(self) -> deque[Logged]:
        """Every access, the latest 200,000."""
        return self.registers.log

    @property
    def faults(self) -> CardFaults:
        """What is wrong with the card."""
        return self.registers.faults

    def _talk(self, link: socket.socket) -> None:
        try:
            self._answer(link)
        finally:
            self._holder.release(link)

    def _answer(self, link: socket.socket) -> None:
        while True:
            count = _HEAD.unpack(_exactly(link, 2))[0]
            accesses = list(_ACCESS.iter_unpack(_exactly(link, 8 * count)))
            if drives(accesses) and (other := self._holder.claim(link)) is not None:
                link.sendall(struct.pack("<HI", _REFUSED, other))
                return
            if self._cut(count):
                # half of an answer, as by a cable pulled in the middle of it
                link.sendall(_HEAD.pack(count))
                return
            try:
                answers = self.registers.batch(accesses)
            finally:
                self._holder.done(link)
            if self.faults.delay:
                self._stopped.wait(self.faults.delay)
            link.sendall(struct.pack(f"<H{count}I", count, *answers))

    def _cut(self, count: int) -> bool:
        left = self.faults.cut
        if left <= 0:
            return False
        self.faults.cut = max(left - count, 0)
        return left <= count


def _exactly(link: socket.socket, length: int) -> bytes:
    data = b""
    while len(data) < length:
        piece = link.recv(length - len(data))
        if not piece:
            raise ConnectionResetError
        data += piece
    return data
