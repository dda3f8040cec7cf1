"""Numbers of a repair come from sub-steps that are enough; where they are not, it is said."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bondgraph.laws import QuadraticDrag
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words
from identification.estimation import enough_steps
from identification.estimation.estimate import estimate
from tests.settled import simulate
from tests.spring import spring

N, RATE, FINER, NOISE = 4000, 50.0, 32, 2e-5
TRUE = {"m": 0.5, "d": 2.0, "k": 200.0, "c_2_d": 3.0}


@cache
def recorded() -> Recording:
    """Return a drag simulated with many more steps than a search takes."""
    t, draw = np.arange(N) / RATE, np.random.default_rng(1)
    lines = np.arange(0.3, 6.0, 0.37)
    phases = draw.uniform(0.0, 2 * np.pi, lines.size)
    u = 3.0 * np.sin(2 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
    fine = np.arange(N * FINER) / (RATE * FINER)
    plant = spring().with_element("d", law=QuadraticDrag())
    x = simulate(plant, fine, {"F": np.interp(fine, t, u)}, {"c_2_d": 3.0})["x"][::FINER]
    x = x + NOISE * draw.standard_normal(N)
    return Recording.from_arrays("drag", {"F[N]": u, "x[m]": x}, fs=RATE)


def diagnosed() -> Diagnosis:
    others = tuple(e.name for e in CATALOGUE if e.name != "quadratic_drag")
    options = DiagnosisOptions(jobs=1, effects=1, keep=2, more=0, without=others)
    known = {"x": NOISE}
    return diagnose(
        spring(m=0.55, d=2.3, k=180.0), recorded(), options=options, noise=known, hold="linear"
    )


def test_no_number_of_a_repair_is_off_by_too_few_sub_steps() -> None:
    found = diagnosed()
    assert [s.chosen.label for s in found.findings if s.chosen] == ["quadratic_drag at d"]
    assert found.repaired is not None
    for e in found.repaired.estimates:
        error = (e.ci95[1] - e.ci95[0]) / 3.92
        assert abs(e.value - TRUE[e.name]) < 2.5 * error, e.name
    # its study carries them on
    assert found.study.n_sub == found.repaired.problem.n_sub
    assert not any("sub-steps" in n or "n_sub" in n for n in estimate(found.study).notes)
    assert "sub-steps" not in in_words(found)


def test_where_enough_sub_steps_would_take_too_long_it_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(enough_steps, "MOST", 1)
    found = diagnosed()
    (said,) = [n for n in found.notes if "sub-steps a sample" in n]
    assert "its interval is too narrow" in said
    assert said in in_words(found)
