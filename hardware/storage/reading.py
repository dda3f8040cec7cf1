"""Reading journals: whole, cut off, damaged, or still being written."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from bondgraph.support.errors import UnusableInput, require_known
from hardware.contracts import Chunk
from hardware.storage.frames import Frame, split_chunk
from hardware.storage.index import Index, Note
from hardware.storage.lock import is_locked
from hardware.storage.stream import StreamData, StreamLayout

__all__ = ["JournalFile", "Note", "open_journal"]


@dataclass(frozen=True, slots=True, eq=False)
class JournalFile:
    """Index of a journal; samples are read when asked for.

    Parameters
    ----------
    path : Path
        The file.
    header : mapping
        As given to `Journal.create`.
    software, utc : str
        Who wrote it, and when it began.
    streams : mapping of str to StreamLayout
        In order of their first chunk.
    notes : tuple of Note
        Events in their order.
    closed : bool
        Whether it was closed in order; a killed writer leaves False.
    live : bool
        Whether a living process was writing it when it was opened.
    size : int
        Bytes of whole records.
    cut : str
        Sentence about what is not whole and was left out; empty if nothing was.
    """

    path: Path
    header: Mapping[str, Any]
    software: str
    utc: str
    streams: Mapping[str, StreamLayout]
    notes: tuple[Note, ...]
    closed: bool
    live: bool
    size: int
    cut: str
    _chunks: Mapping[str, tuple[Frame, ...]] = field(default_factory=dict, repr=False)
    _widths: Mapping[int, int] = field(default_factory=dict, repr=False)

    def read(self, stream: str) -> StreamData:
        """Return all samples of a stream.

        Raises
        ------
        UnknownName
            There is no such stream.
        UnusableInput
            The file changed since it was opened.
        """
        parts = list(self.chunks(stream))
        layout = self.streams[stream]
        none = np.zeros(0, np.int64)
        numbers = np.concatenate([none, *(np.arange(c.first, c.first + c.n) for c in parts)])
        flags = np.concatenate([np.zeros(0, np.uint16), *(c.flags for c in parts)])
        columns = {
            k: np.concatenate([np.zeros(0), *(c.channels[k] for c in parts)]) for k in layout.units
        }
        total = numbers.size
        if np.any(np.diff(numbers) <= 0):
            # the first that came under a number counts
            numbers, keep = np.unique(numbers, return_index=True)
            flags, columns = flags[keep], {k: v[keep] for k, v in columns.items()}
        return StreamData(
            layout, numbers.astype(np.int64), columns, flags, int(total - numbers.size)
        )

    def chunks(self, stream: str) -> Iterator[Chunk]:
        """Yield the chunks of a stream one by one, for large records; raises as `read` does."""
        require_known("stream", self.path.name, self.streams, stream)
        units = dict(self.streams[stream].units)
        with _opened(self.path) as file:
            for frame in self._chunks[stream]:
                file.seek(frame.start)
                payload = file.read(frame.size)
                if zlib.crc32(payload) != frame.crc:
                    raise UnusableInput(
                        f"{self.path.name}: changed since it was opened; open it again"
                    )
                _, first, flags, columns = split_chunk(payload, self._widths)
                yield Chunk(stream, first, dict(zip(units, columns, strict=True)), units, flags)


def open_journal(path: str | os.PathLike[str], *, beyond: bool = False) -> JournalFile:
    """Open a journal in whatever state it is.

    Everything up to the first record that is not whole is given; nothing is accepted whose
    checksum is wrong.

    Parameters
    ----------
    path : path
        The file; another program may be writing it.
    beyond : bool
        Step over what is not whole and give also what is behind it, as a disk that lost one sector
        leaves it. Samples that are missing then show as gaps.

    Raises
    ------
    UnusableInput
        One line: no such file, no journal, or not even its header is whole.
    """
    file = Path(path)
    live = is_locked(file)
    with _opened(file) as stream:
        size = os.fstat(stream.fileno()).st_size
        index = Index(file.name, stream, size, beyond)
    units = {layout.name: layout for layout in index.layouts.values()}
    found = {index.layouts[k].name: tuple(c) for k, c in index.chunks.items()}
    return JournalFile(
        file, index.header, index.software, index.utc, units, tuple(index.notes), index.closed,
        live, index.size, index.cut, found, dict(index.widths),
    )  # fmt: skip


def _opened(file: Path) -> BinaryIO:
    try:
        return open(file, "rb")
    except OSError as error:
        raise UnusableInput(f"{file}: cannot be opened ({error.strerror or error})") from error
