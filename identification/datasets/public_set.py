"""What a public data set is: its origin, its files, its named parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput, unknown_name

__all__ = ["RAW_FILES", "Original", "Parts", "Protocol", "PublicSet", "changed", "cut"]

RAW_FILES = "https://raw.githubusercontent.com"
"""Server of the files of public repositories."""


class Parts(NamedTuple):
    """What a loader returns.

    Parameters
    ----------
    train : mapping of str to Recording
        Records that may be fitted.
    tests : mapping of str to Recording
        Records that judge.
    own : bool
        The files do not allow the official parts.
    """

    train: Mapping[str, Recording]
    tests: Mapping[str, Recording]
    own: bool = False


@dataclass(frozen=True, slots=True)
class Original:
    """A file as its authors publish it.

    Parameters
    ----------
    repository, commit, path : str
        Where it is: `owner/name`, the full commit and the path in it.
    sha256 : str or None
        Of its bytes; None if it is not known, and then it is not downloaded.
    """

    repository: str
    commit: str
    path: str
    sha256: str | None = None

    @property
    def file(self) -> str:
        """Name of the file."""
        return self.path.rpartition("/")[2]

    def url(self, server: str = RAW_FILES) -> str:
        """Address of the file."""
        return f"{server.rstrip('/')}/{self.repository}/{self.commit}/{quote(self.path)}"


@dataclass(frozen=True, slots=True)
class PublicSet:
    """A public data set: what it is, where it is from, how it is read and parted.

    Parameters
    ----------
    name, title : str
        Key, and one line about the device.
    citation, licence : str
        Work to cite; what is known about the licence.
    folder : str
        Sub-folder of the recordings folder.
    files : tuple of tuple of str
        Groups of files that will do, best first; all of a group are needed.
    originals : tuple of Original
        The published files.
    loader : callable
        Paths of one group -> `Parts`, SI, canonical channel names.
    inputs, outputs : tuple of str
        Channels that drive and that respond.
    init : int
        Samples at the start of a test that may set the initial state and are not scored.
    official : str
        Which published protocol the parts follow if the files allow it; empty if there is none.
    note : str
        What a user must know about the parts.
    aliases : tuple of str
        Other names.
    """

    name: str
    title: str
    citation: str
    licence: str
    folder: str
    files: tuple[tuple[str, ...], ...]
    originals: tuple[Original, ...]
    loader: Callable[[tuple[Path, ...]], Parts]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    init: int = 0
    official: str = ""
    note: str = ""
    aliases: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Public source, as `repository @ commit : paths`."""
        texts: dict[str, list[str]] = {}
        for o in self.originals:
            texts.setdefault(f"{o.repository} @ {o.commit}", []).append(o.path)
        return "; ".join(f"{k} : {', '.join(v)}" for k, v in texts.items())

    def find(self, folder: Path) -> tuple[Path, ...] | None:
        """Return the first group of files that is whole under `folder`; None if there is none."""
        for group in self.files:
            paths = tuple(folder / self.folder / file for file in group)
            if all(p.is_file() for p in paths):
                return paths
        return None

    def read(self, paths: tuple[Path, ...]) -> Protocol:
        """Read the files of one group into the named parts.

        Raises
        ------
        UnusableInput
            A file is not what it should be.
        """
        return self.protocol(self.loader(paths))

    def protocol(self, parts: Parts) -> Protocol:
        """Join parts and description."""
        official = "" if parts.own else self.official
        told = {"citation": self.citation, "origin": self.source, "licence": self.licence}
        told["split"] = f"official: {official}" if official else "own"
        train = tuple(self._named(r, f"train/{k}", told) for k, r in parts.train.items())
        tests = {k: self._named(r, f"test/{k}", told) for k, r in parts.tests.items()}
        return Protocol(self, train, MappingProxyType(tests), official)

    def _named(self, recording: Recording, part: str, told: Mapping[str, str]) -> Recording:
        meta = {**recording.meta, **told}
        return replace(recording, name=f"{self.name}/{part}", meta=meta)


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """The records of a public data set, parted in those that fit and those that judge.

    Parameters
    ----------
    about : PublicSet
        Origin, channels, `init`, what is official.
    train : tuple of Recording
        Records that may be fitted.
    tests : mapping of str to Recording
        Records that judge, by name.
    official : str
        Which published protocol these parts follow exactly; empty if they are our own.
    """

    about: PublicSet
    train: tuple[Recording, ...]
    tests: Mapping[str, Recording]
    official: str

    @property
    def init(self) -> int:
        """Samples at the start of a test that are not scored."""
        return self.about.init

    def part(self, name: str) -> tuple[Recording, ...] | Mapping[str, Recording] | Recording:
        """Return `train` (tuple), `tests` (by name), or one test by its name.

        Raises
        ------
        UnknownName
            There is no such part.
        """
        if name == "train":
            return self.train
        if name == "tests":
            return self.tests
        if name in self.tests:
            return self.tests[name]
        raise unknown_name("part", name, self.about.name, ("train", "tests", *self.tests))

    def __repr__(self) -> str:
        """Return the parts and their sizes in one line."""
        tests = ", ".join(f"{k} {r.n}" for k, r in self.tests.items())
        train = " + ".join(str(r.n) for r in self.train)
        return f"Protocol({self.about.name!r}, train {train}, tests {tests})"


def cut(recording: Recording, start: int, stop: int) -> Recording:
    """Return samples `start` to `stop`, all of which must be there.

    Raises
    ------
    UnusableInput
        The record is too short.
    """
    if recording.n < stop:
        raise UnusableInput(
            f"{recording.name}: {recording.n} samples, {stop} are needed; get the whole record"
        )
    return recording.slice(start, stop)


def changed(
    recording: Recording, channels: Mapping[str, ArrayLike], units: Mapping[str, str], note: str
) -> Recording:
    """Return the recording with other values and a note that says so."""
    meta: dict[str, Any] = {**recording.meta, "notes": (*recording.notes, note)}
    values = {k: np.asarray(v, dtype=np.float64) for k, v in channels.items()}
    return replace(recording, channels=values, units=units, meta=meta)
