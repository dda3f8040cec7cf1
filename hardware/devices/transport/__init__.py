"""Links that carry bytes: TCP, serial lines and pseudo-terminals; time-outs, nothing that hangs."""

from hardware.devices.transport.buffer import ReceiveBuffer
from hardware.devices.transport.posix_serial import PosixSerialTransport
from hardware.devices.transport.py_serial import PySerialTransport
from hardware.devices.transport.resynchronise import resynchronise
from hardware.devices.transport.serial_line import SerialSettings, SerialTransport, serial_transport
from hardware.devices.transport.tcp import TcpTransport

__all__ = [
    "PosixSerialTransport",
    "PySerialTransport",
    "ReceiveBuffer",
    "SerialSettings",
    "SerialTransport",
    "TcpTransport",
    "resynchronise",
    "serial_transport",
]
