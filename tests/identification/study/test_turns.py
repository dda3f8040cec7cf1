"""Encoders that are declared to wrap are fitted and diagnosed as if they counted on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, I, One, R, Se
from bondgraph.graph.composing.instruments import encoder
from bondgraph.graph.sensors import Sensor
from bondgraph.laws.wrapping import Wrapping
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.estimation.estimate import estimate
from identification.study.calibration import Known
from identification.study.specification import Nuisances
from identification.study.study import Study
from tests.settled import simulate

DT = 0.01
TURN = 2 * np.pi


def rotor(
    j: float, b: float, *, k: float | None = None, counted: bool = False, wraps: bool = True
) -> BondGraph:
    with BondGraph("rotor") as g:
        w = One("w")
        Se("T", unit="N*m") >> w >> I("J", j, unit="kg*m^2")
        w >> R("b", b, unit="N*m*s/rad")
        if k is not None:
            w >> C("k", stiffness=k, unit="N*m/rad")
        w >> encoder("phi", 4000, wraps=wraps, counted=counted)
    return g


def recorded(g: BondGraph, mean: float, n: int = 900, name: str = "run") -> Recording:
    t = np.asarray(DT * np.arange(n), np.float64)
    torque = mean + np.sin(3.0 * t + mean) + 0.5 * np.sign(np.sin(1.1 * t))
    run = simulate(g, t, {"T": torque})
    unit = g.of_type(Sensor)[0].unit
    return Recording(
        name, t, {"T": torque, "phi": np.asarray(run["phi"])}, {"T": "N*m", "phi": unit}
    )


def turns(g: BondGraph) -> bool:
    return all(isinstance(s.law, Wrapping) for s in g.of_type(Sensor))


@pytest.mark.parametrize("counted", [False, True])
def test_a_fit_finds_what_it_finds_of_an_encoder_that_counts_on(counted: bool) -> None:
    r = recorded(rotor(0.8, 0.4, counted=counted), 1.0)
    found = estimate(Study(rotor(1.0, 0.3, counted=counted), r, ("J", "b")))
    assert found.values["J"] == pytest.approx(0.8, rel=1e-4)
    assert found.values["b"] == pytest.approx(0.4, rel=1e-4)
    # what is simulated, kept and foretold reads as declared
    assert turns(found.graph())
    assert turns(found.study.graph)
    assert found.study.recordings == (r,)
    turn = 4000.0 if counted else TURN
    off = np.abs(found.predict(r)[:, 0] - r["phi"])
    assert np.minimum(off, np.abs(turn - off)).max() < 1e-3 * turn
    assert np.mean(off > 0.5 * turn) < 0.01  # but for jumps that come a sample late


def test_several_recordings_and_windows() -> None:
    records = [recorded(rotor(0.8, 0.4), mean, name=f"at {mean}") for mean in (1.0, -1.5)]
    for window in (None, 150):
        found = estimate(Study(rotor(1.0, 0.3), records, ("J", "b"), window=window))
        assert found.values["J"] == pytest.approx(0.8, rel=1e-3)


def test_readings_begin_in_the_turn_of_the_model() -> None:
    """A shaft on a spring that rests a little before the turn reads nearly a whole one."""
    true = rotor(0.2, 0.4, k=2.0)
    r = recorded(true, -0.4)
    late = r.slice(100, r.n)
    first = next(i for i in range(late.n) if late["phi"][i] > 0.6 * TURN)
    late = late.slice(first, late.n)
    assert late["phi"][0] > 0.6 * TURN
    problem = Study(true, late).stack().problems[0]
    assert problem.data.readings[0, 0] == pytest.approx(late["phi"][0] - TURN)
    known = Study(true, late, initial={"q_k": late["phi"][0] + 2 * TURN}).stack().problems[0]
    assert known.data.readings[0, 0] == pytest.approx(late["phi"][0] + 2 * TURN)
    found = estimate(Study(rotor(0.3, 0.3, k=3.0), late, ("J", "b", "k")))
    assert found.values["k"] == pytest.approx(2.0, rel=1e-3)


@pytest.mark.long
def test_a_diagnosis_judges_the_model_and_not_the_jumps() -> None:
    r = recorded(rotor(0.8, 0.4), 1.0)
    for asked in ((rotor(1.0, 0.3), r), (Study(rotor(1.0, 0.3), r),)):
        d = diagnose(*asked, options=DiagnosisOptions(jobs=1, keep=2, more=1, effects=1))
        assert d.kind == "parameters_only"
        assert d.repaired is None
        assert d.nominal is not None
        assert d.nominal.values["J"] == pytest.approx(0.8, rel=1e-3)
        assert turns(d.study.graph)


def fast(r: Recording) -> Recording:
    around = np.asarray(np.mod(0.45 * TURN * np.arange(r.n), TURN), np.float64)
    return replace(r, channels={**r.channels, "phi": around})


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (
            lambda r: Study(rotor(0.8, 0.4), fast(r)),
            "phi moves by 0.45 of a turn from one sample to the next",
        ),
        (
            lambda r: Study(rotor(0.8, 0.4, counted=True), r, ("J", "gain_phi")),
            "phi begins anew after each turn, and what a turn reads depends on gain_phi",
        ),
        (
            lambda r: Study(
                rotor(0.8, 0.4), r, nuisances=Nuisances(gains={"phi": Known(1.0, 0.02)})
            ),
            "depends on gain_phi, which is fitted; hold gain_phi",
        ),
    ],
)
def test_what_turns_cannot_be_told_is_one_line(
    make: Callable[[Recording], object], says: str
) -> None:
    r = recorded(rotor(0.8, 0.4), 1.0, n=100)
    with pytest.raises(UnusableInput, match=says):
        make(r)
