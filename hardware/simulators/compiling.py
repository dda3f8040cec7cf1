"""C code of the simulators, compiled once with gcc into the user's cache."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

_FLAGS = ("-O2", "-std=c11", "-shared", "-fPIC")


def compiled(name: str, source: Path, *flags: str, folder: str | Path | None = None) -> Path:
    """Compile a C file if no library of it is there.

    Parameters
    ----------
    name : str
        How the library's name begins.
    source : Path
    flags : str
        Of gcc, beside those of every shared library; libraries too.
    folder : path, optional
        Where the library goes; made if it is not there. By default the user's cache.

    Returns
    -------
    Path
        The shared library.

    Raises
    ------
    OSError
        Without gcc.
    """
    if folder is None:
        root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(root) / "bondsight" / "bench"
    digest = hashlib.sha256(source.read_bytes() + " ".join(flags).encode()).hexdigest()[:20]
    target = Path(folder) / f"{name}-{digest}.so"
    if target.exists():
        return target
    gcc = shutil.which("gcc")
    if gcc is None:
        raise OSError(f"{source.name}: no gcc found; it is C code; install gcc")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
        made = Path(scratch) / "made.so"
        command = [gcc, *_FLAGS, "-o", str(made), str(source), *flags, "-lm"]
        subprocess.run(command, check=True, capture_output=True)
        made.replace(target)
    return target
