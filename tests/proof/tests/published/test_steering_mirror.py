"""The steering mirror: derivatives, its bond graph, and the recording if it is there."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph import R, Recording
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import NUMPY
from identification.datasets import protocol
from tests.proof.published.mirror_fit import cost, fitted
from tests.proof.published.mirror_graph import free_run, values_of
from tests.proof.published.mirror_layout import OMEGA, Layout
from tests.proof.published.mirror_lines import Lines, Spectra, spectra, total_rms
from tests.proof.published.mirror_model import MirrorModel
from tests.proof.published.mirror_start import add_mode, vector_fit
from tests.proof.published.mirror_terms import Terms
from tests.proof.published.models.plays_and_powers import PlaysAndPowers
from tests.proof.published.models.steering_mirror import elements_that_feed, steering_mirror
from tests.proof.published.steering_mirror import (
    LINEAR,
    Sizes,
    by_level,
    compare,
    errors_of,
    linear_modes,
    with_memory,
)

LINES = Lines(256, 6400.0, 1, 110, oversampling=8)
TERMS = Terms(of_voltage=(0.1, 0.3), of_rate=(0.2,), of_motion=(0.5,))
MODEL = MirrorModel(Layout(3, ((0, 1), (1, 2)), TERMS.count, 2), TERMS, LINES, 0.2)


def values(strength: float = 1.0) -> np.ndarray:
    """Three modes with memory of a few per cent."""
    rng, at = np.random.default_rng(1), MODEL.layout.at
    p = np.zeros(MODEL.layout.size)
    p[at["log_omega"]] = np.log([0.5, 0.8, 1.3])
    p[at["log_zeta"]] = np.log(0.06)
    p[at["psi"]], p[at["phi"]] = rng.uniform(-1, 1, (2, 3, 3))
    p[at["log_stiffness"]] = np.log([0.3, 0.4, 0.2])
    p[at["softening"]], p[at["slackening"]] = (0.03, 0.01), (0.1, -0.04)
    p[at["bending"]] = (0.01, -0.004)
    p[at["static"]] = rng.uniform(-0.2, 0.2, (3, 3))
    p[at["late_in"]], p[at["late_out"]] = 1.2, (0.1, 0.0, -0.1)
    p[at["coupling"]], p[at["dragging"]] = 0.004, (0.001, -0.0005)
    p[at["dampers"]] = 0.05 * rng.uniform(-1, 1, (3, 2))
    p[at["memory"]] = strength * rng.uniform(0.005, 0.02, (3, TERMS.count))
    return p


def command(seed: int, level: float = 0.25) -> Spectra:
    """Random phases on all lines; no readings yet."""
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, (3, LINES.count))
    u = np.exp(1j * phase) * level / np.sqrt(2 * LINES.count)
    flat = np.ones(u.shape)
    return Spectra(f"seed_{seed}", level, u, 0 * u, flat, 1e4 * flat)


def answered(p: np.ndarray, seed: int, level: float = 0.25) -> Spectra:
    """Spectra whose readings are those of the model."""
    asked = command(seed, level)
    return replace(asked, y=MODEL.settled(p, asked).y)


def test_derivatives_are_those_of_the_settled_response() -> None:
    p, data = values(), command(2)
    _, j = MODEL.sensitivities(p, data, MODEL.modes(p, MODEL.drive(data)))
    for name, places in MODEL.layout.at.items():
        direction = np.zeros(p.size)
        direction[places] = np.random.default_rng(3).standard_normal(places.shape)
        step = 3e-4 * direction
        true = (MODEL.settled(p + step, data).y - MODEL.settled(p - step, data).y) / 6e-4
        error = np.linalg.norm(np.tensordot(direction, j, 1) - true) / np.linalg.norm(true)
        # the loop is corrected once, which leaves most where nothing but memory acts
        assert error < (0.1 if name == "log_stiffness" else 0.02), name


def test_fit_finds_the_model_that_made_the_data() -> None:
    true = values()
    data = [answered(true, seed, level) for seed in (2, 3) for level in (0.1, 0.3)]
    start, places = true.copy(), MODEL.layout.places("memory", "log_omega")
    start[MODEL.layout.at["memory"]] *= 0.3
    start[MODEL.layout.at["log_omega"]] += 0.002
    made = fitted(MODEL, start, data, places, iterations=12, stop=1e-6)
    judge = [answered(true, 9)]
    assert cost(MODEL, made.p, judge) < 1e-3 * cost(MODEL, start, judge)


@pytest.mark.parametrize("drive", [-0.6, 0.0, 0.9])
def test_bond_graph_has_the_matrices_of_the_modes(drive: float) -> None:
    p, s = values(), LINES.s[:, None, None]
    of_modes = np.linalg.inv(MODEL.modes(p, drive).inverse)
    of_modes = MODEL.layout.split(p).stiffness[:, None] * of_modes
    v = values_of(MODEL, p, drive)
    np.testing.assert_allclose(
        np.diag(v.mass) * s**2 + v.damping * s + v.stiffness, of_modes,
        rtol=1e-9, atol=1e-9 * np.abs(of_modes).max(),
    )  # fmt: skip


def test_a_mode_is_added_where_the_weights_see_most() -> None:
    true = {0.3: 1.0, 0.7: 0.05}  # heights of two modes in two sensors, which weigh differently
    ratio = LINES.s / float(np.abs(LINES.s[-1]))
    left = np.zeros((LINES.count, 3, 3), complex)
    for o, (at, height) in enumerate(true.items()):
        left[:, o] = (height / ((ratio / at) ** 2 + 0.02 * ratio / at + 1.0))[:, None]
    top = float(np.abs(LINES.s[-1])) / OMEGA
    for weights, wanted in (((1.0, 1.0, 1.0), 0.3), ((1.0, 1e4, 1.0), 0.7)):
        weight = np.repeat(weights, LINES.count).reshape(3, -1)
        layout, p = add_mode(Layout(0, (), 0), np.zeros(15), left, weight, LINES)
        assert np.exp(p[layout.at["log_omega"][0]]) == pytest.approx(wanted * top, rel=5e-3)


def test_a_wider_layout_keeps_what_a_narrower_one_knew() -> None:
    p, layout = values(), MODEL.layout
    wider = Layout(4, ((0, 1), (0, 2), (1, 2), (2, 3)), TERMS.count, 2)
    a, b = layout.split(p), wider.split(layout.moved(p, wider))
    for name in ("coupling", "bending", "dragging"):
        kept = getattr(b, name)
        np.testing.assert_array_equal(kept[[0, 2]], getattr(a, name))
        assert not kept[[1, 3]].any()
    np.testing.assert_array_equal(b.softening[:3], a.softening)


@pytest.mark.long
def test_bond_graph_simulates_the_same_steady_state() -> None:
    p, data = values(), command(4)
    y = MODEL.settled(p, data).y
    linear = MODEL.settled(values(0.0), data).y
    error = total_rms(free_run(MODEL, p, data, oversampling=32, accuracy=1e-2) - y)
    # commands are linear between the finer samples, and laws act between them too
    assert np.all(error < 0.008 * total_rms(y))
    # the settled response leaves out what memory makes at rest and beyond the lines
    assert np.all(error < 0.12 * total_rms(y - linear))


def test_springs_and_dampers_make_symmetric_matrices_only() -> None:
    good = values_of(MODEL, values(), 0.0)
    assert elements_that_feed(good.damping) == elements_that_feed(good.stiffness) == 0
    active = replace(good, damping=good.damping * np.where(np.eye(3, dtype=bool), 1.0, 30.0))
    assert elements_that_feed(active.damping) > 0
    with pytest.raises(UnusableInput, match="create power"):
        steering_mirror(active)
    with pytest.raises(UnusableInput, match="not symmetric"):
        steering_mirror(replace(good, damping=np.triu(np.ones((3, 3)))))
    with pytest.raises(UnusableInput, match="springs of and between modes"):
        steering_mirror(replace(good, stiffness=good.stiffness - 2.0 * np.eye(3)))
    single = np.outer((1.0, 2.0, 3.0), (1.0, 2.0, 3.0)) * 1e-6
    for damping, count in ((single, 1), (np.diag((0.0, 1e-6, 1e-6)), 2)):
        made = steering_mirror(replace(good, damping=damping))
        assert len([r for r in made.of_type(R) if "far" not in r.name]) == count


def test_law_is_the_sum_of_plays_and_powers() -> None:
    law = PlaysAndPowers(0.7, (0.5, 1.0), (0.2, -0.1), (0.05, 0.01), 0.3)
    plays = PrandtlIshlinskii((0.0, 0.5, 1.0), (0.7, 0.2, -0.1))
    x = 2.0 * np.sin(np.linspace(0.0, 12.0, 300))
    wanted = plays.run(x)[0] + 0.05 * x**2 + 0.01 * x**3 + 0.3 * x * np.abs(x)
    memory, made = law.initial_memory(0.0), []
    for s in x:
        made.append(float(law.value(NUMPY, s, memory, (), law.slope)))
        memory = law.advance(NUMPY, s, memory, ())
    np.testing.assert_allclose(made, wanted, atol=1e-12)
    assert law.initial_memory(2.0) == (1.5, 1.0)
    assert law.memory_sensitivity(0.7) == (1.0, 0.0)


def test_vector_fit_finds_poles() -> None:
    s = 2j * np.pi * np.linspace(100.0, 1000.0, 400)
    poles = np.array([-4 + 300j, -6 + 650j]) * 2 * np.pi
    residues = np.array([[1 + 2j, -1j], [0.5j, 2.0]])
    h = 0.01 + sum(
        r / (s[:, None] - q) + r.conj() / (s[:, None] - q.conj())
        for r, q in zip(residues, poles, strict=True)
    )
    start = np.empty(2, dtype=np.complex128)
    start[:] = 2 * np.pi * np.array([-5 + 200j, -5 + 800j])
    found, _ = vector_fit(s, np.asarray(h, complex), np.ones(h.shape, float), start)
    np.testing.assert_allclose(found, poles, rtol=1e-6)


def test_records_without_whole_periods_are_refused() -> None:
    n = 700
    names = ("u1", "u2", "u3", "y1", "y2", "y3")
    units = {k: "V" if k[0] == "u" else "m" for k in names}
    record = Recording("short", np.arange(n) / 6400.0, {k: np.ones(n) for k in names}, units)
    with pytest.raises(UnusableInput, match="two or more periods"):
        spectra(record, LINES)


def test_levels_must_agree() -> None:
    with pytest.raises(UnusableInput, match="levels"):
        compare({"100mV": []}, {})


@pytest.mark.long
@pytest.mark.recordings
def test_memory_beats_a_linear_model_of_all_levels() -> None:
    folder = os.environ.get("BONDSIGHT_RECORDINGS")
    if not folder or not (Path(folder) / "piezo-steering-mirror").is_dir():
        pytest.skip("BONDSIGHT_RECORDINGS has no piezo-steering-mirror")
    parts, lines = protocol("steering_mirror"), Lines(8192, 6400.0, 1, 3839)
    train = {k: [spectra(r, lines) for r in v] for k, v in by_level(parts.train).items()}
    tests = [spectra(r, lines) for r in parts.tests.values()]
    # a quick fit of few modes only: the full one is the protocol itself
    sizes = Sizes(added=0, reach=0, linear=2)
    linear, start = linear_modes(train["200mV"], lines, sizes, Terms())
    few = [v[0] for v in train.values()]
    places = linear.layout.places(*LINEAR)
    plain = fitted(linear, start, few, places, iterations=3).p
    model, p = with_memory(linear, start, few)
    p = fitted(model, p, few, np.arange(p.size), iterations=3, damping=1e-2).p
    for e in (tests[0], tests[2]):
        noise = np.sqrt(2.0 * e.noise.sum(1)) * 1e-6
        assert np.all(errors_of(model, p, e) < 0.8 * errors_of(linear, plain, e))
        assert np.all(errors_of(model, p, e) > noise)
