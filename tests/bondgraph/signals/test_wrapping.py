"""Encoders that wrap are told from signals that switch, and unwrapped."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph import BondGraph, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.signals.wrapping import unwrapped, wrap_period
from bondgraph.support.errors import BondsightError
from identification.diagnosis.diagnose import diagnose

N = 2000


def angle(seed: int, turns: float, back: bool) -> np.ndarray:
    """An angle that turns on, or there and back, with wobble."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0, 1, N)
    path = np.sin(np.pi * s) if back else s
    return 2 * np.pi * turns * path + 0.2 * np.sin(40 * s + rng.uniform(0, 6))


@given(st.integers(0, 99), st.floats(3.0, 30.0), st.booleans(), st.floats(0.5, 5000.0))
def test_a_wrapping_reading_is_seen_and_made_straight(
    seed: int, turns: float, back: bool, scale: float
) -> None:
    true = scale * angle(seed, turns, back)
    period = 2 * np.pi * scale
    wrapped = np.mod(true, period)
    found = wrap_period(wrapped)
    assert found == pytest.approx(period, rel=0.05)
    straight = unwrapped(wrapped, period)
    assert straight - straight[0] == pytest.approx(true - true[0], abs=1e-9 * period)


@pytest.mark.parametrize("per_sample", [0.01, 0.05, -0.2])
@pytest.mark.parametrize("noise", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("after", [False, True])
def test_noise_at_the_edge_hides_no_wrap(per_sample: float, noise: float, after: bool) -> None:
    e = noise * np.random.default_rng(4).standard_normal(N)
    true = per_sample * np.arange(N) + 1.0
    wrapped = np.mod(true, 2 * np.pi) + e if after else np.mod(true + e, 2 * np.pi)
    assert wrap_period(wrapped) == pytest.approx(2 * np.pi, rel=0.08)


@pytest.mark.parametrize(
    "values",
    [
        np.zeros(N),
        np.linspace(0, 1, N),
        np.sin(np.linspace(0, 60, N)),
        np.sign(np.sin(np.linspace(0, 60, N))),
        np.sign(np.sin(np.linspace(0, 60, N))) + 1e-3 * np.random.default_rng(1).standard_normal(N),
        np.sign(np.sin(np.linspace(0, 60, N))) + 0.1 * np.sin(np.linspace(0, 100, N)),
        np.sign(np.sin(np.linspace(0, 60, N))) + np.linspace(0, 0.4, N),
        np.sign(np.sin(np.linspace(0, 60, N))) + 0.2 * np.random.default_rng(1).standard_normal(N),
        np.sin(2 * np.pi * np.arange(N) / 3.01),
        np.random.default_rng(2).standard_normal(N),
        np.repeat(np.random.default_rng(3).uniform(-1, 1, N // 50), 50),
        np.full(1, 3.0),
        np.zeros(0),
    ],
)
def test_what_switches_or_swings_does_not_wrap(values: np.ndarray) -> None:
    assert wrap_period(values) is None


def test_a_diagnosis_says_so_and_how_to_go_on() -> None:
    with BondGraph("rotor") as g:
        w = One("w")
        Se("T", unit="N*m") >> w >> I("J", 0.8, unit="kg*m^2")
        w >> R("b", 0.4, unit="N*m*s/rad")
        w >> Dq("phi", unit="rad")
    t = np.asarray(np.arange(N) * 0.01, np.float64)
    true = np.asarray(angle(0, 12.0, False), np.float64)
    torque = np.asarray(1.0 + np.sin(t), np.float64)
    r = Recording(
        "run", t, {"T": torque, "phi": np.asarray(np.mod(true, 2 * np.pi), np.float64)},
        {"T": "N*m", "phi": "rad"},
    )  # fmt: skip
    d = diagnose(g, r)
    assert d.kind == "insufficient_data"
    assert "phi jumps by about 6.28" in d.advice[0]
    assert "unwrap('phi', period)" in d.advice[0]
    straight = r.unwrap("phi", 2 * np.pi)
    assert straight["phi"] - straight["phi"][0] == pytest.approx(true - true[0])
    assert any("undone" in n for n in straight.notes)


@pytest.mark.parametrize(("name", "period", "says"), [("phi", 0.0, "one turn"), ("x", 1.0, "x")])
def test_what_cannot_be_unwrapped_is_one_line(name: str, period: float, says: str) -> None:
    r = Recording.from_arrays("r", {"phi[rad]": [0.0, 1.0, 0.5]}, fs=1.0)
    with pytest.raises(BondsightError, match=says):
        r.unwrap(name, period)
