"""Public data sets by name, parted in records that fit and records that judge."""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import MappingProxyType

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.datasets.benchmark_sets import BENCHMARK_SETS
from identification.datasets.converted import is_converted, open_converted
from identification.datasets.machine_sets import MACHINE_SETS
from identification.datasets.places import FOLDER_VARIABLE, cache_folder, recordings_folder
from identification.datasets.public_set import Protocol, PublicSet

__all__ = ["SETS", "part", "protocol", "public_set", "set_available"]

SETS: Mapping[str, PublicSet] = MappingProxyType(
    {s.name: s for s in (*BENCHMARK_SETS, *MACHINE_SETS)}
)
"""All public data sets by name."""


def public_set(name: str) -> PublicSet:
    """Return the entry of a public data set.

    Parameters
    ----------
    name : str
        Its name or an alias.

    Returns
    -------
    PublicSet
        Origin, licence, files, channels, what is official.

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


def set_available(
    name: str,
    folder: str | os.PathLike[str] | None = None,
    *,
    cache: str | os.PathLike[str] | None = None,
) -> str:
    """Say where a set is: `folder`, `cache` (downloaded), or empty.

    Raises
    ------
    UnknownName
        If no set has this name.
    """
    entry, place = public_set(name), recordings_folder(folder)
    if place is not None and entry.find(place) is not None:
        return "folder"
    return "cache" if is_converted(entry, cache_folder(cache)) else ""


def protocol(
    name: str,
    folder: str | os.PathLike[str] | None = None,
    *,
    cache: str | os.PathLike[str] | None = None,
) -> Protocol:
    """Read a public data set into its parts.

    Parameters
    ----------
    name : str
        Name or alias, such as `"silverbox"`.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given. It goes first.
    cache : path, optional
        Folder of downloads; see `identification.datasets.download.fetch`.

    Returns
    -------
    Protocol
        `train`, `tests`, `init`; SI, canonical channel names.

    Raises
    ------
    UnknownName
        If no set has this name.
    UnusableInput
        If no file is there: the line names the variable, the source and the files.
    """
    entry, place = public_set(name), recordings_folder(folder)
    paths = entry.find(place) if place is not None else None
    if paths is not None:
        return entry.read(paths)
    kept = open_converted(entry, cache_folder(cache))
    if kept is not None:
        return kept
    group = " + ".join(f"{entry.folder}/{f}" for f in entry.files[-1][:3])
    more = " + ..." if len(entry.files[-1]) > 3 else ""
    state = f"{FOLDER_VARIABLE} is not set" if place is None else f"its files are not in {place}"
    raise UnusableInput(
        f"data set {entry.name!r}: {state}; get {entry.source} and set {FOLDER_VARIABLE} to the "
        f"folder that holds {group}{more}"
    )


def part(
    name: str, which: str, folder: str | os.PathLike[str] | None = None
) -> tuple[Recording, ...] | Mapping[str, Recording] | Recording:
    """Return one part of a set: `train`, `tests`, or one test by its name.

    Raises
    ------
    UnknownName, UnusableInput
        As `protocol` and `Protocol.part`.
    """
    return protocol(name, folder).part(which)
