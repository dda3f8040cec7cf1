"""Links that carry bytes: TCP, serial lines and pseudo-terminals; time-outs, nothing that hangs."""

from hardware.devices.transport.buffer import ReceiveBuffer as ReceiveBuffer
from hardware.devices.transport.link import Link as Link
from hardware.devices.transport.resynchronise import back_in_step as back_in_step
from hardware.devices.transport.resynchronise import resynchronise as resynchronise
from hardware.devices.transport.serial_line import SerialTransport as SerialTransport
from hardware.devices.transport.serial_settings import SerialSettings as SerialSettings
from hardware.devices.transport.tcp import TcpTransport as TcpTransport
