"""Operators behind and beside each other: the full model of Kuhnen and its inverse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    BadParameter,
    DeadZones,
    MaxwellResistiveCapacitor,
    NotInvertible,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.composed.cascade import Cascade, inverse_memory_of, inverse_of
from bondgraph.hysteresis.composed.parallel import Parallel
from bondgraph.hysteresis.creep.hysteresis_with_creep import HysteresisWithCreep
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.numeric_inverse import numeric_inverse
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.examples import CREEP, PI, ZONES, wander

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)

FULL = Cascade(HysteresisWithCreep(PI, CREEP), ZONES)


@quick
@given(seed=seeds)
def test_plays_then_dead_zones_are_the_operator_of_ang(seed: Any) -> None:
    x = wander(seed)
    cascade, ang = Cascade(PI, ZONES), Ang(PI, ZONES)
    z, memory = cascade.run(x)
    expected, after = ang.run(x)
    np.testing.assert_allclose(z, expected, atol=1e-13)
    assert memory == pytest.approx(after, abs=1e-14)
    np.testing.assert_allclose(cascade.inverse().run(z)[0], ang.inverse().run(z)[0], atol=1e-12)


@quick
@given(seed=seeds, step=st.sampled_from([1e-4, 0.02, 3.0]))
def test_full_model_round_trip_from_a_memory_with_a_past(seed: Any, step: Any) -> None:
    _, memory = FULL.run(wander(seed), step=0.1)
    x = wander(seed + 1, n=200)
    z, after = FULL.run(x, memory, step=step)
    back, after_back = FULL.inverse().run(z, FULL.inverse_memory(memory), step=step)
    assert np.max(np.abs(back - x)) < 1e-13 * np.ptp(x)
    np.testing.assert_allclose(after_back, FULL.inverse_memory(after), atol=1e-11)


def test_full_model_round_trip_as_a_number() -> None:
    worst = 0.0
    for seed in range(30):
        _, memory = FULL.run(wander(seed), step=0.1)
        x = wander(seed + 100, n=2000)
        z, _ = FULL.run(x, memory, step=0.02)
        back, _ = FULL.inverse().run(z, FULL.inverse_memory(memory), step=0.02)
        worst = max(worst, float(np.max(np.abs(back - x)) / np.ptp(x)))
    print(f"plays, creep and dead zones: round trip {worst:.1e} of the range")
    assert worst < 2e-14


def test_feed_forward_makes_the_reference() -> None:
    """The other way round: the inverse drives, the model follows."""
    wanted = 3.0 * np.sin(np.linspace(0, 12, 1500))
    drive, _ = FULL.inverse().run(wanted, step=0.01)
    start = FULL.initial_memory(float(drive[0]))
    made, _ = FULL.run(drive, start, step=0.01)
    assert np.max(np.abs(made - wanted)) < 1e-13
    # without the creep in the inverse the output drifts away
    blind, _ = Ang(PI, ZONES).inverse().run(wanted)
    assert np.max(np.abs(FULL.run(blind, step=0.01)[0] - wanted)) > 0.1


def test_inverse_reverses_the_order_and_the_memory() -> None:
    cascade = Cascade(PI, AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6))
    inverse = cascade.inverse()
    assert inverse.first == cascade.second.inverse()  # type: ignore[attr-defined]
    assert inverse.second == PI.inverse()
    _, memory = cascade.run(wander(2))
    assert inverse.first.n_memory == 6
    assert cascade.inverse_memory(memory)[6:] == PI.inverse_memory(memory[:3])
    twice = Cascade(PI, PrandtlIshlinskii((0.0, 0.5), (0.8, 0.7)))
    _, memory = twice.run(wander(2))
    again = twice.inverse().inverse_memory(twice.inverse_memory(memory))
    np.testing.assert_allclose(again, memory, atol=1e-12)


def test_claims() -> None:
    straight = DeadZones((0.0,), (2.0,))
    assert Cascade(PI, straight).congruent
    assert not Cascade(PI, ZONES).congruent
    assert Cascade(ZONES, PI).congruent
    assert Cascade(PI, ZONES).wipes_out
    assert not FULL.wipes_out
    assert FULL.timed
    assert not Cascade(PI, ZONES).timed
    # a first stage that falls with its input spoils what the second one remembers
    falling = DeadZones((0.0, 1.0), (1.0, -2.0))
    assert not Cascade(falling, PI).wipes_out
    assert not Cascade(falling, PI).congruent
    assert Cascade(PI, falling).wipes_out
    assert Cascade(PI, ZONES).passive_port is None


def test_parallel_adds_outputs_and_energies() -> None:
    plays = PrandtlIshlinskii((0.0, 0.3, 1.0), (1.2, 0.6, 0.4))
    more = PrandtlIshlinskii((0.0, 0.5), (0.1, 0.8))
    both = Parallel(plays, more)
    x = wander(3)
    y, memory = both.run(x)
    np.testing.assert_allclose(y, plays.run(x)[0] + more.run(x)[0], atol=1e-13)
    assert both.passive_port == "input"
    way = np.linspace(float(x[-1]), -6.0, 4001)
    output = both.value(NUMPY, way, memory)
    work = np.sum(0.5 * (way[1:] + way[:-1]) * np.diff(output))
    rise = both.stored_energy(NUMPY, -6.0, memory) - both.stored_energy(NUMPY, way[0], memory)
    lost = both.dissipated_energy(NUMPY, -6.0, memory)
    assert lost > 0.0
    assert work == pytest.approx(rise + lost, rel=1e-6)
    assert Parallel(plays, ZONES).passive_port is None  # one at each port
    assert Parallel(plays, CREEP).passive_port is None
    with pytest.raises(BadParameter, match="no energy function"):
        Parallel(plays, CREEP).stored_energy(NUMPY, 0.0, (0.0,) * 9)


def test_parallel_with_linear_creep_is_inverted_numerically() -> None:
    model = Parallel(PI, KelvinVoigtCreep(1.0, (0.3, 0.2), (0.1, 2.0)))
    x = wander(4, n=300)
    memory = model.initial_memory(0.0)
    y, _ = model.run(x, memory, step=0.05)
    back, _ = numeric_inverse(model, y, memory, step=0.05)
    assert np.max(np.abs(back - x)) < 1e-10


def test_sum_of_creep_and_hysteresis_is_the_model_of_both() -> None:
    x = wander(5)
    both, _ = HysteresisWithCreep(PI, CREEP).run(x, step=0.1)
    np.testing.assert_allclose(Parallel(PI, CREEP).run(x, step=0.1)[0], both, atol=1e-13)


def test_errors_name_the_part() -> None:
    with pytest.raises(BadParameter, match="second must be an operator, not float"):
        Cascade(PI, 1.0)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="first must be an operator, not str"):
        Parallel("plays", PI)  # type: ignore[arg-type]
    with pytest.raises(NotInvertible, match="parallel has no exact inverse") as caught:
        Cascade(PI, Parallel(PI, PI)).inverse()
    assert caught.value.index == -1
    with pytest.raises(NotInvertible, match="maxwell"):
        inverse_of(NUMPY, MaxwellResistiveCapacitor((1.0,), (1.0,)))
    with pytest.raises(NotInvertible, match=r"weights\[1\] = -2"):
        Cascade(PrandtlIshlinskii((0, 1), (1, -2)), ZONES).inverse()
    assert inverse_memory_of(NUMPY, ZONES, ()) == ()
