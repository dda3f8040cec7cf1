"""Where a law switches within a step: against closed forms, in both engines."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.equations.codegen import program
from bondgraph.export.casadi_function import casadi_functions
from bondgraph.graph.elements import MTF
from bondgraph.graph.modulation import displacement
from bondgraph.laws import Coulomb, EndStop, Polynomial
from bondgraph.simulation.simulate import simulate, simulate_general
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.native import compiler

MASS, STIFFNESS, FRICTION = 0.5, 400.0, 0.8
TIME = 1e-3 * np.arange(1501)
native = pytest.mark.skipif(compiler() is None, reason="without gcc steps are not halved")


def rubbing() -> BondGraph:
    with BondGraph("rubbing") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
        body >> C("k", stiffness=STIFFNESS, unit="N/m")
        body >> R("d", 1e-12, unit="N*s/m", law=Coulomb(FRICTION))
        body >> Dq("x", unit="m")
    return g


def let_go(time: Array, begin: float) -> Array:
    """A spring let go at `begin`: half cycles about the end of the dead zone, then rest."""
    centre, half = FRICTION / STIFFNESS, np.pi * np.sqrt(MASS / STIFFNESS)
    x, amplitude = np.empty_like(time), begin - centre
    for n, t in enumerate(np.floor(time / half).astype(int)):
        turned = begin - 2.0 * centre * t
        while t and turned < centre:  # it has come to rest
            t, turned = t - 1, turned + 2.0 * centre
        late = min(time[n] - t * half, half if turned > centre else 0.0)
        amplitude = turned - centre
        x[n] = (-1) ** t * (centre + amplitude * np.cos(np.pi * late / half))
    return x


def stopped(*, damping: float = 1e-12, sides: str = "high") -> BondGraph:
    with BondGraph("stopped") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
        stop = EndStop(2e5, low=-5e-3, high=5e-3, sides=sides)
        body >> C("k", stiffness=STIFFNESS, unit="N/m", law=stop)
        body >> R("d", damping, unit="N*s/m")
        body >> Dq("x", unit="m")
        body >> Df("v", unit="m/s")
    return g


def bouncing(time: Array, force: float) -> Array:
    """Pushed against a stop without loss: arcs of two oscillations, over and over again."""
    gap, stop = 5e-3, 2e5
    w, rest = np.sqrt(STIFFNESS / MASS), force / STIFFNESS
    to = np.arccos(1.0 - gap / rest) / w  # x = rest (1 - cos(w t))
    speed = rest * w * np.sin(w * to)
    # beyond the gap m x'' = F - k x - k_s (x - gap)
    stiff = np.sqrt((STIFFNESS + stop) / MASS)
    away = (force - STIFFNESS * gap) / (STIFFNESS + stop)
    size, phase = np.hypot(away, speed / stiff), np.arctan2(-speed / stiff, -away)
    inside = -2.0 * phase / stiff
    late = np.mod(time, 2.0 * to + inside)
    free = rest * (1.0 - np.cos(w * np.minimum(late, 2.0 * to + inside - late)))
    touching = gap + away + size * np.cos(stiff * (late - to) + phase)
    return np.asarray(np.where((late > to) & (late < to + inside), touching, free))


def off(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.ptp(expected))


@native
@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
def test_a_mass_that_turns_under_friction(accuracy: float) -> None:
    expected = let_go(TIME, 0.03)
    assert np.ptp(expected[-200:]) < 1e-12
    made = simulate(
        rubbing(), TIME, {"F": np.zeros(TIME.size)}, x0={"q_k": 0.03, "p_m": 0.0}, accuracy=accuracy
    )
    assert made.settled
    assert made.steps_per_sample < 16
    assert off(made["x"], expected) < accuracy


@native
def test_what_is_turned_by_a_force_without_a_spring() -> None:
    """A step and its halves both end at rest where the motion has turned: the law tells them."""
    with BondGraph("pushed") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
        body >> R("d", 1e-12, unit="N*s/m", law=Coulomb(FRICTION))
        body >> Df("v", unit="m/s")
    time, force = TIME[:40], -1.0
    for begin in np.linspace(0.01, 0.1, 60):
        slowed, sped = (force - FRICTION) / MASS, (force + FRICTION) / MASS
        turn = -begin / slowed
        expected = np.where(time < turn, begin + slowed * time, sped * (time - turn))
        push = {"F": np.full(time.size, force)}
        made = simulate(g, time, push, x0={"p_m": MASS * begin}, accuracy=1e-7)
        assert made.settled
        assert off(made["v"], expected) < 1e-7, begin


def run(engine: str, accuracy: float, force: float = 4.0) -> tuple[Trajectory, Array]:
    by = simulate if engine == "exact" else simulate_general
    time = TIME[:801]
    push = {"F": np.full(time.size, force)}
    made = by(stopped(), time, push, hold="linear", accuracy=accuracy, x0={"q_k": 0.0, "p_m": 0.0})
    return made, bouncing(time, force)


@native
@pytest.mark.parametrize("engine", ["exact", "general"])
def test_a_mass_that_meets_a_stop(engine: str) -> None:
    """256 sub-steps a sample do not settle to this accuracy, without any loss least of all."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made, expected = run(engine, 1e-6)
    turns = np.sum(np.diff((expected > 5e-3).astype(int)) != 0)
    assert turns > 15
    assert made.settled
    assert made.steps_per_sample < 256
    assert off(made["x"], expected) < 2e-5


def test_without_a_compiler_all_sub_steps_are_doubled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    other = stopped(sides="both")  # another structure: nothing of it is compiled
    with pytest.warns(UserWarning, match="at 256 sub-steps a sample the outputs still change"):
        made = simulate(other, TIME[:100], {"F": np.full(100, 4.0)}, hold="linear", accuracy=1e-9)
    assert not made.settled


@native
def test_a_stop_beside_what_only_the_general_step_takes() -> None:
    """Where all sub-steps are doubled this was refused."""
    with BondGraph("lever") as g:
        body, inner = One("body"), One("inner")
        Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
        body >> R("d", 0.4, unit="N*s/m")
        body >> C("k", stiffness=STIFFNESS, unit="N/m", law=EndStop(2e5, -5e-3, 5e-3))
        body >> MTF("lever", ratio=displacement("k")) >> inner
        inner >> R("c", 0.5)
        body >> Dq("x", unit="m")
    push = 3.0 * np.sin(2.0 * np.pi * 1.7 * TIME) + 1.5 * np.sin(2.0 * np.pi * 5.3 * TIME + 1.0)
    rough, fine = (simulate(g, TIME, {"F": push}, hold="linear", accuracy=a) for a in (1e-5, 1e-7))
    assert fine.settled
    assert off(rough["x"], fine["x"]) < 3e-5


@native
def test_inputs_that_jump_are_no_switches() -> None:
    """A command that is held jumps at every sample; the motion is followed all the same."""
    push = np.where(TIME[:400] < 0.1, 3.0, -2.0)
    made = [
        by(stopped(damping=0.4), TIME[:400], {"F": push}, hold="hold", accuracy=1e-6)["x"]
        for by in (simulate, simulate_general)
    ]
    assert off(*made) < 2e-5


def test_pieces_of_a_law_are_told_to_casadi() -> None:
    two, none = EndStop(2e5, -5e-3, 5e-3), Polynomial(orders=(3,))
    for law, count in ((two, 2), (none, 0)):
        with BondGraph("pieces") as g:
            body = One("body")
            Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
            body >> C("k", stiffness=STIFFNESS, unit="N/m", law=law)
        model = casadi_functions(program(g))
        at = dict(zip(model.names.states, (0.0, 0.0), strict=True)) | {"q_k": 5e-3}
        zero = model.switches(t=0.0, x=list(at.values()), u=0.0, p=model.parameters(), m=[], h=0.0)[
            "zero"
        ]
        assert zero.shape == (count, 1)
        assert not count or np.abs(zero.full()).min() < 1e-15
