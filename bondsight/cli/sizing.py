"""``bondsight sizing``: the sizing sheet of a stack, its load and its amplifier."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, unknown_name

if TYPE_CHECKING:
    from actuators.stack.sizing_sheet import SizingSheet

_STACK = "P-840.1"
_STACK_UNITS = {
    "free_displacement": "m", "voltage": "V", "stiffness": "N/m", "capacitance": "F",
    "mass": "kg", "push_force": "N", "pull_force": "N", "tan_delta": "1",
}  # fmt: skip
# option -> keyword of the sheet, unit, what it is
_OPTIONS = {
    "frequency": ("Hz", "of the drive (default 100 Hz)"),
    "voltage": ("V", "peak to peak, from 0 (default: the most the stack stands)"),
    "current": ("A", "peak current of the amplifier (default 200 mA)"),
    "load-mass": ("kg", "at the tip"),
    "load-stiffness": ("N/m", "spring at the tip"),
    "load-force": ("N", "pressing on the tip"),
}


def add_sizing_command(verbs: Any) -> None:
    """Add ``sizing``; numbers may carry units, such as ``47uF`` or ``0.2 A``."""
    p = verbs.add_parser("sizing", help="data sheet of a stack drive: force, current, resonance")
    p.add_argument("stack", nargs="?", default=_STACK, help=f"known: {_STACK}")
    for name, (unit, what) in _OPTIONS.items():
        p.add_argument(f"--{name}", default=None, metavar=unit, help=what)
    p.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", dest="changes",
        help=f"change a value of the stack: {', '.join(_STACK_UNITS)}",
    )  # fmt: skip
    p.set_defaults(run=_sizing)


def _sizing(options: argparse.Namespace) -> int:
    given = {n: getattr(options, n.replace("-", "_")) for n in _OPTIONS}
    print(sheet(options.stack, {n: v for n, v in given.items() if v is not None}, options.changes))
    return 0


def sheet(name: str, drive: Mapping[str, str], changes: Sequence[str] = ()) -> SizingSheet:
    """Return the sheet from text.

    Parameters
    ----------
    name : str
        A stack of `actuators.stack.sizing.STACKS`.
    drive : dict of str to str
        Options such as ``{"frequency": "1 kHz"}``.
    changes : sequence of str
        Values of the stack as ``name=value``.

    Raises
    ------
    UnknownName
        The stack, an option or a value does not exist; suggests the nearest.
    UnusableInput
        A quantity cannot be read, or is out of its domain.
    """
    from actuators.stack.sizing import STACKS
    from actuators.stack.sizing_sheet import sizing_sheet
    from bondgraph.signals.quantity import quantity

    if name not in STACKS:
        raise unknown_name("stack", name, "the sizing sheet", STACKS)
    stack = STACKS[name]
    for change in changes:
        key, sign, text = change.partition("=")
        if not sign:
            raise UnusableInput(f"--set {change}: write NAME=VALUE, such as capacitance=1.8uF")
        if key not in _STACK_UNITS:
            raise unknown_name("value", key, f"the data of {name}", _STACK_UNITS)
        changed: dict[str, Any] = {key: quantity(text, _STACK_UNITS[key], f"--set {key}")}
        stack = replace(stack, **changed)
    values = {}
    for option, text in drive.items():
        if option not in _OPTIONS:
            raise unknown_name("option", option, "the sizing sheet", _OPTIONS)
        keyword = "voltage_pp" if option == "voltage" else option.replace("-", "_")
        values[keyword] = quantity(text, _OPTIONS[option][0], f"--{option}")
    return sizing_sheet(stack, **values)
