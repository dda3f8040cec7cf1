"""The kind ``mode``: filters of a mass's flow at what is left of the readings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from bondgraph import BondGraph, C, Df, I, One, R, Se
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue.storage.added_mode import ringing
from identification.diagnosis.evidence.block_score import score
from identification.diagnosis.evidence.kind_score import bench_of, kind_scores
from identification.diagnosis.screening.mode_forms import DAMPINGS, MODES, mode_forms
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import Fit
from identification.study.data import Data

N, DT, NOISE = 4000, 1e-3, 1e-3
OTHER = 2 * np.pi * 83.0


def oscillator() -> BondGraph:
    with BondGraph("oscillator") as g:
        tip = One("tip")
        Se("F", unit="N") >> tip >> I("m", 0.1, unit="kg")
        tip >> R("d", 0.2, unit="N*s/m")
        tip >> C("k", stiffness=1200.0, unit="N/m")
        tip >> Df("v", unit="m/s")
    return g


def answer(force: np.ndarray, omega: float, damping: float, residue: float) -> np.ndarray:
    """Velocity of a mode under a force, from its equations of motion."""
    a = [[0.0, 1.0], [-(omega**2), -2 * damping * omega]]
    system = StateSpace(a, [[0.0], [residue]], [[0.0, 1.0]], [[0.0]])
    return np.asarray(lsim(system, force, DT * np.arange(N))[1])


def measured(residue: float) -> Fit:
    """Fit one mode to what two answer; at the reading the second may have the other sign."""
    rng = np.random.default_rng(4)
    force = rng.standard_normal(N)
    first = answer(force, np.sqrt(1200.0 / 0.1), 0.2 / (2 * np.sqrt(1200.0 * 0.1)), 10.0)
    y = first + answer(force, OTHER, 0.008, residue) + NOISE * rng.standard_normal(N)
    t = np.asarray(DT * np.arange(N), np.float64)
    floor, split = np.array([NOISE]), interleaved(0, N)
    data = Data("run", t, {"F": force}, y[:, None], ("v",), floor, split, floor_measured=True)
    return nominal_fit(oscillator(), data, "linear")[1]


def test_ringing_is_what_scipy_integrates() -> None:
    flow = np.cumsum(np.random.default_rng(0).standard_normal(600))
    a, b = [[0.0, 1.0], [-(OTHER**2), -2 * 0.02 * OTHER]], [[0.0], [1.0]]
    c = np.diag([OTHER**2, OTHER])
    t = DT * np.arange(600)
    known = lsim(StateSpace(a, b, c, np.zeros((2, 1))), flow - flow[0], t)[1]
    for mine, theirs in zip(ringing(flow, OTHER, 0.02, DT), known.T, strict=True):
        assert np.abs(mine - theirs).max() < 1e-9 * np.abs(theirs).max()


@pytest.mark.parametrize("residue", [6.0, -6.0], ids=["in phase", "against it"])
def test_a_mode_is_seen_whatever_its_sign(residue: float) -> None:
    made = measured(residue)
    found = kind_scores(bench_of(made, made), scene(made), [])
    plain, best = score(made), found[0]
    assert (best.element, best.kind) == ("m", "mode")
    assert best.score.square < 0.3 * plain.square
    others = [k for k in found if k.kind != "mode"]
    assert min(k.score.square for k in others) > 0.6 * plain.square


def test_only_masses_have_modes() -> None:
    made = measured(6.0)
    looked = scene(made)
    graph = looked.graph
    columns = mode_forms(looked, graph["m"])["mode"].columns
    assert columns.shape[0] == N
    assert 2 * len(DAMPINGS) <= columns.shape[1] <= 2 * len(DAMPINGS) * MODES
    for name in ("d", "k", "F", "v"):
        assert mode_forms(looked, graph[name]) == {}
