"""The end of an acquisition: the recording appears whole beside its journal, or not at all.

A program killed at any step leaves the journal as it was. The recording is written under a hidden
temporary name and renamed when it is complete; a hidden ``.NAME.npz.*.part`` that a kill leaves
behind may be deleted.
"""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.support.errors import UnusableInput
from hardware.storage.errors import JournalFailed
from hardware.storage.journal import Journal
from hardware.storage.plain_fields import fields_of
from hardware.storage.provenance import KEY, ClockAlignment, Provenance, StreamOrigin
from hardware.storage.reading import JournalFile, open_journal
from hardware.storage.syncing import sync_folder

JOURNAL_ENDING = ".journal"


def new_files(target: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Return journal and recording for a new acquisition: NAME.journal and NAME.npz.

    To be asked before anything is driven.

    Parameters
    ----------
    target : path
        NAME or NAME.npz.

    Raises
    ------
    UnusableInput
        One of them exists, or the folder does not.
    """
    file = Path(target)
    archive = file if file.suffix.lower() == ".npz" else file.with_name(f"{file.name}.npz")
    journal = archive.with_suffix(JOURNAL_ENDING)
    if not archive.parent.is_dir():
        raise UnusableInput(f"{archive.parent}: there is no such folder; make it first")
    if archive.exists():
        raise UnusableInput(f"{archive}: exists; measurements are not overwritten, rename one")
    if journal.exists():
        raise UnusableInput(
            f"{journal}: exists without {archive.name}, an acquisition was broken off; make "
            f"recordings of it with {recovery(journal)}, or rename it"
        )
    return journal, archive


def recovery(journal: Path) -> str:
    """Return the command that makes recordings of a journal, as it is typed from here."""
    words = str(journal)
    typed = shlex.quote(words) if os.name == "posix" else subprocess.list2cmdline([words])
    return f"bondsight acquire --recover {typed}"


def journal_header(
    name: str,
    streams: Sequence[StreamOrigin],
    *,
    alignment: ClockAlignment | None = None,
    envelope: Mapping[str, Any] | None = None,
    watchdog: bool = False,
    command: Mapping[str, Any] | None = None,
    noise: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Return a header from which `recover` can make recordings.

    Parameters
    ----------
    name : str
        Name of the recording.
    streams : sequence of StreamOrigin
        Devices and nominal rates.
    alignment : ClockAlignment, optional
        What is known of the clocks beforehand, such as that they are one: ``"shared clock"``.
    envelope : mapping, optional
        Limits in force, plain values.
    watchdog : bool
        Whether the output parks itself when the program is gone.
    command : mapping, optional
        What was asked for, plain values.
    noise : mapping, optional
        Standard deviation of the noise of channels, SI, where it is known.
    """
    return {
        "name": name,
        "streams": [fields_of(s) for s in streams],
        "alignment": fields_of(alignment) if alignment else None,
        "envelope": dict(envelope or {}),
        "watchdog": watchdog,
        "command": dict(command or {}),
        "noise": dict(noise or {}),
    }


def finish(
    journal: Journal, target: str | os.PathLike[str], recording: Recording, provenance: Provenance
) -> Recording:
    """Close the journal and save the recording made of it.

    Parameters
    ----------
    journal : Journal
        With all raw samples; it is kept.
    target : path
        NAME.npz, in the folder of the journal.
    recording : Recording
        Aligned and corrected samples.
    provenance : Provenance
        Of this recording; name and SHA-256 of the journal are filled in.

    Returns
    -------
    Recording
        As saved and as `Recording.open` gives it back; `Provenance.of` and `flags_of` read it.

    Raises
    ------
    UnusableInput, JournalFailed
        One line; the journal is there and says how to go on.
    """
    file = Path(target)
    if file.resolve().parent != journal.path.resolve().parent:
        raise UnusableInput(
            f"{file}: raw data are kept beside the recording; save it in the folder of "
            f"{journal.path.name}"
        )
    try:
        journal.close()
        raw = open_journal(journal.path)
        stated = replace(
            provenance,
            journal=journal.path.name,
            journal_sha256=sha256_of(journal.path),
            started=provenance.started or raw.utc,
        )
        whole = with_provenance(recording, stated)
        whole.save(file)
    except (UnusableInput, JournalFailed, OSError) as error:
        raise type(error)(
            f"{error}; raw data are in {journal.path.name}, save them with bondsight acquire "
            f"--recover {journal.path.name}"
        ) from error
    sync_folder(file)
    return whole


def with_provenance(recording: Recording, provenance: Provenance) -> Recording:
    """Return a recording that carries its provenance.

    Raises
    ------
    UnusableInput
        The provenance is of another number of samples.
    """
    if provenance.samples != recording.n:
        raise UnusableInput(
            f"{recording.name}: provenance of {provenance.samples} samples for {recording.n}"
        )
    return replace(
        recording,
        source=provenance.journal,
        sha256=provenance.journal_sha256,
        meta={**recording.meta, KEY: provenance.to_plain()},
    )


def open_raw(path: str | os.PathLike[str]) -> JournalFile:
    """Open the raw data of a saved recording.

    Parameters
    ----------
    path : path
        The recording; its journal lies beside it.

    Raises
    ------
    UnusableInput
        The journal is gone or is another one.
    """
    file = Path(path)
    origin = Provenance.of(Recording.open(file))
    raw = file.with_name(Path(origin.journal).name or "journal")
    found = open_journal(raw)
    if sha256_of(raw) != origin.journal_sha256:
        raise UnusableInput(
            f"{raw.name}: is not the journal {file.name} was made of, its SHA-256 differs"
        )
    return found
