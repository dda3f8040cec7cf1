"""The device bench's stack: its physics by statics, poles and energy, and cut anywhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.sensing import SENSOR_LAWS
from hardware.simulators.plant_contract import EdgeDriven, Rewindable
from hardware.simulators.plants import (
    ConcealedStack,
    Creeping,
    Disturbed,
    GeneratedPlant,
    HystereticPlant,
    SensorNoise,
    conceal,
    plain_stack,
)
from hardware.simulators.plants.line import DelayLine
from hardware.simulators.plants.stack import BIAS, P840_1, STEP, effects
from hardware.simulators.rig import Rig

SEED = 11
GAIN = P840_1["alpha"] / P840_1["k"]
EFFECTS = effects()[1:]


def strong(name: str, place: str | None = None) -> ConcealedStack:
    return conceal(SEED, name, place, "strong")


def about_the_middle(drawn: ConcealedStack) -> GeneratedPlant:
    """Drive it by what differs from 50 V, from rest there."""
    return GeneratedPlant(
        "stack", drawn.case.parameters, drawn.effects, sized_on=drawn.sized_on, step=STEP
    )


def state_matrix() -> Any:
    """Of charge on the ceramic, displacement and speed; by Kirchhoff's and Newton's laws."""
    p = P840_1
    return np.array(
        [
            [-1.0 / (p["R_a"] * p["C_a"]), 0.0, -p["alpha"]],
            [0.0, 0.0, 1.0],
            [p["alpha"] / (p["C_a"] * p["m"]), -p["k"] / p["m"], -p["b"] / p["m"]],
        ]
    )


def test_it_is_a_plant_of_the_bench() -> None:
    plant = plain_stack()
    assert isinstance(plant, Rewindable)
    assert isinstance(plant, EdgeDriven)
    assert set(P840_1) == set(PLANTS["stack"].nominal)


def test_it_moves_54_nm_a_volt_and_rests() -> None:
    """At rest at 0 V it reads nothing; after a step it settles where statics says."""
    plant = plain_stack()
    assert np.abs(plant.advance(np.zeros(2000)).x).max() == 0.0
    motion = plant.advance(np.full(20_000, BIAS))
    assert motion.x[-1] == pytest.approx(BIAS * GAIN, rel=1e-9)
    assert GAIN == pytest.approx(54e-9, rel=1e-3)
    assert np.ptp(motion.x[-1000:]) < 1e-14
    assert abs(motion.i[-1]) < 1e-9


def test_its_ringing_has_the_poles_of_the_equations() -> None:
    """Frequency and decay of the free motion after a short push."""
    plant = plain_stack()
    plant.advance(np.full(10, 50.0))
    x = plant.advance(np.zeros(3000)).x[400:]
    a, b, c = x[:-2], x[1:-1], x[2:]
    # the charge is gone by now: x_(n+1) = s x_n - d x_(n-1)
    s, d = np.linalg.lstsq(np.stack([b, -a], axis=1), c, rcond=None)[0]
    found = np.log(np.roots([1.0, -s, d])[0]) / STEP
    poles = np.linalg.eigvals(state_matrix())
    ringing = poles[np.argmax(poles.imag)]
    assert abs(found.imag) == pytest.approx(ringing.imag, rel=1e-5)
    assert found.real == pytest.approx(ringing.real, rel=1e-3)
    assert 3400.0 < ringing.imag / (2.0 * np.pi) < 3800.0


def test_against_its_transfer_function() -> None:
    """The steady response to one sine equals the phasor solution of the state equations."""
    p, n, f, step = P840_1, 40_000, 1000.0, STEP / 2
    t = step * np.arange(1, n + 1)
    plant = GeneratedPlant("stack", p, step=step)
    out = plant.advance(np.sin(2 * np.pi * f * (t - step / 2)))
    drive, moved = np.array([1.0 / p["R_a"], 0.0, 0.0]), np.zeros(3, dtype=complex)
    for image in range(-1000, 1001):  # of a sine in steps
        g = f + image / step
        answer = np.linalg.solve(2j * np.pi * g * np.eye(3) - state_matrix(), drive)
        moved += (-1) ** image * np.sinc(g * step) * answer
    charging = (np.exp(-1j * np.pi * f * step) - moved[0] / p["C_a"]) / p["R_a"]
    tail, basis = slice(n // 2, n), np.exp(-2j * np.pi * f * t[n // 2 :])
    for signal, phasor in ((out.x, moved[1]), (out.i, charging)):
        measured = 2j * np.mean(signal[tail] * basis)
        assert abs(measured - phasor) < 1e-5 * abs(phasor)


def test_a_hardening_spring_settles_where_its_law_says() -> None:
    drawn = strong("nonlinear_stiffness", "k")
    plant, p = drawn.plant(), drawn.case.parameters
    assert np.abs(plant.advance(np.zeros(2000)).x).max() < 1e-15
    quadratic, cubic = drawn.effects[0].numbers.values()

    def settled(volts: float) -> float:
        roots = np.roots([cubic, quadratic, p["k"], -p["alpha"] * (volts - BIAS)])
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots).max()].real
        return float(real[np.argmin(np.abs(real - (volts - BIAS) * p["alpha"] / p["k"]))])

    for volts in (90.0, 20.0, 50.0):
        x = plant.advance(np.full(20_000, volts)).x
        assert x[-1] == pytest.approx(settled(volts) - settled(0.0), rel=1e-8)


def test_hysteresis_makes_a_loop_that_knows_no_rate() -> None:
    """Closed in the second period, open between its turns, the same at half the rate."""
    loops = []
    for count in (4000, 8000):
        plant = strong("hysteresis", "k").plant()
        up = np.linspace(0.0, 100.0, count)
        plant.advance(np.concatenate([up, up[::-1]]))
        x = plant.advance(np.concatenate([up, up[::-1]])).x
        rise, fall = x[:count], x[count:][::-1]
        middle = count // 2
        assert abs(fall[0] - rise[0]) < 0.01 * np.ptp(x)
        loops.append((fall[middle] - rise[middle]) / np.ptp(x))
    assert loops[0] > 0.01
    assert loops[1] == pytest.approx(loops[0], rel=0.1)
    up = np.linspace(0.0, 100.0, 8000)
    plain = plain_stack().advance(np.concatenate([up, up[::-1]])).x
    assert abs(plain[8000:][::-1][4000] - plain[4000]) < 0.2 * loops[1] * np.ptp(plain)


@pytest.mark.parametrize("name", ["none", "coulomb_friction", "quadratic_drag"])
def test_what_rubs_takes_energy_at_every_moment(name: str) -> None:
    """Supplied less stored energy never falls by more than the error of its quadrature."""
    drawn = strong(name) if name != "none" else conceal(SEED, "none")
    plant, p = about_the_middle(drawn), drawn.case.parameters
    t = STEP * np.arange(1, 8001)
    u = 40.0 * np.sin(2 * np.pi * 400.0 * (t - STEP / 2)) * np.minimum(1.0, 500.0 * t)
    motion = plant.advance(u)
    charge = p["C_a"] * (u - p["R_a"] * motion.i)
    v = np.gradient(motion.x, STEP)
    stored = 0.5 * (charge**2 / p["C_a"] + p["k"] * motion.x**2 + p["m"] * v**2)
    lost = np.cumsum(u * motion.i * STEP) - stored
    per_period = lost[499::500]
    assert np.all(np.diff(per_period) > 0.0)
    assert lost[-1] > 0.0


@pytest.mark.parametrize("name", ["hysteresis", "creep", "presliding_friction"])
def test_what_remembers_gives_no_energy_away(name: str) -> None:
    """From rest to rest more goes in than comes out."""
    drawn = strong(name, "b" if name.startswith("pre") else "k")
    u = 40.0 * np.sin(2 * np.pi * 20.0 * STEP * np.arange(20_000))
    u[-4000:] = 0.0
    motion = about_the_middle(drawn).advance(u)
    power = u * motion.i
    assert STEP * power.sum() > 0.0
    for part in np.split(power[:15_000].cumsum() * STEP, 3):
        assert part[-1] > -1e-6 * np.abs(part).max()


@pytest.mark.sampled(every=8)
@pytest.mark.parametrize("name", EFFECTS)
def test_cut_anywhere_and_looked_at_it_is_the_same(name: str) -> None:
    """State, dead times, drift and memory go on from call to call; a look leaves no trace."""
    whole, cut = strong(name).plant(), strong(name).plant()
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
    limit = 1e-10 if strong(name).effects[0].hidden.law == "dead_time" else 0.0
    assert np.abs(x - a.x[:n]).max() <= limit * np.ptp(x)
    assert np.abs(i - a.i[:n]).max() <= limit * np.ptp(i)


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("name", EFFECTS)
def test_halving_the_step_changes_less_than_the_noise(name: str) -> None:
    """For the sensors that the effect does not sit in as well."""
    drawn = strong(name)
    at, volts = edges(1000)
    ends = []
    for refine in (1, 2):
        plant = drawn.plant(step=STEP / refine)
        ends.append(plant.advance_edges(1000 * refine, at * refine, volts).x[refine - 1 :: refine])
    if drawn.effects[0].hidden.law not in SENSOR_LAWS:
        assert np.std(ends[0] - ends[1]) < 0.1 * drawn.noise[0]
    assert np.ptp(ends[0]) > 1e-7


def edges(count: int, seed: int = 0) -> tuple[Any, Any]:
    """Random edges of a converter within `count` steps."""
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.0, count, count // 15))
    return at, 50.0 + 45.0 * np.sin(np.cumsum(rng.uniform(0.0, 1.0, at.size + 1)))


def test_edges_between_steps_are_exact_on_the_rig() -> None:
    """A converter of 3125 Hz, 100 Hz full swing: the answer is that of a step 10 times shorter."""
    seen = []
    instants = np.sort(np.random.default_rng(1).uniform(0.0, 0.02, 2000))
    for step in (5e-6, 5e-7):
        rig = Rig(strong("hysteresis", "k").plant(step=step))
        for k in range(63):
            rig.wait_until(k / 3125.0 * 1.0000371)
            rig.drive(50.0 - 50.0 * np.cos(2.0 * np.pi * 100.0 * k / 3125.0))
        rig.wait_until(0.02)
        seen.append(rig.seen(instants).x)
    assert np.abs(seen[0] - seen[1]).max() < 0.1e-9
    assert np.ptp(seen[0]) > 2e-6


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


def test_hysteresis_and_creep_can_be_added() -> None:
    """A play holds its place at a reversal; creep goes on to its ratio."""
    gain = plain_stack().advance(np.full(20_000, 1.0)).x[-1]
    plant = HystereticPlant(plain_stack(), [10.0], [1.0], direct=0.0)
    levels = [50.0, 35.0, 30.0, 20.0]
    settled = [plant.advance(np.full(8000, v)).x[-1] / gain for v in levels]
    assert np.allclose(settled, [40.0, 40.0, 40.0, 30.0], rtol=1e-6)
    creeping = Creeping(plain_stack(), [0.1, 0.05], [2e-3, 10e-3])
    x = creeping.advance(np.full(20_000, 10.0)).x / (10.0 * gain)
    assert x[-1] == pytest.approx(1.15, rel=1e-3)
    t = 4000
    expected = 1.0 + 0.1 * (1.0 - np.exp(-0.02 / 2e-3)) + 0.05 * (1.0 - np.exp(-0.02 / 10e-3))
    assert x[t - 1] == pytest.approx(expected, abs=2e-3)


def test_creep_does_not_depend_on_how_a_record_is_cut() -> None:
    whole, cut = (Creeping(plain_stack(), [0.1, 0.05], [2e-3, 10e-3]) for _ in range(2))
    volts = np.repeat([10.0, 60.0, 30.0], 400)
    x = whole.advance(volts).x
    parts = []
    for piece in np.split(volts, [7, 8, 500, 1100]):
        state = cut.snapshot()
        cut.advance(np.full(9, 80.0))
        cut.restore(state)
        parts.append(cut.advance(piece).x)
    np.testing.assert_allclose(np.concatenate(parts), x, rtol=1e-13)


def test_same_seed_same_bytes() -> None:
    """Two benches with the same seeds and commands; another seed is another bench."""

    def run(seed: int) -> bytes:
        rig = Rig(Disturbed(strong("creep", "k").plant(), SensorNoise(1e-9, 1e-4, seed)))
        rng = np.random.default_rng(2)
        for _ in range(100):
            rig.wait(float(rng.uniform(0.0, 1e-3)))
            rig.drive(float(rng.uniform(0.0, 100.0)))
        seen = rig.seen(np.linspace(0.0, rig.now, 500))
        return seen.x.tobytes() + seen.i.tobytes()

    assert run(1) == run(1)
    assert run(1) != run(2)


@pytest.mark.long
def test_ten_minutes_pass_in_bounded_memory() -> None:
    """Cost of every effect for a second, and 600 s of one of them."""
    import time
    import tracemalloc

    for name in EFFECTS:
        plant = strong(name).plant()
        at, volts = edges(200_000)
        begin = time.process_time()
        plant.advance_edges(200_000, at, volts)
        print(f"{name:20s} {time.process_time() - begin:.3f} s of CPU per second")
    tracemalloc.start()
    rig = Rig(strong("hysteresis", "k").plant(), keep=5.0)
    peaks = []
    for k in range(600):
        rig.drive(50.0 + 45.0 * np.sin(k))
        rig.wait(1.0)
        if k % 100 == 99:
            peaks.append(tracemalloc.get_traced_memory()[1])
    tracemalloc.stop()
    assert peaks[-1] < 1.05 * peaks[1]
    assert peaks[-1] < 100e6
