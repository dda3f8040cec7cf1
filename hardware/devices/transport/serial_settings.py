"""How a serial line is set up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """Settings of a serial line.

    Parameters
    ----------
    baud : int
        Symbols per second.
    bits : {7, 8}
        Data bits.
    parity : {"N", "E", "O"}
        None, even, odd.
    stop_bits : {1, 2}
        Stop bits.
    xon_xoff : bool
        Whether the driver obeys and swallows XON and XOFF; never where they frame answers.
    write_timeout : float
        Longest wait for the other side to take bytes (s).
    most : int
        Bytes buffered without a terminator.
    """

    baud: int = 115200
    bits: Literal[7, 8] = 8
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: Literal[1, 2] = 1
    xon_xoff: bool = False
    write_timeout: float = 1.0
    most: int = 1 << 20

    def __post_init__(self) -> None:
        """Check."""
        if self.bits not in (7, 8) or self.parity not in "NEO" or self.stop_bits not in (1, 2):
            raise UnusableInput(
                f"serial line {self.bits}{self.parity}{self.stop_bits}: use 7 or 8 bits, parity N, "
                "E or O, and 1 or 2 stop bits"
            )
        if self.baud <= 0 or self.write_timeout <= 0.0 or self.most <= 0:
            raise UnusableInput("serial line: baud, write_timeout and most must be positive")
