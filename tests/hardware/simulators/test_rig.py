"""The rig: edges within steps, interpolation, clocks, forgetting, time that passes by itself."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.simulators.edges import EdgeDelay, averages
from hardware.simulators.interpolation import cubic, linear
from hardware.simulators.noise import white
from hardware.simulators.plant_contract import EdgeDriven, PlantMotion, Rewindable
from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.tape import GrowingTape

TAU = 1e-3


class Lag:
    """``tau x' = V - x``, solved exactly for edges anywhere; current V - x at the ends."""

    step = 5e-6

    def __init__(self) -> None:
        self.x = 0.0

    def advance_edges(self, count: int, at: Any, volts: Any) -> PlantMotion:
        x, i = np.empty(count), np.empty(count)
        e, u = 0, float(volts[0])
        for k in range(count):
            begin = float(k)
            while begin < k + 1:
                while e < at.size and at[e] <= begin:
                    e += 1
                    u = float(volts[e])
                end = min(float(at[e]), k + 1.0) if e < at.size else k + 1.0
                self.x = u + (self.x - u) * math.exp(-(end - begin) * self.step / TAU)
                begin = end
            x[k], i[k] = self.x, u - self.x
        return PlantMotion(x, i)

    def advance(self, volts: Any) -> PlantMotion:
        at = np.arange(1.0, len(volts))
        return self.advance_edges(len(volts), at, np.asarray(volts))

    def snapshot(self) -> float:
        return self.x

    def restore(self, state: float) -> None:
        self.x = state


class Means:
    """The same plant without edges of its own and without looking ahead."""

    step = Lag.step

    def __init__(self) -> None:
        self.inner = Lag()

    def advance(self, volts: Any) -> PlantMotion:
        return self.inner.advance(volts)


def closed_form(edges: Any, instants: Any) -> tuple[Any, Any]:
    """Displacement and voltage of the lag for a list of (instant, volts)."""
    at, volts = [0.0], [0.0]
    for t, v in edges:
        at.append(t)
        volts.append(v)
    x = [0.0]
    for k in range(1, len(at)):
        x.append(volts[k - 1] + (x[-1] - volts[k - 1]) * math.exp(-(at[k] - at[k - 1]) / TAU))
    k = np.searchsorted(at, instants, side="right") - 1
    v, x0, t0 = (np.array(a)[k] for a in (volts, x, at))
    return v + (x0 - v) * np.exp(-(instants - t0) / TAU), v


def drive(rig: Rig, seed: int, n: int = 300, look: bool = False) -> list[tuple[float, float]]:
    """Put random edges at random instants."""
    rng = np.random.default_rng(seed)
    edges = []
    for _ in range(n):
        rig.wait(float(rng.uniform(0.0, 3e-5)))
        rig.drive(float(rng.uniform(0.0, 100.0)))
        edges.append((rig.now, rig.volts))
        if look:
            rig.seen(np.array([rig.now]))
    return edges


@pytest.mark.parametrize("look", [False, True])
def test_edges_anywhere_agree_with_the_closed_form(look: bool) -> None:
    """Also while somebody looks after every edge: looking changes nothing."""
    rig = Rig(Lag())
    edges = drive(rig, 1, look=look)
    t = np.asarray(np.sort(np.random.default_rng(2).uniform(0.0, rig.now, 3000)))
    x, v = closed_form(edges, t)
    seen = rig.seen(t)
    assert np.array_equal(seen.v, v)
    # slopes jump at the edges: a cubic across one is off by h dV/tau/20 at most
    assert np.abs(seen.x - x).max() < 100.0 * Lag.step / TAU / 4.0
    at_steps: Any = np.arange(1, int(rig.now / Lag.step)) * Lag.step
    exact, _ = closed_form(edges, at_steps)
    assert np.abs(rig.seen(at_steps).x - exact).max() < 1e-9


def test_looking_leaves_no_trace() -> None:
    """The same bytes whether somebody looked in between or not."""
    a, b = Rig(Lag()), Rig(Lag())
    drive(a, 3, look=True)
    drive(b, 3)
    t = np.linspace(0.0, a.now, 1000)
    assert a.seen(t).x.tobytes() == b.seen(t).x.tobytes()


def test_the_state_now_is_seen_between_steps() -> None:
    """A look in the middle of a step sees what has happened until then, not the last step."""
    rig = Rig(Lag())
    rig.drive(80.0)
    rig.wait(100.4 * Lag.step)
    exact = 80.0 * (1.0 - math.exp(-rig.now / TAU))
    assert rig.seen(np.array([rig.now])).x[0] == pytest.approx(exact, rel=1e-9)
    assert rig.seen(np.array([rig.now + 1.0])).x[0] == pytest.approx(exact, rel=1e-9)


def test_a_plant_without_edges_gets_exact_means() -> None:
    """The area under the voltage is kept, so the error is of second order in the step."""
    assert not isinstance(Means(), EdgeDriven)
    assert not isinstance(Means(), Rewindable)
    rig = Rig(Means())
    edges = drive(rig, 4)
    t: Any = np.arange(1, int(rig.now / Lag.step)) * Lag.step
    exact, _ = closed_form(edges, t)
    error = np.abs(rig.seen(t).x - exact).max()
    assert 1e-9 < error < 100.0 * (Lag.step / TAU) ** 2 * 5.0


@given(
    st.integers(1, 40),
    st.lists(st.floats(0.0, 39.99), max_size=30),
    st.integers(0, 2**32 - 1),
)
def test_means_keep_the_area(count: int, where: list[float], seed: int) -> None:
    """The sum of the means is the integral of the edges."""
    at = np.sort([a for a in where if a < count])
    volts = np.random.default_rng(seed).uniform(-100.0, 100.0, at.size + 1)
    means = averages(count, at, volts)
    area = float(volts @ np.diff(np.concatenate([[0.0], at, [count]])))
    assert means.sum() == pytest.approx(area, abs=1e-8)
    assert means.min() >= volts.min() - 1e-9
    assert means.max() <= volts.max() + 1e-9


@given(st.floats(0.0, 20.0), st.lists(st.integers(1, 9), min_size=1, max_size=12), st.data())
def test_a_dead_time_only_shifts_edges(delay: float, parts: list[int], data: Any) -> None:
    """However the record is cut."""
    line = EdgeDelay(delay, 0.0)
    level, start = 0.0, 0
    given_, got = [], []
    for count in parts:
        places = st.floats(0.0, count, exclude_max=True)
        at = np.array(sorted(data.draw(st.lists(places, max_size=3, unique=True))))
        volts = np.concatenate([[level], np.arange(1.0, at.size + 1.0) + level])
        given_ += [(start + a, v) for a, v in zip(at, volts[1:], strict=True)]
        out_at, out = line.pass_on(count, at, volts)
        got += [(start + a, v) for a, v in zip(out_at, out[1:], strict=True)]
        level, start = float(volts[-1]), start + count
    due = [(a + delay, v) for a, v in given_]
    assert [v for _, v in got] == [v for _, v in due[: len(got)]]
    assert np.allclose([a for a, _ in got], [a for a, _ in due[: len(got)]], atol=1e-9)
    assert all(a >= start - 1e-9 for a, _ in due[len(got) :])


def test_interpolation_of_a_sine() -> None:
    """Cubic: error of fourth order; a value at a sample is the sample."""
    errors = []
    for n in (200, 400):
        grid = np.sin(2.0 * np.pi * np.arange(n + 1) / n * 5.0)
        at = np.random.default_rng(0).uniform(2.0, n - 2.0, 2000)
        errors.append(np.abs(cubic(grid, at) - np.sin(2.0 * np.pi * at / n * 5.0)).max())
        assert np.array_equal(cubic(grid, np.arange(2.0, n - 2.0)), grid[2 : n - 2])
        assert linear(grid, np.array([-3.0, n + 5.0])) == pytest.approx([grid[0], grid[-1]])
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_what_is_long_past_is_refused_not_invented() -> None:
    """One line that says what to do; the rest stays right after many forgettings."""
    rig = Rig(Lag(), keep=0.01)
    edges = []
    for k in range(2000):
        rig.wait(1e-4)
        rig.drive(float(k % 7))
        edges.append((rig.now, rig.volts))
    t = np.linspace(rig.now - 0.009, rig.now, 500)
    x, v = closed_form(edges, t)
    seen = rig.seen(t)
    assert np.array_equal(seen.v, v)
    assert np.abs(seen.x - x).max() < 7.0 * Lag.step / TAU / 4.0
    with pytest.raises(ValueError, match=r"not kept.*keep=") as refused:
        rig.seen(np.array([0.05]))
    assert "\n" not in str(refused.value)


def test_memory_is_bounded() -> None:
    """A tape that forgets does not grow."""
    tape = GrowingTape(2)
    for k in range(3000):
        tape.append(np.full(100, float(k)), np.full(100, -float(k)))
        tape.forget(len(tape) - 1000)
    assert len(tape) == 1000
    assert tape.total == 300_000
    assert tape.column(0)[-1] == 2999.0
    assert tape._data.shape[1] < 4000


def test_actions_happen_at_their_instants() -> None:
    """In the order of time, those of one instant in the order in which they were asked for."""
    rig = Rig(Lag())
    seen: list[tuple[str, float]] = []

    def note(name: str) -> Any:
        return lambda: seen.append((name, rig.now))

    rig.at(2e-3, note("late"))
    rig.at(1e-3, note("a"))
    rig.at(1e-3, note("b"))

    def chain() -> None:
        note("first")()
        rig.drive(5.0)
        rig.at(rig.now + 1e-4, note("second"))

    rig.at(1.5e-3, chain)
    rig.wait(0.01)
    rig.at(0.0, note("past"))
    assert seen == [
        ("a", 1e-3),
        ("b", 1e-3),
        ("first", 1.5e-3),
        ("second", 1.5e-3 + 1e-4),
        ("late", 2e-3),
        ("past", 0.01),
    ]
    assert rig.seen(np.array([1.4e-3, 1.6e-3])).v.tolist() == [0.0, 5.0]


def test_triggers_and_extremes() -> None:
    """What the actuator met is told; a voltage that is no number is refused."""
    rig = Rig(Lag())
    rig.drive(3.0)
    rig.wait(0.5)
    rig.trigger()
    rig.drive(-2.0)
    rig.wait(-1.0)
    rig.wait_until(0.1)
    rig.trigger()
    assert rig.trigger_edges == (0.5, 0.5)
    assert rig.trigger_edges_from(1) == (0.5,)
    e = rig.extremes
    assert (e.lowest, e.highest, e.largest_step) == (-2.0, 3.0, 5.0)
    for wrong in (math.nan, math.inf):
        with pytest.raises(ValueError, match="no voltage"):
            rig.drive(wrong)


def test_a_paced_bench_follows_its_clock() -> None:
    """Time passes by itself, waits do nothing, and an action sees its own instant."""
    rig = Rig(Lag())
    time = [0.0]
    rig.pace(lambda: time[0])
    seen: list[float] = []

    def act() -> None:
        rig.drive(7.0)
        seen.append(rig.now)

    rig.at(0.25, act)
    rig.wait(5.0)
    assert rig.now == 0.0
    time[0] = 1.0
    assert rig.now == 1.0
    assert seen == [0.25]
    assert rig.seen(np.array([0.2, 0.3])).v.tolist() == [0.0, 7.0]
    rig.pace(None)
    rig.wait(0.5)
    assert rig.now == 1.5


@settings(max_examples=50)
@given(st.integers(0, 5000), st.lists(st.integers(1, 700), min_size=1, max_size=8))
def test_instants_do_not_depend_on_how_they_are_asked_for(first: int, parts: list[int]) -> None:
    """Rate error, drift and jitter belong to sample numbers."""
    clock = DeviceClock(ppm=37.0, offset=1e-5, jitter=1e-6, drift_ppm=3.0, seed=4)
    whole = clock.instants(2.0, first, sum(parts), 16e3)
    at, pieces = first, []
    for n in parts:
        pieces.append(clock.instants(2.0, at, n, 16e3))
        at += n
    assert np.array_equal(np.concatenate(pieces), whole)


def test_the_clock_runs_as_it_says() -> None:
    """Ratio, offset and the size of the jitter."""
    t = DeviceClock(ppm=40.0, offset=3e-6).instants(1.0, 0, 100_001, 1e4)
    assert t[0] == pytest.approx(1.0 + 3e-6, abs=1e-15)
    assert (t[-1] - t[0]) / 10.0 == pytest.approx(1.0 + 40e-6, abs=1e-12)
    rough = DeviceClock(jitter=2e-7).instants(0.0, 0, 100_000, 1e4) - np.arange(100_000) / 1e4
    assert np.std(rough) == pytest.approx(2e-7, rel=0.02)
    minute = DeviceClock(drift_ppm=6.0).instants(0.0, 0, 600_001, 1e4)
    rate = np.diff(minute) * 1e4 - 1.0
    assert rate[-1] - rate[0] == pytest.approx(6e-6, rel=1e-3)


def test_white_noise_is_white() -> None:
    """Unit rms, no mean, independent streams."""
    a, b = white(1, 0, 50_000), white(1, 0, 50_000, stream=1)
    assert abs(a.mean()) < 0.02
    assert a.std() == pytest.approx(1.0, rel=0.02)
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.02
    assert abs(np.corrcoef(a[1:], a[:-1])[0, 1]) < 0.02
    assert white(1, 5, 0).size == 0
