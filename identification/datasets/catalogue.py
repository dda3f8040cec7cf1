"""The catalogue of public data sets: by name, parted; none is part of this project.

Every entry names its public source; files are read from the folder in the environment variable
`BONDSIGHT_RECORDINGS`, one sub-folder per source.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name
from identification.datasets.benchmark_sets import BENCHMARK_SETS
from identification.datasets.machine_sets import MACHINE_SETS
from identification.datasets.places import FOLDER_VARIABLE, originals_folder, recordings_folder
from identification.datasets.public_set import Protocol, PublicSet, SetPart

Folder = str | os.PathLike[str] | None


class LoadedRecording(NamedTuple):
    """A recording and the samples that fit and judge.

    Parameters
    ----------
    recording : Recording
        SI channels under canonical names.
    split : Split
        Train, held-out and rest samples.
    """

    recording: Recording
    split: Split


class KnownRecording(NamedTuple):
    """A part of a public data set that is diagnosed by name, with a split of its own.

    Parameters
    ----------
    set : PublicSet
        Source, licence, citation, channels.
    part : SetPart
        Samples and rule of the split.
    """

    set: PublicSet
    part: SetPart

    @property
    def title(self) -> str:
        """One line about the recording."""
        return self.part.title or self.set.title

    @property
    def files(self) -> tuple[str, ...]:
        """File names that will do, best first."""
        return tuple(group[0] for group in self.set.files if len(group) == 1)

    @property
    def aliases(self) -> tuple[str, ...]:
        """Other names: ``set/part``, and those of the set if it is its first such part."""
        sets = (self.set.name, *self.set.aliases)
        first = next(p for p in self.set.parts if p.called) is self.part
        every = (*(f"{s}/{self.part.name}" for s in sets), *(sets if first else ()))
        return tuple(n for n in every if n != self.part.called)

    def find(self, folder: Path) -> Path | None:
        """Return the first of the files that exists under `folder`; None if there is none."""
        paths = (folder / self.set.folder / file for file in self.files)
        return next((p for p in paths if p.is_file()), None)


SETS: Mapping[str, PublicSet] = MappingProxyType(
    {s.name: s for s in (*BENCHMARK_SETS, *MACHINE_SETS)}
)
"""All public data sets by name."""

KNOWN: Mapping[str, KnownRecording] = MappingProxyType(
    {p.called: KnownRecording(s, p) for s in SETS.values() for p in s.parts if p.called}
)
"""All recordings that are diagnosed by name."""


def names() -> tuple[str, ...]:
    """Names of the known recordings, aliases left out."""
    return tuple(KNOWN)


def about(name: str) -> KnownRecording:
    """Return a known recording: its set and its part, by its name or an alias.

    Raises
    ------
    UnknownName
        If no recording has this name.

    Examples
    --------
    >>> about("daisy-mechatronics/hair_dryer").part.called
    'hair_dryer'
    """
    for called, known in KNOWN.items():
        if name == called or name in known.aliases:
            return known
    raise unknown_name("known recording", name, "identification.datasets", KNOWN)


def available(name: str, folder: Folder = None, *, cache: Folder = None) -> bool:
    """Whether a file of a known recording is in the folder or was fetched: `load` will find it.

    Parameters and errors as `load`.
    """
    return _file_of(about(name), folder, cache) is not None


def _file_of(known: KnownRecording, folder: Folder, cache: Folder) -> Path | None:
    """Return its file in the folder of the user, else as it was downloaded."""
    places = (recordings_folder(folder), originals_folder(cache))
    found = (known.find(p) for p in places if p is not None)
    return next((f for f in found if f is not None), None)


def load(name: str, folder: Folder = None, *, cache: Folder = None) -> LoadedRecording:
    """Read a known recording and its split.

    Parameters
    ----------
    name : str
        Name or alias, such as `"emps"`.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given. It goes first.
    cache : path, optional
        Folder of downloads; see `identification.datasets.download.fetch`.

    Returns
    -------
    LoadedRecording
        `(recording, split)`; SI, canonical channel names.

    Raises
    ------
    UnknownName
        If no recording has this name.
    UnusableInput
        If the file is not there: the line names the variable, the source and the file.

    Examples
    --------
    >>> from bondsight import BondsightError
    >>> try:
    ...     load("silverbax")
    ... except BondsightError as error:
    ...     print(error)
    no known recording 'silverbax' in identification.datasets. Did you mean 'silverbox' ...
    """
    known, place = about(name), recordings_folder(folder)
    entry, own = known
    path = _file_of(known, folder, cache)
    if path is None:
        files = " or ".join(f"{entry.folder}/{f}" for f in known.files)
        state = f"{FOLDER_VARIABLE} is not set" if place is None else f"no such file in {place}"
        raise _absent(f"recording {own.called!r}", state, entry, files)
    read = own.cut(entry.records((path,)))
    meta = {**read.meta, "citation": entry.citation, "origin": entry.source}
    recording = replace(read, name=own.called, meta=meta)
    return LoadedRecording(recording, own.split(recording))


def public_set(name: str) -> PublicSet:
    """Return the entry of a public data set, by its name or an alias.

    Raises
    ------
    UnknownName
        If no set has this name.

    Examples
    --------
    >>> public_set("silverbox").init
    50
    """
    for entry in SETS.values():
        if name == entry.name or name in entry.aliases:
            return entry
    raise unknown_name("public data set", name, "identification.datasets", SETS)


def set_available(name: str, folder: Folder = None, *, cache: Folder = None) -> str:
    """Say where a set is: `folder`, `cache` (downloaded), or empty.

    Raises
    ------
    UnknownName
        If no set has this name.
    """
    entry, place = public_set(name), recordings_folder(folder)
    if place is not None and entry.find(place) is not None:
        return "folder"
    return "cache" if entry.find(originals_folder(cache)) is not None else ""


def protocol(name: str, folder: Folder = None, *, cache: Folder = None) -> Protocol:
    """Read a public data set into its parts: `train`, `tests`, `init`.

    Parameters, units and errors as `load`.
    """
    entry, place = public_set(name), recordings_folder(folder)
    found = protocol_here(entry, folder, cache)
    if found is not None:
        return found
    group = " + ".join(f"{entry.folder}/{f}" for f in entry.files[-1][:3])
    more = " + ..." if len(entry.files[-1]) > 3 else ""
    state = f"{FOLDER_VARIABLE} is not set" if place is None else f"its files are not in {place}"
    raise _absent(f"data set {entry.name!r}", state, entry, group + more)


def protocol_here(entry: PublicSet, folder: Folder, cache: Folder) -> Protocol | None:
    """Return a set from the folder of the user, else as downloaded; None if it is in neither."""
    place = recordings_folder(folder)
    if place is not None and (paths := entry.find(place)) is not None:
        return entry.read(paths)
    if (paths := entry.find(originals_folder(cache))) is None:
        return None
    try:
        return entry.read(paths)
    except BondsightError as error:
        raise UnusableInput(
            f"{paths[0].parent}: the downloaded set cannot be opened ({error}); delete the folder "
            "and fetch again"
        ) from error


def _absent(what: str, state: str, entry: PublicSet, files: str) -> UnusableInput:
    return UnusableInput(
        f"{what}: {state}; get {entry.source} and set {FOLDER_VARIABLE} to the folder that holds "
        f"{files}"
    )
