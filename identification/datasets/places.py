"""Where recordings lie: the folder of the user first, then what was downloaded."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER_VARIABLE = "BONDSIGHT_RECORDINGS"
"""Environment variable with the folder of the recordings."""
CACHE_VARIABLE = "BONDSIGHT_CACHE"
"""Environment variable with the folder of downloads."""


def recordings_folder(folder: str | os.PathLike[str] | None = None) -> Path | None:
    """Return the folder given, else that of the environment; None if there is neither."""
    given = os.environ.get(FOLDER_VARIABLE, "") if folder is None else os.fspath(folder)
    return Path(given).expanduser() if given else None


def originals_folder(cache: str | os.PathLike[str] | None = None) -> Path:
    """Return where downloaded files lie as they came, one sub-folder for each source.

    In the cache that is given, in that of the environment, or in the user's.
    """
    given = os.environ.get(CACHE_VARIABLE, "") if cache is None else os.fspath(cache)
    if given:
        return Path(given).expanduser() / "originals"
    base = os.environ.get("XDG_CACHE_HOME", "") or Path.home() / ".cache"
    return Path(base) / "bondsight" / "recordings" / "originals"
