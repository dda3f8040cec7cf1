"""The stack bench that goes on: against its own equations, against the records, cut anywhere."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hardware.simulators.draw import ChannelNoise, Truth
from hardware.simulators.effects import CATALOGUE
from hardware.simulators.excitation import SAMPLE_RATE, voltage
from hardware.simulators.plant import BIAS, NOMINAL
from hardware.simulators.plants import Creeping, Disturbed, HystereticPlant, SensorNoise, StackPlant
from hardware.simulators.plants.line import DelayLine
from hardware.simulators.plants.native import library
from hardware.simulators.rig import Rig
from hardware.simulators.simulation import simulate

PAIRS = [(e.name, e.place) for e in CATALOGUE]
SEED = 11

compiled = pytest.mark.skipif(library() is None, reason="no compiler")


@functools.cache
def truth(name: Any, place: Any) -> Any:
    """Give one strong truth per entry, without the search for its promised strength."""
    entry = next(e for e in CATALOGUE if (e.name, e.place) == (name, place))
    shape = entry.shape(np.random.default_rng(SEED))
    amplitude = entry.classes["medium"][1] if entry.classes else 3.0 * entry.first_guess
    plant = replace(NOMINAL, R_e=18.0, k=55e6)
    noise = ChannelNoise(1e-9, 1e-4, 0.0, 0.0)
    return Truth(SEED, plant, entry.effect(shape, amplitude, plant), "strong", noise)


def plain() -> Any:
    """Give a bench that conceals nothing."""
    return truth("creep", "k").twin()


def edges(count: int, seed: int = 0) -> tuple[Any, Any]:
    """Random edges of a converter within `count` steps."""
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.0, count, count // 15))
    return at, 50.0 + 45.0 * np.sin(np.cumsum(rng.uniform(0.0, 1.0, at.size + 1)))


@compiled
@pytest.mark.parametrize(("name", "place"), PAIRS)
def test_compiled_code_is_the_same_equations(name: Any, place: Any) -> None:
    """C against the bench's own Python, with edges inside the steps; equal to rounding."""
    at, volts = edges(160)
    quick, slow = (StackPlant(truth(name, place), compiled=c) for c in (True, False))
    a, b = (p.advance_edges(160, at, volts) for p in (quick, slow))
    assert np.std(a.x) > 1e-7
    assert np.abs(a.x - b.x).max() < 1e-11 * np.ptp(b.x)
    assert np.abs(a.i - b.i).max() < 1e-11 * np.ptp(b.i)


@pytest.mark.parametrize(("name", "place"), PAIRS)
def test_the_records_of_the_sealed_bench_come_out(name: Any, place: Any) -> None:
    """The record's voltage in ever shorter steps converges to the record, in second order."""
    t, n = truth(name, place), 128
    command = voltage(SEED, n)
    reference = simulate(t.plant, t.effect, command)
    worst = []
    for parts in (8, 32):
        step = 1.0 / SAMPLE_RATE / parts
        plant = StackPlant(t, volts=float(command[0]), step=step, span=(n - 1) / SAMPLE_RATE)
        grid = np.interp(np.arange((n - 1) * parts + 1) / parts, np.arange(n), command)
        motion = plant.advance(0.5 * (grid[1:] + grid[:-1]))
        worst.append(np.abs(motion.x[parts - 1 :: parts] - reference.x[1:]).max())
    assert worst[1] < 3e-4 * np.ptp(reference.x)
    assert worst[1] < 0.12 * worst[0]


@pytest.mark.parametrize(("name", "place"), [p for p in PAIRS if library() is not None])
def test_cut_anywhere_and_looked_at_it_is_the_same(name: Any, place: Any) -> None:
    """State, dead times, drift and memory go on from call to call; a look leaves no trace."""
    whole, cut = StackPlant(truth(name, place)), StackPlant(truth(name, place))
    volts = np.repeat(50.0 + 45.0 * np.sin(np.arange(120.0)), 50)
    a = whole.advance(volts)
    pieces, at = [], 0
    for n in np.random.default_rng(5).integers(1, 900, 40):
        state = cut.snapshot()
        cut.advance(np.array([90.0, 3.0, 40.0]))
        cut.restore(state)
        pieces.append(cut.advance(volts[at : at + int(n)]))
        at += int(n)
    n = sum(p.x.size for p in pieces)
    x, i = (np.concatenate([getattr(p, c) for p in pieces]) for c in "xi")
    # late edges are counted from the cut, which rounds
    limit = 1e-10 if (name, place) == ("delay", "V_in") else 0.0
    assert np.abs(x - a.x[:n]).max() <= limit * np.ptp(x)
    assert np.abs(i - a.i[:n]).max() <= limit * np.ptp(i)


@pytest.mark.parametrize("place", ["C_nl", "k"])
def test_it_rests_and_holds(place: Any) -> None:
    """At rest at 0 V it reads nothing; after a step it settles where statics says."""
    plant = StackPlant(truth("nonlinear_stiffness", place))
    assert np.abs(plant.advance(np.zeros(2000)).x).max() < 1e-15
    motion = plant.advance(np.full(40_000, BIAS))
    p = truth("nonlinear_stiffness", place).plant
    assert np.ptp(motion.x[-1000:]) < 1e-14
    if place == "k":
        # the dielectric is linear then and the spring unloaded at rest
        assert motion.x[-1] == pytest.approx(p.T * p.C_q * BIAS, rel=1e-9)


def test_the_line_delays_exactly() -> None:
    """Cubic between steps."""
    grid = np.arange(4000.0)
    for delay in (0.0, 0.3, 1.0, 7.25):
        line = DelayLine(delay, 0.0)
        parts = [line.pass_on(np.sin(0.05 * part)) for part in np.split(grid, 16)]
        late = np.concatenate(parts)[50:]
        assert np.abs(late - np.sin(0.05 * (grid[50:] - delay))).max() < (
            1e-6 if delay >= 1.0 else 4e-4
        )


def test_edges_between_steps_are_exact_on_the_rig() -> None:
    """A converter of 3125 Hz, 100 Hz full swing: the answer is that of a step 10 times shorter."""
    seen = []
    instants = np.sort(np.random.default_rng(1).uniform(0.0, 0.02, 2000))
    for step in (5e-6, 5e-7):
        rig = Rig(StackPlant(truth("hysteresis", "C_nl"), step=step))
        for k in range(63):
            rig.wait_until(k / 3125.0 * 1.0000371)
            rig.drive(50.0 - 50.0 * np.cos(2.0 * np.pi * 100.0 * k / 3125.0))
        rig.wait_until(0.02)
        seen.append(rig.seen(instants).x)
    assert np.abs(seen[0] - seen[1]).max() < 0.1e-9
    assert np.ptp(seen[0]) > 2e-6


def test_hysteresis_and_creep_can_be_added() -> None:
    """A play holds its place at a reversal; creep goes on to its ratio."""
    bench = StackPlant(plain())
    gain = bench.advance(np.full(20_000, 1.0)).x[-1]
    plant = HystereticPlant(StackPlant(plain()), [10.0], [1.0], direct=0.0)
    levels = [50.0, 35.0, 30.0, 20.0]
    settled = [plant.advance(np.full(8000, v)).x[-1] / gain for v in levels]
    assert np.allclose(settled, [40.0, 40.0, 40.0, 30.0], rtol=1e-6)
    creeping = Creeping(StackPlant(plain()), [0.1, 0.05], [2e-3, 10e-3])
    x = creeping.advance(np.full(20_000, 10.0)).x / (10.0 * gain)
    assert x[-1] == pytest.approx(1.15, rel=1e-3)
    t = 4000
    expected = 1.0 + 0.1 * (1.0 - np.exp(-0.02 / 2e-3)) + 0.05 * (1.0 - np.exp(-0.02 / 10e-3))
    assert x[t - 1] == pytest.approx(expected, abs=2e-3)


def test_same_seed_same_bytes() -> None:
    """Two benches with the same seeds and commands; another seed is another bench."""

    def run(seed: int) -> bytes:
        rig = Rig(Disturbed(StackPlant(truth("creep", "k")), SensorNoise(1e-9, 1e-4, seed)))
        rng = np.random.default_rng(2)
        for _ in range(100):
            rig.wait(float(rng.uniform(0.0, 1e-3)))
            rig.drive(float(rng.uniform(0.0, 100.0)))
        seen = rig.seen(np.linspace(0.0, rig.now, 500))
        return seen.x.tobytes() + seen.i.tobytes()

    assert run(1) == run(1)
    assert run(1) != run(2)


@pytest.mark.long
@compiled
def test_ten_minutes_pass_in_bounded_memory() -> None:
    """Cost of every plant for a second, and 600 s of one of them."""
    import time
    import tracemalloc

    for name, place in PAIRS:
        plant = StackPlant(truth(name, place))
        at, volts = edges(200_000)
        begin = time.process_time()
        plant.advance_edges(200_000, at, volts)
        print(f"{name:20s} {place:5s} {time.process_time() - begin:.3f} s of CPU per second")
    tracemalloc.start()
    rig = Rig(StackPlant(truth("hysteresis", "C_nl")), keep=5.0)
    peaks = []
    for k in range(600):
        rig.drive(50.0 + 45.0 * np.sin(k))
        rig.wait(1.0)
        if k % 100 == 99:
            peaks.append(tracemalloc.get_traced_memory()[1])
    tracemalloc.stop()
    assert peaks[-1] < 1.05 * peaks[1]
    assert peaks[-1] < 100e6
