"""Evidence kept as numbers decides as the evidence itself."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.decision import Thresholds, decide
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.proof.exam.stored import evidence_of, recorded


def spring() -> BondGraph:
    with BondGraph("spring") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> Dq("x", unit="m")
    return g


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_stored_evidence_gives_the_same_decisions(friction: float) -> None:
    t = np.asarray(0.01 * np.arange(1200), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 3 * np.sin(2 * np.pi * 2.3 * t)
    truth = spring().with_element("d", law=Coulomb(friction)) if friction else spring()
    x = simulate(truth, t, {"F": u})["x"] + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    recording = Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})
    with recorded() as kept:
        found = diagnose(spring(), recording, options=DiagnosisOptions(jobs=1, effects=1))
    assert len(kept) == len(found.steps)
    again = [decide(evidence_of(c)) for c in json.loads(json.dumps(kept))]
    assert [d.kind for d in again] == [d.kind for d in found.steps]
    assert [d.answer for d in again] == [d.answer for d in found.steps]
    assert [d.places for d in again] == [d.places for d in found.steps]
    assert [d.chosen and d.chosen.label for d in again] == [
        d.chosen and d.chosen.label for d in found.steps
    ]
    if friction:
        assert found.kind == "missing_physics"
        blunt = decide(evidence_of(kept[0]), Thresholds(gain=1e9))
        assert blunt.kind != "missing_physics"
