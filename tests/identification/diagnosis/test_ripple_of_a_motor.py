"""Ripple of many waves a turn where only the speed is read: the way is its sum."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Df, I, One, R, Se
from bondgraph.laws import Periodic
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate

N, DT = 5000, 1e-3
PERIOD = 2 * np.pi / 12


def motor() -> BondGraph:
    with BondGraph("motor") as g:
        shaft = One("shaft")
        Se("M", unit="N*m") >> shaft >> I("J", 7e-4, unit="kg*m2")
        shaft >> R("b", 3e-4, unit="N*m*s/rad")
        shaft >> Df("w", unit="rad/s")
    return g


@pytest.mark.slow
@pytest.mark.long
def test_ripple_is_named_along_a_way_that_nobody_measured() -> None:
    rng, t = np.random.default_rng(8), DT * np.arange(N)
    torque = np.repeat(rng.uniform(0.01, 0.04, 20), N // 20)
    torque[: N // 20] = 0.0
    ripple = C("cogs", law=Periodic(PERIOD, 0.02, 100.0, "N*m", "rad"))
    plant = motor().with_branch("shaft", [ripple])
    plant = plant.with_values({"J": 5e-4, "b": 5e-4, "a_cogs": 0.006, "b_cogs": 0.008})
    w = np.asarray(simulate(plant, t, {"M": torque}, hold="hold")["w"])
    assert w.sum() * DT > 150 * PERIOD
    w = w + 0.1 * rng.standard_normal(N)
    recorded = Recording.from_arrays("cogs", {"M[N*m]": torque, "w[rad/s]": w}, fs=1 / DT)
    found = diagnose(motor(), recorded, options=DiagnosisOptions(jobs=1, keep=4, more=2))
    (chosen,) = (d.chosen for d in found.findings if d.chosen)
    assert chosen.label == "position_periodic_force at J"
    values = chosen.fit.values
    assert np.hypot(values["a_ripple_J"], values["b_ripple_J"]) == pytest.approx(0.01, rel=0.03)
    assert values["period_ripple_J"] == pytest.approx(PERIOD, rel=2e-3)
    assert values["J"] == pytest.approx(5e-4, rel=0.02)
