"""g for m/s^2, degrees for radians, a force cell with the wrong sign: told as such."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Da, Df, Dq, I, One, R, Reading, Se, Zero
from bondgraph.graph.modulation import effort
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.screening.mixups import _conversions, forgotten
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.diagnosis.verdict.text import in_words
from tests.settled import simulate
from tests.spring import spring

N, LONG, G = 200, 4.0, 9.80665
UNITS = {"F": "N", "x": "m", "w": "m/s", "a": "m/s^2", "f": "N"}
A, X, W = Da("a", unit="m/s^2"), Dq("x", unit="m"), Df("w", unit="m/s")
CELL = Reading("f", effort("k"), unit="N")


def found(wrong: str, factor: float, *read: Sensor, n: int = N) -> Diagnosis:
    """Diagnose a spring whose values are declared 15 to 25 % off, one channel by a factor."""

    def model(**values: Any) -> BondGraph:
        g = spring(**values).remove("x")
        for s in read:
            if isinstance(s, Reading):
                g.add(s)
            else:
                g = g.with_branch("v", [s])
        return g

    rng = np.random.default_rng(3)
    t = np.asarray(LONG / n * np.arange(n), np.float64)
    waves = np.sin(2 * np.pi * np.outer(t, (0.7, 1.9, 4.1)) + rng.uniform(0, 6, 3))
    channels = {"F": waves @ np.array([2.0, 1.0, 0.5])}
    run = simulate(model(), t, channels)
    for s in read:
        y = np.asarray(run[s.name])
        scale = factor if s.name == wrong else 1.0
        channels[s.name] = scale * (y + 1e-3 * y.std() * rng.standard_normal(n))
    record = Recording("run", t, channels, {n: UNITS[n] for n in channels})
    options = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)
    return diagnose(model(m=0.6, d=1.5, k=230.0), record, options=options)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "factor", "read", "says", "n"),
    [
        ("a", 1 / G, (A, X), "a looks about 9.81 times too small (its unit?)", N),
        pytest.param(
            # a length has no degrees: no conversion is named
            *("x", 180 / np.pi, (X, W), "x looks about 57 times too large (its unit, or", 2 * N),
            marks=pytest.mark.long,
        ),
        # a quicker one of a sign: test_other_quantity
        pytest.param(
            *("f", -1.0, (CELL, X), "f looks recorded with the wrong sign", 2 * N),
            marks=pytest.mark.long,
        ),
    ],
)
def test_beside_another_sensor_the_channel_is_named(
    wrong: str, factor: float, read: tuple[Sensor, ...], says: str, n: int
) -> None:
    d = found(wrong, factor, *read, n=n)
    assert d.kind not in ("explained", "parameters_only")
    assert d.advice[0].startswith(says)


def turning(value: float, damping: float, stiffness: float | None = None) -> BondGraph:
    """A shaft whose inertia is known within 30 %, with its angle read."""
    with BondGraph("rotor") as g:
        shaft = One("shaft")
        Se("T", unit="N*m") >> shaft >> I("J", value, unit="kg*m^2", spread=1.3)
        shaft >> R("d", damping, unit="N*m*s/rad")
        if stiffness is not None:
            shaft >> C("k", stiffness=stiffness, unit="N*m/rad")
        shaft >> Dq("th", unit="rad")
    return g


@pytest.mark.parametrize(
    ("stiffness", "factor", "says"),
    [
        # it drifts so far that an error of a fifth of its spread is never reached
        pytest.param(
            *(None, 180 / np.pi, "th looks about 57.3 times too large (its unit?)"),
            marks=pytest.mark.long,
        ),
        (None, 2048 / np.pi, "times too large (its unit, or counts?)"),
        # a state that is fitted to degrees hides that they are
        (0.5, 180 / np.pi, "th looks about 57.3 times too large (its unit?)"),
    ],
)
def test_alone_it_is_told_where_a_parameter_is_bounded(
    stiffness: float | None, factor: float, says: str
) -> None:
    rng = np.random.default_rng(8)
    t = np.asarray(8e-3 * np.arange(375), np.float64)
    torque = 0.05 * np.repeat(rng.standard_normal(75), 5)
    angle = np.asarray(simulate(turning(0.01, 0.02, stiffness), t, {"T": torque})["th"])
    seen = factor * (angle + 1e-4 * angle.std() * rng.standard_normal(t.size))
    record = Recording("turns", t, {"T": torque, "th": seen}, {"T": "N*m", "th": "rad"})
    declared = turning(0.011, 0.03, None if stiffness is None else 0.4)
    d = diagnose(declared, record, options=DiagnosisOptions(jobs=1))
    assert any(says in m.claim for m in d.mistakes)
    assert not any("exchanged" in m.claim or "sign" in m.claim for m in d.mistakes)
    (first, more, *_), said = in_words(d).splitlines(), retold(v := verdict(d))
    assert first.startswith("The recording turns rather than the model rotor looks wrong: ")
    assert more.endswith("No physics is told before that is mended.")
    assert v["suspects"] == [m.claim for m in d.mistakes]
    assert v["parameters"] == []
    assert parse_verdict(json.dumps(v)) == v
    assert "recording turns rather than the model rotor looks wrong: " in " ".join(said.split())


def two_bodies(m: float, k: float, b: float) -> BondGraph:
    """Two bodies on springs, the first pushed, the acceleration of both read."""
    with BondGraph("two") as g:
        first, second, joint, link = One("v1"), One("v2"), Zero("z"), One("r")
        Se("F", unit="N") >> first >> I("m1", m, unit="kg")
        second >> I("m2", 0.6 * m, unit="kg")
        first >> joint >> second
        joint >> link
        for body, n, share in ((first, 1, 1.8), (link, 2, 1.0)):
            body >> C(f"k{n}", stiffness=share * k, unit="N/m")
            body >> R(f"b{n}", share * b, unit="N*s/m")
        first >> Da("a1", unit="m/s^2")
        second >> Da("a2", unit="m/s^2")
    return g


@pytest.mark.long
@pytest.mark.slow
def test_beside_a_like_sensor_that_is_right() -> None:
    """Values declared a third off bring the ratio of the sizes away from the conversion."""
    rng = np.random.default_rng(23)
    t = np.asarray(0.005 * np.arange(400), np.float64)
    channels = {"F": np.repeat(rng.uniform(-5, 5, 40), 10)}
    run = simulate(two_bodies(1.0, 500.0, 1.2), t, channels, hold="hold")
    for n, factor in (("a1", 1.0), ("a2", 1 / G)):
        y = np.asarray(run[n])
        channels[n] = factor * (y + 1e-3 * y.std() * rng.standard_normal(t.size))
    record = Recording("run", t, channels, {"F": "N", "a1": "m/s^2", "a2": "m/s^2"})
    options = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)
    d = diagnose(two_bodies(1.3, 380.0, 0.9), record, hold="hold", options=options)
    assert d.kind == "unknown_physics"
    (line,) = d.advice
    assert line.startswith("a2 looks about 9.81 times too small (its unit?)")


def test_conversions_fit_what_is_read() -> None:
    """An acceleration is in g, not in turns a minute; an angle is not in inches."""
    assert _conversions(0.15, Da("a", unit="m/s^2"))[0] == pytest.approx(1 / G)
    assert not set(_conversions(7.0, Da("a", unit="m/s^2"))) & {30 / np.pi}
    assert not set(_conversions(45.0, Dq("q", unit="rad"))) & {1e3 / 25.4}
    assert _conversions(1.3) == []


def test_alone_it_shows_in_all_values() -> None:
    """No misfit tells it: mass, damping and stiffness make up for it."""
    (line,) = (n for n in found("a", 1 / G, A).notes if "all values are fitted" in n)
    assert "times larger than declared" in line
    assert line.endswith("check those of F, a")


def test_right_units_say_nothing() -> None:
    d = found("x", 1.0, X)
    assert d.kind == "parameters_only"
    assert not any("all values" in n for n in d.notes)


def test_a_calibration_that_looks_like_a_mistake() -> None:
    assert forgotten("f", 1.04) is None
    assert forgotten("f", -0.5) is None
    sign, unit = forgotten("f", -0.98), forgotten("a", 0.104)
    assert sign is not None
    assert unit is not None
    assert sign.claim == "f looks recorded with the wrong sign"
    assert unit.factor == pytest.approx(1 / G, rel=0.03)  # turns a minute are as near
