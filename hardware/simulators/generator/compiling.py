"""The C code of the generator, compiled once with gcc into the user's cache."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

_FLAGS = ("-O2", "-std=c11", "-shared", "-fPIC")


def compiled(name: str, *before: str) -> ctypes.CDLL:
    """Compile ``c/<name>.c`` if no library of these sources is there, and load it.

    Parameters
    ----------
    name : str
    before : str
        Files to be read before it.

    Raises
    ------
    OSError
        Without gcc, or one that does not work.
    """
    here = Path(__file__).parent / "c"
    text = b"".join(file.read_bytes() for file in sorted(here.iterdir()))
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    target = root / "bondsight" / "blind" / f"{name}-{hashlib.sha256(text).hexdigest()[:20]}.so"
    if not target.exists():
        gcc = shutil.which("gcc")
        if gcc is None:
            raise OSError("no gcc found; the virtual plants are C code; install gcc")
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
            made = Path(scratch) / "made.so"
            first = [word for file in before for word in ("-include", str(here / file))]
            command = [gcc, *_FLAGS, "-o", str(made), *first, str(here / f"{name}.c"), "-lm"]
            done = subprocess.run(command, check=False, capture_output=True, text=True)
            if done.returncode:
                said = (done.stderr.strip().splitlines() or ["nothing"])[-1]
                raise OSError(f"gcc cannot compile the virtual plants; it says: {said}")
            made.replace(target)
    return ctypes.CDLL(str(target))
