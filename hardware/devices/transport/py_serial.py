"""A serial line by pyserial, for systems without termios."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any, final

from hardware.devices.transport.buffer import ReceiveBuffer
from hardware.devices.transport.serial_settings import SerialSettings
from hardware.errors import DriverMissing, LinkLost, TimedOut

__all__ = ["PySerialTransport"]


@final
class PySerialTransport:
    """A serial line by pyserial; the contract is that of the other transports.

    Parameters
    ----------
    path : str
        Port such as ``COM3``.
    settings : SerialSettings
        Speed, frame and flow control.
    """

    def __init__(self, path: str, settings: SerialSettings) -> None:
        self._path = path
        self._settings = settings
        self._port: Any = None
        self._buffer = ReceiveBuffer(settings.most, self.address)

    @property
    def address(self) -> str:
        """Port."""
        return f"serial {self._path}"

    def open(self) -> None:
        """Connect; nothing if it is open.

        Raises
        ------
        DriverMissing
            Without pyserial.
        LinkLost
            If the port is not there.
        """
        if self._port is not None:
            return
        try:
            import serial
        except ImportError as error:
            raise DriverMissing(
                f"{self.address}: needs pyserial; pip install 'bondsight[bench]'"
            ) from error
        s = self._settings
        try:
            self._port = serial.Serial(
                self._path,
                s.baud,
                bytesize=s.bits,
                parity=s.parity,
                stopbits=s.stop_bits,
                xonxoff=s.xon_xoff,
                write_timeout=s.write_timeout,
            )
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise LinkLost(
                f"{self.address}: cannot open ({error}); check cable and port"
            ) from error
        self._buffer = ReceiveBuffer(s.most, self.address)

    def close(self) -> None:
        """Disconnect; never raises, never hangs, any number of times."""
        port, self._port = self._port, None
        self._buffer.clear()
        if port is None:
            return
        # what it raises depends on system and moment; nothing may come out of here
        with suppress(Exception):
            # else closing waits for a device that holds the line
            port.reset_output_buffer()
        with suppress(Exception):
            port.close()

    def write(self, data: bytes) -> None:
        """Send all of it, or raise `LinkLost` or `TimedOut`."""
        port = self._required()
        import serial

        try:
            port.write(data)
        except serial.SerialTimeoutException as error:
            raise TimedOut(
                f"{self.address}: {len(data)} bytes not taken within "
                f"{self._settings.write_timeout:g} s; the device is stuck or holds the line (XOFF)"
            ) from error
        except Exception as error:  # OSError, TypeError or termios.error, by system and moment
            raise self._lost(error) from error

    def read_until(self, ends: bytes | tuple[bytes, ...], timeout: float) -> bytes:
        """Return bytes up to and with one of the terminators; see the contract."""
        wanted = (ends,) if isinstance(ends, bytes) else ends
        deadline = time.monotonic() + timeout
        while (answer := self._buffer.take(wanted)) is None:
            left = deadline - time.monotonic()
            data = self._piece(left) if left > 0.0 else b""
            if not data and left <= 0.0:
                so_far = self._buffer.waiting
                raise TimedOut(
                    f"{self.address}: no {' or '.join(map(repr, wanted))} within {timeout:g} s "
                    f"({len(so_far)} bytes came: {so_far[:40]!r})",
                    so_far,
                )
            self._buffer.add(data)
        return answer

    def drain(self) -> bytes:
        """Return and forget everything that waits, without waiting."""
        taken = bytearray(self._buffer.clear())
        try:
            while self._port is not None and len(taken) < self._settings.most:
                data = self._piece(0.0)
                if not data:
                    break
                taken += data
        except LinkLost:
            pass
        return bytes(taken)

    def _piece(self, seconds: float) -> bytes:
        port = self._required()
        try:
            port.timeout = max(seconds, 0.0)
            first: bytes = port.read(1)
            return first + port.read(port.in_waiting) if first else first
        except Exception as error:  # OSError, TypeError or termios.error, by system and moment
            raise self._lost(error) from error

    def _required(self) -> Any:
        if self._port is None:
            raise LinkLost(f"{self.address}: not open; call open() first", self._buffer.waiting)
        return self._port

    def _lost(self, error: Exception) -> LinkLost:
        so_far = self._buffer.waiting
        self.close()
        return LinkLost(f"{self.address}: link lost ({error})", so_far)
