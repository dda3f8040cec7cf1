"""Public data sets by name (none is part of this project; see `catalogue`)."""

from __future__ import annotations

from identification.datasets.catalogue import (
    KNOWN,
    SETS,
    KnownRecording,
    LoadedRecording,
    about,
    available,
    load,
    names,
    part,
    protocol,
    public_set,
    set_available,
)
from identification.datasets.places import FOLDER_VARIABLE
from identification.datasets.public_set import Protocol, PublicSet, SetPart

__all__ = [
    "FOLDER_VARIABLE",
    "KNOWN",
    "SETS",
    "KnownRecording",
    "LoadedRecording",
    "Protocol",
    "PublicSet",
    "SetPart",
    "about",
    "available",
    "load",
    "names",
    "part",
    "protocol",
    "public_set",
    "set_available",
]
