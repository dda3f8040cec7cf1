"""The folder of a verdict: the document, the repaired model, and the input to record next."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

import numpy as np

from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.verdict.document import verdict
from identification.study.factors import drives


def write_verdict(d: Diagnosis, folder: Path) -> Path:
    """Write ``verdict.json`` atomically; returns its path.

    Where something was named, ``repaired.json`` beside it is the repaired model with its fitted
    values, which every ``--model`` takes. Where an input would tell rivals apart, ``next.csv`` is
    the best one, to be played by the drive.

    Examples
    --------
    >>> write_verdict(found, folder).name
    'verdict.json'
    """
    target = folder / "verdict.json"
    write_atomically(target, json.dumps(verdict(d), indent=2, allow_nan=False) + "\n")
    _write_repaired(d, folder / "repaired.json")
    _write_next(d, folder / NEXT)
    return target


def next_input(d: Diagnosis) -> Experiment | None:
    """Return the best experiment that is an input; None where rivals need another sensor."""
    return next((e for e in d.experiments if e.commands and e.kind != "sensor"), None)


NEXT = "next.csv"
"""Name of the file of what to play next."""


def _write_repaired(d: Diagnosis, target: Path) -> None:
    """Write the repaired model; no file where nothing was named, or a law has no place in one."""
    target.unlink(missing_ok=True)
    if d.repaired is None:
        return
    graph = d.repaired.problem.graph
    known = {n: v for n, v in d.repaired.values.items() if n in graph.parameters}
    with suppress(UnusableInput):  # a law of somebody's own
        write_atomically(target, to_json(graph.with_values(known)) + "\n")


def _write_next(d: Diagnosis, target: Path) -> None:
    """Write the first experiment that is an input, SI; no file where there is none."""
    target.unlink(missing_ok=True)
    made = next_input(d)
    if made is None or d.data is None:
        return
    units = {s.name: s.unit for s in drives(d.graph)}
    time = d.data.dt * np.arange(made.samples)
    courses = {f"{n}[{units.get(n) or '1'}]": u for n, u in made.commands.items()}
    with suppress(UnusableInput):  # a command that is called like the time
        Recording.from_arrays("next", {"t[s]": time, **courses}).write_csv(target)
