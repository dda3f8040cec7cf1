"""TDMS files of LabVIEW and its relatives: channels `group/channel` with units and time steps."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import optional, readable
from bondgraph.signals.files.columns import ColumnTable
from bondgraph.signals.files.stored import StoredArray, pick_stored
from bondgraph.support.errors import UnusableInput

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "units")
_MAGIC = b"TDSm"


def read_tdms(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read the needed channels of a TDMS file.

    The time step is the property `wf_increment`, the first time `wf_start_offset` (zero if it is
    not there); a channel called `t` or `time` in the same group goes before them.
    """
    where = file.name
    with open(file, "rb") as stream:
        if stream.read(4) != _MAGIC:
            raise UnusableInput(f"{where}: this is no TDMS file; export the recording again")
    nptdms = optional("nptdms", "read of .tdms", "files")
    # its warnings go to the terminal; what matters becomes a note or an error here
    manager = optional("nptdms.log", "read of .tdms", "files").log_manager
    level = manager.log_level
    manager.set_level(logging.CRITICAL)
    try:
        with readable(where, "TDMS"):
            # a stream of ours is closed whatever happens
            with open(file, "rb") as stream, nptdms.TdmsFile.open(stream) as opened:
                found = list(_channels(opened))
                cut = _is_cut(opened)
                if cut and not any(s.shape and s.shape[0] for s in found if not s.refusal):
                    raise UnusableInput(f"{where}: the file is cut off; copy it again")
                table = pick_stored(found, map, fs, where)
    finally:
        manager.set_level(level)
    if cut:
        note = "the file is cut off in its last segment; what is whole was read"
        return replace(table, notes=(*table.notes, note))
    return table


def _is_cut(opened: Any) -> bool:
    return bool(getattr(opened.file_status, "incomplete_final_segment", False))


def _channels(opened: Any) -> Iterator[StoredArray]:
    for group in opened.groups():
        for channel in group.channels():
            path = f"{group.name}/{channel.name}"
            kind = np.dtype(channel.dtype).kind if channel.dtype is not None else ""
            if kind not in set("biufM"):
                yield StoredArray(path, (), partial(np.zeros, 0), refusal="no channel of numbers")
                continue
            properties = channel.properties
            step = _number(properties.get("wf_increment"))
            yield StoredArray(
                path,
                (len(channel),),
                partial(_values, channel),
                unit=_unit(properties),
                start=_number(properties.get("wf_start_offset")) or 0.0,
                step=step if step is not None and step > 0.0 else None,
            )


def _values(channel: Any) -> NDArray[Any]:
    return np.asarray(channel[:])


def _unit(properties: Mapping[str, Any]) -> str:
    texts = (properties.get(k) for k in _UNITS)
    return next((t.strip() for t in texts if isinstance(t, str) and t.strip()), "")


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None
