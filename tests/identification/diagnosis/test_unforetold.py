"""What is missed by more than noise, and by more than the readings move, tells nothing."""

from __future__ import annotations

from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.conclusion import QUIET, unforetold
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate
from tests.spring import spring

SWING = 2.0


def left(x: float, v: float, floor: float = 0.5) -> Any:
    """A fit that misses the held-out samples of two readings, which swing by 2, by so much."""
    readings = SWING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    data = SimpleNamespace(readings=readings, floor=np.array([floor, floor]))
    return SimpleNamespace(
        problem=SimpleNamespace(data=data), rmse=lambda part: {"x": x, "v": v}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("missed", "floor", "told"),
    [
        ((2.5, 2.1), 0.5, True),
        ((2.5, 1.9), 0.5, False),
        ((2.5, 2.1), 2.0, False),  # nothing but noise to foretell
    ],
)
def test_nothing_is_foretold(missed: tuple[float, float], floor: float, told: bool) -> None:
    assert bool(unforetold(left(*missed, floor))) == told


def test_it_is_said_before_anything_else(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, t = np.random.default_rng(2), np.asarray(0.02 * np.arange(90), np.float64)
    model, force = spring(), np.sin(5.0 * t)
    x = np.asarray(simulate(model, t, {"F": force})["x"])
    noisy = x + 1e-5 * rng.standard_normal(t.size)
    recording = Recording("run", t, {"F": force, "x": noisy}, {"F": "N", "x": "m"})
    options = DiagnosisOptions(jobs=1, keep=1, more=1, effects=1)
    assert diagnose(model, recording, options=options).kind in QUIET
    monkeypatch.setattr(
        import_module("identification.diagnosis.diagnose"), "unforetold", lambda fit: ("missed",)
    )
    found = diagnose(model, recording, options=options)
    assert found.kind == "insufficient_data"
    assert str(found).startswith("There is too little to go on: missed.")
