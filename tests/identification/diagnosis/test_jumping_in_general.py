"""Dry friction at the joint of a pendulum: no sum of a linear model and scalar laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.equations.derivation import equations
from bondgraph.laws import Coulomb, Law
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import verdict
from tests.identification.study.general_plants import pendulum
from tests.settled import simulate

LEVEL = 0.05


def swung(law: Law | None) -> Recording:
    rng = np.random.default_rng(1)
    t = np.asarray(0.01 * np.arange(600), np.float64)
    given: dict[str, Any] = {"T": 2.0 * np.repeat(rng.standard_normal(30), 20)}
    phi = np.asarray(simulate(pendulum().with_element("b", law=law), t, given, hold="hold")["phi"])
    given["phi"] = phi + 1e-4 * phi.std() * rng.standard_normal(t.size)
    return Recording("swing", t, given, {"T": "N*m", "phi": "rad"})


@pytest.mark.long
def test_friction_in_a_pendulum_is_named() -> None:
    assert equations(pendulum()).lure is None
    options = DiagnosisOptions(jobs=1, keep=2, more=1, effects=1)
    d = diagnose(pendulum(), swung(Coulomb(LEVEL)), hold="hold", options=options)
    (finding,) = verdict(d)["findings"]
    assert (finding["effect"], finding["location"]["element"]) == ("coulomb_friction", "b")
    assert d.repaired is not None
    assert d.repaired.values["F_c_b"] == pytest.approx(LEVEL, rel=0.02)
