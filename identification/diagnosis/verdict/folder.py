"""The folder of a verdict: the document, the repaired model, and the input to record next."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import TwoPort, Valued
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.verdict.document import verdict
from identification.report.numbers import unit_of_level
from identification.report.words import shortened
from identification.study.factors import drives


def write_verdict(d: Diagnosis, folder: Path) -> Path:
    """Write ``verdict.json`` atomically; returns its path.

    Where something was named, ``repaired.json`` beside it is the repaired model with its fitted
    values, which every ``--model`` takes; what was declared stands in the source of each. Where an
    input would tell rivals apart, ``next.csv`` is the best one, to be played by the drive.

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
        write_atomically(target, to_json(_sourced(graph.with_values(known), d)) + "\n")


def _sourced(graph: BondGraph, d: Diagnosis) -> BondGraph:
    """Return the repaired model, its fitted values with what was declared as their source.

    A file has one value a parameter; where it comes from is the place of the other.
    """
    declared, run = d.graph.parameters, shortened(d.recording.name)
    for name, now in graph.parameters.items():
        was = declared.get(name)
        if was is None or was.value == now.value:
            continue
        unit = f" {was.unit}" if was.unit not in ("", "1") else ""
        known = f" ({was.source})" if was.source else ""
        said = f"fitted to {run}; declared as {was.value:.12g}{unit}{known}"
        if name in graph.declared_parameters:
            graph = graph.with_parameters([replace(now, source=said)])
        elif isinstance(graph.elements.get(name), Valued | TwoPort):
            graph = graph.with_element(name, source=said)
    return graph


def _write_next(d: Diagnosis, target: Path) -> None:
    """Write the first experiment that is an input, SI; no file where there is none."""
    target.unlink(missing_ok=True)
    made = next_input(d)
    if made is None or d.data is None:
        return
    read = d.recording.read_in
    units = {s.name: unit_of_level(s.unit or "", read.get(s.name, "")) for s in drives(d.graph)}
    time = d.data.dt * np.arange(made.samples)
    courses = {f"{n}[{units.get(n) or '1'}]": u for n, u in made.commands.items()}
    with suppress(UnusableInput):  # a command that is called like the time
        Recording.from_arrays("next", {"t[s]": time, **courses}).write_csv(target)
