"""Recordings from the journal of an acquisition that never came to its end."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import BondsightError, UnusableInput
from hardware.contracts import INSTANT, Air, Identity
from hardware.storage.finishing import with_provenance
from hardware.storage.pieces import Piece, joined, pieces
from hardware.storage.plain_fields import made_from
from hardware.storage.provenance import ClockAlignment, Provenance, StreamOrigin
from hardware.storage.reading import JournalFile, open_journal
from hardware.storage.stream import StreamData
from hardware.storage.syncing import sync_folder

MAX_PIECES = 100
OUTPUT = "output"


def recover(
    path: str | os.PathLike[str], rates: Mapping[str, float] | None = None
) -> tuple[Path, ...]:
    """Save what a journal holds as recordings beside it.

    Streams on one clock become NAME.npz; every other one becomes NAME-STREAM.npz with a time base
    of its own, also what carries its own instants, as a force gauge does. Where samples are
    missing or not finite a new recording begins (NAME-STREAM-2.npz): nothing is filled and nothing
    joined. The journal stays as it is.

    Parameters
    ----------
    path : path
        NAME.journal, in any state; damage within is stepped over. Of its notes those are
        understood whose ``event`` is "air" (with fields of `Air`), "alignment" (of
        `ClockAlignment`), "output" (``state``) or "error" (``message``), and ``output_end`` as in
        `Provenance`.
    rates : mapping of str to float, optional
        Rate (Hz) of a stream whose header does not tell.

    Returns
    -------
    tuple of Path
        The recordings.

    Raises
    ------
    UnusableInput
        One line: no journal, one that is still being written, or without a usable sample; or
        NAME.npz exists, so that nothing is to be recovered.
    """
    file = Path(path)
    journal = _opened(file)
    if journal.live:
        raise UnusableInput(f"{file.name}: a program is still writing it; wait for its end")
    whole = file.with_suffix(".npz")
    if whole.exists():
        raise UnusableInput(
            f"{whole}: exists, the acquisition of {file.name} came to its end; open that, or "
            "rename it first"
        )
    saved = []
    for suffix, recording in recovered(journal, rates):
        target = file.with_name(f"{file.stem}{suffix}.npz")
        recording.save(target)
        sync_folder(target)
        saved.append(target)
    return tuple(saved)


def _opened(file: Path) -> JournalFile:
    """Open a journal, behind its damage too if anything is there."""
    try:
        first = open_journal(file)
    except UnusableInput as error:
        try:
            return open_journal(file, beyond=True)
        except UnusableInput:
            raise error from None
    if not first.cut:
        return first
    further = open_journal(file, beyond=True)
    return further if further.size > first.size else first


def recovered(
    journal: JournalFile, rates: Mapping[str, float] | None = None
) -> tuple[tuple[str, Recording], ...]:
    """Return recordings of what a journal holds, and what to add to its name for each.

    Raises
    ------
    UnusableInput
        There is no usable sample.
    """
    origins = _origins(journal, dict(rates or {}))
    alignment = _stated(journal, "alignment", ClockAlignment) or ClockAlignment("none")
    data = {s: journal.read(s) for s in journal.streams}
    known = {s: origins[s].nominal_rate for s in data if s in origins}
    warnings = _warnings(journal, [s for s in data if s not in known])
    paced = {s: d for s, d in data.items() if _is_paced(s, d)}
    pace = {known.get(s) for s in paced}
    one_clock = alignment.method == "shared clock" and len(pace) == 1 and None not in pace
    found: list[tuple[str, Piece]] = []
    if one_clock and len(paced) > 1:
        found += [("", p) for p in pieces(joined(paced))]
    alone = known if not found else [s for s in known if s not in paced]
    # two clocks, or one stream without a sample of the other: each by itself
    for stream in alone:
        suffix = "-" + re.sub(r"[^A-Za-z0-9_.-]", "_", stream)
        found += [(suffix, p) for p in pieces({stream: data[stream]})]
    if not found:
        raise UnusableInput(
            f"{journal.path.name}: holds no usable sample; {' '.join(warnings) or 'none arrived'}"
        )
    digest = sha256_of(journal.path)
    counts: dict[str, int] = {}
    out: list[tuple[str, Recording]] = []
    for suffix, piece in _longest(found, warnings):
        counts[suffix] = counts.get(suffix, 0) + 1
        end = suffix + (f"-{counts[suffix]}" if counts[suffix] > 1 else "")
        streams = tuple(
            replace(origins[s], samples=data[s].n, lost=data[s].lost) for s in piece.streams
        )
        provenance = Provenance(
            piece.n,
            piece.first / streams[0].nominal_rate,
            streams[0].nominal_rate,
            streams,
            output_end=_output_end(journal),
            alignment=alignment,
            air=_stated(journal, "air", Air),
            envelope=_mapping(journal.header.get("envelope")),
            flags=piece.flags,
            warnings=(*warnings, *piece.remarks),
            started=journal.utc,
            journal=journal.path.name,
            journal_sha256=digest,
            software=journal.software,
        )
        out.append((end, with_provenance(_recording(journal, end, piece, provenance), provenance)))
    return tuple(out)


def _is_paced(stream: str, data: StreamData) -> bool:
    """Whether its numbers are those of the output.

    What has instants of its own was read now and then, and of what has lost its names nobody knows.
    """
    return stream == OUTPUT or (data.layout.named and INSTANT not in data.channels)


def _recording(journal: JournalFile, end: str, piece: Piece, origin: Provenance) -> Recording:
    name = journal.header.get("name")
    name = (name if isinstance(name, str) and name else journal.path.stem) + end
    units = {k: parse_unit(u, f"{name}, channel {k!r}") for k, u in piece.units.items()}
    stated = journal.header.get("noise")
    known = stated if isinstance(stated, Mapping) else {}
    noise = {k: v for k, v in known.items() if k in units and isinstance(v, float)}
    notes = ("recovered from a journal; raw values on nominal rates", *origin.warnings)
    return Recording(
        name,
        (piece.first + np.arange(piece.n)) / origin.rate,
        {k: units[k].to_si(v) for k, v in piece.channels.items()},
        {k: u.si for k, u in units.items()},
        meta={"notes": notes, **({"noise": noise} if noise else {})},
    )


def _origins(journal: JournalFile, rates: dict[str, float]) -> dict[str, StreamOrigin]:
    """Who measured what, as far as the header and the user tell."""
    stated = journal.header.get("streams")
    found = {}
    for content in stated if isinstance(stated, list | tuple) else ():
        try:
            origin = made_from(StreamOrigin, content, "stream")
        except BondsightError:
            continue
        found[origin.stream] = origin
    for stream, rate in rates.items():
        known = found.get(stream, StreamOrigin(stream, Identity(), rate))
        found[stream] = replace(known, nominal_rate=float(rate))
    return {s: o for s, o in found.items() if 0.0 < o.nominal_rate < np.inf}


def _stated(journal: JournalFile, key: str, kind: type[Any]) -> Any:
    """Return what the last note of an event says, else what the header says; None if neither."""
    for content in (*reversed(_events(journal, key)), journal.header.get(key)):
        fields = {f.name for f in dataclasses.fields(kind)}
        try:
            given = {k: v for k, v in _mapping(content).items() if k in fields}
            return made_from(kind, given, key)
        except BondsightError:
            continue
    return None


def _events(journal: JournalFile, event: str) -> list[dict[str, Any]]:
    """Return notes of a kind of event, in their order."""
    return [_mapping(n.content) for n in journal.notes if n.content.get("event") == event]


def _output_end(journal: JournalFile) -> str:
    """State of the output as last noted; one left driven by a program that is gone is unknown."""
    said = [
        n.content.get("output_end", n.content.get("state"))
        for n in journal.notes
        if n.content.get("event") == "output" or "output_end" in n.content
    ]
    return str(said[-1]) if said and said[-1] in ("parked", "none") else "unknown"


def _mapping(value: Any) -> dict[str, Any]:
    return dict(value) if isinstance(value, Mapping) else {}


def _warnings(journal: JournalFile, without_rate: list[str]) -> list[str]:
    out = []
    if journal.cut:
        out.append(f"journal: {journal.cut}")
    elif not journal.closed:
        out.append("journal: its program ended without closing it; everything stored is there")
    if _output_end(journal) == "unknown":
        out.append(
            "output: its state at the end is unknown"
            + (", its device has a watchdog" if journal.header.get("watchdog") is True else "")
        )
    out += [f"error: {e.get('message')}" for e in _events(journal, "error")]
    for stream in without_rate:
        out.append(f"stream {stream}: left out, its rate is not known; give rates")
    return out


def _longest(found: list[tuple[str, Piece]], warnings: list[str]) -> list[tuple[str, Piece]]:
    """Return at most so many pieces as anyone looks at, in their order."""
    if len(found) <= MAX_PIECES:
        return found
    least = sorted((p.n for _, p in found), reverse=True)[MAX_PIECES - 1]
    kept = [f for f in found if f[1].n >= least][:MAX_PIECES]
    warnings.append(
        f"{len(found)} pieces between gaps: the {len(kept)} longest were kept, all are in the "
        "journal"
    )
    return kept
