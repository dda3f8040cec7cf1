"""Confidence of places, and its drawing."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, I, One, R, Se
from bondgraph.drawing import shading
from bondgraph.drawing.svg import svg
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import Insertion
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.localisation.recording.plausible import (
    confidence_of_places,
    place_weights,
)
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit


def graph() -> BondGraph:
    with BondGraph("spring") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> C("k", stiffness=200.0, unit="N/m")
    return g


def trial(element: str, level: float, *, home: bool = True, effect: str = "creep") -> Candidate:
    """A trial with 40 blocks about `level`; all share the same scatter."""
    scatter = 1 + 0.1 * np.random.default_rng(1).standard_normal(40)
    own = 1 + 0.1 * np.random.default_rng(len(element) + ord(element[0])).standard_normal(40)
    insertion = Insertion(effect, "memory", "law", element, graph(), (), ())
    fit: Fit = None  # type: ignore[assignment]
    return Candidate(insertion, home, fit, level, level, level * scatter * own)


def decision(chosen: Candidate, confidence: float, same: tuple[Candidate, ...] = ()) -> Decision:
    return Decision("missing_physics", chosen, same, (), 0.9, confidence, ())


def test_a_clear_winner_takes_it_all() -> None:
    w = place_weights([trial("k", 1.0), trial("d", 5.0), trial("m", 9.0)])
    assert w["k"] > 0.999
    assert sum(w.values()) == pytest.approx(1.0)


def test_equals_share_and_unusual_places_count_less() -> None:
    w = place_weights([trial("k", 1.0), trial("d", 1.0)])
    assert 0.2 < w["d"] <= 0.5 <= w["k"] < 0.8
    unusual = place_weights([trial("k", 1.0), trial("d", 1.0, home=False)])
    assert unusual["d"] < w["d"]


def test_an_unnamed_curve_locates_as_well() -> None:
    w = place_weights([trial("k", 3.0), trial("d", 1.0, effect="unknown")])
    assert w["d"] > 0.99


def test_no_trials_no_places() -> None:
    assert place_weights([]) == {}
    assert place_weights([trial("k", float("inf"))]) == {}


def test_the_named_class_has_at_least_the_confidence_of_the_name() -> None:
    k, d, m = trial("k", 1.0), trial("d", 1.0), trial("m", 1.0)
    w = confidence_of_places([decision(k, 0.95, (d,))], [k, d, m])
    assert w["k"] + w["d"] == pytest.approx(0.95)
    assert w["m"] == pytest.approx(0.05)


def test_two_effects_have_a_place_each() -> None:
    k, d = trial("k", 1.0), trial("d", 1.0)
    steps = [
        Decision("missing_physics", k, (), (), 0.9, 0.9, (), trials=(k, trial("d", 9.0))),
        Decision("missing_physics", d, (), (), 0.9, 0.9, (), trials=(d, trial("k", 9.0))),
    ]
    w = confidence_of_places(steps, ())
    assert min(w["k"], w["d"]) > 0.9


def test_nothing_missing_has_no_place() -> None:
    assert (
        confidence_of_places([Decision("explained", None, (), (), 0, 0, ())], [trial("k", 1)]) == {}
    )


def test_the_drawing_is_shaded() -> None:
    drawn = svg(graph(), marked={"k": "creep"}, also=["d"], shades={"k": 0.8, "d": 0.2, "m": 0.0})
    assert f'fill="{shading.fill(0.8)}"' in drawn
    assert "creep, 80 %" in drawn
    assert ">20 %<" in drawn
    assert "plausibility of the place" in drawn
    assert "cannot be told apart" in drawn
    assert "plausibility" not in svg(graph(), marked={"k": "creep"})
    without = svg(graph(), marked={"k": "creep"}, shades={"k": 0.8}, numbers=False)
    assert f'fill="{shading.fill(0.8)}"' in without
    assert "80 %" not in without
    with pytest.raises(BondsightError, match="kk"):
        svg(graph(), shades={"kk": 0.5})
