"""A latent signal at a port: reconstructed from readings, described without a library."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.hysteresis import play_record
from bondgraph.laws import Coulomb
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.explanation.characterisation import Character, characterise
from identification.diagnosis.explanation.latent_signal import latent
from identification.diagnosis.explanation.loops import cycles, loops
from identification.diagnosis.explanation.recovered import characterised
from identification.diagnosis.screening.port_history import PortHistory
from tests.identification.diagnosis.rubbing_spring import diagnosed
from tests.settled import simulate
from tests.spring import spring

DT = 5e-3


def wander(n: int = 6000, seed: int = 0) -> Array:
    """A record of several amplitudes and speeds."""
    rng = np.random.default_rng(seed)
    t = DT * np.arange(n)
    x = np.zeros(n)
    for f in (0.13, 0.31, 0.57, 1.1, 2.3):
        x += rng.uniform(0.3, 1.0) * np.sin(2 * np.pi * f * t + rng.uniform(0, 6))
    return np.asarray(x * (0.4 + 0.6 * np.sin(0.35 * t) ** 2))


def described(signal: Array, x: Array, *, flow: bool = False, noise: float = 0.05) -> Character:
    moved = np.cumsum(x) * DT if flow else None
    rough = noise * signal.std() * np.random.default_rng(1).standard_normal(x.size)
    return characterise(PortHistory(x, x, DT, moved), signal + rough, flow=flow)


def test_a_curve_over_the_argument() -> None:
    x = wander()
    cubic = described(x**3, x)
    assert cubic.variable == "argument"
    assert cubic.explained["argument"] > 0.95
    assert cubic.odd > 0.9
    assert cubic.jump < 0.1
    assert abs(cubic.loops.dissipation) < 0.05
    assert "present argument alone" in cubic.words
    square = described(x**2, x)
    assert square.variable == "argument"
    assert square.even > 0.9


def test_memory_of_turning_points() -> None:
    x = wander()
    widths = np.array([0.2, 0.5, 1.0])
    stops = x[:, None] - play_record(x, widths, np.full(3, x[0]))
    found = described(stops.sum(axis=1), x)
    assert found.variable == "memory"
    assert found.rate_gain < 0.05
    assert found.loops.dissipation > 0.1
    assert found.loops.memory > 0.3
    assert "rate independent" in found.words
    assert "takes energy" in found.words


def test_rate_and_reversal() -> None:
    x = wander()
    rate = np.gradient(x, DT)
    viscous = described(rate, x)
    assert viscous.variable == "rate"
    assert viscous.loops.dissipation > 0.95
    assert viscous.jump < 0.1
    dry = described(np.sign(rate), x)
    assert dry.variable == "rate"
    assert dry.jump > 0.7
    assert "jumps" in dry.words
    driving = described(-np.sign(rate), x)
    assert driving.loops.dissipation < -0.5
    assert "gives energy" in driving.words


def test_growth_of_loops_with_speed() -> None:
    t = DT * np.arange(8000)
    x = np.sin(2 * np.pi * (0.1 * t + 0.015 * t**2)) * (1 + 0.3 * np.sin(1.7 * t))
    stops = x - play_record(x, np.array([0.3]), x[:1])[:, 0]
    steady = described(stops, x).loops.speed_exponent
    assert steady == pytest.approx(0.0, abs=0.1)
    viscous = described(np.gradient(x, DT), x).loops.speed_exponent
    assert viscous == pytest.approx(1.0, abs=0.1)


def test_friction_over_a_flow() -> None:
    v = wander()
    dry = described(np.sign(v), v, flow=True)
    assert dry.variable == "argument"
    assert dry.odd > 0.9
    assert dry.jump > 0.7
    assert dry.loops.dissipation > 0.5
    spring = described(np.cumsum(v) * DT, v, flow=True)
    assert spring.explained["way"] > 0.9 > spring.explained["argument"]


def test_slow_time_and_nothing() -> None:
    x = wander()
    t = DT * np.arange(x.size)
    assert described(lagged(x, 0.05 * t[-1], DT), x).variable == "slow"
    ageing = described(x * t**2, x)
    assert ageing.variable == "time"
    assert ageing.explained["time"] > 0.95
    noise = np.random.default_rng(5).standard_normal(x.size)
    nothing = described(noise, x)
    assert nothing.variable == "nothing"
    assert max(nothing.explained.values()) < 0.05
    assert nothing.words.startswith("none of")


def test_plateau_and_stop() -> None:
    x = wander()
    x -= 0.5 * (x.max() + x.min())
    edge = 0.55 * x.max()
    flat = described(np.clip(x, -edge, edge) - x, x, noise=0.0)
    assert flat.plateau < 0.2
    assert "levels off" in flat.words
    stop = described(5 * np.sign(x) * np.maximum(np.abs(x) - edge, 0), x, noise=0.0)
    assert stop.plateau > 3
    assert described(0.01 * x**2, x).plateau == pytest.approx(1.0, abs=0.1)


def test_creep_shows_in_rests() -> None:
    x = np.repeat(np.array([0.0, 1.0, -0.5, 0.7, 0.0, -1.0]), 600)
    x = np.convolve(x, np.ones(20) / 20, "same")
    creeping = described(lagged(x, 1.0, DT), x, noise=0.01)
    assert creeping.dwell is not None
    assert creeping.dwell > 0.1
    steady = described(x**3, x, noise=0.01)
    assert steady.dwell is not None
    assert abs(steady.dwell) < 0.02
    assert described(wander() ** 3, wander()).dwell is None


def test_loops_count_and_close() -> None:
    t = DT * np.arange(4000)
    x = np.sin(2 * np.pi * 0.5 * t)
    assert len(cycles(x)) == 8
    past = PortHistory(x, x, DT)
    same = loops(past, np.sign(np.gradient(x)))
    assert same.area == pytest.approx(1.0, abs=0.05)
    assert same.closure > 0.9
    noisy = loops(past, np.random.default_rng(0).standard_normal(t.size))
    assert noisy.closure < 0.1
    assert same.speed_exponent is None  # one speed only
    assert loops(past, np.zeros(t.size)).dissipation == 0.0


def mass(friction: float = 0.0) -> BondGraph:
    return spring(1.0, 0.5, 100.0, friction=Coulomb(friction) if friction else None, speed="v")


def respond(w: Array) -> Array:
    """Displacement of the linear mass that loses the force `w`, linear between samples."""
    a, b = np.array([[0.0, 1.0], [-100.0, -0.5]]), np.array([[0.0], [-1.0]])
    c, d = np.array([[1.0, 0.0]]), np.zeros((1, 1))
    made: Any = cont2discrete((a, b, c, d), DT, "foh")
    poles = np.poly(made[0])
    # numerator from the first three samples of the impulse response
    impulse = [made[3][0, 0]]
    state = made[1]
    for _ in range(2):
        impulse.append((made[2] @ state)[0, 0])
        state = made[0] @ state
    top = np.convolve(poles, impulse)[:3]
    return np.asarray(lfilter(top, poles, w, axis=0)[:, None, :])


def test_coulomb_force_is_seen_through_a_mass_and_a_spring() -> None:
    """From the displacement alone, noise 40 dB below it."""
    n = 4000
    t = DT * np.arange(n)
    u = np.zeros(n)
    for a, f, p in ((6, 0.31, 0), (4, 0.83, 1), (4, 1.9, 2), (3, 3.3, 4)):
        u += a * np.sin(2 * np.pi * f * t + p)
    truth = simulate(mass(2.0), t, {"F": u})
    linear = simulate(mass(), t, {"F": u})
    x, v = np.asarray(truth["x"]), np.asarray(truth["v"])
    floor = 1e-2 * x.std()
    noise = floor * np.random.default_rng(0).standard_normal(n)
    residual = (x + noise - np.asarray(linear["x"]))[:, None]
    found = latent(respond, residual, np.array([floor]), DT)
    force = 2.0 * np.sign(v)
    assert np.corrcoef(found.signal, force)[0, 1] > 0.9
    assert found.signal.std() == pytest.approx(2.0, rel=0.15)
    assert found.explained > 0.99
    # the port's own flow explains it, with a jump, and it takes energy
    seen = characterise(
        PortHistory(v, 0.5 * v, DT, np.asarray(truth["x"])), found.signal, flow=True
    )
    assert seen.variable == "argument"
    assert seen.odd > 0.9
    assert seen.loops.dissipation > 0.5


def test_of_what_no_variable_explains_nothing_more_is_said() -> None:
    rng = np.random.default_rng(1)
    x = lfilter([1.0], [1.0, -0.9], rng.standard_normal(3000))
    seen = characterise(PortHistory(x, x, DT), 30 * rng.standard_normal(3000) * np.abs(x))
    assert seen.variable == "nothing"
    assert seen.plateau < 0.5 or seen.plateau > 2.0
    assert seen.words == "none of the port's own variables explains it"


def test_a_sign_that_foretells_nothing_is_no_jump() -> None:
    t = DT * np.arange(3000)
    x = np.sin(1.3 * t)
    seen = characterise(PortHistory(x, x, DT), np.cos(0.31 * t))
    assert seen.jump == 0.0


@pytest.mark.long
def test_a_resistor_is_looked_at_over_its_flow() -> None:
    """Friction jumps with the sign of its flow, not with that of the acceleration."""
    seen = characterised(diagnosed()).traits["d"][0]
    assert "it jumps where the motion turns" in seen.words
    assert "energy" not in seen.words, "what is proportional to the flow is not in what was rebuilt"


def test_what_parameters_can_imitate_is_left_out() -> None:
    n = 2000
    t = DT * np.arange(n)
    push = np.sign(np.sin(2 * np.pi * 0.7 * t))
    imitated = respond(np.cos(2 * np.pi * 1.9 * t)[:, None])
    floor = np.array([1e-5])
    noise = floor * np.random.default_rng(3).standard_normal((n, 1))
    residual = respond(push[:, None])[:, :, 0] + 3 * imitated[:, :, 0] + noise
    with_it = latent(respond, residual, floor, DT)
    without = latent(respond, residual, floor, DT, tangents=imitated)
    assert np.corrcoef(with_it.signal, push)[0, 1] < 0.7
    assert np.corrcoef(without.signal, push)[0, 1] > 0.95


def test_windows_of_their_own() -> None:
    """Stretches that start from rest each, the last one shorter."""
    n = 2000
    push = np.sign(np.sin(2 * np.pi * 0.7 * DT * np.arange(n)))
    parts = [slice(0, 700), slice(700, 1400), slice(1400, 1990)]

    def restarted(w: Array) -> Array:
        out = np.zeros((n, 1, w.shape[1]))
        for s in parts:
            out[s] = respond(w[s])
        return out

    floor = np.array([1e-5])
    noise = floor * np.random.default_rng(3).standard_normal((n, 1))
    residual = restarted(push[:, None])[:, :, 0] + noise
    found = latent(restarted, residual, floor, DT, windows=parts)
    assert np.corrcoef(found.signal[:1990], push[:1990])[0, 1] > 0.95
    assert not found.signal[1990:].any()


def test_stretches_that_were_held_out_are_no_readings_of_zero() -> None:
    n = 3000
    push = np.sign(np.sin(2 * np.pi * 0.7 * DT * np.arange(n)))
    floor = np.array([1e-5])
    noise = floor * np.random.default_rng(3).standard_normal((n, 1))
    scored = np.arange(n) % 300 < 200
    residual = (respond(push[:, None])[:, :, 0] + noise) * scored[:, None]
    found = latent(respond, residual, floor, DT, scored=scored)
    assert np.corrcoef(found.signal[scored], push[scored])[0, 1] > 0.95
    assert np.abs(found.signal).max() < 5.0
    assert np.abs(latent(respond, residual, floor, DT).signal).max() > 30.0


def test_a_recording_that_was_held_out_says_nothing_of_the_others() -> None:
    n = 2000
    push = np.sign(np.sin(2 * np.pi * 0.7 * DT * np.arange(n)))
    parts, scored = [slice(0, 1200), slice(1200, n)], np.arange(n) < 1200

    def restarted(w: Array) -> Array:
        return np.concatenate([respond(w[s]) for s in parts])

    floor = np.array([1e-5])
    noise = floor * np.random.default_rng(3).standard_normal((n, 1))
    residual = (restarted(push[:, None])[:, :, 0] + noise) * scored[:, None]
    found = latent(restarted, residual, floor, DT, windows=parts, scored=scored)
    assert np.corrcoef(found.signal[scored], push[scored])[0, 1] > 0.95


def test_noise_alone_gives_almost_nothing() -> None:
    floor = np.array([1e-3])
    noise = floor * np.random.default_rng(7).standard_normal((2000, 1))
    found = latent(respond, noise, floor, DT)
    assert found.explained < 0.02
