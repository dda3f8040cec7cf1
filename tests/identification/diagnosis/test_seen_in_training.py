"""What happens rarely is divided between the samples that fit and those that judge."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from bondgraph.laws import Coulomb, EndStop
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved, stretches
from bondgraph.support.deadline import SEARCHED
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import STOPPED, Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.nominal import split_that_shows
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import Point
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 3000, 0.01, 2e-5
HIT = slice(1702, 1735)
"""Within a stretch that is held out of thirty, early enough to ring down in it."""


def run(hit: bool = True, dry: float = 0.0) -> Recording:
    """A stop that is reached in one stretch only, where the force is eight times as large."""
    t = np.asarray(DT * np.arange(N), np.float64)
    force = 2 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    force[HIT] *= 8
    law = EndStop(2000.0, -0.04, 0.04) if hit else None
    truth = spring(d=10.0).with_element("k", law=law)
    if dry:
        truth = truth.with_element("d", law=Coulomb(dry))
    x = simulate(truth, t, {"F": force})["x"]
    x += NOISE * np.random.default_rng(3).standard_normal(N)
    return Recording("run", t, {"F": force, "x": x}, {"F": "N", "x": "m"})


OPTIONS = DiagnosisOptions(jobs=1, keep=4, more=2, effects=1)


def few(*kept: str) -> DiagnosisOptions:
    """Where it is not the question which of all laws is missing."""
    return replace(OPTIONS, without=tuple(e.name for e in CATALOGUE if e.name not in kept))


def judged(r: Recording, options: DiagnosisOptions = OPTIONS, **given: object) -> Diagnosis:
    return diagnose(spring(d=9.0), r, options=options, **given)  # type: ignore[arg-type]


def test_the_hit_lies_in_a_stretch_that_is_held_out() -> None:
    held = stretches(interleaved(0, N).test)
    assert any(p.start <= HIT.start and HIT.stop <= p.stop for p in held)


def test_a_stop_reached_once_is_fitted_and_named() -> None:
    d = judged(run())
    assert d.data is not None
    assert "of 90 equal stretches" in d.data.split.rule
    assert d.kind == "missing_physics"
    assert [(s.chosen.effect, s.chosen.element) for s in d.findings if s.chosen] == [
        ("end_stop", "k")
    ]


@pytest.mark.long
def test_a_stop_that_hides_behind_friction_is_fitted_and_named() -> None:
    d = judged(run(dry=0.5), replace(OPTIONS, effects=2))
    assert d.data is not None
    assert "of 30 equal stretches" not in d.data.split.rule
    found = {(s.chosen.effect, s.chosen.element) for s in d.findings if s.chosen}
    assert found == {("coulomb_friction", "d"), ("end_stop", "k")}


@pytest.mark.long
def test_a_search_on_finer_stretches_that_is_stopped_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ctrl-C, the studio's stop and the time all come with the progress."""
    finer = interleaved(0, 900, 90)
    module = import_module(diagnose.__module__)
    monkeypatch.setattr(module, "split_that_shows", lambda fit, noise: finer)
    asked: list[str] = []

    def stop(text: str, fraction: float) -> None:
        if "floor" in text:
            asked.append(text)
        if len(asked) == 2 and fraction < SEARCHED:
            raise KeyboardInterrupt

    options = replace(few("coulomb_friction", "quadratic_drag", "end_stop"), effects=2)
    d = judged(run(hit=False, dry=0.5).slice(0, 900), options, progress=stop)
    assert d.data is not None
    assert "of 30 equal stretches" in d.data.split.rule
    assert [s.chosen.effect for s in d.findings if s.chosen] == ["coulomb_friction"]
    assert STOPPED in d.notes


def test_the_usual_division_stays_where_nothing_is_missed() -> None:
    d = judged(run(hit=False))
    assert d.data is not None
    assert "of 30 equal stretches" in d.data.split.rule
    assert d.kind in ("explained", "parameters_only")


def test_a_division_that_is_given_stays() -> None:
    d = judged(run(), few("end_stop"), split=interleaved(0, N))
    assert d.data is not None
    assert "of 30 equal stretches" in d.data.split.rule


def repaired(extra: np.ndarray, blocks: int = 30) -> Fit:
    """Return a fit that leaves noise of the floor, and something more at some samples."""
    t = np.asarray(DT * np.arange(N), np.float64)
    x = NOISE * np.random.default_rng(0).standard_normal(N) + extra
    floor, split = np.array([NOISE]), interleaved(0, N, blocks)
    data = Data("planted", t, {"F": t}, x[:, None], ("x",), floor, split)
    point = Point(np.zeros(0), np.zeros((1, 2)))
    problem = Problem(spring(), data)
    return Fit(problem, point, FitStatus.CONVERGED, 1.0, 1, np.zeros((N, 1)))


def test_finer_stretches_show_what_hides_in_held_out_ones() -> None:
    hidden = np.zeros(N)
    hidden[HIT] = 50 * NOISE
    split = split_that_shows(repaired(hidden), 1.5)
    assert split is not None
    assert "of 90 equal stretches" in split.rule or "of 270 equal stretches" in split.rule
    finer = repaired(hidden, 270)
    assert finer.chi2("train") > 0.1 * finer.chi2("test")  # there it shows anyway
    assert split_that_shows(finer, 1.5) is None


def test_what_shows_in_training_asks_for_no_finer_stretches() -> None:
    assert split_that_shows(repaired(np.zeros(N)), 1.5) is None
    everywhere = 5 * NOISE * np.sin(np.arange(N))
    assert split_that_shows(repaired(everywhere), 1.5) is None
