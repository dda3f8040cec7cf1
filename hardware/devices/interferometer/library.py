"""The vendor's library `siosifm`, loaded by ctypes."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, final

from bondgraph.support.errors import UnusableInput
from hardware.devices.interferometer.signatures import SIGNATURES
from hardware.errors import DriverMissing, HardwareError, LinkLost, Overrun, ProtocolFault, TimedOut

VARIABLE: Final = "BONDSIGHT_SIOS_LIB"
"""Environment variable with the path of the library."""

_NAMES = {
    -1: "device invalid",
    -2: "bad channel",
    -3: "bad device type",
    -4: "data length",
    -6: "unknown error",
    -10: "too many devices",
    -11: "bad request type",
    -12: "invalid USB id",
    -13: "cannot create a handle",
    -15: "bus in use",
    -16: "bus write",
    -17: "bus time-out",
    -18: "output rate too high",
    -19: "information not available yet",
    -20: "bad sensor",
    -21: "bus read",
    -22: "bad parameter",
    -23: "bus answer",
    -100: "not implemented",
}
_KIND: dict[int, type[HardwareError]] = {
    -1: LinkLost,
    -4: Overrun,
    -10: LinkLost,
    -13: LinkLost,
    -17: TimedOut,
    -19: TimedOut,
}
_REFUSED = (-2, -12, -18, -22)


@final
class VendorLibrary:
    """Functions of the library with their types set, and its errors as those of the project.

    Parameters
    ----------
    path : path, optional
        The shared library; by default what the environment variable ``BONDSIGHT_SIOS_LIB`` says,
        else the one the system knows as ``siosifm``.

    Raises
    ------
    DriverMissing
        If there is none, or it cannot be loaded.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        name = str(path) if path is not None else os.environ.get(VARIABLE) or _system_name()
        if name is None:
            raise DriverMissing(
                f"interferometer: no library siosifm found; get it from SIOS and give its path, "
                f"or set {VARIABLE}"
            )
        try:
            self._dll = ctypes.CDLL(name)
        except OSError as fault:
            raise DriverMissing(
                f"interferometer: {name} cannot be loaded ({fault}); check the path and that it is "
                f"built for this {'64' if sys.maxsize > 2**32 else '32'}-bit system"
            ) from fault
        self.path = name
        self._functions: dict[str, Any] = {}
        self._users = _users_of(self._dll._handle)

    def function(self, name: str) -> Any:
        """Return a function of the library with its types set.

        Raises
        ------
        DriverMissing
            If this version of the library has it not.
        """
        if name not in self._functions:
            result, arguments = SIGNATURES[name]
            try:
                function = getattr(self._dll, name)
            except AttributeError as fault:
                raise DriverMissing(
                    f"interferometer: {self.path} has no function {name}; use a newer library"
                ) from fault
            function.restype, function.argtypes = result, list(arguments)
            self._functions[name] = function
        return self._functions[name]

    def has(self, name: str) -> bool:
        """Return whether this version of the library has a function."""
        return hasattr(self._dll, name)

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function; a negative integer result becomes an error of the project.

        Raises
        ------
        LinkLost, Overrun, TimedOut, ProtocolFault, UnusableInput
            By the code of the library, with its text.
        """
        result = self.function(name)(*arguments)
        if isinstance(result, int) and SIGNATURES[name][0] is ctypes.c_int32 and result < 0:
            raise self.error(result, name)
        return result

    def error(self, code: int, where: str) -> Exception:
        """Make (not raise) the error for a code of the library."""
        text = f"interferometer: {where} answered {code} ({self._text(code)})"
        if code in _REFUSED:
            return UnusableInput(f"{text}; change what was asked for")
        kind = _KIND.get(code, ProtocolFault)
        if kind is LinkLost:
            text += "; check cable and supply, open again, and set to zero"
        return kind(text)

    def enter(self) -> None:
        """Initialise the library for its first user in this process."""
        if self._users.count == 0:
            if self.has("IfmSetOption"):
                self.call("IfmSetOption", 1, 0)  # no debug files in the user's folder
            self.call("IfmInit")
        self._users.count += 1

    def leave(self) -> None:
        """Release the library after its last user: that closes every device of the process."""
        self._users.count = max(self._users.count - 1, 0)
        if self._users.count == 0:
            self.call("IfmClose")

    def _text(self, code: int) -> str:
        own = _NAMES.get(code, "unknown code")
        if not self.has("IfmGetErrorString"):
            return own
        told: bytes | None = self.function("IfmGetErrorString")(code)
        return told.decode("latin-1").strip() if told else own


def _system_name() -> str | None:
    return ctypes.util.find_library("siosifm64") or ctypes.util.find_library("siosifm")


@dataclass(slots=True)
class _Users:
    count: int = 0


@cache
def _users_of(loaded: int) -> _Users:
    """Count users of a library that is loaded once however many objects stand for it."""
    return _Users()
