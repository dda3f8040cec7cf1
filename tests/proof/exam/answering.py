"""What the tool says of one recording of the exam, with what it cost and what it left."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bondgraph.support.errors import BondsightError
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import graph_of, ports_of, recording_of
from tests.proof.trial.truths import Public

__all__ = ["exam_answer", "half_answer"]


def exam_answer(
    layout: Layout, public: Public, seed: int = 0, *, part: float = 1.0
) -> dict[str, Any]:
    """Diagnose one recording, or the first `part` of it; an error becomes part of the answer.

    Returns
    -------
    dict
        ``id``, ``verdict`` (its JSON; null after a crash), ``ports``, ``nominal_rms`` and
        ``repaired_rms`` (held-out rms of each reading in SI; null without such a fit),
        ``seconds``, ``cpu_seconds``, ``error``.
    """
    begin, spent = time.perf_counter(), time.process_time()
    content: dict[str, Any] = {
        "id": public.id, "verdict": None, "error": None, "nominal_rms": None, "repaired_rms": None
    }  # fmt: skip
    try:
        recording = recording_of(layout, public)
        if part < 1.0:
            recording = recording.slice(0, int(part * recording.n))
        graph = graph_of(public)
        content["ports"] = sorted(ports_of(graph))
        options = replace(DiagnosisOptions(), jobs=1)
        found = diagnose(
            graph, recording, model=public.plant, options=options, hold=public.hold, seed=seed
        )
        said = verdict(found)
        content |= {
            "verdict": said,
            "nominal_rms": _rms(said["fit"]["nominal"]),
            "repaired_rms": _rms(said["fit"]["repaired"]),
        }
    except BondsightError as error:
        content["error"] = " ".join(str(error).split())
    except Exception:  # a crash is an answer as well: it must be counted, not lost
        content["error"] = traceback.format_exc(limit=-6)
    return content | {
        "seconds": round(time.perf_counter() - begin, 3),
        "cpu_seconds": round(time.process_time() - spent, 3),
    }


def _rms(fit: Mapping[str, Any]) -> dict[str, float] | None:
    """Held-out rms of each reading; nothing without a fit or where it ran away."""
    found = {name: float(v) for name, v in fit["test_rmse"].items()}
    return found if found and all(map(math.isfinite, found.values())) else None


def half_answer(layout: Layout, public: Public, seed: int = 0) -> dict[str, Any]:
    """Diagnose the first half of a recording: what is said of it should be said of the whole."""
    return exam_answer(layout, public, seed, part=0.5)
