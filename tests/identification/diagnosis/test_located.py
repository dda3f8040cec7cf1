"""Where relations leave one place, the decision is made there, and says why."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.places_without_name import located
from identification.diagnosis.search import looks
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import verdict
from tests.settled import simulate
from tests.spring import spring


def pushed() -> Recording:
    """A spring that something pushes now and then, which no law and no kind of its own follows."""
    t = np.asarray(0.01 * np.arange(700), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 3 * np.sin(2 * np.pi * 2.3 * t)
    rng = np.random.default_rng(3)
    force = sum(
        rng.normal(scale=6.0) * np.exp(-(((t - c) / 0.05) ** 2)) for c in rng.uniform(0, 7, 20)
    )
    x = simulate(spring(), t, {"F": u + force})["x"] + 1e-5 * rng.standard_normal(t.size)
    return Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})


def test_a_relation_that_leaves_hundreds_of_times_the_noise_places_nothing() -> None:
    """A delay of a reading bends all parameters; the relation of the spring leaves a sixtieth."""

    def placed(least: float) -> tuple[str, ...]:
        return located(
            (
                BlindRelation(("k",), 2.06e4, least, 1.09 * least, 1e4, 1e4, 1.154e4),
                BlindRelation(("i",), 8.2e3, 876.0, 748.0, 1e4, 1e4, 1.154e4),
                BlindRelation(("m", "R"), 2.1e4, 2.1e4, 2.1e4, 1e4, 1e4, 1.154e4),
            ),
            ("i", "x"),
        )

    assert placed(192.0) == ()
    assert placed(60.0) == ("k",)


@pytest.mark.long
def test_the_place_that_relations_leave_is_told_with_its_reason(monkeypatch: Any) -> None:
    place = ("k",)

    def relations(*_: Any) -> tuple[BlindRelation, ...]:
        return (
            BlindRelation(place, 400.0, 1.3, 1.4, 9.0, 1e3, 401.0),
            BlindRelation(("F", "m"), 400.0, 90.0, 95.0, 1e3, 1e3, 401.0),
        )

    options = DiagnosisOptions(jobs=1, keep=4, more=1, effects=1)
    monkeypatch.setattr(looks, "blind_relations", relations)
    d = diagnose(spring(), pushed(), options=options)
    assert d.kind == "unknown_physics"
    assert d.decision is not None
    assert d.decision.places == place
    assert "it sits at k: that leaves 1.14 times the noise" in d.decision.reasons[-1]
    assert "any other element that the model has 9.49 at least" in d.decision.reasons[-1]
    assert d.relations == relations()
    location = verdict(d)["findings"][0]["location"]
    assert place[0] in (location["element"], *location["indistinguishable_from"])
