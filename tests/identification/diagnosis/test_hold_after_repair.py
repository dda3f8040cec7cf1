"""What commands do between samples is asked again of the repaired model, at settled sub-steps."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Se, Zero
from bondgraph.laws import Law, NonlinearResistance
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions

NOISE = 5e-3


def circuit(law: Law | None = None, off: float = 1.0) -> BondGraph:
    with BondGraph("circuit") as g:
        loop, near, link, far = One("loop"), Zero("near"), One("link"), Zero("far")
        Se("V", unit="V") >> loop >> near >> link >> far
        loop >> R("R_1", 1e3 * off, unit="ohm", law=law)
        near >> C("C_1", 1e-6 * off, unit="F")
        link >> R("R_2", 2e3 / off, unit="ohm")
        far >> C("C_2", 0.5e-6 / off, unit="F")
        far >> R("R_L", 1e4 * off, unit="ohm")
        near >> De("v1", unit="V")
        far >> De("v2", unit="V")
    return g


def stepped(n: int, seed: int) -> Recording:
    """Return both voltages of a real circuit whose resistor hardens, behind a held command."""
    rng = np.random.default_rng(seed)
    t = 5e-5 * np.arange(n)
    drive = np.repeat(rng.uniform(-8.0, 8.0, n // 20), 20)
    real = circuit(NonlinearResistance(1.0, 1e-3), 1.1).with_values({"a_3_R_1": 0.6})
    made = simulate(real, t, {"V": drive}, accuracy=1e-7)
    read = {n: made[n] + NOISE * rng.standard_normal(t.size) for n in ("v1", "v2")}
    units = dict.fromkeys(("V", "v1", "v2"), "V")
    return Recording("run", np.asarray(t, np.float64), {"V": drive, **read}, units)


@pytest.mark.parametrize(
    ("n", "seed", "keep"),
    [
        pytest.param(2000, 8, 3, marks=pytest.mark.long),
        # the nominal fit has capacitors 200 times too large and takes steps for ramps
        pytest.param(1200, 1, 3, marks=pytest.mark.long),
        # it takes steps for ramps with capacitors half too large
        (600, 1, 2),
    ],
)
def test_a_step_that_was_taken_for_a_ramp_is_one_once_the_law_is_known(
    n: int, seed: int, keep: int
) -> None:
    """A coarse step with the wrong behaviour may seem to fit better than a fine one with it."""
    options = DiagnosisOptions(jobs=1, effects=1, keep=keep, more=1)
    d = diagnose(circuit(), stepped(n, seed), options=options)
    assert d.repaired is not None
    assert d.repaired.problem.data.hold == "hold"
    assert d.repaired.chi2("test") == pytest.approx(1.0, abs=0.2)
    assert [(s.answer, s.chosen and s.chosen.label) for s in d.findings] == [
        ("exact", "nonlinear_resistance at R_1")
    ]
