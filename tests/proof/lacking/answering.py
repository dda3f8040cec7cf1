"""What the tool says of a recording whose model lacks an element."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from hardware.simulators.generator.making_exam import exam_record
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.proof.exam.answering import timed_answer
from tests.proof.lacking.drawing import drawn
from tests.proof.trial.generating import Progress, make_all
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import graph_of, recording_of, run_all
from tests.proof.trial.truths import Public, read_public


def elements_of(layout: Layout) -> dict[str, str]:
    """Read the element that each model lacks."""
    return dict(json.loads((layout.folder / "elements.json").read_text(encoding="utf-8")))


def ask_all(
    layout: Layout, *, count: int, seed: int = 0, jobs: int = -1, progress: Progress | None = None
) -> int:
    """Draw, make and diagnose what has no answer yet; returns how many were diagnosed."""
    cases = drawn(seed, count)
    make_all([c.case for c in cases], layout, exam_record, jobs, None)
    write_elements(layout.folder, {c.case.id: c.element for c in cases})
    public = read_public(layout.public)
    return run_all(layout, public, layout.answers, answer, jobs=jobs, seed=seed, progress=progress)


def write_elements(folder: Path, elements: Mapping[str, str]) -> None:
    """Write the element that each model lacks."""
    write_atomically(folder / "elements.json", json.dumps(dict(elements), indent=1) + "\n")


def answer(layout: Layout, public: Public, seed: int = 0) -> dict[str, Any]:
    """Diagnose one recording with the model that lacks its element."""
    without = graph_of(public).remove(elements_of(layout)[public.id])
    return timed_answer(
        public,
        lambda: diagnose(
            without, recording_of(layout, public), model=public.plant,
            options=replace(DiagnosisOptions(), jobs=1), hold=public.hold, seed=seed,
        ),
    )  # fmt: skip
