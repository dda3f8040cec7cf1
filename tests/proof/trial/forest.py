"""Baseline: a random forest on features of the screening (Breiman, Mach. Learn. 45 (2001) 5)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hardware.simulators.judging.claims import told_at
from hardware.simulators.judging.truths import ExamTruth
from tests.proof.trial.rivals import Content, Pick, Rule

TREES = 300
NOTHING, OUTSIDE = "", "outside"
"""Classes beside the names."""


def forest(truths: Mapping[str, ExamTruth], contents: Mapping[str, Content]) -> Rule | None:
    """Train on development recordings; returns the rule, or nothing without any to train on.

    The rule takes the likeliest name; knob: its probability. Its place is the one where the
    screening finds this name best.

    Raises
    ------
    ImportError
        scikit-learn is not installed.
    """
    from sklearn.ensemble import RandomForestClassifier

    known = {i: c for i, c in contents.items() if i in truths and _screening(c)}
    if not known:
        return None
    heads = sorted({h for c in known.values() for h in features(c)})
    made = RandomForestClassifier(TREES, min_samples_leaf=2, random_state=0)
    made.fit([_row(c, heads) for c in known.values()], [_label(truths[i]) for i in known])
    names = [str(x) for x in made.classes_]

    def rule(content: Content) -> Pick | None:
        if not _screening(content):
            return None
        sure = made.predict_proba([_row(content, heads)])[0]
        able = [i for i, n in enumerate(names) if n not in (NOTHING, OUTSIDE)]
        if not able:
            return None
        best = max(able, key=lambda i: sure[i])
        rows = [row for row in _screening(content) if row[0] == names[best]]
        here = [(share, _told_at(name, place, kind)) for name, place, kind, share, _ in rows]
        places = frozenset({max(here)[1]} if here else ())
        return Pick(names[best], places, (float(sure[best]),))

    return rule


def _told_at(effect: str, element: str, kind: str) -> str:
    return told_at(effect, element, {element} if kind == "sensor" else ())


def _label(truth: ExamTruth) -> str:
    """Return the effect that moves most of those that have a name."""
    named = [e for e in truth.effects if e.names]
    if named:
        return max(named, key=lambda e: e.moved).effect
    return OUTSIDE if truth.effects else NOTHING


def features(content: Content) -> dict[str, float]:
    """Return the best scores of the screening, by effect and by kind of element, and statistics.

    Effects are screened by the share of the misfit that they would remove and by its standard
    errors; the share is told of the largest as well.
    """
    found: dict[str, float] = {}
    top = max((row[3] for row in _screening(content)), default=0.0) or 1.0
    for effect, _, kind, share, z in _screening(content):
        for head, value in (
            (effect, share),
            (f"{effect} of the best", share / top),
            (f"{effect} z", z),
            (f"at a {kind}", share),
            (f"at a {kind} of the best", share / top),
            (f"{effect} at a {kind} of the best", share / top),
        ):
            found[head] = max(value, found.get(head, value))
    kept = content["baselines"]["residual"]
    return found | {head: value for head, value in kept.items() if value is not None}


def _screening(content: Content) -> list[Any]:
    rows = (content.get("baselines") or {}).get("screening") or ()
    return [row for row in rows if None not in row]


def _row(content: Content, heads: list[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    found = features(content)
    return np.array([found.get(h, 0.0) for h in heads])
