"""A trial or exam as plain files: CSV, JSON, equations as text, FMU."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from actuators.models.plants import plant_model
from bondgraph.export.formats import export
from bondgraph.export.notations import notation
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.whole_file import write_atomically
from hardware.simulators.generator.accepted import KINDS
from hardware.simulators.generator.families import FAMILIES, FAMILY_OF
from hardware.simulators.judging.claims import ExamAnswer
from hardware.simulators.judging.outcome import judge_exam
from hardware.simulators.judging.truths import ExamTruth, truth_of
from identification.diagnosis.catalogue import CATALOGUE
from tests.proof.exam.separable import kind_separable, name_separable, no_law_fits
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import graph_of, kinds_of_ports, recording_of
from tests.proof.trial.truths import Public, read_public

HERE = Path(__file__).parent
PLAIN = ("ENTER.md", "scorer.py", "answer.schema.json")
"""Files that are handed on as they stand here."""


def export_benchmark(layout: Layout, out: Path) -> int:
    """Write what an entrant gets; returns the number of recordings.

    Raises
    ------
    UnusableInput
        There is no list of recordings.
    """
    public = read_public(layout.public)
    for name in ("recordings", "models"):
        (out / name).mkdir(parents=True, exist_ok=True)
    for p in public:
        write_csv(recording_of(layout, p), out / "recordings" / f"{p.id}.csv")
    for plant in sorted({p.plant for p in public}):
        write_model(plant_model(plant), plant, out / "models")
    _write(out / "recordings.json", {"recordings": [known(p) for p in public]})
    _write(out / "vocabulary.json", vocabulary())
    for name in PLAIN:
        shutil.copyfile(HERE / name, out / name)
    return len(public)


def write_csv(recording: Recording, path: Path) -> None:
    """Write time and channels, SI, with their units in the header: ``time [s],F [N],x [m]``."""
    names = list(recording.channels)
    heads = ["time [s]", *(f"{n} [{recording.units[n]}]" for n in names)]
    table = np.column_stack([recording.time, *(recording.channels[n] for n in names)])
    rows = "\n".join(",".join(f"{v:.10g}" for v in row) for row in table)
    write_atomically(path, ",".join(heads) + "\n" + rows + "\n")


def write_model(graph: BondGraph, plant: str, folder: Path) -> None:
    """Write a plant's graph, its equations and, where it can be made, an FMU."""
    export(graph, "json", folder / f"{plant}.json")
    write_atomically(folder / f"{plant}.txt", notation(graph, "text") + "\n")
    with suppress(BondsightError):  # a model that no FMU can hold is there as graph and equations
        export(graph, "fmu2-cs", folder / f"{plant}.fmu")


def known(public: Public) -> dict[str, Any]:
    """Return what may be known of a recording."""
    graph = graph_of(public)
    return {
        "id": public.id,
        "plant": public.plant,
        "command_between_samples": public.hold,
        "declared_delay": public.delay,
        "resolution": {
            k: r for k, r in zip(public.sensors, public.resolution, strict=False) if r > 0
        },
        "elements": kinds_of_ports(graph),
    }


def vocabulary() -> dict[str, Any]:
    """Return the effects that may be named, with family, kind and a sentence, and the kinds."""
    told = {e.name: {"kind": e.kind, "sentence": e.sentence} for e in CATALOGUE}
    return {
        "effects": {
            name: {"family": FAMILY_OF[name], **told.get(name, {})}
            for name in FAMILY_OF
            if name != "unknown"
        },
        "families": {k: [n for n in v if n != "unknown"] for k, v in FAMILIES.items()},
        "kinds": list(KINDS),
    }


def read_opened(path: Path) -> dict[str, ExamTruth]:
    """Read truths as they lie sealed, or as a trial reveals them beside its salt.

    Raises
    ------
    UnusableInput
        The file is missing or holds no truths.
    """
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))
        rows = rows["truths"] if isinstance(rows, dict) else rows
        return {t.id: t for t in map(truth_of, rows)}
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise UnusableInput(f"{path}: no truths ({error!r})") from None


def open_truths(
    truths: Mapping[str, ExamTruth], public: Iterable[Public], answers: Mapping[str, ExamAnswer]
) -> dict[str, Any]:
    """Return the truths as the scorer reads them.

    Parameters
    ----------
    answers : mapping
        Ours, whose fits say what the declared model leaves of each recording once its parameters
        are fitted, and what an oracle could separate. Without an answer it leaves all that the
        effects moved, and an oracle separates everything.
    """
    rows = [
        truth_row(truths[p.id], len(kinds_of_ports(graph_of(p))), answers.get(p.id))
        for p in public
        if p.id in truths
    ]
    return {"families": {k: list(v) for k, v in FAMILIES.items()}, "recordings": rows}


def truth_row(truth: ExamTruth, ports: int, answer: ExamAnswer | None) -> dict[str, Any]:
    """Return one truth as the scorer reads it; `ports` elements may hold an effect."""
    first = answer.first if answer is not None else {}
    left = judge_exam(truth, answer).left if answer else max(truth.moved.values(), default=0.0)
    main = truth.main is not None
    return {
        "id": truth.id, "cell": truth.cell, "plant": truth.plant, "ports": ports,
        "effects": [
            {
                "effect": e.effect, "law": e.law, "family": e.family, "moved": e.moved,
                "names": sorted(e.names), "kinds": sorted(e.kinds), "places": sorted(e.places),
            }
            for e in truth.effects
        ],
        "control": truth.control, "noise": dict(truth.noise), "moved": dict(truth.moved),
        "empty": truth.empty, "outside": truth.outside, "single": truth.single,
        "several": truth.cell in ("two", "three"), "shows": truth.shows,
        "left": None if math.isnan(left) else left,
        "separable": {
            "name": main and name_separable(truth, first),
            "kind": main and kind_separable(truth, first),
            "law": main and no_law_fits(truth, first),
        },
    }  # fmt: skip


def _write(path: Path, content: Any) -> None:
    write_atomically(path, json.dumps(content, indent=1, allow_nan=False) + "\n")
