"""Heat lost by natural convection: a law of the catalogue is near it, a disturbance is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Se, Sf, Zero
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.explanation.advice import _incomplete, _surroundings
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.identification.diagnosis.decision_cases import trial

N, NOISE = 3000, 0.03
TIME = np.asarray(1.0 * np.arange(N), np.float64)


def heater(*, ambient: bool = False) -> BondGraph:
    """Two bodies that lose heat to an ambient, which is zero or a source."""
    with BondGraph("heater") as g:
        one, two, link, lost = Zero("one"), Zero("two"), One("link"), One("lost")
        Sf("P", unit="W") >> one >> C("C_1", 120.0, unit="J/K")
        one >> lost >> R("R_1a", 6.0, unit="K/W")
        one >> link >> two
        link >> R("R_12", 0.8, unit="K/W")
        two >> C("C_2", 60.0, unit="J/K")
        two >> R("R_2a", 4.0, unit="K/W")
        if ambient:
            lost >> Se("T_a", unit="K")
        one >> De("T1", unit="K")
        two >> De("T2", unit="K")
    return g


def convecting(seed: int) -> Recording:
    """Heat goes from the first body to the ambient as the power 1.25 of the difference."""
    rng = np.random.default_rng(seed)
    power, k = np.zeros(N), 60
    while k < N - 150:
        stop = k + int(rng.uniform(30, 260))
        power[k:stop] = rng.choice([0, 4, 8, 12, 18, 25])
        k = stop
    power[N - 100 :] = 0.0
    states, h = [np.zeros(2)], 0.5

    def rate(x: Array, p: float) -> Array:
        lost, across = x[0] / 6.6 * (abs(x[0]) / 20.0) ** 0.25, (x[0] - x[1]) / 0.9
        return np.array([(p - lost - across) / 135.0, (across - x[1] / 4.4) / 52.0])

    for p in np.repeat(power, 2):
        x = states[-1]
        a = rate(x, p)
        b = rate(x + 0.5 * h * a, p)
        c = rate(x + 0.5 * h * b, p)
        states.append(x + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(x + h * c, p)))
    seen = np.array(states[:-1:2]) + 21.4 + NOISE * rng.standard_normal((N, 2))
    channels = {"P": power, "T1": seen[:, 0], "T2": seen[:, 1]}
    return Recording("run", TIME, channels, {"P": "W", "T1": "K", "T2": "K"})


@pytest.mark.long
def test_a_disturbance_is_neither_named_nor_in_question_beside_the_bent_loss() -> None:
    """The rest of a law that is nearly right looks like anything in time at the store there."""
    d = diagnose(heater(), convecting(0), options=DiagnosisOptions(jobs=1))
    assert d.kind == "missing_physics"
    (found,) = d.findings
    assert found.chosen is not None
    assert found.chosen.label == "nonlinear_resistance at R_1a"
    assert found.rivals == ()


@pytest.mark.parametrize("recorded", [False, True])
def test_what_acts_on_a_warm_store_may_be_the_ambient(recorded: bool) -> None:
    step = SimpleNamespace(possible=(trial("external_disturbance at C_1", 0.0, 1.0),))
    beside = {"T_a": np.zeros(N)} if recorded else {}
    recording = Recording("run", TIME, {"P": TIME, **beside}, {"P": "W", "T_a": "K"})
    d: Any = SimpleNamespace(findings=(step,), graph=heater(ambient=recorded), recording=recording)
    said = list(_surroundings(d))
    assert len(said) == (0 if recorded else 1)
    assert all("that is what acts on C_1" in s for s in said)


@pytest.mark.parametrize(("left", "lines"), [(7.0, 2), (1.02, 0)])
def test_a_body_that_loses_heat_without_a_way_out_asks_for_a_resistor(
    left: float, lines: int
) -> None:
    step = SimpleNamespace(possible=(trial("leakage at C_1", 0.0, 1.0),))
    d: Any = SimpleNamespace(
        kind="missing_physics", findings=(step,), graph=heater(), limits=Thresholds(),
        left=Remaining({"T1": left}, True, 0.0),
    )  # fmt: skip
    said = list(_incomplete(d))
    assert len(said) == lines
    assert not said or said[0].startswith("declare a resistor from C_1 to the ambient")
