"""Work through every recording of a trial, one file each; what is done is never done twice."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from joblib import delayed

from actuators.models.plants import plant_model
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput
from bondgraph.support.parallel import results
from bondgraph.support.whole_file import write_atomically
from bondsight.cli.judged import places_of
from identification.diagnosis.localisation.element_kind import element_kind
from tests.proof.trial.commitment import read_commitment
from tests.proof.trial.layout import Layout
from tests.proof.trial.truths import Public

Progress = Callable[[str, float], None]
Work = Callable[[Layout, Public, int], dict[str, Any]]
"""What is done with one recording: returns the content of its file."""


def recording_of(layout: Layout, public: Public) -> Recording:
    """Read the recording of one entry of the public list; units are those of the model.

    Units of coarse converters that are declared go to ``meta["resolution"]``.
    """
    path = layout.recordings / f"{public.id}.npz"
    graph = plant_model(public.plant, public.sensors)
    names = [e.name for e in graph.of_type(Source, Sensor)]
    with np.load(path, allow_pickle=False) as file:
        channels = {n: np.asarray(file[n], float) for n in names}
        time = np.asarray(file["time"], float)
    units = {e.name: parse_unit(e.unit).si for e in graph.of_type(Source, Sensor)}
    coarse = {n: r for n, r in zip(public.sensors, public.resolution, strict=False) if r > 0}
    return Recording(
        public.id, time, channels, units, path.name, sha256_of(path), {"resolution": coarse}
    )


def graph_of(public: Public) -> BondGraph:
    """Model of the plant with the sensors and the dead time that the public list states."""
    return plant_model(public.plant, public.sensors, public.delay)


def kinds_of_ports(graph: BondGraph) -> dict[str, str]:
    """Kind of every element that may hold an effect."""
    return {name: element_kind(graph, name) for name in places_of(graph)}


def run_all(
    layout: Layout,
    public: Sequence[Public],
    target: Path,
    work: Work,
    *,
    jobs: int = -1,
    seed: int = 0,
    progress: Progress | None = None,
) -> int:
    """Do `work` for every recording that has no file in `target` yet; returns how many were done.

    Each file appears as a whole as soon as its work is done, so that an interruption costs what is
    in hand and no more. Runs on the joblib backend in force, so that loky, dask or ray carry it:
    ``with joblib.parallel_config(backend="dask"): run_all(...)``; workers write into `target`.

    Parameters
    ----------
    jobs : int
        Processes; -1 for all cores.

    Raises
    ------
    UnusableInput
        The public list names a recording that is not there, or an answer is to another one.
    """
    for entry in public:
        if not (layout.recordings / f"{entry.id}.npz").is_file():
            raise UnusableInput(f"{layout.recordings}: the recording {entry.id} is not there")
    require_own(layout, target)
    target.mkdir(parents=True, exist_ok=True)
    todo = [p for p in public if not (target / f"{p.id}.json").exists()]
    done = 0
    # the slow ones are not known beforehand: a fixed shuffle spreads plants over the processes
    order = np.random.default_rng(0).permutation(len(todo))
    calls = (delayed(one)(work, layout, todo[i], target, seed) for i in order)
    for name, said in results(calls, jobs):
        done += 1
        if progress is not None:
            progress(f"{name}: {said}", (len(public) - len(todo) + done) / len(public))
    return done


def require_own(layout: Layout, answers: Path) -> None:
    """Refuse answers to other recordings than the trial's, such as those of an older draw.

    Raises
    ------
    UnusableInput
        The first of them; what a recording is says the commitment, else its file.
    """
    sealed = read_commitment(layout)["data_sha256"] if layout.commitment.is_file() else {}
    for path in sorted(answers.glob("*.json")):
        file, said = layout.recordings / f"{path.stem}.npz", _answered(path)
        known = sealed.get(file.name) or (sha256_of(file) if said and file.is_file() else "")
        if said and known and said != known:
            raise UnusableInput(
                f"{path}: the answer to another recording than {file.name} is now, of an older "
                "draw; move the answers away and run again"
            )


def _answered(path: Path) -> str:
    """Return the hash of the recording that an answer is to; empty where it says none."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return str(((content.get("verdict") or {}).get("recording") or {}).get("sha256") or "")
    except (ValueError, AttributeError):
        return ""  # who reads the answer says that it is damaged


def one(work: Work, layout: Layout, public: Public, target: Path, seed: int) -> tuple[str, str]:
    """Do the work for one recording and write its file; runs in a process of its own."""
    content = work(layout, public, seed)
    write_atomically(
        target / f"{public.id}.json", json.dumps(content, indent=1, allow_nan=False) + "\n"
    )
    return public.id, said_of(content)


def said_of(content: Mapping[str, Any]) -> str:
    """Outcome in a few words, for the progress bar."""
    if content.get("error"):
        return "stopped"
    said = (content.get("verdict") or {}).get("verdict", "done")
    return str(said)
