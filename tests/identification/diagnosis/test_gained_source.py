"""A source with a gain is searched as one without: its drive is given the command behind it."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Recording, Se
from bondgraph.graph.drives import Drive
from bondgraph.laws import Saturation
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words
from tests.settled import simulate

T = np.asarray(0.005 * np.arange(1600), np.float64)
FORCE = 8 * np.sin(2 * np.pi * (0.5 + 0.4 * T) * T) + 3 * np.sin(2 * np.pi * 0.6 * T)


def stage(gain: float | None, drive: Drive | None = None) -> BondGraph:
    with BondGraph("stage") as g:
        v = One("v")
        Se("F", unit="N", gain=gain, drive=drive) >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 4.0, unit="N*s/m")
        v >> C("k", stiffness=300.0, unit="N/m")
        v >> Dq("x", unit="m")
    return g


@pytest.mark.parametrize("gain", [pytest.param(None, marks=pytest.mark.long), 4.0])
def test_a_limit_of_the_drive_is_found_behind_a_gain(gain: float | None) -> None:
    x = np.asarray(simulate(stage(None, Drive(law=Saturation(-6.0, 7.0))), T, {"F": FORCE})["x"])
    x = x + 1e-3 * x.std() * np.random.default_rng(3).standard_normal(T.size)
    command = FORCE / (gain or 1.0)
    run = Recording.from_arrays("run", {"t[s]": T, "F[N]": command, "x[m]": x})
    found = diagnose(stage(gain), run, options=DiagnosisOptions(effects=1))
    (step,) = found.findings
    assert step.chosen is not None
    assert step.chosen.label == "saturation at F"
    assert found.repaired is not None
    assert ("is the command F behind its gain" in in_words(found)) == (gain is not None)
    values = found.repaired.values
    assert values["high_F"] == pytest.approx(7.0, rel=0.02)
    assert values["low_F"] == pytest.approx(-6.0, rel=0.02)
