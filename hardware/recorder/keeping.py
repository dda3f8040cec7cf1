"""What is written down while something runs on a bench, whatever drives it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from hardware.contracts import Acquisition, Chunk, Flag
from hardware.errors import BeamLost, HardwareError, LinkLost, Overrun
from hardware.recorder.station import GuardedVoltage, Preparation
from hardware.storage import OUTPUT_ENDS, JournalFailed, recovery


class Notebook(Protocol):
    """Where chunks and events are written as they come."""

    def append(self, chunk: Chunk) -> None:
        """Write a chunk."""
        ...

    def note(self, event: Mapping[str, Any]) -> None:
        """Write an event."""
        ...


def write(journal: Notebook, chunks: Iterable[Chunk]) -> list[Chunk]:
    """Write chunks and return them."""
    written = []
    for chunk in chunks:
        journal.append(chunk)
        written.append(chunk)
    return written


def heard(
    journal: Notebook, sensor: Acquisition, source: Callable[[], Sequence[Chunk]]
) -> list[Chunk]:
    """Write what a sensor hands out; samples that it lost are told, and the take goes on.

    Only if nobody knows where they are missing the take ends: what follows has no time.
    """
    try:
        return write(journal, source())
    except Overrun as error:
        chunks = chunks_of(error.partial)
        if not any((c.flags & Flag.LOST_BEFORE).any() for c in chunks):
            raise
        error.partial = None
        journal.note({"event": "overrun", "stream": sensor.stream, "message": str(error)})
        return write(journal, chunks)


def note_air(preparation: Preparation, journal: Notebook, when: str) -> None:
    """Write the state of the air."""
    air = preparation.air()
    journal.note({"event": "air", "when": when, **({} if air is None else asdict(air))})


def keep(journal: Notebook, error: BaseException) -> None:
    """Write what an error carries, and the error; the journal itself may be what failed."""
    kind = type(error).__name__
    flags = Flag.BEAM_LOST if isinstance(error, BeamLost | LinkLost) else Flag.GOOD
    with contextlib.suppress(HardwareError):
        if isinstance(error, HardwareError):
            for chunk in chunks_of(error.partial):
                journal.append(chunk)
        journal.note({"event": "error", "kind": kind, "message": str(error), "flag": int(flags)})


def rescue(sensors: Iterable[Acquisition], journal: Notebook) -> None:
    """Write what sensors still hold after an error, once the output is safe."""
    for sensor in sensors:
        with contextlib.suppress(HardwareError):
            try:
                write(journal, sensor.finish())
            except HardwareError as error:
                write(journal, chunks_of(error.partial))


def chunks_of(partial: object) -> list[Chunk]:
    """Return the chunks that an error carries."""
    if isinstance(partial, Chunk):
        return [partial]
    if isinstance(partial, list | tuple):
        return [c for c in partial if isinstance(c, Chunk)]
    return []


@contextlib.contextmanager
def ended(journal: Notebook, path: Path, output: GuardedVoltage) -> Iterator[None]:
    """Write how the output ended; an error is told where the data are."""
    try:
        yield
    except BaseException as error:
        # the journal may be what failed; the first error is the one to tell
        with contextlib.suppress(JournalFailed):
            journal.note({"output_end": end_of(output)})
        error.add_note(str(output.provenance().get("status", "output unknown")))
        error.add_note(f"what had arrived is in {path}: {recovery(path)}")
        raise
    journal.note({"output_end": end_of(output)})


def end_of(output: GuardedVoltage) -> str:
    """Return the state of the output at the end, in the words that are stored."""
    state = str(output.provenance().get("state", "unknown")).lower()
    return state if state in OUTPUT_ENDS else "unknown"
