"""Keeping what was measured: a journal while it runs, a recording at the end."""

from hardware.storage.errors import JournalFailed
from hardware.storage.finishing import (
    finish,
    journal_header,
    new_files,
    open_raw,
    with_provenance,
)
from hardware.storage.flag_runs import FlagRun, flag_runs
from hardware.storage.journal import Journal
from hardware.storage.provenance import (
    OUTPUT_ENDS,
    ClockAlignment,
    Provenance,
    Scale,
    StreamOrigin,
    flags_of,
)
from hardware.storage.reading import JournalFile, Note, open_journal
from hardware.storage.recovering import recover, recovered
from hardware.storage.stream import StreamData, StreamGap, StreamLayout

__all__ = [
    "OUTPUT_ENDS",
    "ClockAlignment",
    "FlagRun",
    "Journal",
    "JournalFailed",
    "JournalFile",
    "Note",
    "Provenance",
    "Scale",
    "StreamData",
    "StreamGap",
    "StreamLayout",
    "StreamOrigin",
    "finish",
    "flag_runs",
    "flags_of",
    "journal_header",
    "new_files",
    "open_journal",
    "open_raw",
    "recover",
    "recovered",
    "with_provenance",
]
