"""Named public recordings (none is part of this project; see `known` and `protocols`)."""

from __future__ import annotations

from identification.datasets.known import (
    FOLDER_VARIABLE,
    KNOWN,
    KnownRecording,
    LoadedRecording,
    about,
    available,
    load,
    names,
)
from identification.datasets.protocols import SETS, part, protocol, public_set, set_available
from identification.datasets.public_set import Protocol, PublicSet

__all__ = [
    "FOLDER_VARIABLE",
    "KNOWN",
    "SETS",
    "KnownRecording",
    "LoadedRecording",
    "Protocol",
    "PublicSet",
    "about",
    "available",
    "load",
    "names",
    "part",
    "protocol",
    "public_set",
    "set_available",
]
