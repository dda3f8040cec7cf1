"""A serial line or pseudo-terminal of a POSIX system, by termios."""

from __future__ import annotations

import os
import sys
from typing import Any, final

from hardware.devices.transport.descriptor_link import DescriptorLink
from hardware.devices.transport.serial_settings import SerialSettings
from hardware.errors import DriverMissing

__all__ = ["PosixSerialTransport"]


@final
class PosixSerialTransport(DescriptorLink):
    """A serial line by its device node.

    Parameters
    ----------
    path : str
        Device node.
    settings : SerialSettings
        Speed, frame and flow control.
    """

    def __init__(self, path: str, settings: SerialSettings) -> None:
        self._path = path
        self._settings = settings
        self._node = -1
        super().__init__(settings.write_timeout, settings.most)

    @property
    def address(self) -> str:
        """Device node."""
        return f"serial {self._path}"

    def _connect(self) -> None:
        if sys.platform == "win32":
            raise DriverMissing(f"{self.address}: no termios here; pip install 'bondsight[bench]'")
        import termios

        # without O_NONBLOCK a line without carrier would hang right here
        self._node = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            mode = _mode(termios, termios.tcgetattr(self._node), self._settings)
            termios.tcsetattr(self._node, termios.TCSANOW, mode)
            termios.tcflush(self._node, termios.TCIOFLUSH)
        except termios.error as error:
            raise OSError(f"not a serial line: {error}") from error

    def _descriptor(self) -> int:
        return self._node

    def _send(self, data: memoryview) -> int:
        return os.write(self._node, data)

    def _receive(self, most: int) -> bytes:
        return os.read(self._node, most)

    def _release(self) -> None:
        node, self._node = self._node, -1
        if node < 0:
            return
        import termios

        try:
            # else closing waits for a device that holds the line
            termios.tcflush(node, termios.TCIOFLUSH)
        except termios.error:
            pass
        finally:
            os.close(node)


def _mode(termios: Any, now: list[Any], settings: SerialSettings) -> list[Any]:
    """Attributes of a raw line."""
    speed = getattr(termios, f"B{settings.baud}", None)
    if speed is None:
        raise OSError(f"this system has no {settings.baud} baud")
    frame = termios.CREAD | termios.CLOCAL
    frame |= termios.CS8 if settings.bits == 8 else termios.CS7
    frame |= termios.CSTOPB if settings.stop_bits == 2 else 0
    frame |= 0 if settings.parity == "N" else termios.PARENB
    frame |= termios.PARODD if settings.parity == "O" else 0
    incoming = termios.IXON | termios.IXOFF if settings.xon_xoff else 0
    characters = list(now[6])
    characters[termios.VMIN], characters[termios.VTIME] = 1, 0
    return [incoming, 0, frame, 0, speed, speed, characters]
