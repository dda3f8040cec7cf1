r"""The form of a journal, ``bondsight-journal/1``: framed records that are only ever appended.

For those who read it with their own program. All numbers are little-endian.

A file begins with the 16 bytes ``\x89BSJOURNAL/1\r\n\x1a\n`` and goes on with records. A
record is a head of 32 bytes and a payload:

====== ====== =====================================================================
offset type   meaning
====== ====== =====================================================================
0      4 B    mark, the bytes ``\xb5BSR``
4      u32    kind: 1 header, 2 stream, 3 chunk, 4 note, 5 end
8      u64    number of the record: 0, 1, 2, ...
16     u64    length of the payload in bytes
24     u32    CRC-32 (that of zlib) of the payload
28     u32    CRC-32 of the 28 bytes before
32     bytes  payload; the next record follows at once
====== ====== =====================================================================

Payloads of kinds 1, 2, 4 and 5 are JSON objects in UTF-8; tuples and numbers that JSON lacks are
``{"$tuple": [...]}`` and ``{"$float": "inf"}``.

1 header
    ``format`` ("bondsight-journal/1"), ``software``, ``utc`` (ISO 8601), ``header`` (what the user
    of the journal wrote). Record 0, once.
2 stream
    ``number`` (0, 1, ...), ``name``, ``channels`` (list of names), ``units`` (list). Before the
    first chunk of its stream, once.
3 chunk
    u32 number of the stream, u32 zero, i64 number of the first sample, u64 number of samples n,
    then n flags (u16), then every channel in the order of its stream record, n float64 each.
4 note
    ``utc`` and ``note`` (what the user of the journal wrote).
5 end
    ``utc``. The last record of a journal that was closed in order.

A journal whose writer was killed ends within a record or without kind 5. Reading stops before the
first record that is not whole; records behind it can be found again by their mark, the CRC of their
head, and their number. Chunks whose stream record is lost still tell how many channels they have.

An SQLite file in its place (write-ahead log, one transaction an append) was tried and left: cut in
the middle it gives back nothing where the root of its tree was split later, damage within the log
ends a take in silence, and a take is three files that reading changes.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.json_codec import from_plain, to_plain

FORMAT = "bondsight-journal/1"
"""Name and version of the form."""
MAGIC = b"\x89BSJOURNAL/1\r\n\x1a\n"
MARK = b"\xb5BSR"
_HEAD = struct.Struct("<4sIQQI")
_CHECK = struct.Struct("<I")
_CHUNK = struct.Struct("<IIqQ")
MAX_NUMBER = 2**62
"""No sample has a higher number: 146,000 years at 1 MHz."""
_BLOCK = 1 << 20
HEAD_SIZE = _HEAD.size + _CHECK.size


class FrameKind(IntEnum):
    """Kinds of record."""

    HEADER = 1
    STREAM = 2
    CHUNK = 3
    NOTE = 4
    END = 5


@dataclass(frozen=True, slots=True)
class Frame:
    """Head of one record found in a file.

    Parameters
    ----------
    kind : FrameKind
        What it is.
    number : int
        Its number.
    start : int
        Offset of its payload in the file.
    size : int
        Bytes of its payload.
    crc : int
        CRC-32 of its payload.
    """

    kind: FrameKind
    number: int
    start: int
    size: int
    crc: int


def head(kind: FrameKind, number: int, payload: bytes) -> bytes:
    """Head of a record, 32 bytes."""
    first = _HEAD.pack(MARK, kind, number, len(payload), zlib.crc32(payload))
    return first + _CHECK.pack(zlib.crc32(first))


def parse_head(data: bytes, start: int) -> Frame | None:
    """Read the head in front of offset `start`; None unless it is one."""
    if len(data) != HEAD_SIZE or _CHECK.unpack(data[-4:])[0] != zlib.crc32(data[:-4]):
        return None
    mark, kind, number, size, crc = _HEAD.unpack(data[:-4])
    if mark != MARK or kind not in tuple(FrameKind):
        return None
    return Frame(FrameKind(kind), number, start, size, crc)


def frames(
    stream: BinaryIO, size: int, skipped: list[tuple[int, int]] | None = None
) -> Iterator[tuple[Frame, bytes]]:
    """Yield records from the present place to the first that is not whole.

    The file stands behind the last whole record when it ends.

    Parameters
    ----------
    stream : binary file
        At the head of a record.
    size : int
        Bytes of the file that count; more may be on their way.
    skipped : list, optional
        If given, what is not whole is stepped over, and its first byte and the one behind it are
        entered here.
    """
    number = 0
    while True:
        place = stream.tell()
        found = parse_head(stream.read(HEAD_SIZE), place + HEAD_SIZE)
        follows = found is not None and (
            found.number == number or (skipped is not None and found.number > number)
        )
        whole = follows and found is not None and found.start + found.size <= size
        payload = stream.read(found.size) if found is not None and whole else b""
        if whole and found is not None and zlib.crc32(payload) == found.crc:
            number = found.number + 1
            yield found, payload
            continue
        behind = size if skipped is None else _next_head(stream, place + 1, size)
        stream.seek(place if skipped is None else behind)
        if skipped is not None and behind > place:
            begin = skipped.pop()[0] if skipped and skipped[-1][1] == place else place
            skipped.append((begin, behind))
        if behind == size:
            return


def _next_head(stream: BinaryIO, place: int, size: int) -> int:
    """Offset of the next place that looks like the head of a record; the size if there is none."""
    while place < size:
        stream.seek(place)
        block = stream.read(_BLOCK)
        at = block.find(MARK)
        while at >= 0:
            head_at = block[at : at + HEAD_SIZE]
            if len(head_at) < HEAD_SIZE:
                stream.seek(place + at)
                head_at = stream.read(HEAD_SIZE)
            if parse_head(head_at, 0) is not None:
                return place + at
            at = block.find(MARK, at + 1)
        if len(block) < _BLOCK:
            return size
        # a mark may lie across two blocks
        place += len(block) - len(MARK) + 1
    return size


def broken_because(stream: BinaryIO, size: int) -> str:
    """Say why no whole record stands at the present place."""
    place = stream.tell()
    data = stream.read(HEAD_SIZE)
    stream.seek(place)
    if len(data) < HEAD_SIZE:
        return "the file ends within the head of a record"
    found = parse_head(data, place + HEAD_SIZE)
    if found is None:
        return "the head of a record is damaged"
    if found.start + found.size > size:
        return "the file ends within a record"
    return "a record is damaged"


def json_payload(content: dict[str, Any], where: str) -> bytes:
    """Plain values as bytes."""
    plain = to_plain(content, where)
    return json.dumps(plain, separators=(",", ":"), allow_nan=False).encode("utf-8")


def document(payload: bytes) -> dict[str, Any]:
    """Return what `json_payload` stored; ValueError if it did not."""
    content = from_plain(json.loads(payload), "record")
    if not isinstance(content, dict):
        raise ValueError("no object")
    return content


def chunk_payload(
    number: int, first: int, flags: NDArray[np.uint16], columns: list[NDArray[np.float64]]
) -> bytes:
    """Return samples as bytes."""
    parts = [_CHUNK.pack(number, 0, first, flags.size), flags.astype("<u2", copy=False).tobytes()]
    return b"".join(parts + [c.astype("<f8", copy=False).tobytes() for c in columns])


def width_of(payload: bytes) -> tuple[int, int]:
    """Return stream number and number of channels as a chunk's size tells; ValueError if not."""
    if len(payload) < _CHUNK.size:
        raise ValueError("too short")
    number, _, _, n = _CHUNK.unpack_from(payload)
    columns, rest = divmod(len(payload) - _CHUNK.size - 2 * n, 8 * max(n, 1))
    if rest or columns < 1:
        raise ValueError("of no stream")
    return number, columns


def split_chunk(
    payload: bytes, widths: Mapping[int, int]
) -> tuple[int, int, NDArray[np.uint16], list[NDArray[np.float64]]]:
    """Return stream number, first sample, flags and columns; ValueError if they do not fit.

    Parameters
    ----------
    payload : bytes
        Of a chunk record.
    widths : mapping of int to int
        Number of channels of each stream.
    """
    if len(payload) < _CHUNK.size:
        raise ValueError("too short")
    number, zero, first, n = _CHUNK.unpack_from(payload)
    if zero or number not in widths or not 0 <= first <= MAX_NUMBER - n:
        raise ValueError("of no stream")
    if len(payload) != _CHUNK.size + n * (2 + 8 * widths[number]):
        raise ValueError("of another size")
    flags = np.frombuffer(payload, "<u2", n, _CHUNK.size).astype(np.uint16)
    start = _CHUNK.size + 2 * n
    columns = [
        np.frombuffer(payload, "<f8", n, start + 8 * n * k).astype(np.float64)
        for k in range(widths[number])
    ]
    return number, first, flags, columns
