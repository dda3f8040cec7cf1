"""Registers that lie in the memory of this process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

from hardware.devices.daq.registers import Access, AccessKind
from hardware.errors import LinkLost


class MappedRegisters:
    """Registers behind writable memory, one piece a BAR.

    A memoryview cast to the width of the register is used because it moves exactly that width and
    does nothing else; a field of ctypes reads before it writes, and reading is not harmless here.

    Parameters
    ----------
    windows : mapping of int to memoryview
        Bytes of every BAR; their length is a multiple of 4.
    address : str
        For messages.
    """

    def __init__(self, windows: Mapping[int, memoryview], address: str) -> None:
        self.address = address
        self._bytes = dict(windows)
        self._halves = {k: v.cast("B").cast("H") for k, v in windows.items()}
        self._words = {k: v.cast("B").cast("I") for k, v in windows.items()}

    def window(self, bar: int) -> memoryview:
        """Bytes of a BAR, for compiled code."""
        self._check(bar, 0, 1)
        return self._bytes[bar]

    def read16(self, bar: int, offset: int) -> int:
        """Read 16 bits."""
        self._check(bar, offset, 2)
        return self._halves[bar][offset >> 1]

    def write16(self, bar: int, offset: int, value: int) -> None:
        """Write 16 bits."""
        self._check(bar, offset, 2)
        self._halves[bar][offset >> 1] = value

    def read32(self, bar: int, offset: int) -> int:
        """Read 32 bits."""
        self._check(bar, offset, 4)
        return self._words[bar][offset >> 2]

    def write32(self, bar: int, offset: int, value: int) -> None:
        """Write 32 bits."""
        self._check(bar, offset, 4)
        self._words[bar][offset >> 2] = value

    def batch(self, accesses: Sequence[Access]) -> list[int]:
        """Do several in their order; return what was read, 0 for a write."""
        result = [0] * len(accesses)
        for n, (kind, bar, offset, value) in enumerate(accesses):
            if kind == AccessKind.WRITE16:
                self.write16(bar, offset, value)
            elif kind == AccessKind.READ16:
                result[n] = self.read16(bar, offset)
            elif kind == AccessKind.READ32:
                result[n] = self.read32(bar, offset)
            else:
                self.write32(bar, offset, value)
        return result

    def close(self) -> None:
        """Let go of the memory."""
        for views in (self._halves, self._words, self._bytes):
            for view in views.values():
                view.release()
            views.clear()

    def _check(self, bar: int, offset: int, width: int) -> None:
        window = self._bytes.get(bar)
        if window is None:
            raise LinkLost(
                f"{self.address}: BAR {bar} is not mapped (mapped: "
                f"{sorted(self._bytes) or 'none, it is closed'}); open the card again"
            )
        if offset % width or not 0 <= offset <= len(window) - width:
            raise LinkLost(
                f"{self.address}: BAR {bar} has no register of {8 * width} bits at {offset:#x}; "
                f"it is {len(window)} bytes long: is this the right card?"
            )


@final
class MemoryRegisters(MappedRegisters):
    """Plain memory in place of a card: nothing reacts, so it shows what the program alone costs.

    Parameters
    ----------
    bars : sequence of int
        Numbers of the BARs.
    size : int
        Bytes of each.

    Examples
    --------
    >>> memory = MemoryRegisters((0, 2))
    >>> memory.write16(2, 0x20, 0x2000)
    >>> hex(memory.read16(2, 0x20))
    '0x2000'
    """

    def __init__(self, bars: Sequence[int] = (0, 2, 3, 4), size: int = 128) -> None:
        super().__init__({k: memoryview(bytearray(size)) for k in bars}, "memory")
