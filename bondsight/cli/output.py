"""Where results and words go."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from bondgraph.support.errors import BondsightError

INTERRUPTED = 130
"""Exit code after Ctrl-C."""


class Stopped(KeyboardInterrupt):
    """Ctrl-C, or the end of the time, with the sentence on what became of the results."""


def words_of(options: argparse.Namespace) -> Callable[[str], None]:
    """Return what prints a line as it comes: to standard error where JSON is asked for."""
    return partial(print, file=sys.stderr if options.json else sys.stdout, flush=True)


def writable(folder: Path) -> None:
    """Refuse a folder that cannot be written before the work is done, not after."""
    _MADE.extend(reversed([f for f in (folder, *folder.parents) if not f.exists()]))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BondsightError(
            f"cannot write to {folder}: {error.strerror}; give another --out"
        ) from None
    if not os.access(folder, os.W_OK):
        raise BondsightError(f"cannot write to {folder}: no permission; give another --out")


_MADE: list[Path] = []
"""Folders that `writable` was the first to make, the outer ones first."""


@contextmanager
def none_left_empty() -> Iterator[None]:
    """Take folders away again that `writable` made in the block and nothing was written to."""
    before = len(_MADE)
    try:
        yield
    finally:
        while len(_MADE) > before:
            with suppress(OSError):  # something was written, or another command took it away
                _MADE.pop().rmdir()


@contextmanager
def ended_like_ctrl_c() -> Iterator[None]:
    """Let SIGTERM, as batch systems send it, end the work inside as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may say what a signal does
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL if before is None else before)
