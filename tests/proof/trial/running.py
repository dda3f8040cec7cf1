"""Diagnose every recording of a trial, one answer a file; what is done is never done twice."""

from __future__ import annotations

import json
import math
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Sensor, Source, TwoPort, Valued
from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.localisation.element_kind import element_kind
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from tests.proof.trial.black_box import black_box
from tests.proof.trial.layout import Layout
from tests.proof.trial.models import blind_model
from tests.proof.trial.truths import Public

Progress = Callable[[str, float], None]
Work = Callable[[Layout, Public, int], dict[str, Any]]
"""What is done with one recording: returns the content of its file."""


def recording_of(layout: Layout, public: Public) -> Recording:
    """Read the recording of one entry of the public list; units are those of the model.

    Units of coarse converters that are declared go to ``meta["resolution"]``.
    """
    path = layout.recordings / f"{public.id}.npz"
    graph = blind_model(public.plant, public.sensors)
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
    return blind_model(public.plant, public.sensors, public.delay)


def answer(
    layout: Layout, public: Public, seed: int = 0, options: DiagnosisOptions | None = None
) -> dict[str, Any]:
    """Diagnose one recording; an error becomes part of the answer.

    Returns
    -------
    dict
        ``id``, ``verdict`` (its JSON; null after a crash), ``seconds``, ``error``, ``nominal``,
        ``trials``, ``kinds`` (the ports of the model).
    """
    begin = time.perf_counter()
    content: dict[str, Any] = {"id": public.id, "verdict": None, "error": None}
    try:
        recording = recording_of(layout, public)
        graph = graph_of(public)
        content["kinds"] = ports_of(graph)
        chosen = replace(options or DiagnosisOptions(), jobs=1)
        found = diagnose(
            graph, recording, model=public.plant, options=chosen, hold=public.hold, seed=seed
        )
        content |= {
            "verdict": verdict(found),
            "nominal": nominal_of(found),
            "trials": trials_of(found),
        }
        # the black box sees the same recording; its time is not the tool's
        content["seconds"] = round(time.perf_counter() - begin, 3)
        content["black_box"] = black_box_of(found)
    except BondsightError as error:
        content["error"] = " ".join(str(error).split())
    except Exception:  # a crash is an answer as well: it must be counted, not lost
        content["error"] = traceback.format_exc(limit=-6)
    return {"seconds": round(time.perf_counter() - begin, 3)} | content


def ports_of(graph: BondGraph) -> dict[str, str]:
    """Kind of every element that may hold an effect."""
    elements = graph.of_type(Valued, TwoPort, Source, Sensor)
    return {e.name: element_kind(graph, e.name) for e in elements}


def nominal_of(found: Diagnosis) -> dict[str, Any] | None:
    """Scores of the model as it is, with what the information criteria need."""
    if found.nominal is None:
        return None
    data = found.nominal.problem.data
    return {
        "train": finite(found.nominal.chi2("train")),
        "test": finite(found.nominal.chi2("test")),
        "parameters": len(found.nominal.problem.free),
        "samples": int(data.mask("train").sum()) * len(data.names),
    }


def trials_of(found: Diagnosis) -> list[dict[str, Any]]:
    """Score of every effect that was fitted, for the baselines."""
    return [
        {
            "effect": t.effect,
            "family": t.insertion.family,
            "element": t.element,
            "home": bool(t.home),
            "train": finite(t.train),
            "test": finite(t.test),
            "parameters": len(t.fit.problem.free),
            "samples": int(t.fit.problem.data.mask("train").sum()) * len(t.fit.problem.data.names),
            "test_rmse": {n: finite(v) for n, v in t.fit.rmse("test").items()},
            # held-out mean squares block by block: the oracle compares itself with them
            "blocks": [finite(float(f"{b:.6g}")) for b in t.blocks],
        }
        for t in found.trials
    ]


def black_box_of(found: Diagnosis) -> dict[str, Any] | None:
    """Score of a black box on the residual of the model as it is."""
    if found.nominal is None:
        return None
    data = found.nominal.problem.data
    inputs = np.column_stack([*data.commands.values(), found.nominal.simulated])
    residual = data.readings - found.nominal.simulated
    if not np.isfinite(residual).all():
        return None
    left = black_box(inputs, residual, data.floor, data.mask("train"))
    return {k: finite(float(np.mean(left[data.mask(k)] ** 2))) for k in ("train", "test")}


def finite(value: float) -> float | None:
    """Return a number that JSON can hold, or nothing."""
    return float(value) if math.isfinite(value) else None


def run_all(
    layout: Layout,
    public: Sequence[Public],
    target: Path,
    work: Work = answer,
    *,
    jobs: int = -1,
    seed: int = 0,
    progress: Progress | None = None,
) -> int:
    """Do `work` for every recording that has no file in `target` yet; returns how many were done.

    Each file appears as a whole as soon as its work is done, so that an interruption costs what is
    in hand and no more.

    Parameters
    ----------
    jobs : int
        Processes; -1 for all cores.

    Raises
    ------
    UnusableInput
        The public list names a recording that is not there.
    """
    for entry in public:
        if not (layout.recordings / f"{entry.id}.npz").is_file():
            raise UnusableInput(f"{layout.recordings}: the recording {entry.id} is not there")
    target.mkdir(parents=True, exist_ok=True)
    todo = [p for p in public if not (target / f"{p.id}.json").exists()]
    done = 0
    # the slow ones are not known beforehand: a fixed shuffle spreads plants over the processes
    order = np.random.default_rng(0).permutation(len(todo))
    found = Parallel(n_jobs=jobs, return_as="generator_unordered", pre_dispatch="2*n_jobs")(
        delayed(one)(work, layout, todo[i], target, seed) for i in order
    )
    for name, said in found:
        done += 1
        if progress is not None:
            progress(f"{name}: {said}", (len(public) - len(todo) + done) / len(public))
    return done


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
