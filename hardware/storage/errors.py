"""What can go wrong with the store."""

from __future__ import annotations

from pathlib import Path

from hardware.errors import HardwareError
from hardware.storage.lock import is_locked


class JournalFailed(HardwareError):
    """The journal cannot be made or continued; everything appended before is intact.

    `partial` is the chunk or note that was not stored, None where nothing was at stake.
    """


def why_not(file: Path, error: OSError) -> str:
    """Say why a journal cannot be made."""
    if not isinstance(error, FileExistsError):
        return f"{file}: a journal cannot be made ({error.strerror or error}); give another place"
    if is_locked(file):
        return f"{file}: another program is writing it; give another name"
    return f"{file}: exists, and a journal is never overwritten; give another name"
