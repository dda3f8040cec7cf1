"""Access to the registers of a card, whatever leads to them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple, Protocol, runtime_checkable


class AccessKind(IntEnum):
    """Width and direction of one access; the numbers are those of the wire."""

    READ16 = 0
    WRITE16 = 1
    READ32 = 2
    WRITE32 = 3


class Access(NamedTuple):
    """One access.

    Parameters
    ----------
    kind : AccessKind
        Width and direction.
    bar : int
        Number of the PCI base address register.
    offset : int
        Byte within it.
    value : int
        What is written; nothing for a read.
    """

    kind: int
    bar: int
    offset: int
    value: int = 0


@runtime_checkable
class Registers(Protocol):
    """Reads and writes of single registers, in the order of the calls.

    Reading may have side effects (on these cards it starts conversions and empties a queue), so an
    implementation never reads what it is not asked to read, and never twice. A single access is a
    batch of one, unless an implementation has a shorter way.
    """

    @property
    def address(self) -> str:
        """Where they are, for messages."""
        ...

    def read16(self, bar: int, offset: int) -> int:
        """Read 16 bits."""
        return self.batch((Access(AccessKind.READ16, bar, offset),))[0]

    def write16(self, bar: int, offset: int, value: int) -> None:
        """Write 16 bits."""
        self.batch((Access(AccessKind.WRITE16, bar, offset, value),))

    def read32(self, bar: int, offset: int) -> int:
        """Read 32 bits."""
        return self.batch((Access(AccessKind.READ32, bar, offset),))[0]

    def write32(self, bar: int, offset: int, value: int) -> None:
        """Write 32 bits."""
        self.batch((Access(AccessKind.WRITE32, bar, offset, value),))

    def batch(self, accesses: Sequence[Access]) -> list[int]:
        """Do several in their order; return what was read, 0 for a write."""
        ...

    def close(self) -> None:
        """Let go; never raises, any number of times."""
        ...
