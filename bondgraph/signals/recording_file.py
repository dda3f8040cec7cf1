"""Recordings as archives: every bit and where it came from."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.archive import archive_schema, read_archive, write_archive
from bondgraph.support.errors import UnusableInput

if TYPE_CHECKING:
    from bondgraph.signals.recording import Recording

SCHEMA = "bondsight-recording/1"
"""Name and version of the document: name, units, source, sha256, meta; arrays: time, channels."""
_TIME = "time"


def sha256_of(file: Path) -> str:
    """SHA-256 of the bytes of a file, in hexadecimal."""
    digest = hashlib.sha256()
    with open(file, "rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def is_saved(file: Path) -> bool:
    """Whether a file looks like one that `save_recording` wrote, in any version."""
    if file.suffix.lower() != ".npz":
        return False
    schema = archive_schema(file)
    return schema is not None and schema.partition("/")[0] == SCHEMA.partition("/")[0]


def save_recording(recording: Recording, file: Path) -> Path:
    """Write a recording; see `Recording.save`."""
    if file.suffix.lower() != ".npz":
        raise UnusableInput(
            f"{file.name}: a recording is saved as .npz; write_csv writes tables for others"
        )
    document = {
        "name": recording.name,
        "units": dict(recording.units),
        "source": recording.source,
        "sha256": recording.sha256,
        "meta": dict(recording.meta),
    }
    # no channel may be called time
    write_archive(file, SCHEMA, document, {_TIME: recording.time, **recording.channels})
    return file


def open_fields(file: Path) -> dict[str, Any]:
    """Fields of a saved recording, for its constructor."""
    document, arrays = read_archive(file, SCHEMA)
    try:
        fields = {k: document[k] for k in ("name", "units", "source", "sha256", "meta")}
        fields["time"] = arrays.pop(_TIME)
        fields["channels"] = arrays
        if list(fields["units"]) != list(arrays):
            raise KeyError("units")
    except KeyError as error:
        raise UnusableInput(
            f"{file.name}: cannot be reopened, it has no {error.args[0]!r}; save it again"
        ) from None
    return fields
