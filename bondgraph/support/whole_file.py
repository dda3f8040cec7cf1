"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from bondgraph.support.errors import UnusableInput


def regular_target(target: Path) -> Path:
    """Return where a file is really to be written, links followed.

    Raises
    ------
    UnusableInput
        It exists and is no regular file: a folder, a device, a pipe.
    """
    real = target.resolve()
    if real.exists() and not real.is_file():
        raise UnusableInput(f"{target} exists and is no regular file; give another --out")
    return real


@contextlib.contextmanager
def replacing(target: Path) -> Iterator[BinaryIO]:
    """Write a file under a temporary name beside it and put it in place at the end.

    A reader sees the old file or the new one, never a part, also if the process is killed; an
    error leaves the old file and no other.

    Parameters
    ----------
    target : Path
        The file; its folder must exist.

    Yields
    ------
    binary file
        To be written; seekable.

    Raises
    ------
    UnusableInput
        The folder or the file cannot be written.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(Path(folder) / "a.txt") as stream:
    ...         _ = stream.write(b"whole")
    ...     (Path(folder) / "a.txt").read_text()
    'whole'
    """
    temporary: str | None = None
    try:
        real = regular_target(target)
        handle, temporary = tempfile.mkstemp(
            dir=real.parent, prefix=f".{real.name[:100]}.", suffix=".part"
        )
        with os.fdopen(handle, "w+b") as stream:
            yield stream
            stream.flush()
            # the name must not be on the disk before the bytes are
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, real)
        temporary = None
    except OSError as error:
        raise UnusableInput(f"{target}: cannot be written ({error.strerror or error})") from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def write_atomically(target: Path, text: str) -> None:
    """Write a text file whole or not at all; missing folders are made.

    Raises
    ------
    UnusableInput
        A folder or the file cannot be written.
    """
    try:
        target.resolve().parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnusableInput(
            f"{target.parent}: cannot be made ({error.strerror or error})"
        ) from error
    with replacing(target) as stream:
        stream.write(text.encode("utf-8"))
