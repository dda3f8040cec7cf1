"""What repeats along a way is drawn within its period: over many it is a tangle."""

from __future__ import annotations

from base64 import b64decode
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph import C
from bondgraph.laws import Periodic
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.explanation.latent_signal import Latent
from identification.diagnosis.explanation.recovered import NO_POINTS
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.studio import law_plane
from identification.diagnosis.studio.law_plane import planes
from tests.settled import simulate
from tests.spring import spring

N, DT = 1500, 0.01


def recorded(effect: str, period: float) -> Recording:
    """A spring whose reading errs, or whose mass is pushed, several times along its way."""
    t = DT * np.arange(N)
    u = 4.0 * np.sin(2 * np.pi * 0.7 * t) + 3.0 * np.sin(2 * np.pi * 0.23 * t)
    g = spring()
    if effect == "position_periodic_force":
        g = g.with_branch("v", [C("ripple", law=Periodic(period, 1.0, 0.1))])
        g = g.with_values({"a_ripple": 0.3, "b_ripple": 0.1})
    x = np.asarray(simulate(g, t, {"F": u})["x"])
    if effect == "periodic_error":
        x = x + 4e-4 * np.sin(2 * np.pi * x / period + 0.4)
    x = x + 1e-5 * np.random.default_rng(1).standard_normal(N)
    return Recording.from_arrays("turns", {"F[N]": u, "x[m]": x}, fs=1.0 / DT)


def values(packed: Any) -> FloatArray:
    return np.frombuffer(b64decode(packed), "<f4").astype(float)


@pytest.mark.parametrize(
    ("effect", "element", "period", "follows"),
    [("periodic_error", "x", 6e-3, 0.98), ("position_periodic_force", "m", 8e-3, 0.8)],
)
@pytest.mark.sampled(every=2)
def test_a_way_is_folded_by_the_period(
    effect: str, element: str, period: float, follows: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    others = tuple(e.name for e in CATALOGUE if e.name != effect)
    options = DiagnosisOptions(jobs=1, effects=1, keep=2, more=0, without=others)
    found = diagnose(spring(), recorded(effect, period), options=options)
    assert [s.chosen.label for s in found.findings if s.chosen] == [f"{effect} at {element}"]
    # noise that was read far too high, off the very law, hides nothing
    plane = planes(_read_louder(found))["of"][element]
    x, y = values(plane["x"]), values(plane["y"])
    assert plane["xLabel"] == "way within its period (mm)"
    assert 0.0 <= x.min() < x.max() <= 1e3 * period * 1.01
    (law,) = plane["laws"]
    on_it = np.interp(x, values(law["x"]), values(law["y"]))
    assert np.corrcoef(on_it, y)[0, 1] > follows
    assert f"the period of {1e3 * period:.0f} mm" in plane["open"]
    assert NO_POINTS not in plane["open"]
    monkeypatch.setattr(law_plane, "recovered", _nothing)
    plane = planes(found)["of"][element]
    assert values(plane["x"]).size == 0
    assert NO_POINTS in plane["open"]


def _read_louder(d: Diagnosis) -> Diagnosis:
    assert d.scene is not None
    data = replace(d.scene.data, floor=100.0 * d.scene.data.floor)
    return replace(d, scene=replace(d.scene, data=data))


def _nothing(d: Diagnosis, *_: Any) -> Latent:
    assert d.scene is not None
    return Latent(np.zeros(d.scene.data.n), 0.0, 0.0, 0.0, 0)


def test_what_moves_by_few_periods_is_drawn_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    others = tuple(e.name for e in CATALOGUE if e.name != "periodic_error")
    options = DiagnosisOptions(jobs=1, effects=1, keep=2, more=0, without=others)
    found = diagnose(spring(), recorded("periodic_error", 0.03), options=options)
    plane = planes(found)["of"]["x"]
    assert "within" not in plane["xLabel"]
    assert values(plane["x"]).size == N
    monkeypatch.setattr(law_plane, "recovered", _nothing)
    plane = planes(found)["of"]["x"]
    assert (values(plane["x"]).size, plane["open"]) == (0, NO_POINTS)
