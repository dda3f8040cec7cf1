"""A forgotten load of a motor looks like offsets of all sensors: the verdict says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph import GY, BondGraph, Df, I, MSe, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.explanation.advice import advice
from identification.diagnosis.explanation.constant_load import constant_load
from identification.diagnosis.verdict.text import sentence
from identification.estimation.leaning import leanings
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate

N, DT = 1500, 2e-3
FLOOR = np.array([1e-3, 2e-2])


def motor(load: float = 0.0) -> BondGraph:
    with BondGraph("motor") as g:
        coil, shaft = One("coil"), One("shaft")
        Se("U", unit="V") >> coil >> R("R_a", 1.2, unit="ohm")
        coil >> I("L_a", 1e-3, unit="H")
        coil >> GY("K", 0.06, unit="V*s/rad") >> shaft >> I("J", 4e-4, unit="kg*m2")
        shaft >> R("b", 2e-4, unit="N*m*s/rad")
        if load:
            MSe("load", load, unit="N*m") >> shaft
        coil >> Df("i", unit="A")
        shaft >> Df("w", unit="rad/s")
    return g


def fitted(load: float, offsets: tuple[float, float], model: BondGraph) -> Fit:
    t = np.asarray(DT * np.arange(N))
    u = 6 + 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    run = simulate(motor(load), t, {"U": u})
    y = np.stack([run["i"], run["w"]], axis=1) + np.array(offsets)
    y = y + FLOOR * np.random.default_rng(0).standard_normal(y.shape)
    data = Data("run", t, {"U": u}, y, ("i", "w"), FLOOR, interleaved(0, N), floor_measured=True)
    return fit(Problem(model, data))


def test_one_load_stands_for_the_offsets_of_two_sensors() -> None:
    made = fitted(-0.03, (0.0, 0.0), motor())
    load = constant_load(made, leanings(made))
    assert load is not None
    assert (load.offsets, load.places, load.junction) == (("offset i", "offset w"), ("J",), "shaft")
    assert load.value == pytest.approx(-0.03, rel=0.02)
    assert load.claim == (
        "offset i and offset w together are what one constant torque of 30 mN*m at J would do"
    )
    assert f'put MSe("load", {load.value:.4g}, unit="N*m") at shaft' in load.advice
    # with that the model leans on nothing any more
    mended = fitted(-0.03, (0.0, 0.0), motor(load.value))
    assert not [n for n in leanings(mended) if n.estimate.name.startswith("offset")]


@pytest.mark.parametrize("offsets", [(0.5, 0.0), (0.5, 3.0)])
def test_offsets_that_no_load_would_give_stay_offsets(offsets: tuple[float, float]) -> None:
    made = fitted(0.0, offsets, motor())
    assert leanings(made)
    assert constant_load(made, leanings(made)) is None


def test_answer_and_advice_name_the_load() -> None:
    made = fitted(-0.03, (0.0, 0.0), motor())
    run = Recording("run", made.problem.data.time, {"w": np.zeros(N)}, {"w": "rad/s"})
    d = Diagnosis("parameters_only", "motor", run, motor(), made.problem.data, nominal=made)
    assert d.load is not None
    assert sentence(d).endswith(f"nothing missing shows. But {d.load.claim}.")
    slow = replace(d, left=Remaining({"w": 2.6}, False, 0.0))  # the rest has the colour of noise
    assert "nothing missing shows. But 2.6 times the noise of the quickest" in sentence(slow)
    assert advice(d, np.array([1.0])) == (d.load.advice,)
    unknown = replace(d, kind="unknown_physics")  # what is missing may have bent the offsets
    assert unknown.load is None
