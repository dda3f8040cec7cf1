"""What the tool says of one recording of the exam, with what it cost and what it left."""

from __future__ import annotations

import math
import os
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError
from bondsight.cli.judged import places_of
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from tests.proof.exam.stored import recorded
from tests.proof.trial.alongside import alongside
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import graph_of, recording_of
from tests.proof.trial.truths import Public

BLOCKS = 40
"""Pieces in which residuals are drawn anew, so that what is left of their colour stays."""


def exam_answer(
    layout: Layout, public: Public, seed: int = 0, without: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Diagnose one recording, `without` some effects; an error becomes part of the answer.

    Returns
    -------
    dict
        ``id``, ``verdict`` (its JSON; null after a crash), ``evidence`` (of every decision,
        `stored`), ``ports``, ``nominal_rms`` and ``repaired_rms`` (held-out rms of each reading in
        SI; null without such a fit), ``seconds``, ``cpu_seconds``, ``compiler_seconds`` (of
        processes it called, such as a compiler whose work is kept for the next time), ``error``,
        ``baselines`` (`alongside`, timed apart; null where the diagnosis ended before it searched).
    """
    kept: list[Diagnosis] = []

    def whole() -> Diagnosis:
        kept.append(_diagnosed(public, recording_of(layout, public), seed, without))
        return kept[0]

    content = timed_answer(public, whole)
    return content | {"baselines": _alongside(*kept) if kept else None}


def _alongside(found: Diagnosis) -> dict[str, Any] | None:
    try:
        return alongside(found)
    except Exception:  # a baseline that crashes says nothing, and costs the tool's answer nothing
        return {"error": traceback.format_exc(limit=-6)}


def half_answer(layout: Layout, public: Public, seed: int = 0) -> dict[str, Any]:
    """Diagnose the first half of a recording: what is said of it should be said of the whole."""

    def half() -> Diagnosis:
        recording = recording_of(layout, public)
        return _diagnosed(public, recording.slice(0, recording.n // 2), seed)

    return timed_answer(public, half)


def transplant_answer(layout: Layout, public: Public, seed: int = 0) -> dict[str, Any]:
    """Diagnose what the repaired model makes of the same command, with its residuals drawn anew.

    The answer to a recording whose truth is the answer itself: it should be the same.
    """

    def transplanted() -> Diagnosis:
        recording = recording_of(layout, public)
        return _diagnosed(public, transplant(_diagnosed(public, recording, seed), seed), seed)

    # the evidence would be of two recordings
    return {**timed_answer(public, transplanted), "evidence": []}


WORKS: Mapping[str, Callable[[Layout, Public, int], dict[str, Any]]] = MappingProxyType(
    {"whole": exam_answer, "half": half_answer, "transplant": transplant_answer}
)
"""What a recording may be made into before it is diagnosed, by the word of the command line."""


def transplant(found: Diagnosis, seed: int) -> Recording:
    """Return the readings of the last model with its residuals in a drawn order of blocks."""
    fit = found.repaired or found.nominal
    if fit is None:
        return found.recording
    data = fit.problem.data
    residual = data.readings - fit.simulated
    n = len(residual)
    length = max(1, n // BLOCKS)
    starts = np.random.default_rng([seed, 1]).integers(0, n - length + 1, -(-n // length))
    order = (starts[:, None] + np.arange(length)).ravel()[:n]
    made = dict(zip(data.names, (fit.simulated + residual[order]).T, strict=True))
    return replace(found.recording, time=data.time, channels={**data.commands, **made})


def _diagnosed(
    public: Public, recording: Recording, seed: int, without: tuple[str, ...] = ()
) -> Diagnosis:
    return diagnose(
        graph_of(public),
        recording,
        model=public.plant,
        options=replace(DiagnosisOptions(), jobs=1, without=without),
        hold=public.hold,
        seed=seed,
    )


def timed_answer(public: Public, work: Callable[[], Diagnosis]) -> dict[str, Any]:
    begin, spent, others = time.perf_counter(), time.process_time(), os.times()
    content: dict[str, Any] = {
        "id": public.id, "verdict": None, "error": None, "nominal_rms": None, "repaired_rms": None
    }  # fmt: skip
    try:
        content["ports"] = sorted(places_of(graph_of(public)))
        with recorded() as evidence:
            found = work()
        said = verdict(found)
        content |= {
            "verdict": said,
            "evidence": evidence,
            "nominal_rms": _rms(said["fit"]["nominal"]),
            "repaired_rms": _rms(said["fit"]["repaired"]),
        }
    except BondsightError as error:
        content["error"] = " ".join(str(error).split())
    except Exception:  # a crash is an answer as well: it must be counted, not lost
        content["error"] = traceback.format_exc(limit=-6)
    now = os.times()
    called = now.children_user + now.children_system - others.children_user - others.children_system
    return content | {
        "seconds": round(time.perf_counter() - begin, 3),
        "cpu_seconds": round(time.process_time() - spent, 3),
        "compiler_seconds": round(called, 3),
    }


def _rms(fit: Mapping[str, Any]) -> dict[str, float] | None:
    """Held-out rms of each reading; nothing without a fit or where it ran away."""
    found = {name: float(v) for name, v in fit["test_rmse"].items()}
    return found if found and all(map(math.isfinite, found.values())) else None
