"""From a name, or a file, to a recording whose channels fit a model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Sensor, Source
from bondgraph.signals.files.checks import means_time
from bondgraph.signals.files.columns import OTHERS
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.datasets.catalogue import KNOWN, load, names


def open_recording(
    text: str, graph: BondGraph, mapping: Mapping[str, str] | None = None, **reading: Any
) -> tuple[Recording, Split | None, tuple[str, ...]]:
    """Read a file or a known recording and match its channels to the model.

    Channels are matched by name, then by `mapping` (name -> column), then by unit where exactly one
    channel with that unit is left. `reading` goes to `Recording.read`.

    Returns
    -------
    recording, split (None for the default rule), sentences about automatic matches
    """
    mapping = dict(mapping or {})
    names_of_model = [e.name for e in graph.of_type(Source, Sensor)]
    for name in mapping:
        if name not in names_of_model and not means_time(name):
            raise unknown_name("source or sensor", name, graph.name, names_of_model)
    split = None
    if text and (Path(text).exists() or Path(text).suffix):
        recording = _read(Path(text), mapping, reading)
    elif text in names() or any(text in k.aliases for k in KNOWN.values()):
        if reading:
            raise UnusableInput(
                f"{text} is a known recording and read as its origin says; leave out "
                f"{', '.join('--' + n for n in reading)}"
            )
        recording, split = load(text)
        if mapping:
            recording = recording.select({OTHERS: OTHERS, **mapping})
    else:
        error = unknown_name("recording", text, "the known ones", names())
        raise UnusableInput(f"{error}; nor is there a file of that name")
    recording, said = match_by_unit(recording, graph)
    return recording, split, said


def _read(path: Path, mapping: Mapping[str, str], reading: Mapping[str, Any]) -> Recording:
    """Read a file with all its channels, those of `mapping` under their new names.

    Where some other column cannot be read (no unit, no number), only the mapped ones are taken.
    """
    if not mapping:
        return Recording.read(path, **reading)
    try:
        return Recording.read(path, map={**mapping, OTHERS: OTHERS}, **reading)
    except UnusableInput:
        return Recording.read(path, map=mapping, **reading)


def match_by_unit(recording: Recording, graph: BondGraph) -> tuple[Recording, tuple[str, ...]]:
    """Give channels the names the model uses where their unit leaves one possibility."""
    wanted = [e for e in graph.of_type(Source, Sensor)]
    open_names = [e for e in wanted if e.name not in recording.channels]
    free = [n for n in recording.channels if n not in {e.name for e in wanted}]
    said, renamed = [], {}
    for e in open_names:
        if not e.unit:
            continue
        same = [n for n in free if _same_unit(recording.units[n], e.unit)]
        rivals = [o for o in open_names if o.unit and _same_unit(o.unit, e.unit)]
        if len(same) == 1 and len(rivals) == 1:
            renamed[same[0]] = e.name
            said.append(f"channel {same[0]} is taken as {e.name} (the only one in {e.unit})")
    if not renamed:
        return recording, ()
    table = {renamed.get(n, n): n for n in recording.channels}
    return recording.select(table), tuple(said)


def _same_unit(a: str, b: str) -> bool:
    try:
        return parse_unit(a).same_dimension(parse_unit(b))
    except UnusableInput:
        return a == b
