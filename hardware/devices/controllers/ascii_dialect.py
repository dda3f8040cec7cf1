"""How an ASCII controller speaks, as data: a new device is a recipe, not a class."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from bondgraph.support.errors import UnusableInput
from hardware.devices.transport import SerialSettings


@dataclass(frozen=True, slots=True)
class AsciiDialect:
    r"""The dialect of one kind of controller.

    Patterns are regular expressions searched in an answer without its frame.

    Parameters
    ----------
    name, maker, model : str
        What it is called here, who makes it, what the maker calls it.
    command_end, answer_end : bytes
        Ends of a command and of an answer.
    framing : bytes
        Single bytes that frame answers and are taken off both ends.
    echo : bool
        Whether the device may repeat the command before its answer.
    identity : tuple of (str, str)
        Queries and patterns; the first groups make up the identity: firmware or model, serial.
    prepare : tuple of str
        Commands that bring the channel under remote open-loop control.
    set_voltage : str
        Command with ``{volts}``, such as ``"set,{volts:.3f}"``.
    read_voltage, voltage_pattern : str
        Query and pattern with the voltage as its first group.
    lowest, highest : tuple of (str, str)
        Queries and patterns of the limits set in the device (V); empty where there are none.
    refusals : tuple of (str, bool)
        Patterns of errors; true where a limit is what was violated.
    echoes_setpoint : float, optional
        Largest difference (V) between a voltage set and the voltage read back at once, where
        the latter is the setpoint; None where it is measured.
    settings : SerialSettings
        The line.
    source, unseen : str
        Where it is known from, and what was never seen on a device.

    Examples
    --------
    >>> from hardware.devices.controllers import NV200
    >>> NV200.set_voltage.format(volts=12.5)
    'set,12.500'
    """

    name: str
    maker: str
    model: str
    command_end: bytes
    answer_end: bytes
    framing: bytes
    identity: tuple[tuple[str, str], ...]
    set_voltage: str
    read_voltage: str
    voltage_pattern: str
    refusals: tuple[tuple[str, bool], ...]
    prepare: tuple[str, ...] = ()
    lowest: tuple[str, str] | tuple[()] = ()
    highest: tuple[str, str] | tuple[()] = ()
    echo: bool = False
    echoes_setpoint: float | None = None
    settings: SerialSettings = field(default_factory=SerialSettings)
    source: str = ""
    unseen: str = "everything"

    def __post_init__(self) -> None:
        """Check that the recipe is whole."""
        if not self.identity or not self.command_end or not self.answer_end:
            raise UnusableInput(f"dialect {self.name}: needs identity, command_end and answer_end")
        if self.set_voltage.format(volts=1.0) == self.set_voltage.format(volts=2.0):
            raise UnusableInput(f"dialect {self.name}: set_voltage has no {{volts}}")
        patterns = [self.voltage_pattern, *(p for _, p in self.identity)]
        patterns += [pair[1] for pair in (self.lowest, self.highest) if pair]
        for pattern in patterns:
            if re.compile(pattern).groups < 1:
                raise UnusableInput(f"dialect {self.name}: pattern {pattern!r} has no group")
        if self.settings.xon_xoff and any(c in self.framing + self.answer_end for c in b"\x11\x13"):
            raise UnusableInput(
                f"dialect {self.name}: XON and XOFF frame its answers; set xon_xoff=False"
            )
