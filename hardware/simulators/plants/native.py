"""The C code of the plants, compiled once with gcc into the user's cache."""

from __future__ import annotations

import ctypes
import os
import subprocess
from functools import cache
from pathlib import Path

from hardware.simulators.arrays import Array
from hardware.simulators.compiling import compiled


def library() -> ctypes.CDLL | None:
    """Return the compiled code; None without gcc, or with ``BONDSIGHT_NO_COMPILER`` set."""
    return None if os.environ.get("BONDSIGHT_NO_COMPILER") else _loaded()


@cache
def _loaded() -> ctypes.CDLL | None:
    try:
        source = Path(__file__).with_name("stack.c")
        return ctypes.CDLL(str(compiled("stack", source, "-fno-math-errno")))
    except (OSError, subprocess.SubprocessError):
        return None


def pointer(a: Array) -> ctypes.c_void_p:
    """Return the address of a contiguous array of doubles."""
    return ctypes.c_void_p(a.ctypes.data)
