"""Public recordings of real devices, by name, read from a folder the user provides.

No data are part of this project: every entry names its public source, and the files are read
from the folder in the environment variable `BONDSIGHT_RECORDINGS` (one sub-folder per source).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from bondgraph.signals.recording import Recording, Split, default_split
from bondgraph.support.errors import UnusableInput, unknown_name
from identification.datasets import loaders
from identification.datasets.places import FOLDER_VARIABLE, recordings_folder

__all__ = [
    "FOLDER_VARIABLE",
    "KNOWN",
    "KnownRecording",
    "LoadedRecording",
    "about",
    "available",
    "load",
    "names",
]


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


@dataclass(frozen=True, slots=True)
class KnownRecording:
    """A public recording: what it is, where it is from, how it is read and split.

    Parameters
    ----------
    name : str
        Its key.
    title : str
        One line about the device.
    source : str
        Public source, as `repository @ commit : path`.
    citation : str
        Work to cite.
    licence : str
        What is known about the licence.
    folder : str
        Sub-folder of the recordings folder.
    files : tuple of str
        File names that will do, best first (the converted copy, then the original).
    loader : callable
        File path -> `Recording` with canonical names, SI.
    splitter : callable
        `Recording` -> `Split`.
    inputs, outputs : tuple of str
        Channels that drive and that respond.
    aliases : tuple of str
        Other names.
    """

    name: str
    title: str
    source: str
    citation: str
    licence: str
    folder: str
    files: tuple[str, ...]
    loader: Callable[[Path], Recording]
    splitter: Callable[[Recording], Split]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    aliases: tuple[str, ...] = ()

    def find(self, folder: Path) -> Path | None:
        """Return the first of the files that exists under `folder`; None if there is none."""
        paths = (folder / self.folder / file for file in self.files)
        return next((p for p in paths if p.is_file()), None)


# --- splits ---------------------------------------------------------------------------------


def _piezo_split(recording: Recording) -> Split:
    return default_split(recording, 1.0 / 3.0, drive="V")


def _last_third(recording: Recording) -> Split:
    return default_split(recording, 1.0 / 3.0)


def _last_quarter(recording: Recording) -> Split:
    return default_split(recording, 0.25)


# --- the list -------------------------------------------------------------------------------

_SILVERBOX_SOURCE = (
    "biaslab/nsi-silverbox @ 728f07e4539d4f7da76a4778b52a756260b488ac : data/Silverbox/SNLS80mV.mat"
)
_SILVERBOX_CITATION = (
    "T. Wigren, J. Schoukens, Three free data sets for development and benchmarking in nonlinear "
    "system identification, European Control Conference 2013, pp. 2933-2938"
)
_BENCHMARK_LICENCE = (
    "public nonlinearbenchmark.org benchmark; licence of the data not found, cite the authors"
)

_ALL = (
    KnownRecording(
        name="piezo-actuator-sine",
        title="Piezoelectric actuator: 3.26 s of rest, then a 150 V, 1 Hz sine (hysteresis)",
        source=(
            "chandratue/SmartHysteresis @ e7672dabcabbc75341e9ea965d073f68b27e5cda : "
            "Data/hysteresis_v_150_1hz.csv"
        ),
        citation=(
            "Discovery of sparse hysteresis models for piezoelectric materials, Applied Physics "
            "Letters 2023, doi 10.1063/5.0146134"
        ),
        licence="none stated by the repository: do not redistribute",
        folder="piezo-actuator-sine",
        files=("sine_150V_1Hz.csv",),
        loader=loaders.piezo,
        splitter=_piezo_split,
        inputs=("V",),
        outputs=("x",),
    ),
    KnownRecording(
        name="emps",
        title="EMPS: motor, ball screw and carriage in closed loop (Coulomb friction, offset)",
        source=(
            "meco-group/nlgreyfast @ 7a29c1a0eb6392855d908f07f06160d50cdf8599 : "
            "nlid_emps_sim_data_training.mat"
        ),
        citation=(
            "A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, Workshop on "
            "Nonlinear System Identification Benchmarks, Eindhoven, 2019"
        ),
        licence=_BENCHMARK_LICENCE,
        folder="emps",
        files=("emps_training.csv", "DATA_EMPS.mat", "nlid_emps_sim_data_training.mat"),
        loader=loaders.emps,
        splitter=_last_third,
        inputs=("F",),
        outputs=("x",),
    ),
    KnownRecording(
        name="silverbox",
        title="Silverbox: electronic Duffing oscillator, ten odd multisines (cubic stiffness)",
        source=_SILVERBOX_SOURCE,
        citation=_SILVERBOX_CITATION,
        licence=_BENCHMARK_LICENCE,
        folder="silverbox",
        files=("silverbox.npz", "SNLS80mV.mat"),
        loader=loaders.silverbox_multisine,
        splitter=_last_quarter,
        inputs=("u",),
        outputs=("y",),
        aliases=("silverbox/multisine",),
    ),
    KnownRecording(
        name="silverbox/arrow",
        title="Silverbox: noise of growing amplitude, beyond the multisines (extrapolation)",
        source=_SILVERBOX_SOURCE,
        citation=_SILVERBOX_CITATION,
        licence=_BENCHMARK_LICENCE,
        folder="silverbox",
        files=("silverbox.npz", "SNLS80mV.mat"),
        loader=loaders.silverbox_arrow,
        splitter=_last_third,
        inputs=("u",),
        outputs=("y",),
    ),
    KnownRecording(
        name="hair_dryer",
        title="Hair dryer: heater voltage to air temperature reading (dead time, second lag)",
        source=(
            "RomanFoell/DRGP-VSS @ 457f35ffd321cdfe9359d1df707fde9a32041c9c : "
            "matlab_ip/data_raw/dryer.mat"
        ),
        citation=(
            "B. De Moor (ed.), DaISy: Database for the Identification of Systems, KU Leuven, "
            "[96-006] hair dryer"
        ),
        licence="DaISy: licence not verified, the database asks for citation",
        folder="daisy-mechatronics",
        files=("hair_dryer.csv", "dryer.mat"),
        loader=loaders.hair_dryer,
        splitter=_last_third,
        inputs=("u",),
        outputs=("y",),
        aliases=("daisy-mechatronics/hair_dryer",),
    ),
)

KNOWN: Mapping[str, KnownRecording] = MappingProxyType({k.name: k for k in _ALL})
"""All known recordings by name."""


def names() -> tuple[str, ...]:
    """Names of the known recordings, aliases left out."""
    return tuple(KNOWN)


def about(name: str) -> KnownRecording:
    """Return the entry of a known recording.

    Parameters
    ----------
    name : str
        Its name or an alias.

    Returns
    -------
    KnownRecording
        Title, source, citation, licence and files.

    Raises
    ------
    UnknownName
        If no recording has this name.

    Examples
    --------
    >>> about("daisy-mechatronics/hair_dryer").name
    'hair_dryer'
    """
    for entry in _ALL:
        if name == entry.name or name in entry.aliases:
            return entry
    raise unknown_name("known recording", name, "identification.datasets", KNOWN)


def available(name: str, folder: str | os.PathLike[str] | None = None) -> bool:
    """Whether a file of a known recording is in the folder.

    Parameters
    ----------
    name : str
        Name or alias.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given.

    Returns
    -------
    bool
        True if `load` will find a file.

    Raises
    ------
    UnknownName
        If no recording has this name.
    """
    entry, place = about(name), recordings_folder(folder)
    return place is not None and entry.find(place) is not None


def load(name: str, folder: str | os.PathLike[str] | None = None) -> LoadedRecording:
    """Read a known recording and its split.

    Parameters
    ----------
    name : str
        Name or alias, such as `"emps"`.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given.

    Returns
    -------
    Loaded
        `(recording, split)`; SI, canonical channel names.

    Raises
    ------
    UnknownName
        If no recording has this name.
    UnusableInput
        If the file is not there: the line names the variable, the source and the file.
    """
    entry, place = about(name), recordings_folder(folder)
    path = entry.find(place) if place is not None else None
    if path is None:
        files = " or ".join(f"{entry.folder}/{f}" for f in entry.files)
        state = f"{FOLDER_VARIABLE} is not set" if place is None else f"no such file in {place}"
        raise UnusableInput(
            f"recording {entry.name!r}: {state}; get {entry.source} and set {FOLDER_VARIABLE} to "
            f"the folder that holds {files}"
        )
    read = entry.loader(path)
    meta = {**read.meta, "citation": entry.citation, "origin": entry.source}
    recording = replace(read, name=entry.name, meta=meta)
    return LoadedRecording(recording, entry.splitter(recording))
