"""What a public data set is: its origin, its files, its named parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.signals.files.columns import OTHERS
from bondgraph.signals.recording import Recording, Split, default_split
from bondgraph.signals.split import whole
from bondgraph.support.errors import UnknownName, UnusableInput, require_known

Records = Mapping[str, Recording]

RAW_FILES = "https://raw.githubusercontent.com"
"""Server of the files of public repositories."""


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
class Columns:
    """Where one record lies in a file.

    Parameters
    ----------
    file : str
        Its name.
    plan : mapping of str to str
        Channel -> column, as `Recording.read` takes it.
    fs : float or None
        Sampling rate if the file does not tell it, Hz.
    record : str
        Name of the record; empty if it is the only one.
    """

    file: str
    plan: Mapping[str, str]
    fs: float | None = None
    record: str = ""


@dataclass(frozen=True, slots=True)
class SetPart:
    """Samples of one record of a set, by name.

    Parameters
    ----------
    name : str
        ``train/...`` fits and ``test/...`` judges under the set's protocol; any other name is a
        record to be diagnosed, with a split of its own.
    record : str
        The record it is cut from.
    start, stop : int or Fraction or None
        Samples, as counts or as a share of the record; None for the end.
    held : float
        Share that is held out by `default_split`; a train or test part is that side of it.
    drive : str or None
        Input whose rest and periods set the split.
    called : str
        Name on the command line; empty if it has none.
    title : str
        One line, if the set's does not do.
    """

    name: str
    record: str = ""
    start: int | Fraction = 0
    stop: int | Fraction | None = None
    held: float = 0.0
    drive: str | None = None
    called: str = ""
    title: str = ""

    @property
    def side(self) -> str:
        """`train`, `test`, or empty for a record with a split of its own."""
        return self.name.rpartition("/")[0]

    def split(self, recording: Recording) -> Split:
        """Split by the declared rule."""
        return default_split(recording, self.held, drive=self.drive)

    def cut(self, records: Records) -> Recording:
        """Cut the part from its record, all of whose samples must be there.

        Raises
        ------
        UnusableInput
            The record is too short.
        """
        recording = records[self.record]
        start, stop = (_sample(at, recording.n) for at in (self.start, self.stop))
        if self.held and self.side:
            samples = whole(getattr(self.split(recording), self.side))
            start, stop = samples.start, samples.stop
        if recording.n < stop:
            raise UnusableInput(
                f"{recording.name}: {recording.n} samples, {stop} are needed; get the whole record"
            )
        return recording.slice(start, stop)


def _sample(at: int | Fraction | None, n: int) -> int:
    """Return a place in a record of `n` samples; a share is rounded up."""
    return n if at is None else at if isinstance(at, int) else n - int(n * (1 - at))


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
    layouts : tuple of tuple of Columns
        Groups of records that will do, best first; all files of a group are needed.
    originals : tuple of Original
        The published files.
    inputs, outputs : tuple of str
        Channels that drive and that respond.
    parts : tuple of SetPart
        Named samples; of a set with `official` they follow it.
    init : int
        Samples at the start of a test that may set the initial state and are not scored.
    official : str
        Which published protocol the parts follow if the files allow it; empty if there is none.
    note : str
        What a user must know about the parts.
    aliases : tuple of str
        Other names; the folder if none is given.
    otherwise : tuple of SetPart
        Our own parts if the files do not hold the records of `parts`; if they do not hold those
        of either, the records are parts by their names.
    reader : callable, optional
        Paths of one group -> records by name, in place of their columns.
    prepare : callable, optional
        Records as read -> records in SI under canonical channel names.
    """

    name: str
    title: str
    citation: str
    licence: str
    folder: str
    layouts: tuple[tuple[Columns, ...], ...]
    originals: tuple[Original, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parts: tuple[SetPart, ...]
    init: int = 0
    official: str = ""
    note: str = ""
    aliases: tuple[str, ...] = ()
    otherwise: tuple[SetPart, ...] = ()
    reader: Callable[[tuple[Path, ...]], Records] | None = None
    prepare: Callable[[Records], Records] | None = None

    def __post_init__(self) -> None:
        """Answer to the folder's name."""
        if not self.aliases and self.folder != self.name:
            object.__setattr__(self, "aliases", (self.folder,))

    @property
    def files(self) -> tuple[tuple[str, ...], ...]:
        """Groups of files that will do, best first."""
        return tuple(dict.fromkeys(_files(layout) for layout in self.layouts))

    @property
    def source(self) -> str:
        """Public source, as `repository @ commit : paths`."""
        texts: dict[str, list[str]] = {}
        for o in self.originals:
            texts.setdefault(f"{o.repository} @ {o.commit}", []).append(o.path)
        return "; ".join(f"{k} : {', '.join(v)}" for k, v in texts.items())

    @property
    def published(self) -> tuple[Original, ...]:
        """Published files that make up one of the groups that are read; none if none is."""
        table = {o.file: o for o in self.originals}
        groups = (g for g in self.files if all(f in table for f in g))
        return tuple(table[f] for f in next(groups, ()))

    def find(self, folder: Path) -> tuple[Path, ...] | None:
        """Return the first group of files that is whole under `folder`; None if there is none."""
        for group in self.files:
            paths = tuple(folder / self.folder / file for file in group)
            if all(p.is_file() for p in paths):
                return paths
        return None

    def records(self, paths: tuple[Path, ...]) -> Records:
        """Read the files of one group.

        Raises
        ------
        UnusableInput
            A file is not what it should be.
        """
        found = self._columns(paths) if self.reader is None else self.reader(paths)
        return found if self.prepare is None else self.prepare(found)

    def _columns(self, paths: tuple[Path, ...]) -> Records:
        """Read by the first layout of these files whose columns are there."""
        places = {p.name: p for p in paths}
        fault: UnknownName | None = None
        for layout in self.layouts:
            if _files(layout) == tuple(places):
                try:
                    return {
                        c.record: Recording.read(places[c.file], {**c.plan, OTHERS: ""}, fs=c.fs)
                        for c in layout
                    }
                except UnknownName as error:
                    fault = fault or error
        raise fault or UnusableInput(f"{self.name}: {', '.join(places)} are not files of this set")

    def read(self, paths: tuple[Path, ...]) -> Protocol:
        """Read the files of one group into the parts that train and test.

        Raises
        ------
        UnusableInput
            A file is not what it should be.
        """
        records = self.records(paths)
        declared = (
            p for p in (self.parts, self.otherwise) if {c.record for c in p} == set(records)
        )
        parts = next(declared, tuple(SetPart(name, name) for name in records))
        official = self.official if parts is self.parts else ""
        told = {"citation": self.citation, "origin": self.source, "licence": self.licence}
        told["split"] = f"official: {official}" if official else "own"
        sides: dict[str, dict[str, Recording]] = {"train": {}, "test": {}}
        for p in (p for p in parts if p.side in sides):
            cut = p.cut(records)
            named = replace(cut, name=f"{self.name}/{p.name}", meta={**cut.meta, **told})
            sides[p.side][p.name.removeprefix(f"{p.side}/")] = named
        train = tuple(sides["train"].values())
        return Protocol(self, train, MappingProxyType(sides["test"]), official)


def _files(layout: tuple[Columns, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(c.file for c in layout))


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

    def __getitem__(self, name: str) -> Recording:
        """Return one record: ``train/NAME``, ``test/NAME``, or a test by its name alone.

        Raises
        ------
        UnknownName
            There is no such part.
        """
        every = {r.name.removeprefix(f"{self.about.name}/"): r for r in self.records}
        every |= self.tests
        require_known("part", self.about.name, every, name)
        return every[name]

    @property
    def records(self) -> tuple[Recording, ...]:
        """All records, those that train first."""
        return (*self.train, *self.tests.values())

    def __repr__(self) -> str:
        """Return the parts and their sizes in one line."""
        tests = ", ".join(f"{k} {r.n}" for k, r in self.tests.items())
        train = " + ".join(str(r.n) for r in self.train)
        return f"Protocol({self.about.name!r}, train {train}, tests {tests})"


def alone(file: str, fs: float | None = None, /, **plan: str) -> tuple[Columns]:
    """Return a group of one record in one file; channels by name."""
    return (Columns(file, plan, fs),)


def sides(at: int | Fraction, train: str = "first", test: str = "last") -> tuple[SetPart, SetPart]:
    """Return two parts that share the only record at one place."""
    return SetPart(f"train/{train}", stop=at), SetPart(f"test/{test}", start=at)


def changed(
    recording: Recording, channels: Mapping[str, ArrayLike], units: Mapping[str, str], note: str
) -> Recording:
    """Return the recording with other values and a note that says so."""
    meta: dict[str, Any] = {**recording.meta, "notes": (*recording.notes, note)}
    meta.pop("noise", None)  # that of the old values
    values = {k: np.asarray(v, dtype=np.float64) for k, v in channels.items()}
    return replace(recording, channels=values, units=units, meta=meta)
