"""Whether a writer is alive: a lock that the operating system releases with its process."""

from __future__ import annotations

import contextlib
import importlib
import os
import time
from pathlib import Path
from typing import Any

_TRIES = 50


def lock(handle: int) -> None:
    """Mark a file as being written, as long as this process has it open.

    That there is one writer only is not left to the lock: a journal is made by the one who writes
    it and never opened for writing again. A file system without locks loses only `is_locked`.
    """
    fcntl = _fcntl()
    if fcntl is None:
        return
    for _ in range(_TRIES):
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.001)  # a reader asks at this instant; real time, whatever the bench's
        except OSError:
            return
        else:
            return


def is_locked(file: Path) -> bool:
    """Whether a living process writes a file; False also where nobody can tell."""
    fcntl = _fcntl()
    if fcntl is None:
        return False
    with contextlib.suppress(OSError):
        handle = os.open(file, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(handle)
    return False


def _fcntl() -> Any:
    try:
        return importlib.import_module("fcntl")
    except ImportError:  # Windows
        return None
