"""From a name, or a file, to a recording whose channels fit a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.binding import external_signals
from bondgraph.graph.elements import Modulated, Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import map_argument, means_time, require_map
from bondgraph.signals.files.columns import OTHERS, NoUnit, TurnedRound, is_time
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.units import same_dimension, split_header
from bondgraph.support.errors import BondsightError, UnusableInput, nearest, unknown_name
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
    require_map(mapping)
    mapping = dict(mapping or {})
    recorded = {e.name: e for e in _recorded(graph)}
    for name in mapping:
        if isinstance(graph.elements.get(name), Modulated):
            raise UnusableInput(
                f"{map_argument(name, mapping[name])}: {name} has no channel, the model "
                f"{graph.name} gives its value; map one of {', '.join(recorded)}"
            )
        known = (*recorded, *external_signals(graph))
        if name not in known and not means_time(name):
            if mapping[name] in known and name in _channels(text, reading):
                raise UnusableInput(
                    f"{map_argument(name, mapping[name])}: {mapping[name]} is the name in "
                    f"{graph.name}; turn it round, {map_argument(mapping[name], name)}"
                )
            raise unknown_name("source or sensor", name, graph.name, known)
    split = None
    called = text in names() or any(text in k.aliases for k in KNOWN.values())
    if _is_file(text, called):
        try:
            recording = _read(Path(text), mapping, graph, reading)
        except NoUnit as lacking:
            raise UnusableInput(_without_unit(lacking, mapping, graph)) from None
        except TurnedRound as turned:
            if turned.target in recorded or means_time(turned.target):
                raise
            raise turned.error from None  # the model has no such name either
    elif called:
        if reading:
            raise UnusableInput(
                f"{text} is a known recording and read as its origin says; leave out "
                f"{', '.join(n + '=' for n in reading)}"
            )
        recording, split = load(text)
        if mapping:
            recording = recording.select({OTHERS: OTHERS, **mapping})
    else:
        error = unknown_name("recording", text, "the known ones", names())
        raise UnusableInput(f"{error}; nor is there a file of that name")
    for name, column in mapping.items():
        if name in recorded:
            _require_dimension(recorded[name], column, recording, mapping)
    recording, said = match_by_unit(recording, graph)
    return recording, split, said


def _is_file(text: str, called: bool) -> bool:
    """Whether a text means a file; a folder called as a known recording does not hide it."""
    path = Path(text)
    return bool(text) and (path.is_file() or bool(path.suffix) or (path.exists() and not called))


def _channels(text: str, reading: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the channels of a file that can be read as it is."""
    try:
        return tuple(Recording.read(Path(text), **reading).channels)
    except (BondsightError, OSError):
        return ()


def _recorded(graph: BondGraph) -> list[Source | Sensor]:
    """Return what a recording has channels for: no source that the model drives itself."""
    return [e for e in graph.of_type(Source, Sensor) if not isinstance(e, Modulated)]


def _without_unit(error: NoUnit, mapping: Mapping[str, str], graph: BondGraph) -> str:
    """Return the line on a column without unit, with a name of the model and its unit."""
    asked = [n for n, c in mapping.items() if c.strip() == error.column]
    left = _left({}, (), graph) if asked else _left(mapping, error.beside, graph)
    if not left:
        return str(error)
    name = [*asked, *nearest(error.column, left), *left][0]
    others = [f"{n} [{u}]" for n, u in left.items() if n != name]
    also = f"; other names of {graph.name}: {', '.join(others)}" if others and not asked else ""
    return error.said(name, left.get(name, "s")) + also


def _left(mapping: Iterable[str], beside: Sequence[str], graph: BondGraph) -> dict[str, str]:
    """Return names of the model without a column, with their units."""
    taken = {*mapping, *_taken(beside, graph)}
    return {e.name: e.unit or "1" for e in _recorded(graph) if e.name not in taken}


def _taken(headers: Sequence[str], graph: BondGraph) -> set[str]:
    """Return the names of the model that columns with a unit are taken for."""
    units = dict(split_header(h) for h in headers if not is_time(h))
    known = {base: unit for base, unit in units.items() if unit}
    recorded = _recorded(graph)
    return {e.name for e in recorded if e.name in units} | {*_by_unit(known, recorded).values()}


def _require_dimension(
    e: Source | Sensor, column: str, recording: Recording, mapping: Mapping[str, str]
) -> None:
    """Refuse a column that the map gives to a channel in another unit, as the header has it."""
    unit = recording.units[e.name]
    if not (e.unit and unit) or same_dimension(unit, e.unit):
        return
    alike = (n for n, u in recording.units.items() if n != e.name and same_dimension(u, e.unit))
    others = [split_header(mapping.get(n, n))[0] for n in alike]
    better = f"; in {e.unit} is {' and '.join(others)}" if others else f"; none is in {e.unit}"
    raise UnusableInput(
        f"{map_argument(e.name, column)}: {e.name} is in {e.unit}, that column of "
        f"{recording.name} in {split_header(column)[1] or unit}{better}"
    )


def _read(
    path: Path, mapping: Mapping[str, str], graph: BondGraph, reading: Mapping[str, Any]
) -> Recording:
    """Read a file; columns without a unit are left out where all names of the model are taken."""
    try:
        return Recording.read(path, mapping or None, **reading)
    except NoUnit as lacking:
        if mapping or _left({}, lacking.beside, graph):
            raise
        return Recording.read(path, {OTHERS: OTHERS}, **reading)


def match_by_unit(recording: Recording, graph: BondGraph) -> tuple[Recording, tuple[str, ...]]:
    """Give channels the names the model uses where their unit leaves one possibility.

    The recording notes what was matched so.
    """
    renamed = _by_unit({n: recording.units[n] for n in recording.channels}, _recorded(graph))
    if not renamed:
        return recording, ()
    unit = {e.name: e.unit for e in _recorded(graph)}
    said = tuple(
        f"channel {n} is taken as {e} (the only one in {unit[e]})" for n, e in renamed.items()
    )
    table = {renamed.get(n, n): n for n in recording.channels}
    made = recording.select(table)
    return replace(made, meta={**made.meta, "notes": (*made.notes, *said)}), said


def _by_unit(units: Mapping[str, str], wanted: Sequence[Source | Sensor]) -> dict[str, str]:
    """Return column -> name of the model, where the unit leaves one of either.

    Not of a command beside another one of its dimension that is there by name: what is left then is
    more likely a reading, and one that acts as a command tells nothing but nonsense.
    """
    named = [e for e in wanted if e.name in units and e.unit]

    def lacking(e: Source | Sensor) -> bool:
        beside = (o for o in named if isinstance(o, Source) and same_dimension(o.unit, e.unit))
        return isinstance(e, Source) and any(beside)

    open_names = [e for e in wanted if e.name not in units and e.unit and not lacking(e)]
    free = [n for n in units if n not in {e.name for e in wanted}]
    found = {}
    for e in open_names:
        same = [n for n in free if same_dimension(units[n], e.unit)]
        rivals = [o for o in open_names if same_dimension(o.unit, e.unit)]
        if len(same) == 1 and len(rivals) == 1:
            found[same[0]] = e.name
    return found
