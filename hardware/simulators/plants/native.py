"""The C code of the plants, compiled once with gcc into the user's cache."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["library", "pointer"]

Array = NDArray[np.float64]

_FLAGS = ("-O2", "-std=c11", "-shared", "-fPIC", "-fno-math-errno")


def library() -> ctypes.CDLL | None:
    """Return the compiled code; None without gcc, or with ``BONDSIGHT_NO_COMPILER`` set."""
    return None if os.environ.get("BONDSIGHT_NO_COMPILER") else _loaded()


@cache
def _loaded() -> ctypes.CDLL | None:
    gcc = shutil.which("gcc")
    source = Path(__file__).with_name("stack.c")
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    digest = hashlib.sha256(source.read_bytes() + " ".join(_FLAGS).encode()).hexdigest()[:20]
    target = Path(root) / "bondsight" / "bench" / f"stack-{digest}.so"
    try:
        if not target.exists():
            if gcc is None:
                return None
            target.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
                made = Path(scratch) / "stack.so"
                command = [gcc, *_FLAGS, "-o", str(made), str(source), "-lm"]
                subprocess.run(command, check=True, capture_output=True)
                made.replace(target)
        return ctypes.CDLL(str(target))
    except (OSError, subprocess.SubprocessError):
        return None


def pointer(a: Array) -> ctypes.c_void_p:
    """Return the address of a contiguous array of doubles."""
    return ctypes.c_void_p(a.ctypes.data)
