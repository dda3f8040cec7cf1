"""Telling the disk to write, beside the acquisition and not in its way."""

from __future__ import annotations

import contextlib
import os
import threading
from pathlib import Path
from typing import final

_PATIENCE = 10.0  # s; a disk that hangs longer must not hang the program


@final
class Syncing:
    """A thread that calls fsync every so often; a disk may take a tenth of a second for it.

    Parameters
    ----------
    handle : int
        The open file.
    every : float
        s of real time.
    """

    def __init__(self, handle: int, every: float) -> None:
        self._handle = handle
        self._every = every
        self._ended = threading.Event()
        self._error: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="journal-fsync", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raise, once, the OSError that the disk gave since the last call."""
        error, self._error = self._error, None
        if error is not None:
            raise error

    def stop(self) -> None:
        """End the thread, waiting for a disk that answers; the file may be closed then."""
        self._ended.set()
        self._thread.join(_PATIENCE)

    def _run(self) -> None:
        while not self._ended.wait(self._every):
            try:
                os.fsync(self._handle)
            except OSError as error:
                self._error = error


def sync_folder(file: Path) -> None:
    """Let the disk know a file's name; nothing where folders cannot be opened (Windows)."""
    with contextlib.suppress(OSError):
        handle = os.open(file.parent, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
