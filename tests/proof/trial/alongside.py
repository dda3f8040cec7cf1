"""What the baselines need of one recording: read off the diagnosis, or computed beside it."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.signal import coherence
from scipy.stats import kurtosis, skew

from bondgraph.support.arrays import FloatArray as Array
from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.element_kind import element_kind
from identification.diagnosis.screening.score_test import Screened
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from tests.proof.trial.black_box import black_box
from tests.proof.trial.columns import columns_of
from tests.proof.trial.sparse import sparse_terms

POWERS = (2, 3)
"""Powers of commands and readings that the residual is held against."""
SEGMENT = 256
"""Samples of a segment of the coherence."""


def alongside(found: Diagnosis) -> dict[str, Any] | None:
    """Return what the baselines are asked with; nothing without a fit or a screening.

    Returns
    -------
    dict
        ``plain`` and ``trials`` (misfit, parameters and samples of the model as it is and of every
        law that was fitted in the first step), ``screening`` (rows of effect, element, kind of
        element, share, standard errors), ``residual`` (statistics of it, by word), ``sparse``
        (terms kept, by optimiser; null without pysindy), ``black_box`` (held-out rms of each
        reading, SI), ``cpu_seconds`` of all that.
    """
    if found.scene is None or found.nominal is None or not found.ranking:
        return None
    begin = time.process_time()
    with calm():
        content = {
            "plain": _scored(found.scene.nominal),
            "trials": [
                {"effect": t.effect, "element": t.element, **_scored(t.fit)}
                for t in found.trials
                if t.effect != UNNAMED.name
            ],
            "screening": screening_of(found),
            "residual": residual_statistics(found.scene.nominal),
            "sparse": _sparse(found),
            "black_box": _black_box(found.nominal),
        }
    return content | {"cpu_seconds": round(time.process_time() - begin, 3)}


def _scored(fit: Fit) -> dict[str, Any]:
    data = fit.problem.data
    return {
        "train": _number(fit.chi2("train")),
        "test": _number(fit.chi2("test")),
        "parameters": len(fit.problem.free),
        "samples": int(data.mask("train").sum()) * len(data.names),
    }


def screening_of(found: Diagnosis) -> list[list[Any]]:
    """Return rows of effect, element, kind of element, share and standard errors."""
    assert found.scene is not None
    graph = found.scene.graph

    def row(s: Screened) -> list[Any]:
        kind = element_kind(graph, s.element.name)
        return [s.effect.name, s.element.name, kind, _number(s.share), _number(s.z)]

    return [row(s) for s in found.ranking if s.hint is not None]


def residual_statistics(fit: Fit) -> dict[str, float | None]:
    """Return statistics of what a fit leaves on the training part, the largest of all readings."""
    data = fit.problem.data
    inside = data.mask("train")
    left = fit.residuals("train") / data.floor
    drives = {
        "command": np.column_stack([*data.commands.values()])[inside],
        "reading": data.readings[inside],
    }
    made = {
        "log misfit": math.log(max(float(np.mean(left**2)), 1e-300)),
        "skew": _most(skew(left)),
        "kurtosis": _most(kurtosis(left)),
        "colour": _most(_correlation(left[1:], left[:-1]).diagonal()),
        "coherence": _coherence(left, drives["command"], data.dt),
    }
    for word, signal in drives.items():
        for power in POWERS:
            made[f"{word} to the {power}"] = _most(_correlation(left, _centred(signal) ** power))
    return {word: _number(v) for word, v in made.items()}


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean(axis=0))


def _correlation(a: Array, b: Array) -> Array:
    a, b = _centred(a), _centred(b)
    size = np.outer(np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0))
    return np.asarray(a.T @ b / np.maximum(size, 1e-300))


def _coherence(left: Array, command: Array, dt: float) -> float:
    segment = min(SEGMENT, len(left) // 4)
    found = [
        np.mean(coherence(u, r, fs=1.0 / dt, nperseg=segment)[1])
        for u in command.T
        for r in left.T
        if np.ptp(u) > 0 and np.ptp(r) > 0
    ]
    return max(map(float, found), default=0.0)


def _most(values: Any) -> float:
    """Return the value furthest from zero."""
    flat = np.ravel(values)
    return float(flat[np.argmax(np.abs(flat))]) if flat.size else 0.0


def _sparse(found: Diagnosis) -> Mapping[str, Sequence[Any]] | None:
    assert found.scene is not None
    try:
        import pysindy  # noqa: F401
    except ImportError:
        return None
    return sparse_terms(columns_of(found.scene, found.ranking))


def _black_box(nominal: Fit) -> dict[str, float | None] | None:
    """Return the held-out rms of what a black box leaves beside the model as it is."""
    data = nominal.problem.data
    inputs = np.column_stack([*data.commands.values(), nominal.simulated])
    residual = data.readings - nominal.simulated
    if not np.isfinite(residual).all():
        return None
    left = black_box(inputs, residual, data.floor, data.mask("train"))[data.mask("test")]
    rms = np.sqrt(np.mean(left**2, axis=0)) * data.floor
    return dict(zip(data.names, map(_number, rms), strict=True))


def _number(value: float) -> float | None:
    """Return a number that JSON can hold, or nothing."""
    return float(f"{value:.5g}") if math.isfinite(value) else None
