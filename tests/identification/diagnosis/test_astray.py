"""Nominal fits that do not follow the readings at all: what is missing is found all the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, Df, I, One, R, Se
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.screening.carried import astray
from identification.diagnosis.search import one_step
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.one_step import in_turn, without_place

pytestmark = pytest.mark.slow

DT = 0.1


def rotor() -> BondGraph:
    """A wheel turned both ways, with an encoder that may not know the sense."""
    with BondGraph("rotor") as g:
        w = One("w")
        Se("T", unit="N*m") >> w >> I("J", 0.8, unit="kg*m^2")
        w >> R("b", 0.4, unit="N*m*s/rad")
        w >> Df("speed", unit="rad/s")
    return g


@pytest.mark.long
def test_a_reading_without_a_sign() -> None:
    """The fit of the plain model is nearly zero: its course shows no effect at any port."""
    t = np.asarray(DT * np.arange(400), np.float64)
    torque = np.where(np.sin(2 * np.pi * 0.11 * t) + np.sin(2 * np.pi * 0.29 * t) > 0, 1.0, -1.0)
    speed = np.zeros(t.size)
    for i in range(1, t.size):
        decay = np.exp(-0.5 * DT)
        speed[i] = decay * speed[i - 1] + (1 - decay) * 2.0 * torque[i - 1]
    noise = 1e-3 * np.random.default_rng(1).standard_normal(t.size)
    y = np.abs(speed) + noise
    seen = Recording("run", t, {"T": torque, "speed": y}, {"T": "N*m", "speed": "rad/s"})
    found = diagnose(
        rotor(), seen, options=DiagnosisOptions(jobs=1, keep=3, more=0, effects=1), hold="hold"
    )
    assert found.nominal is not None
    assert astray(found.nominal)
    assert [d.chosen.effect for d in found.findings if d.chosen] == ["sensor_rectification"]


def test_both_rankings_in_turn() -> None:
    def screened(*labels: str) -> list[Any]:
        made = []
        for label in labels:
            effect, element = label.split("@")
            made.append(_Screened(effect, element))
        return made

    first, second = screened("a@k", "b@k", "c@d"), screened("c@d", "a@k", "d@m", "e@m")
    names = [f"{s.effect.name}@{s.element.name}" for s in in_turn(first, second)]
    assert names == ["a@k", "c@d", "b@k", "d@m", "e@m"]
    assert in_turn(first, second)[1] is second[0]
    assert in_turn(first, []) == first


class _Named:
    def __init__(self, name: str) -> None:
        self.name = name


class _Screened:
    def __init__(self, effect: str, element: str) -> None:
        self.effect, self.element = _Named(effect), _Named(element)


def test_where_it_is_takes_a_fit_that_follows_something(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(one_step, "nearest", lambda e: ("what is nearest",))
    at: Any = {"places": ("travel",), "answer": "unknown"}
    untold = Decision("unknown_physics", None, (), (), 0.0, 0.0, (), **at)
    evidence: Any = None
    said = without_place(untold, evidence)
    assert said.places == ()
    assert list(map(str, said.nearest)) == ["what is nearest"]
    told = Decision("unknown_physics", None, (), (), 0.0, 0.0, (), **{**at, "answer": "kind"})
    assert without_place(told, evidence) is told
