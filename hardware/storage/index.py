"""What a journal holds and where, in one pass over its records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO, final

from bondgraph.support.errors import BondsightError, UnusableInput
from hardware.storage.frames import (
    FORMAT,
    MAGIC,
    Frame,
    FrameKind,
    broken_because,
    document,
    frames,
    split_chunk,
    width_of,
)
from hardware.storage.stream import StreamLayout

MAX_STREAMS = 1000
"""A chunk of a stream with a higher number is none whose names were lost."""


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


@final
class Index:
    """Records of a journal, checked one by one; no samples are kept.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    stream : binary file
        At its start.
    size : int
        Bytes that count.
    beyond : bool
        Whether to step over what is not whole.

    Raises
    ------
    UnusableInput
        It is no journal, or its header is not whole.
    """

    def __init__(self, name: str, stream: BinaryIO, size: int, beyond: bool) -> None:
        self.header: dict[str, Any] = {}
        self.software = self.utc = ""
        self.layouts: dict[int, StreamLayout] = {}
        self.chunks: dict[int, list[Frame]] = {}
        self.widths: dict[int, int] = {}
        self.notes: list[Note] = []
        self.closed = False
        self.cut = ""
        self._name, self._beyond = name, beyond
        self._headed = False
        self._next: dict[int, int] = {}
        self._strange = 0
        self._nameless: list[int] = []
        self.size = self._scan(stream, size)

    def _scan(self, stream: BinaryIO, size: int) -> int:
        """Read all records; return the bytes up to the last that is whole."""
        magic = stream.read(len(MAGIC))
        if self._beyond and magic != MAGIC:
            stream.seek(0)
        else:
            _check_magic(self._name, magic)
        skipped: list[tuple[int, int]] = []
        end, why = stream.tell(), ""
        for frame, payload in frames(stream, size, skipped if self._beyond else None):
            try:
                self._take(frame, payload)
            except (ValueError, KeyError, TypeError, RecursionError, BondsightError) as error:
                if isinstance(error, _NewerFormat):
                    raise UnusableInput(f"{self._name}: {error}") from None
                why = "a record is whole but does not belong there"
                if not self._beyond:
                    break
                self._strange += 1
            end = frame.start + frame.size
        if not self._headed and not (self._beyond and self.layouts):
            raise UnusableInput(
                f"{self._name}: {why or broken_because(stream, size)}, it is the first one: "
                "nothing can be read from this journal"
            )
        if self._beyond:
            self.cut = _stepped_over(skipped, self._strange, self._nameless, size)
        elif end < size:
            stream.seek(end)
            self.cut = (
                f"{why or broken_because(stream, size)} at byte {end}: the last {size - end} of "
                f"{size} bytes were left out"
            )
        return end

    def _take(self, frame: Frame, payload: bytes) -> None:
        """Enter a record; ValueError, KeyError or TypeError if it is not what it says."""
        if (frame.kind is FrameKind.HEADER) != (frame.number == 0) or self.closed:
            raise ValueError("out of place")
        if frame.kind is FrameKind.HEADER:
            self._take_header(document(payload))
        elif frame.kind is FrameKind.STREAM:
            self._take_stream(document(payload))
        elif frame.kind is FrameKind.CHUNK:
            if self._beyond:
                self._name_again(payload)
            number, first, flags, _ = split_chunk(payload, self.widths)
            self.chunks[number].append(frame)
            self._next[number] = first + flags.size
        elif frame.kind is FrameKind.NOTE:
            samples = {self.layouts[k].name: n for k, n in self._next.items()}
            self.notes.append(_note(document(payload), samples))
        else:
            self.closed = True

    def _name_again(self, payload: bytes) -> None:
        """Let a chunk whose stream record is lost tell how many channels there were."""
        number, width = width_of(payload)
        if number in self.widths or number > MAX_STREAMS:
            return
        units = {f"channel_{k + 1}": "1" for k in range(width)}
        self._enter(number, StreamLayout(f"stream_{number}", units, named=False))
        self._nameless.append(number)

    def _enter(self, number: int, layout: StreamLayout) -> None:
        self.layouts[number], self.chunks[number] = layout, []
        self.widths[number], self._next[number] = len(layout.units), 0

    def _take_header(self, content: dict[str, Any]) -> None:
        if content["format"] != FORMAT:
            raise _NewerFormat(
                f"journal of format {content['format']!r}, this version reads {FORMAT!r}; update "
                "Bondsight"
            )
        header, software, utc = (content[k] for k in ("header", "software", "utc"))
        if not (isinstance(header, dict) and isinstance(software, str) and isinstance(utc, str)):
            raise ValueError("no header")
        self.header, self.software, self.utc = header, software, utc
        self._headed = True

    def _take_stream(self, content: dict[str, Any]) -> None:
        number, name = content["number"], content["name"]
        channels, units = content["channels"], content["units"]
        after = number not in self.layouts if self._beyond else number == len(self.layouts)
        if not after or name in [s.name for s in self.layouts.values()]:
            raise ValueError("a stream twice")
        if not all(isinstance(text, str) for text in [name, *channels, *units]):
            raise ValueError("no names")
        layout = StreamLayout(name, dict(zip(channels, units, strict=True)))
        if len(layout.units) != len(channels) or not channels:
            raise ValueError("a channel twice")
        self._enter(number, layout)


@final
class _NewerFormat(UnusableInput):
    """A journal of another version."""


def _check_magic(name: str, magic: bytes) -> None:
    if magic == MAGIC:
        return
    if MAGIC.startswith(magic):
        raise UnusableInput(f"{name}: ends within its first bytes; nothing had been stored")
    raise UnusableInput(f"{name}: this is no journal of an acquisition, or its start is lost")


def _stepped_over(
    skipped: list[tuple[int, int]], strange: int, nameless: list[int], size: int
) -> str:
    """Say what was left out when reading went on behind it."""
    parts = []
    if skipped:
        lost = sum(b - a for a, b in skipped)
        parts.append(
            f"{lost} of {size} bytes in {len(skipped)} places are not whole and were stepped over, "
            f"the first at byte {skipped[0][0]}"
        )
    if strange:
        parts.append(f"{strange} whole records belong to none that is left")
    if nameless:
        names = ", ".join(f"stream_{k}" for k in nameless)
        parts.append(f"what {names} and its channels were called, and their units, is lost")
    return "; ".join(parts)


def _note(content: dict[str, Any], samples: dict[str, int]) -> Note:
    if not isinstance(content["note"], dict) or not isinstance(content["utc"], str):
        raise ValueError("no note")
    return Note(content["utc"], content["note"], samples)
