"""Compiles the stub library of the vendor's interface."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

__all__ = ["build"]

_SOURCE = Path(__file__).parent / "c" / "siosifm.c"


def build(folder: str | Path | None = None) -> Path:
    """Compile the stub with gcc, once per version of its source.

    Parameters
    ----------
    folder : path, optional
        Where the library goes; made if it is not there. By default the user's cache.

    Returns
    -------
    Path
        The shared library; load it as the vendor's.

    Raises
    ------
    OSError
        Without gcc.
    """
    text = _SOURCE.read_bytes()
    if folder is None:
        root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
        folder = Path(root) / "bondsight" / "bench"
    target = Path(folder) / f"libsiosifm-{hashlib.sha256(text).hexdigest()[:16]}.so"
    if target.exists():
        return target
    gcc = shutil.which("gcc")
    if gcc is None:
        raise OSError("stub of siosifm: no gcc found; it is C code; install gcc")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
        made = Path(scratch) / "stub.so"
        flags = ["-O2", "-std=c11", "-shared", "-fPIC", "-o", str(made)]
        subprocess.run([gcc, *flags, str(_SOURCE), "-lpthread", "-lm"], check=True)
        made.replace(target)
    return target
