"""Links that carry bytes: TCP, serial lines and pseudo-terminals; time-outs, nothing that hangs."""

from hardware.devices.transport.buffer import ReceiveBuffer
from hardware.devices.transport.link import Link
from hardware.devices.transport.resynchronise import back_in_step, resynchronise
from hardware.devices.transport.serial_line import SerialTransport
from hardware.devices.transport.serial_settings import SerialSettings
from hardware.devices.transport.tcp import TcpTransport

__all__ = [
    "Link",
    "ReceiveBuffer",
    "SerialSettings",
    "SerialTransport",
    "TcpTransport",
    "back_in_step",
    "resynchronise",
]
