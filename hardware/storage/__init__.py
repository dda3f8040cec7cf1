"""Keeping what was measured: a journal while it runs, a recording at the end."""

from hardware.storage.errors import JournalFailed as JournalFailed
from hardware.storage.finishing import finish as finish
from hardware.storage.finishing import journal_header as journal_header
from hardware.storage.finishing import new_files as new_files
from hardware.storage.finishing import open_raw as open_raw
from hardware.storage.finishing import recovery as recovery
from hardware.storage.finishing import with_provenance as with_provenance
from hardware.storage.flag_runs import FlagRun as FlagRun
from hardware.storage.flag_runs import flag_runs as flag_runs
from hardware.storage.journal import Journal as Journal
from hardware.storage.provenance import OUTPUT_ENDS as OUTPUT_ENDS
from hardware.storage.provenance import ClockAlignment as ClockAlignment
from hardware.storage.provenance import Provenance as Provenance
from hardware.storage.provenance import Scale as Scale
from hardware.storage.provenance import StreamOrigin as StreamOrigin
from hardware.storage.provenance import flags_of as flags_of
from hardware.storage.reading import JournalFile as JournalFile
from hardware.storage.reading import Note as Note
from hardware.storage.reading import open_journal as open_journal
from hardware.storage.recovering import recover as recover
from hardware.storage.recovering import recovered as recovered
from hardware.storage.stream import StreamData as StreamData
from hardware.storage.stream import StreamGap as StreamGap
from hardware.storage.stream import StreamLayout as StreamLayout
