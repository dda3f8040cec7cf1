"""Every limit with its message, and waveforms against a loop that looks at every sample."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.envelope import (
    P840_1,
    P840_1_UNIPOLAR,
    Capacitance,
    Converter,
    Dwell,
    Envelope,
    check_ramp,
    check_set,
    check_wave,
)
from hardware.errors import LimitViolation
from tests.counted import calls


def refusal(function: Any, *args: Any, **options: Any) -> str:
    with pytest.raises(LimitViolation) as caught:
        function(*args, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def sine(frequency: float, peak_to_peak: float, rate: float, count: int = 1000) -> np.ndarray:
    angle = 2.0 * np.pi * frequency * np.arange(count) / rate
    return np.asarray(50.0 - peak_to_peak / 2.0 * np.cos(angle))


def test_single_commands() -> None:
    assert "50 V above v_max 100 V" in refusal(check_set, P840_1, 0.0, 150.0)
    assert "10 V below v_min -20 V" in refusal(check_set, P840_1, 0.0, -30.0)
    text = refusal(check_set, P840_1, 0.0, 100.0)
    assert "a step of 100 V" in text
    assert "20 V" in text
    assert "ramp(100) takes 400 ms" in text
    text = refusal(check_set, P840_1, 0.0, 1.0, 5e-5)
    assert "50 us after the command before" in text
    check_set(P840_1, 0.0, 20.0, 2e-4)
    check_set(P840_1, 95.0, 100.0 + 1e-8)
    held = Envelope(0.0, 100.0, 1e5, dwell=[Dwell(90.0, 10.0)])
    assert "beyond 90 V for 12 s" in refusal(check_set, held, 95.0, 96.0, held=[12.0])
    check_set(held, 95.0, 89.0, held=[12.0])


def test_the_current_limits_a_step_by_the_worst_capacitance() -> None:
    c = Capacitance((0.0, 10.0, 20.0, 100.0), (1e-6, 4e-6, 1e-6, 1e-6))
    e = Envelope(0.0, 100.0, 1e9, i_max=0.1, capacitance=c, update_period=1e-3)
    check_set(e, 30.0, 100.0)
    assert "100 mA into 4 uF" in refusal(check_set, e, 0.0, 40.0)


@pytest.mark.parametrize(
    "value",
    [
        math.nan,
        math.inf,
        -math.inf,
        "5",
        b"5",
        None,
        True,
        np.True_,
        1j,
        [1.0],
        np.ones(1),
        10**400,
    ],
)
def test_what_is_no_number_is_refused(value: Any) -> None:
    assert "not one finite real number" in refusal(check_set, P840_1, 0.0, value)
    assert "not one finite real number" in refusal(check_ramp, P840_1, 0.0, value)


@pytest.mark.parametrize("value", [1, np.int16(1), np.float32(1.0), np.float64(1.0)])
def test_numbers_of_numpy_are_numbers(value: Any) -> None:
    check_set(P840_1, 0.0, value)


def test_ramps() -> None:
    assert check_ramp(P840_1, 0.0, 100.0) == 250.0
    assert "faster than the 100 kV/s" in refusal(check_ramp, P840_1, 0.0, 100.0, 2e5)
    assert "never arrives" in refusal(check_ramp, P840_1, 0.0, 100.0, 0.0)
    assert "not one finite" in refusal(check_ramp, P840_1, 0.0, 100.0, math.nan)
    e = Envelope(-50.0, 100.0, 1e5, dwell=[Dwell(80.0, 0.1), Dwell(-10.0, 0.1)])
    assert "200 ms beyond 80 V" in refusal(check_ramp, e, 0.0, 100.0, 100.0)
    assert "beyond -10 V" in refusal(check_ramp, e, 0.0, -40.0, 100.0)
    check_ramp(e, 0.0, 100.0, 201.0)
    check_ramp(e, 100.0, 0.0, 1.0)


def test_waveforms_say_what_where_how_much_and_what_to_try() -> None:
    text = refusal(check_wave, P840_1, sine(2000.0, 100.0, 1e5), 1e5)
    assert "sample 2 (20 us)" in text
    assert "at 2 kHz is 15.9 V peak to peak" in text
    check_wave(P840_1, sine(2000.0, 15.9, 1e5), 1e5)
    text = refusal(check_wave, P840_1, sine(10.0, 110.0, 1e4) - 10.0 + 15.0, 1e4)
    assert "110 V" in text
    assert "shift it by -10 V" in text
    text = refusal(check_wave, P840_1, sine(10.0, 130.0, 1e4), 1e4)
    assert "must become 120 V or less" in text
    current = Envelope(-20.0, 100.0, 1e7, i_max=0.1, capacitance=1e-6)
    assert "needs 118 mA into 1 uF" in refusal(check_wave, current, sine(2e3, 100.0, 1e5), 1e5)
    text = refusal(check_wave, P840_1, [0.0, 50.0], 10.0)
    assert "more samples" in text
    assert "ramp(50) first" in refusal(check_wave, P840_1, [50.0], 10.0, 0.0)
    assert "wave, exit" in refusal(check_wave, P840_1, [50.0], 10.0, 50.0, 0.0)
    text = refusal(check_wave, P840_1, 50.0 + sine(12e3, 4.0, 1e6, 10000), 1e6)
    assert "outside" in text
    text = refusal(check_wave, P840_1, sine(12e3, 2.5, 1e6, 10000), 1e6)
    assert "content above 9 kHz reaches 1.28 V" in text
    assert "12 kHz must become lower" in text
    check_wave(P840_1, sine(12e3, 2.3, 1e6, 12000), 1e6)


def step(volts: float, n: int = 4000) -> np.ndarray:
    return np.where(np.arange(n) < n // 2, 0.0, volts)


@pytest.mark.parametrize(("volts", "rate"), [(1.8, 5e4), (0.9, 1e5)])
def test_the_step_that_the_reference_of_the_actuators_tells_is_allowed(
    volts: float, rate: float
) -> None:
    check_wave(P840_1_UNIPOLAR, step(volts), 1.1 * rate)
    refusal(check_wave, P840_1_UNIPOLAR, step(volts * 1.02), 1.1 * rate)


@pytest.mark.parametrize("haste", [1.0, 1.1])
@pytest.mark.parametrize(
    ("wave", "rate"),
    [(step(5.0), 5e4), (step(2.0), 5e4), (step(1.0), 1e5), (step(20.1), 1e3), (step(60.0), 1e3),
     (0.9 * sine(25.0, 100.0, 5e4, 4000) + step(3.0), 5e4), (sine(40.0, 100.0, 200.0), 200.0),
     (sine(2000.0, 100.0, 1e5), 1e5)],
)  # fmt: skip
def test_what_a_refusal_advises_is_allowed(wave: np.ndarray, rate: float, haste: float) -> None:
    def judged(volts: np.ndarray, rate: float) -> None:
        check_wave(P840_1_UNIPOLAR, volts, rate, haste=haste)
        check_wave(P840_1_UNIPOLAR, volts, haste * rate)  # as a player that may hurry

    try:
        judged(wave, rate)
    except LimitViolation as refused:
        said = str(refused)
    else:
        assert (haste, wave.max()) in {(1.0, 2.0), (1.0, 1.0)}, "exactly what is allowed"
        return
    size = float(re.findall(r"is ([\d.e+-]+) V peak to peak", said)[0])
    judged(wave * size / np.ptp(wave), rate)
    slower = float(re.findall(r"play it ([\d.e+-]+) times slower", said)[0])
    assert slower > 1.0
    if "more samples" in said:
        at = np.arange(0.0, wave.size - 1.0, 1.0 / slower)
        judged(np.interp(at, np.arange(wave.size), wave), rate)
    else:
        judged(wave, rate / slower)


def test_a_burst_is_not_hidden_by_a_long_record() -> None:
    wave = np.full(200_000, 50.0)
    wave[100_000:100_250] += 1.3 * np.sin(2.0 * np.pi * 12e3 * np.arange(250) / 1e6)
    text = refusal(check_wave, P840_1, wave, 1e6)
    assert "content above 9 kHz reaches 1." in text
    assert "(100 ms)" in text


def test_dwell_counts_what_came_before() -> None:
    e = Envelope(-50.0, 100.0, 1e5, dwell=[Dwell(90.0, 1e-2), Dwell(-10.0, 1e-3)])
    wave = np.full(50, 95.0)
    check_wave(e, wave, 1e4)
    assert "15 ms above 90 V (of these 10 ms before it)" in refusal(
        check_wave, e, wave, 1e4, held=[1e-2, 0.0]
    )
    assert "below -10 V" in refusal(check_wave, e, np.full(50, -20.0), 1e4)


def test_the_converter_has_limits_too() -> None:
    c = Converter(-10.0, 60.0, 0.0244, rate_max=2e4)
    assert "converter's 60 V" in refusal(check_set, P840_1, 55.0, 70.0, converter=c)
    assert "converter's own range" in refusal(check_wave, P840_1, [65.0], 1e4, converter=c)
    assert "faster than the converter's 20 kHz" in refusal(
        check_wave, P840_1, [5.0], 1e5, converter=c
    )
    assert "less than one step" in refusal(check_wave, P840_1, [5.0, 5.01], 1e4, converter=c)


@pytest.mark.parametrize(
    ("wave", "words"),
    [
        ([], "n >= 1"),
        ([[1.0, 2.0]], "row"),
        ([1.0, math.nan], "sample 1 is nan"),
        ([1.0, -math.inf], "sample 1 is -inf"),
        (["1", "2"], "row"),
        ([True, False], "row"),
        ([1.0, 1j], "row"),
        ([1.0, None], "row"),
        ([[1.0], [1.0, 2.0]], "not a row"),
        (np.ma.masked_array([1.0, 2.0], [False, True]), "masked"),
        (np.array([1.0, 1e4000], np.longdouble), "sample 1 is inf"),
    ],
)
def test_bad_waveforms(wave: Any, words: str) -> None:
    assert words in refusal(check_wave, P840_1, wave, 1e3)


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, "fast", None])
def test_bad_rates(rate: Any) -> None:
    assert "rate" in refusal(check_wave, P840_1, [0.0], rate)


def accepted_by_loop(
    e: Envelope, wave: list[float], rate: float, start: float | None, end: float | None
) -> tuple[bool, float]:
    """Judge sample by sample, from the definition; and the least distance to any limit."""
    ratios = [0.0]
    route = ([] if start is None else [start]) + wave + ([] if end is None else [end])
    for v in wave:
        ratios.append((v - e.v_min) / (e.v_max - e.v_min) * 2.0 - 1.0)
        ratios.append(-ratios[-1])
    duration = 1.0 / rate if 1.0 / rate < e.update_period else e.update_period
    for a, b in pairwise(route):
        ratios.append(abs(b - a) / duration / e.slew)
        if e.curve is not None and e.i_max is not None:
            table = list(zip(e.curve.volts, e.curve.farads, strict=True))
            on_the_way = [c for v, c in table if min(a, b) < v < max(a, b)]
            worst = max([e.curve.at(a), e.curve.at(b), *on_the_way])
            ratios.append(worst * abs(b - a) / duration / e.i_max)
    for d in e.dwell:
        run = 0
        for v in wave:
            run = run + 1 if (v > d.level if d.level > e.safe else v < d.level) else 0
            ratios.append(run / rate / d.seconds)
    if e.f_max is not None and len(wave) > 1:
        n = len(wave)
        high = [0.0] * n
        for k in range(n):
            if k * rate / (2 * n) <= e.f_max * (1.0 + 1e-12):
                continue
            shape = [math.cos(math.pi * k * (2 * j + 1) / (2 * n)) for j in range(n)]
            weight = 2.0 / n * sum(s * v for s, v in zip(shape, wave, strict=True))
            high = [h + weight * s for h, s in zip(high, shape, strict=True)]
        ratios.append(max(map(abs, high)) / (e.f_share * (e.v_max - e.v_min)))
    return max(ratios) <= 1.0, min(abs(r - 1.0) for r in ratios)


@st.composite
def envelopes(draw: st.DrawFn) -> Envelope:
    low = draw(st.floats(-50.0, 0.0))
    high = draw(st.floats(20.0, 150.0))
    current: dict[str, Any] = {}
    if draw(st.booleans()):
        knots = np.linspace(low, high, draw(st.integers(2, 9)))
        farads = draw(st.lists(st.floats(5e-7, 4e-6), min_size=knots.size, max_size=knots.size))
        table = Capacitance(tuple(knots), tuple(farads))
        current = {"i_max": draw(st.floats(1e-3, 1.0)), "capacitance": table}
    dwell = [Dwell(0.7 * high, draw(st.floats(1e-3, 0.1)))] if draw(st.booleans()) else []
    return Envelope(
        low,
        high,
        draw(st.floats(1e3, 1e6)),
        f_max=draw(st.one_of(st.none(), st.floats(10.0, 500.0))),
        f_share=draw(st.floats(0.005, 0.5)),
        dwell=dwell,
        update_period=draw(st.sampled_from([1e-4, 1e-3, 1e-2])),
        **current,
    )


@settings(max_examples=120, deadline=None, derandomize=True, database=None)
@given(
    e=envelopes(),
    seed=st.integers(0, 2**31),
    count=st.integers(1, 40),
    rate=st.sampled_from([100.0, 1e3, 2e4]),
    rough=st.sampled_from([0.0, 0.01, 0.3]),
    size=st.floats(0.0, 1.1),
    joined=st.booleans(),
)
def test_waveforms_are_accepted_exactly_when_every_sample_is(
    e: Envelope, seed: int, count: int, rate: float, rough: float, size: float, joined: bool
) -> None:
    rng = np.random.default_rng(seed)
    span = 0.5 * (e.v_max - e.v_min)
    shape = np.cos(2.0 * np.pi * rng.uniform(0.1, 3.0) * np.arange(count) / 40.0)
    wave = e.v_min + span * (1.0 + size * (shape + rough * rng.standard_normal(count)))
    start, end = (float(wave[0]) - 1.0, float(wave[-1]) + 1.0) if joined else (None, None)
    expected, margin = accepted_by_loop(e, [float(v) for v in wave], rate, start, end)
    if margin < 1e-6:
        return
    try:
        check_wave(e, wave, rate, start, end)
    except LimitViolation:
        assert not expected
    else:
        assert expected


def test_a_million_samples_are_judged_at_once() -> None:
    table = Capacitance((-20.0, 0.0, 50.0, 100.0), (1e-6, 1.5e-6, 2e-6, 2.4e-6))
    e = Envelope(-20.0, 100.0, 1e5, i_max=0.2, capacitance=table, dwell=[Dwell(90.0, 10.0)])
    for limits in (e, P840_1):

        def work(n: int, limits: Envelope = limits) -> int:
            wave = sine(10.0, 100.0, 1e5, n)
            return calls(lambda: check_wave(limits, wave, 1e5))

        assert work(1_000_000) <= work(10_000) < 2000
