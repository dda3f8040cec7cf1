"""Named public recordings (none is part of this project; see `known` and `protocols`)."""

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
from identification.data.protocols import SETS, part, protocol, public_set, set_available
from identification.data.public_set import Protocol, PublicSet

__all__ = [
    "FOLDER_VARIABLE",
    "KNOWN",
    "SETS",
    "KnownRecording",
    "Loaded",
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
