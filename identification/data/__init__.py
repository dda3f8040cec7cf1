"""Named public recordings (none is part of this project; see `known`)."""

from __future__ import annotations

from identification.data.known import (
    FOLDER_VARIABLE,
    KNOWN,
    KnownRecording,
    Loaded,
    about,
    available,
    load,
    names,
)

__all__ = [
    "FOLDER_VARIABLE",
    "KNOWN",
    "KnownRecording",
    "Loaded",
    "about",
    "available",
    "load",
    "names",
]
