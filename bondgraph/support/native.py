"""C code compiled by the system's gcc, kept in a cache by the hash of source and flags.

Without gcc, or with ``BONDSIGHT_NO_COMPILER`` set, nothing is compiled and the callers fall back to
NumPy or to CasADi's virtual machine.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

LARGE = 300_000
"""Length of a source beyond which gcc's time matters more than the speed of its code."""

MACHINE = (
    "-march=native",
    "-fPIC",
    "-shared",
    "-fno-math-errno",
    # without it every fmax of CasADi is a call that another library might replace
    "-fno-semantic-interposition",
)

STRAIGHT = ("-O1", "-fexpensive-optimizations")
"""For code without loops as CasADi writes it: as fast as with -O2, and gcc is done much sooner."""

FLAGS = (*STRAIGHT, *MACHINE)

LOOPS = '#pragma GCC optimize ("O2")\n'
"""What stands before loops written by hand, behind code without any."""


def compiler() -> str | None:
    """Path of gcc, or None if it is absent or not wanted."""
    return None if os.environ.get("BONDSIGHT_NO_COMPILER") else shutil.which("gcc")


@lru_cache(maxsize=4)
def _machine(gcc: str) -> str:
    """Return what gcc says of this processor and of itself, as macros."""
    asked = [gcc, "-march=native", "-dM", "-E", "-x", "c", os.devnull]
    try:
        return subprocess.run(asked, check=True, capture_output=True, text=True, timeout=60).stdout
    except (OSError, subprocess.SubprocessError):
        return ""


def vector_length() -> int:
    """Return how many doubles a register of this processor holds.

    Longer vectors are possible, but gcc takes each of their operations through memory
    (``bondsight bench rows`` prints what that costs).
    """
    known = _machine(compiler() or "")
    return 8 if "__AVX512F__" in known else 4 if "__AVX__" in known else 2


def cache_folder() -> Path:
    """Folder of the compiled libraries."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "bondsight" / "kernels"


def c_source(*functions: Any) -> str:
    """C source of CasADi functions.

    Their `fmax` and `fmin` become comparisons: the library's, which must look for NaN, are calls
    that cost more than the rest of a play.
    """
    import casadi as ca

    generator = ca.CodeGenerator("code.c", {"with_header": False, "main": False})
    for function in functions:
        generator.add(function)
    text = str(generator.dump())
    text = text.replace("return fmax(x, y);", "return x > y ? x : y;")
    return text.replace("return fmin(x, y);", "return x < y ? x : y;")


def build(source: str, flags: tuple[str, ...] = FLAGS) -> Path | None:
    """Compile C source into a shared library.

    Parameters
    ----------
    source : str
        C source.
    flags : tuple of str
        Flags of gcc; they must hold ``-fPIC -shared``.

    Returns
    -------
    Path or None
        The library, or None if there is no compiler or it fails.
    """
    gcc = compiler()
    if len(source) > LARGE:
        kept = (f for f in flags if f != "-fexpensive-optimizations")
        flags = tuple("-O1" if f in ("-O2", "-O3") else f for f in kept)
    if gcc is None:
        return None
    try:
        return _library(source, gcc, flags)
    except (OSError, subprocess.SubprocessError):
        return None


def _library(source: str, gcc: str, flags: tuple[str, ...]) -> Path:
    # a folder may be seen from machines with other processors
    digest = hashlib.sha256((source + " ".join(flags) + _machine(gcc)).encode()).hexdigest()[:24]
    folder = cache_folder()
    target = folder / f"{digest}.so"
    if target.exists():
        return target
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as work:
        code = Path(work) / "code.c"
        code.write_text(source)
        built = Path(work) / "code.so"
        subprocess.run(
            [gcc, *flags, str(code), "-o", str(built), "-lm"],
            check=True,
            capture_output=True,
            timeout=120,
        )
        # a finished file replaces at once, so that two processes cannot meet a half one
        built.replace(target)
    return target
