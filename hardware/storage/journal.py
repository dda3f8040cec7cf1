"""Writing the journal of a running acquisition; see `hardware.storage.frames` for its form.

What survives:

- A program that ends in any way (error, ``kill -9``): all that was appended. Every record is handed
  to the operating system in one go before `append` returns; nothing waits in the program.
- A power cut or a crash of the operating system: what was appended until the last time the disk was
  told to write, at most `sync` seconds (1 s by default) and the time the disk takes for it; with
  ``sync=None`` what the operating system had written of its own accord (half a minute is usual).
- A full disk, or a disk that fails: everything before; the record that did not fit is taken back.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

from bondgraph.support.archive import software
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk
from hardware.storage.errors import JournalFailed, why_not
from hardware.storage.frames import (
    FORMAT,
    MAGIC,
    MAX_NUMBER,
    FrameKind,
    chunk_payload,
    head,
    json_payload,
)
from hardware.storage.lock import lock
from hardware.storage.syncing import Syncing, sync_folder

_BINARY = getattr(os, "O_BINARY", 0)  # Windows would translate line ends

_Layout = tuple[int, str, dict[str, str]]  # number, name, unit of every channel


def utc_now() -> str:
    """Date and time of the computer, ISO 8601, UTC, to the microsecond."""
    return datetime.now(timezone.utc).isoformat(timespec="microseconds")  # noqa: UP017


@final
class Journal:
    """One writer of one new file; made by `create`, used by one thread.

    Attributes
    ----------
    path : Path
        The file.
    size : int
        Bytes stored.
    """

    def __init__(self, path: Path, handle: int, sync: float | None) -> None:
        self.path = path
        self._handle: int | None = handle
        self.size = 0
        self._number = 0
        self._pending: tuple[int, int, _Layout | None] | None = None
        self._layouts: dict[str, _Layout] = {}
        self._syncing = Syncing(handle, sync) if sync is not None else None

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        header: Mapping[str, Any],
        *,
        sync: float | None = 1.0,
    ) -> Journal:
        """Start a journal.

        Parameters
        ----------
        path : path
            A file that does not exist yet, customarily NAME.journal; its folder must.
        header : mapping
            Plain values: texts, numbers, flags, None, lists, tuples and mappings of them. What
            `recover` needs is written by `hardware.storage.journal_header`.
        sync : float, optional
            Time between two orders to the disk to write (s), given by a thread beside; None leaves
            it to the operating system.

        Raises
        ------
        JournalFailed
            The file exists (perhaps another program is writing it), or cannot be made.
        UnusableInput
            The header holds more than plain values.

        Examples
        --------
        >>> import tempfile, numpy as np
        >>> from hardware.storage import open_journal
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with Journal.create(Path(folder) / "run.journal", {"who": "I"}) as journal:
        ...         journal.append(Chunk("a", 0, {"x": np.array([1.0, 2.0])}, {"x": "m"}))
        ...         journal.note({"event": "parked"})
        ...     open_journal(journal.path).read("a").channels["x"]
        array([1., 2.])
        """
        file = Path(path)
        if sync is not None and not 0.0 < sync < float("inf"):
            raise UnusableInput(f"{file.name}: sync = {sync!r} s; give a positive time, or None")
        content = {"format": FORMAT, "software": software(), "utc": utc_now()}
        payload = json_payload({**content, "header": dict(header)}, f"{file.name}: header")
        try:
            handle = os.open(
                file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | _BINARY, 0o644
            )
        except OSError as error:
            raise JournalFailed(why_not(file, error)) from error
        lock(handle)
        journal = cls(file, handle, sync)
        try:
            # one write: a journal is never without its header
            journal._put(MAGIC + head(FrameKind.HEADER, 0, payload) + payload, 1, None, None)
            sync_folder(file)
        except BaseException:
            journal._shut()
            with contextlib.suppress(OSError):
                file.unlink()
            raise
        return journal

    def append(self, chunk: Chunk) -> None:
        """Store samples; they are safe from the end of the program when this returns.

        Parameters
        ----------
        chunk : Chunk
            Of any stream; a stream keeps its channels and units.

        Raises
        ------
        JournalFailed
            Nothing of this chunk was stored, with it as `partial`: disk full, failing or gone, or
            the journal is closed. Appending may be tried again.
        """
        if not 0 <= chunk.first <= MAX_NUMBER - chunk.n:
            raise JournalFailed(
                f"{self.path.name}: a chunk of {chunk.stream} begins with sample {chunk.first}; "
                "samples count from 0 since the start of the stream",
                chunk,
            )
        self._settle(chunk)
        layout = self._layouts.get(chunk.stream)
        units = dict(chunk.units)
        data, number, fresh = b"", self._number, None
        if layout is None:
            layout = fresh = (len(self._layouts), chunk.stream, units)
            stream = {
                "number": layout[0],
                "name": chunk.stream,
                "channels": list(units),
                "units": list(units.values()),
            }
            payload = json_payload(stream, f"{self.path.name}: stream")
            data = head(FrameKind.STREAM, number, payload) + payload
            number += 1
        elif layout[2] != units:
            raise JournalFailed(
                f"{self.path.name}: stream {chunk.stream} began with {_listed(layout[2])} and now "
                f"has {_listed(units)}; give a stream of other channels another name",
                chunk,
            )
        columns = [chunk.channels[c] for c in layout[2]]
        payload = chunk_payload(layout[0], chunk.first, chunk.flags, columns)
        data += head(FrameKind.CHUNK, number, payload) + payload
        self._put(data, number + 1 - self._number, fresh, chunk)

    def note(self, content: Mapping[str, Any]) -> None:
        """Store an event: a trigger, a state of the air, an exception, a change of a setting.

        Parameters
        ----------
        content : mapping
            Plain values; the date and time are added.

        Raises
        ------
        JournalFailed
            It was not stored; see `append`.
        UnusableInput
            It holds more than plain values.
        """
        self._json(FrameKind.NOTE, {"utc": utc_now(), "note": dict(content)}, content)

    def close(self) -> None:
        """Write the end and let the disk write all of it; any number of times.

        Raises
        ------
        JournalFailed
            The end or the last seconds could not be written to the disk.
        """
        if self._handle is None:
            return
        try:
            self._json(FrameKind.END, {"utc": utc_now()}, None)
            os.fsync(self._handle)
        except OSError as error:
            raise self._failed(error, None) from error
        finally:
            self._shut()

    @property
    def closed(self) -> bool:
        """Whether it takes nothing more."""
        return self._handle is None

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it; an error on the way out of another one is dropped."""
        if error is None:
            self.close()
        else:
            with contextlib.suppress(JournalFailed):
                self.close()

    def _json(self, kind: FrameKind, content: dict[str, Any], partial: Any) -> None:
        payload = json_payload(content, f"{self.path.name}: note")
        self._settle(partial)
        self._put(head(kind, self._number, payload) + payload, 1, None, partial)

    def _put(self, data: bytes, records: int, layout: _Layout | None, partial: Any) -> None:
        """Hand bytes to the operating system, all or none of them."""
        if self._handle is None:
            raise self._closed(partial)
        self._pending = (self.size + len(data), self._number + records, layout)
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._handle, rest) :]
        except OSError as error:
            with contextlib.suppress(JournalFailed):
                self._settle(partial)
            raise self._failed(error, partial) from error
        self._settle(partial)

    def _settle(self, partial: Any) -> None:
        """Count what `_put` wrote, or take back what an exception (Ctrl-C, full disk) broke off."""
        if self._handle is None:
            raise self._closed(partial)
        try:
            if self._syncing is not None:
                self._syncing.check()
            if self._pending is None:
                return
            size, number, layout = self._pending
            if os.fstat(self._handle).st_size == size:
                self.size, self._number = size, number
                if layout is not None:
                    self._layouts[layout[1]] = layout
            else:
                os.ftruncate(self._handle, self.size)
            self._pending = None
        except OSError as error:
            raise self._failed(error, partial) from error

    def _failed(self, error: OSError, partial: Any) -> JournalFailed:
        return JournalFailed(
            f"{self.path.name}: {error.strerror or error}; the {self.size} bytes stored before are "
            "intact, free the disk or start another journal on another one",
            partial,
        )

    def _closed(self, partial: Any) -> JournalFailed:
        return JournalFailed(f"{self.path.name}: the journal is closed; start another", partial)

    def _shut(self) -> None:
        handle, self._handle = self._handle, None
        if self._syncing is not None:
            self._syncing.stop()
        if handle is not None:
            with contextlib.suppress(OSError):
                os.close(handle)


def _listed(units: Mapping[str, str]) -> str:
    return ", ".join(f"{c} [{u}]" for c, u in units.items())
