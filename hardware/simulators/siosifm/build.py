"""Compiles the stub library of the vendor's interface."""

from __future__ import annotations

from pathlib import Path

from hardware.simulators.compiling import compiled

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
    return compiled("libsiosifm", _SOURCE, "-lpthread", folder=folder)
