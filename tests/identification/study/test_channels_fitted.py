"""Gains, offsets, resolutions and dynamics of sensors in fits; commands beside their monitors."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Reading, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.graph.modulation import effort
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.estimation import Study, estimate
from identification.study.joint import JointPoint
from tests.bondgraph.readings_bench import bench, power, shaken
from tests.identification.study.test_joint import jacobian, residuals, somewhere
from tests.settled import simulate

T = np.asarray(1e-3 * np.arange(2000), np.float64)
FORCE = 3.0 * np.sin(2 * np.pi * (0.5 + 5.0 * T) * T) + np.repeat(
    np.random.default_rng(3).standard_normal(40), 50
)
TRUTH = {
    "m": 0.47, "k": 214.0, "d": 2.3, "gain_x": 1.9, "offset_x": 0.03, "gain_F": 1.4,
    "natural_frequency_a": 270.0, "damping_ratio_a": 0.5, "lag_f": 5e-3,
}  # fmt: skip
NOISE = {"x": 1e-4, "a": 5e-3, "f": 1e-2, "monitor": 1e-3}


def record(graph: BondGraph, truth: dict[str, float], **commands: np.ndarray) -> Recording:
    run, rng = simulate(graph, T, commands, truth), np.random.default_rng(7)
    read = {n: np.asarray(v) for n, v in run.outputs.items()}
    for n in read.keys() - {"x"}:  # what is rounded is read without noise
        read[n] = read[n] + NOISE.get(n, 1e-3) * rng.standard_normal(T.size)
    channels = {**commands, **read}
    return Recording("r", T, channels, {n: graph[n].unit for n in channels})  # type: ignore[attr-defined]


@cache
def benched() -> Recording:
    return record(bench(), TRUTH, F=FORCE)


@pytest.mark.parametrize("kind", ["exact", "general", "rate", "integral"])
def test_derivatives_match_differences(kind: str) -> None:
    if kind == "exact":
        graph = bench().with_element("x", resolution=None)
        free = list(TRUTH)
    elif kind in ("rate", "integral"):
        graph = shaken(kind)
        free = ["k", "d", "m", "offset_force", "natural_frequency_w", "damping_ratio_w"]
    else:
        graph = power().with_element("P", natural_frequency=200.0, damping_ratio=0.6, lag=3e-3)
        free = ["k", "gain_P", "offset_P", "natural_frequency_P", "damping_ratio_P", "lag_P"]
    command = "b" if "b" in graph.elements else "F"
    short = record(graph, {}, **{command: FORCE}).slice(0, 120)
    stack = Study(graph, short, free=free, n_sub=2).stack()
    point = somewhere(stack)
    exact, (lower, upper) = jacobian(stack, point), stack.bounds
    assert set(free) <= {stack.names[j] for j in np.flatnonzero(upper > lower)}
    for j in np.flatnonzero(upper > lower):
        ends = []
        for sign in (1, -1):
            theta = point.theta.copy()
            theta[j] += sign * 1e-5
            ends.append(residuals(stack, JointPoint(theta, point.states)))
        numeric = (ends[0] - ends[1]) / 2e-5
        size = np.linalg.norm(numeric)
        assert np.linalg.norm(exact[:, j] - numeric) < 5e-4 * size, stack.names[j]


def test_all_numbers_of_the_channels_are_found() -> None:
    noise = NOISE | {"x": 6e-4}  # a step of 2 mm
    found = estimate(Study(bench(), benched(), free=list(TRUTH), noise=noise))
    errors = {e.name: (e.value, *e.ci95) for e in found.estimates}
    for name, true in TRUTH.items():
        value, low, high = errors[name]
        assert value == pytest.approx(true, rel=1e-2), name
        assert abs(value - true) < 2.0 * (high - low), name
    # the declared offset takes the place of the nuisance, the others keep theirs
    assert "offset x" not in {e.name for e in found.nuisances}
    assert "offset a" in {e.name for e in found.nuisances}


def test_a_resolution_is_held_and_cannot_be_freed() -> None:
    assert "resolution_x" not in {v.name for v in Study(bench(), benched()).free}
    with pytest.raises(UnusableInput, match=r"resolution of x.* no fit finds it"):
        Study(bench(), benched(), free=["resolution_x"])


def two_commands() -> BondGraph:
    """Two masses, each pushed; the amplifier of the first has a lag and a monitor."""
    with BondGraph("two_commands") as g:
        g.parameter("tau", 4e-3, "s")
        g.parameter("ratio", 0.1, "V/N")
        first, s, second = One("first"), Zero("s"), One("second")
        Se("F_1", unit="N", drive=Drive(lag="tau")) >> first >> I("m_1", 0.5, unit="kg")
        first >> R("d_1", 3.0, unit="N*s/m")
        first >> s >> second >> I("m_2", 0.3, unit="kg")
        s >> C("k", stiffness=200.0, unit="N/m")
        Se("F_2", unit="N", gain=1.0) >> second >> R("d_2", 2.0, unit="N*s/m")
        second >> Dq("x", unit="m", offset=0.0)
        Reading("u_1", effort("F_1"), unit="V", gain="ratio", offset=0.0)
    return g


def test_two_commands_and_the_monitor_of_one() -> None:
    truth = {"tau": 6e-3, "ratio": 0.11, "gain_F_2": 0.8, "k": 230.0, "d_2": 2.5, "offset_u_1": 0.2}
    recording = record(two_commands(), truth, F_1=FORCE, F_2=2.0 * np.cos(35.0 * T * T))
    study = Study(two_commands(), recording, free=list(truth), noise={"x": 1e-3, "u_1": 1e-3})
    found = {e.name: e.value for e in estimate(study).estimates}
    assert found == pytest.approx(truth, rel=1e-2)
    # what the monitor says is the command behind its amplifier, not the command
    alone = simulate(two_commands(), T, {"F_1": FORCE, "F_2": 0 * T}, truth)["u_1"]
    late = simulate(two_commands(), T, {"F_1": FORCE, "F_2": FORCE}, truth)["u_1"]
    assert np.abs(np.asarray(alone) - np.asarray(late))[200:].max() < 1e-12
    assert np.abs((np.asarray(alone) - 0.2) / 0.11 - FORCE).max() > 0.1
