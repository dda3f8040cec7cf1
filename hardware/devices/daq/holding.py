"""Files of a card that one program at a time may hold.

Two programs on one card would each take the other's outputs for their own. Nothing in these cards
or in their drivers keeps the second one out, so every program locks what it opens (``flock``). The
system lifts the lock with the end of the process, however it ends.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from hardware.errors import DriverMissing, LinkLost


def held(path: Path, flags: int, opened: contextlib.ExitStack) -> int:
    """Open a file or folder, lock it, and return its descriptor.

    Parameters
    ----------
    path : Path
        What to open.
    flags : int
        As for ``os.open``.
    opened : ExitStack
        Closing it lifts the lock and closes the file.

    Raises
    ------
    DriverMissing
        It cannot be opened.
    LinkLost
        Another program holds it; the line names it if the system tells.
    """
    # not at the top: the package has to be importable where there is no such lock
    import fcntl

    try:
        file = os.open(path, flags)
    except OSError as error:
        raise DriverMissing(
            f"{path}: cannot be opened ({error.strerror}); give the user access to it by a udev "
            "rule, or run as root"
        ) from error
    opened.callback(_released, file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise LinkLost(
            f"{path}: another program drives this card{_holder(file)}; end it, or close the card "
            "there, then open it again"
        ) from None
    except OSError as error:
        raise LinkLost(
            f"{path}: cannot be locked ({error.strerror}), so another program could drive the card "
            "at the same time"
        ) from error
    return file


def _released(file: int) -> None:
    import fcntl

    # a mapping has a duplicate of the descriptor, and with it the lock
    with contextlib.suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_UN)
    os.close(file)


def _holder(file: int) -> str:
    """Name the process that holds the lock, as the kernel's list tells; empty if it does not."""
    status = os.fstat(file)
    device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    with contextlib.suppress(OSError):
        for line in Path("/proc/locks").read_text().splitlines():
            words = line.split()
            # number, FLOCK, ADVISORY, WRITE, process, device, first, last
            if len(words) == 8 and words[1] == "FLOCK" and words[5] == device:
                return f" ({_process(words[4])})"
    return ""


def _process(number: str) -> str:
    if number == str(os.getpid()):
        return "this program itself"
    with contextlib.suppress(OSError):
        return f"process {number}, {Path('/proc', number, 'comm').read_text().strip()}"
    return f"process {number}"
