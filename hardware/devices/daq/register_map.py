"""Where the registers of a Humusoft card lie, from the public Linux drivers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """Where the registers of a model lie.

    Parameters
    ----------
    model : str
        Name.
    device : int
        PCI device number.
    bars : tuple of int
        Its BARs, in the order of the drivers' maps.
    control_bar, control : int
        The general control register (32 bits).
    data_bar : int
        BAR of the registers below (16 bits each).
    inputs, start, digital, outputs : int
        Input queue (read) and list of inputs (write); start of a conversion (read); digital lines;
        first output (write).
    converting, hold, enable : int
        Bits of the control register: high while a conversion runs; outputs keep their values until
        it falls; outputs are connected (else grounded).
    """

    model: str
    device: int
    bars: tuple[int, ...]
    control_bar: int
    control: int
    data_bar: int = 2
    inputs: int = 0x00
    start: int = 0x20
    digital: int = 0x10
    outputs: int = 0x20
    converting: int = 1 << 17
    hold: int = 1 << 23
    enable: int = 1 << 26
