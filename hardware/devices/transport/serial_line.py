"""Serial lines and pseudo-terminals, by pyserial."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, final

from hardware.devices.transport.link import Link
from hardware.devices.transport.serial_settings import SerialSettings

_PIECE = 256
"""Bytes handed over at once; pyserial does not tell how many of them were taken in time."""
_SOON = 1e-3
"""Shortest wait to send (s): with none, pyserial would try for ever."""


@final
class SerialTransport(Link):
    """A serial line.

    After a time-out of `write`, up to 256 bytes more than those surely sent may have gone out, in
    their order and none of them twice.

    Parameters
    ----------
    path : str
        Device node such as ``/dev/ttyUSB0``, or a port such as ``COM3``.
    settings : SerialSettings, optional
        By default 115200 baud, 8N1, no flow control.
    """

    def __init__(self, path: str, settings: SerialSettings | None = None) -> None:
        self._path = path
        self._settings = SerialSettings() if settings is None else settings
        self._port: Any = None
        super().__init__(self._settings.write_timeout, self._settings.most)

    @property
    def address(self) -> str:
        """Device node or port."""
        return f"serial {self._path}"

    def _connect(self) -> None:
        import serial

        s = self._settings
        self._port = serial.Serial(
            self._path,
            s.baud,
            bytesize=s.bits,
            parity=s.parity,
            stopbits=s.stop_bits,
            xonxoff=s.xon_xoff,
            write_timeout=s.write_timeout,
        )

    def _put(self, data: memoryview, seconds: float) -> int:
        import serial

        self._port.write_timeout = max(seconds, _SOON)
        try:
            return int(self._port.write(data[:_PIECE]))
        except serial.SerialTimeoutException:
            return 0

    def _get(self, seconds: float) -> bytes:
        self._port.timeout = seconds
        first: bytes = self._port.read(1)
        return first + self._port.read(self._port.in_waiting) if first else first

    def _release(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            with suppress(Exception):
                # else closing waits for a device that holds the line
                port.reset_output_buffer()
            port.close()
