"""Settings of a serial line, and the implementation that fits the system."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Literal, TypeAlias

from bondgraph.support.errors import UnusableInput
from hardware.devices.transport.posix_serial import PosixSerialTransport
from hardware.devices.transport.py_serial import PySerialTransport
from hardware.devices.transport.serial_settings import SerialSettings

__all__ = ["SerialSettings", "SerialTransport", "serial_transport"]

SerialTransport: TypeAlias = PosixSerialTransport | PySerialTransport


def serial_transport(
    path: str,
    settings: SerialSettings | None = None,
    by: Literal["", "termios", "pyserial"] = "",
) -> SerialTransport:
    """Return a transport over a serial line, not yet open.

    Parameters
    ----------
    path : str
        Device node such as ``/dev/ttyUSB0``, or a port such as ``COM3``.
    settings : SerialSettings, optional
        By default 115200 baud, 8N1, no flow control.
    by : {"", "termios", "pyserial"}
        Implementation; by default termios where the system has it.
    """
    settings = SerialSettings() if settings is None else settings
    if by not in ("", "termios", "pyserial"):
        raise UnusableInput(f"{path}: by={by!r} is unknown; choose termios or pyserial")
    if by == "termios" or (not by and find_spec("termios") is not None):
        return PosixSerialTransport(path, settings)
    return PySerialTransport(path, settings)
