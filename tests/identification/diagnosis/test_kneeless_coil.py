"""Iron that bends without a knee: a series of the flux takes the place of two slopes."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, Df, I, One, R, Se
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.restoring.curves import kneeless_at
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate

N, DT = 2500, 2e-5


def choke() -> BondGraph:
    with BondGraph("choke") as g:
        coil = One("coil")
        Se("u", unit="V") >> coil >> I("L", 1.2e-3, unit="H")
        coil >> R("R_L", 0.5, unit="ohm")
        coil >> Df("i", unit="A")
    return g


@pytest.fixture(scope="module")
def recorded() -> Recording:
    t = DT * np.arange(N)
    tones = ((60, 0.3), (130, 1.1), (290, 2.0), (470, 0.1), (710, 4.0))
    u = np.asarray(sum(4.0 * np.sin(2 * np.pi * f * t + p) for f, p in tones))
    bent = choke().with_element("L", law=Polynomial(0.0, 6e-3, 1.0, (3,), "A"))
    bent = bent.with_values({"L": 1.35e-3, "R_L": 0.42, "a_3_L": 5.0})
    i = np.asarray(simulate(bent, t, {"u": u})["i"])
    i = i + 5e-3 * np.random.default_rng(3).standard_normal(N)
    return Recording.from_arrays("choke", {"u[V]": u, "i[A]": i}, fs=1 / DT)


@pytest.mark.long
def test_a_cubic_is_found_where_two_slopes_come_near(recorded: Recording) -> None:
    kept = ("nonlinear_stiffness", "eddy_current_loss")
    others = tuple(e.name for e in CATALOGUE if e.name not in kept)
    found = diagnose(choke(), recorded, options=DiagnosisOptions(jobs=1, without=others))
    (chosen,) = (d.chosen for d in found.findings if d.chosen)
    assert chosen.label == "nonlinear_stiffness at L"
    assert chosen.insertion.law == "polynomial"
    values = chosen.fit.values
    assert values["L"] == pytest.approx(1.35e-3, rel=3e-3)
    assert values["a_3_L"] / values["half_1_L"] ** 3 == pytest.approx(5.0 / 6e-3**3, rel=0.01)
    assert found.repaired is not None
    assert found.repaired.chi2("test") < 1.3
    (effect,) = (e for e in CATALOGUE if e.name == "nonlinear_stiffness")
    assert found.scene is not None
    assert kneeless_at(effect, found.scene, choke()["L"], {}) == ()  # type: ignore[arg-type]
