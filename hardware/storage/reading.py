"""Reading journals: whole, cut off, damaged, or still being written."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from bondgraph.errors import BondsightError, UnusableInput, unknown_name
from hardware.contracts import Chunk
from hardware.storage.frames import (
    FORMAT,
    MAGIC,
    Frame,
    Kind,
    broken_because,
    document,
    frames,
    split_chunk,
)
from hardware.storage.lock import is_locked
from hardware.storage.stream import StreamData, StreamLayout

__all__ = ["JournalFile", "Note", "open_journal"]


@dataclass(frozen=True, slots=True)
class Note:
    """An event.

    Parameters
    ----------
    utc : str
        Date and time of the computer, ISO 8601.
    content : mapping
        What was noted.
    samples : mapping of str to int
        For every stream the number of the sample that came next.
    """

    utc: str
    content: Mapping[str, Any]
    samples: Mapping[str, int]


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
        Sentence about what stands behind the last whole record; empty if nothing does.
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
        """Yield the chunks of a stream one by one, for records larger than the memory.

        Raises
        ------
        UnknownName
            There is no such stream.
        UnusableInput
            The file changed since it was opened.
        """
        if stream not in self.streams:
            raise unknown_name("stream", stream, self.path.name, self.streams)
        units = dict(self.streams[stream].units)
        order = list(self.streams)
        widths = [len(s.units) for s in self.streams.values()]
        with _opened(self.path) as file:
            for frame in self._chunks[stream]:
                file.seek(frame.start)
                payload = file.read(frame.size)
                if zlib.crc32(payload) != frame.crc:
                    raise UnusableInput(
                        f"{self.path.name}: changed since it was opened; open it again"
                    )
                number, first, flags, columns = split_chunk(payload, widths)
                assert order[number] == stream
                yield Chunk(stream, first, dict(zip(units, columns, strict=True)), units, flags)


def open_journal(path: str | os.PathLike[str]) -> JournalFile:
    """Open a journal in whatever state it is.

    Everything up to the first record that is not whole is given; nothing is accepted whose
    checksum is wrong.

    Parameters
    ----------
    path : path
        The file; another program may be writing it.

    Raises
    ------
    UnusableInput
        One line: no such file, no journal, or not even its header is whole.
    """
    file = Path(path)
    live = is_locked(file)
    with _opened(file) as stream:
        size = os.fstat(stream.fileno()).st_size
        return _index(file, stream, size, live)


def _index(file: Path, stream: BinaryIO, size: int, live: bool) -> JournalFile:
    _check_magic(file, stream.read(len(MAGIC)))
    head: dict[str, Any] | None = None
    layouts: list[StreamLayout] = []
    chunks: list[list[Frame]] = []
    nexts: list[int] = []
    notes: list[Note] = []
    closed = False
    end, why = stream.tell(), ""
    for frame, payload in frames(stream, size):
        try:
            if (frame.kind is Kind.HEADER) != (head is None) or closed:
                raise ValueError("out of place")
            if frame.kind is Kind.HEADER:
                head = _header(document(payload), frame)
            elif frame.kind is Kind.STREAM:
                layouts.append(_layout(document(payload), layouts))
                chunks.append([])
                nexts.append(0)
            elif frame.kind is Kind.CHUNK:
                widths = [len(s.units) for s in layouts]
                number, first, flags, _ = split_chunk(payload, widths)
                chunks[number].append(frame)
                nexts[number] = first + flags.size
            elif frame.kind is Kind.NOTE:
                names = [s.name for s in layouts]
                notes.append(_note(document(payload), dict(zip(names, nexts, strict=True))))
            else:
                closed = True
        except (ValueError, KeyError, TypeError, RecursionError, BondsightError) as error:
            if isinstance(error, UnusableInput) and head is None:
                raise
            why = "a record is whole but does not belong there"
            break
        end = frame.start + frame.size
    if head is None:
        raise UnusableInput(
            f"{file.name}: {why or broken_because(stream, size)}, it is the first one: nothing can "
            "be read from this journal"
        )
    cut = ""
    if end < size:
        stream.seek(end)
        cut = (
            f"{why or broken_because(stream, size)} at byte {end}: "
            f"the last {size - end} of {size} bytes were left out"
        )
    found = {s.name: tuple(c) for s, c in zip(layouts, chunks, strict=True) if c}
    streams = {s.name: s for s in layouts}
    return JournalFile(
        file, head["header"], head["software"], head["utc"], streams,
        tuple(notes), closed, live, end, cut, {s: found.get(s, ()) for s in streams},
    )  # fmt: skip


def _check_magic(file: Path, magic: bytes) -> None:
    if magic == MAGIC:
        return
    if MAGIC.startswith(magic):
        raise UnusableInput(f"{file.name}: ends within its first bytes; nothing had been stored")
    raise UnusableInput(f"{file.name}: this is no journal of an acquisition, or its start is lost")


def _header(content: dict[str, Any], frame: Frame) -> dict[str, Any]:
    if content["format"] != FORMAT:
        raise UnusableInput(
            f"journal of format {content['format']!r}, this version reads {FORMAT!r}; update "
            "Bondsight"
        )
    if frame.number or not isinstance(content["header"], dict):
        raise ValueError("no header")
    return {k: content[k] for k in ("header", "software", "utc")}


def _layout(content: dict[str, Any], before: list[StreamLayout]) -> StreamLayout:
    name, channels, units = content["name"], content["channels"], content["units"]
    if content["number"] != len(before) or name in [s.name for s in before]:
        raise ValueError("a stream twice")
    if not all(isinstance(text, str) for text in [name, *channels, *units]):
        raise ValueError("no names")
    layout = StreamLayout(name, dict(zip(channels, units, strict=True)))
    if len(layout.units) != len(channels) or not channels:
        raise ValueError("a channel twice")
    return layout


def _note(content: dict[str, Any], samples: dict[str, int]) -> Note:
    if not isinstance(content["note"], dict) or not isinstance(content["utc"], str):
        raise ValueError("no note")
    return Note(content["utc"], content["note"], samples)


def _opened(file: Path) -> BinaryIO:
    try:
        return open(file, "rb")
    except OSError as error:
        raise UnusableInput(f"{file}: cannot be opened ({error.strerror or error})") from error
