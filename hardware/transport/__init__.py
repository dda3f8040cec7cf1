"""Links that carry bytes: TCP, serial lines and pseudo-terminals; time-outs, nothing that hangs."""

from hardware.transport.buffer import ReceiveBuffer
from hardware.transport.posix_serial import PosixSerialTransport
from hardware.transport.py_serial import PySerialTransport
from hardware.transport.resynchronise import resynchronise
from hardware.transport.serial_line import SerialSettings, SerialTransport, serial_transport
from hardware.transport.tcp import TcpTransport

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
