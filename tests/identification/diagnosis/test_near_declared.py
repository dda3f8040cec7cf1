"""A drive that rubs, read by a fine encoder: its fit bends far, and friction is found."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.laws import Coulomb, Law
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.screening.carried import FAR
from identification.diagnosis.search.beginnings import freed, resting
from identification.diagnosis.search.near_declared import TENFOLD, near_declared
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate

DT, STEP = 1e-3, 2e-5


def stage(law: Law | None = None) -> BondGraph:
    """A motor that drives a load over a coupling; its friction is viscous if nothing is said."""
    with BondGraph("stage") as g:
        motor, joint, coupling, load = One("motor"), Zero("joint"), One("coupling"), One("load")
        Se("F", unit="N") >> motor >> I("m1", 0.8, unit="kg")
        motor >> R("d", 6.0, unit="N*s/m", law=law)
        motor >> joint >> coupling >> C("k", stiffness=4e4, unit="N/m")
        coupling >> R("c", 8.0, unit="N*s/m")
        joint >> load >> I("m2", 1.5, unit="kg")
        load >> Dq("x", unit="m")
    return g


@cache
def recorded(n: int) -> Recording:
    t = np.asarray(DT * np.arange(n), np.float64)
    force = 12 * np.sin(2 * np.pi * (0.5 + 1.5 * t) * t) + 4 * np.sign(np.sin(1.8 * np.pi * t))
    x = simulate(stage(Coulomb(3.0)), t, {"F": force}, x0=None, hold="hold", accuracy=1e-6)["x"]
    x = STEP * np.round(np.asarray(x) / STEP)
    return Recording("run", t, {"F": force, "x": x}, {"F": "N", "x": "m"})


@cache
def fitted(n: int) -> Fit:
    r = recorded(n)
    data = Data(
        "run", np.asarray(r.time), {"F": np.asarray(r["F"])}, np.asarray(r["x"])[:, None], ("x",),
        np.array([STEP / np.sqrt(12)]), interleaved(0, n),
    )  # fmt: skip
    return nominal_fit(stage(), data, "linear")[1]


@pytest.mark.long
def test_a_fit_that_went_far_is_held_near_what_is_declared() -> None:
    free = fitted(4000)
    assert free.chi2("train") > FAR
    held = near_declared(free)
    assert held is not None
    declared = {n: p.value for n, p in stage().parameters.items()}
    far = {n: max(f.values[n] / v, v / f.values[n]) for f in (free,) for n, v in declared.items()}
    near = {n: max(held.values[n] / v, v / held.values[n]) for n, v in declared.items()}
    assert max(far.values()) > TENFOLD
    assert max(near.values()) < 0.3 * TENFOLD
    assert np.isfinite(held.cost)
    assert held.problem.priors == free.problem.priors  # what is known is not made up for later fits
    assert np.array_equal(held.problem.data.floor, free.problem.data.floor)


def test_a_fit_that_stayed_is_taken_as_it_is() -> None:
    free = fitted(4000)
    stayed = fit(replace(free.problem, fixed=tuple(stage().parameters)), max_iterations=3)
    assert stayed.chi2("train") > FAR
    assert near_declared(stayed) is None


def rubbing(**wrong: float) -> Problem:
    data = replace(fitted(4000).problem.data, hold="hold")
    return Problem(stage(Coulomb(2.8)).with_values(wrong), data, source_offsets=True)


def test_a_start_at_rest_leads_where_a_free_one_is_stuck() -> None:
    p = rubbing(m1=1.0, d=7.0, k=3e4, c=10.0, m2=1.3)
    stuck, still = fit(p, max_iterations=12), fit(resting(p), max_iterations=12)
    assert still.cost < 0.01 * stuck.cost
    assert not still.problem.free_states.size
    free = freed(still, 3)
    assert free.problem.free_states.size == p.free_states.size
    assert free.cost <= 1.001 * still.cost
    assert freed(free, 3) is free


@pytest.mark.long
def test_friction_of_a_drive_is_found_to_the_digit() -> None:
    found = diagnose(stage(), recorded(4000))
    named = [(s.chosen.effect, s.chosen.element) for s in found.findings if s.chosen]
    assert named[0] == ("coulomb_friction", "d")
    assert found.repaired is not None
    assert found.repaired.values["F_c_d"] == pytest.approx(3.0, rel=1e-3)
    assert found.repaired.values["m1"] == pytest.approx(0.8, rel=0.01)
