"""The envelope refuses limits that contradict each other, and reads well."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput
from hardware.envelope import P840_1, PRESETS, Capacitance, Converter, Dwell, Envelope

GOOD: dict[str, Any] = {"v_min": -20.0, "v_max": 100.0, "slew": 1e5}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"v_min": math.nan}, "v_min"),
        ({"v_max": math.inf}, "v_max"),
        ({"v_min": 100.0}, "leaves no room"),
        ({"slew": 0.0}, "slew"),
        ({"slew": math.nan}, "slew"),
        ({"safe": -21.0}, "safe value -21 V"),
        ({"safe": None}, "safe"),
        ({"i_max": 0.2}, "need each other"),
        ({"capacitance": 1e-6}, "need each other"),
        ({"i_max": -0.2, "capacitance": 1e-6}, "i_max must be positive"),
        ({"i_max": 0.2, "capacitance": math.nan}, "capacitance"),
        ({"i_max": 0.2, "capacitance": Capacitance((0.0, 50.0), (1e-6, 1e-6))}, "not known over"),
        ({"f_max": 0.0}, "f_max"),
        ({"f_share": 1.0}, "f_share"),
        ({"update_period": 0.0}, "update_period"),
        ({"gentle": 2e5}, "faster than slew and current"),
        ({"gentle": 2e4, "i_max": 0.01, "capacitance": 1e-6}, "faster than slew and current"),
        ({"dwell": [Dwell(0.0, 1.0)]}, "no dwell"),
        ({"dwell": [Dwell(100.0, 1.0)]}, "no dwell"),
        ({"dwell": [(90.0, 1.0)]}, "Dwell(level, seconds)"),
    ],
)
def test_a_contradiction_is_refused_in_one_line(change: dict[str, Any], words: str) -> None:
    with pytest.raises(UnusableInput) as caught:
        Envelope(**(GOOD | change))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Dwell(90.0, 0.0), "more than 0"),
        (lambda: Dwell(math.nan, 1.0), "level"),
        (lambda: Capacitance((), ()), "at least one"),
        (lambda: Capacitance((0.0, 0.0), (1e-6, 1e-6)), "rise"),
        (lambda: Capacitance((0.0,), (-1e-6,)), "positive"),
        (lambda: Converter(10.0, -10.0), "no room"),
        (lambda: Converter(-10.0, 10.0, 30.0), "step"),
        (lambda: Converter(-10.0, 10.0, rate_max=0.0), "rate"),
    ],
)
def test_parts_are_checked_too(make: Any, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        make()


def test_gentle_stays_below_what_current_allows() -> None:
    slow = Envelope(0.0, 100.0, 1e5, i_max=1e-5, capacitance=1e-6)
    assert slow.ramp_rate == pytest.approx(10.0)
    assert slow.ramp_time(0.0, 50.0) == pytest.approx(5.0)


def test_capacitance_counts_at_its_worst_on_the_way() -> None:
    peak = Capacitance((0.0, 40.0, 50.0, 60.0, 100.0), (1.0, 1.0, 3.0, 1.0, 2.0))
    assert peak.worst(0.0, 100.0) == peak.worst(100.0, 0.0) == 3.0
    assert peak.worst(0.0, 45.0) == pytest.approx(2.0)
    assert peak.worst(70.0, 90.0) == pytest.approx(1.75)
    assert peak.worst(-50.0, -40.0) == 1.0
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-20.0, 120.0, (2, 500))
    fine = np.linspace(0.0, 1.0, 2001)
    dense = [
        np.interp(p + (q - p) * fine, peak.volts, peak.farads).max()
        for p, q in zip(a, b, strict=True)
    ]
    many = peak.worst_of_each(a, b)
    np.testing.assert_allclose(many, [peak.worst(p, q) for p, q in zip(a, b, strict=True)])
    assert np.all(many >= np.array(dense) - 1e-12)
    assert np.all(many <= np.array(dense) + 0.02)


def test_a_function_of_the_voltage_becomes_a_table() -> None:
    c = Capacitance.of(lambda v: 1e-6 * (1.0 + (v / 100.0) ** 2), 0.0, 100.0)
    assert c.at(50.0) == pytest.approx(1.25e-6, rel=1e-4)


def test_presets_read_well_and_are_plain() -> None:
    assert P840_1.describe() == (
        "P-840.1: -20 .. 100 V, 100 kV/s, 200 mA into 1.88 uF, above 9 kHz at most 1.2 V, "
        "safe at 0 V, ramps of 250 V/s, updates >= 200 us"
    )
    for envelope in PRESETS.values():
        assert json.loads(json.dumps(envelope.as_dict()))["v_max"] == 100.0


def test_engineering_numbers() -> None:
    assert engineering(999.9, "Hz") == "1 kHz"
    assert engineering(0.0, "V") == "0 V"
    assert engineering(-2.5e-3, "A") == "-2.5 mA"
    assert engineering(1e-15, "F") == "0.001 pF"
