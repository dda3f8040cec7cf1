"""The virtual stack bench: independence, accuracy, passivity, sealing, promised strengths."""

from __future__ import annotations

import ast
import functools
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hardware.simulators as simulators
from hardware.simulators import draw_truth, effects, record
from hardware.simulators.bench import CSV_HEADER, visibility
from hardware.simulators.draw import deviation_ratio, imitations, left_over
from hardware.simulators.effects import CATALOGUE, RATIO_RANGES, STRENGTHS, HiddenEffect
from hardware.simulators.excitation import training_samples, voltage
from hardware.simulators.plant import PlantParameters
from hardware.simulators.seal import SealBrokenError, SealedTruth
from hardware.simulators.simulation import SUBSTEPS, simulate

PAIRS = [(e.name, e.place) for e in CATALOGUE]
SIZED = [(e.name, e.place) for e in CATALOGUE if e.classes is None]
INNER = [p for p in PAIRS if p[1] not in ("x", "i")]
SEED = 11


@functools.cache
def truth(name: Any, place: Any) -> Any:
    """Give one truth per entry; the class goes round the catalogue."""
    strength = STRENGTHS[PAIRS.index((name, place)) % 3]
    return draw_truth(SEED, name, place, strength)


def shows(t: Any, seed: int) -> float:
    """What other parameters leave of the effect, over the noise."""
    plain, like = linear(t.plant, t.noise, seed)
    changed = simulate(t.plant, t.effect, voltage(seed), substeps=3)
    return left_over((changed.x, changed.i), plain, t.noise, like)


@functools.cache
def linear(plant: Any, noise: Any, seed: int) -> Any:
    """Give the readings of a bench that conceals nothing, and what its parameters imitate."""
    command = voltage(seed)
    run = simulate(plant, HiddenEffect(), command, substeps=3)
    return (run.x, run.i), imitations(plant, command, (run.x, run.i), noise)


def test_bench_imports_nothing_of_the_tool() -> None:
    """Only numpy, scipy, the standard library and the bench itself."""
    allowed = {"numpy", "scipy", "hardware", *sys.stdlib_module_names}
    folder = Path(simulators.__file__).parent
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [a.name for a in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, path.name
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[0] in allowed, (path.name, name)
                if name.startswith("hardware"):
                    assert name.startswith("hardware.simulators"), (path.name, name)


def slowest_are_long(pairs: Any) -> list[Any]:
    """Every play of a hysteresis is a state of its own: half a minute."""
    return [p if p[0] != "hysteresis" else pytest.param(*p, marks=pytest.mark.long) for p in pairs]


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(("name", "place"), slowest_are_long(PAIRS))
def test_halving_the_step_changes_less_than_the_noise_by_orders(name: Any, place: Any) -> None:
    """Error of the default step is far below the noise floor for every law."""
    t = truth(name, place)
    command = voltage(SEED, 160)
    coarse, fine = (
        simulate(t.plant, t.effect, command, substeps=n) for n in (SUBSTEPS, 2 * SUBSTEPS)
    )
    assert np.std(coarse.x - fine.x) < 1e-4 * t.noise.x_rms
    assert np.std(coarse.i - fine.i) < 1e-4 * t.noise.i_rms


@pytest.mark.parametrize(("name", "place"), slowest_are_long(INNER))
def test_bench_dissipates(name: Any, place: Any) -> None:
    """Supplied minus stored energy never falls by more than the error of its quadrature."""
    t = truth(name, place)
    path = simulate(t.plant, t.effect, voltage(SEED, 320), substeps=32, energy=True).path
    lost = path.supplied - (path.stored - path.stored[0])
    assert lost[-1] > 0.0
    assert np.min(np.diff(lost)) > -1e-4 * lost[-1]


def test_linear_plant_against_its_transfer_function() -> None:
    """Steady response to one sine equals the phasor solution of the state equations."""
    p = PlantParameters(1.5e-6, 0.036, 60e6, 0.108, 400.0, 20.0)
    n, f, fs = 4000, 1000.0, 40e3
    t = np.arange(n) / fs
    out = simulate(p, HiddenEffect(), 50.0 + np.sin(2 * np.pi * f * t))
    total = np.zeros(2, dtype=complex)
    for image in range(-3000, 3001):
        g = f + image * fs
        s = 2j * np.pi * g
        matrix = np.array(
            [
                [s * p.R_e + 1 / p.C_q + p.k * p.T**2, -p.T * p.k],
                [-p.k * p.T, p.m * s**2 + p.b * s + p.k],
            ]
        )
        q, x = np.linalg.solve(matrix, np.array([1.0, 0.0]))
        total += np.sinc(g / fs) ** 2 * np.array([x, s * q])
    tail = slice(n // 2, n)
    basis = np.exp(-2j * np.pi * f * t[tail])
    for signal, phasor in zip((out.x, out.i), total, strict=True):
        measured = 2j * np.mean((signal[tail] - signal[tail].mean()) * basis)
        assert abs(measured - phasor) < 1e-5 * abs(phasor)


def test_free_static_displacement() -> None:
    """A step held long ends at x = T q = T C_q V."""
    p = draw_truth(1, "none").plant
    command = np.full(1200, 60.0)
    command[0] = 50.0
    x = simulate(p, HiddenEffect(), command).x
    assert x[-200:].mean() == pytest.approx(10.0 * p.T * p.C_q, rel=1e-4)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(("name", "place"), slowest_are_long(PAIRS))
def test_recording_is_finite_and_inside_the_range(name: Any, place: Any) -> None:
    """All channels are finite, the command keeps to 0..100 V and starts at the bias."""
    r = record(truth(name, place), SEED, n_samples=512)
    for channel in (r.time, r.V, r.x, r.i):
        assert channel.shape == (512,)
        assert np.all(np.isfinite(channel))
    assert r.V.min() >= 0.0
    assert r.V.max() <= 100.0
    assert r.V[0] == 50.0


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize(("name", "place"), slowest_are_long(SIZED))
def test_mark_is_in_the_promised_class(name: Any, place: Any) -> None:
    """Deviation from the twin over noise lies in the range of the class.

    A creep that would be a softer spring to below the noise is larger, but no larger than it needs
    to be.
    """
    t = truth(name, place)
    low, high = RATIO_RANGES[t.strength]
    mark = visibility(t, SEED)
    assert mark >= low
    if mark > high:
        assert (name, place) == ("creep", "k")
        assert 0.95 < shows(t, SEED) < 1.5


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize(("name", "place"), slowest_are_long(SIZED))
def test_what_is_concealed_shows(name: Any, place: Any) -> None:
    assert shows(truth(name, place), SEED) > 0.95


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("seed", [3, 2094261339])
def test_other_parameters_do_not_imitate_what_is_concealed(seed: Any) -> None:
    """The weakest creep is a softer spring but for a part of the noise, so it is made larger."""
    t = draw_truth(seed, "creep", "k", "weak")
    assert 0.95 < shows(t, seed) < 1.5
    softer = replace(t.plant, k=0.99 * t.plant.k)
    command = voltage(seed)
    plain, columns = linear(t.plant, t.noise, seed)
    run = simulate(softer, HiddenEffect(), command, substeps=3)
    assert columns.shape == (2 * command.size, 6)
    left = left_over((run.x, run.i), plain, t.noise, columns)
    assert left < 0.03 * deviation_ratio((run.x, run.i), plain, t.noise)


@pytest.mark.parametrize("strength", STRENGTHS)
def test_delays_and_pole_follow_their_own_classes(strength: Any) -> None:
    """These are drawn from plausible values; all leave a clear mark."""
    for e in CATALOGUE:
        if e.classes is not None:
            t = draw_truth(SEED, e.name, e.place, strength)
            ((_, value),) = t.effect.parameters
            assert e.classes[strength][0] <= value <= e.classes[strength][1]
            assert visibility(t, SEED, n_samples=2048) > 10.0


@pytest.mark.parametrize("seed", range(8))
def test_excitation(seed: Any) -> None:
    """Range, start, and a held-out third unlike the training part."""
    v = voltage(seed)
    assert v.min() >= 0.0
    assert v.max() <= 100.0
    assert v[0] == 50.0
    assert np.ptp(v) > 70.0
    cut = training_samples(v.size)
    held = v[cut:] - v[cut:].mean()
    train = v[:cut] - v[:cut].mean()
    match = np.correlate(train, held, "valid") / np.linalg.norm(held) ** 2
    assert np.max(np.abs(match)) < 0.95


def test_seed_decides_everything() -> None:
    """Same seed, same bench and bytes; another seed, another bench."""
    a, b = (draw_truth(5, "quadratic_drag", "b") for _ in range(2))
    assert a == b
    ra, rb = record(a, 9, n_samples=256), record(b, 9, n_samples=256)
    np.testing.assert_array_equal(ra.x, rb.x)
    np.testing.assert_array_equal(ra.i, rb.i)
    assert draw_truth(6, "none").plant != draw_truth(5, "none").plant
    assert not np.array_equal(record(a, 10, n_samples=256).x, ra.x)


def test_noise_level() -> None:
    """Sensors are 55 to 65 dB below the signal."""
    t = draw_truth(3, "none")
    r = record(t, 3, substeps=4)
    for signal, noise in ((r.x, t.noise.x_rms), (r.i, t.noise.i_rms)):
        assert 54.9 < 20 * np.log10(np.std(signal) / noise) < 65.1


def test_parameters_stay_within_twenty_percent() -> None:
    """True parameters are near the nominal ones but not equal."""
    from hardware.simulators.plant import NOMINAL

    p = draw_truth(8, "none").plant
    for name in ("C_q", "T", "k", "m", "b", "R_e"):
        ratio = getattr(p, name) / getattr(NOMINAL, name)
        assert 1 / 1.2 <= ratio <= 1.2


def test_seal_opens_to_the_same_truth(tmp_path: Any) -> None:
    """Opening gives the sealed truth, also from a file; salts differ; repr tells nothing."""
    t = truth("creep", "C_nl")
    sealed, again = (SealedTruth.closed(t.as_dict()) for _ in range(2))
    assert sealed.open() == t
    assert sealed.hash != again.hash
    assert len(sealed.hash) == 64
    assert "creep" not in repr(sealed)
    sealed.save(tmp_path / "envelope.json")
    assert SealedTruth.load(tmp_path / "envelope.json").open() == t


def test_tampering_is_found() -> None:
    """Changed payload, salt or hash do not open."""
    sealed = SealedTruth.closed(truth("creep", "C_nl").as_dict())
    content = json.loads(sealed.payload)
    content["effect"] = "none"
    forged = json.dumps(content, sort_keys=True, separators=(",", ":"))
    for bad in (
        replace(sealed, payload=forged),
        replace(sealed, salt="00" * 32),
        replace(sealed, hash="0" * 64),
    ):
        with pytest.raises(SealBrokenError, match="does not match"):
            bad.open()


def test_csv_is_exact_and_silent(tmp_path: Any) -> None:
    """The file gives back every bit and says nothing of the truth."""
    t = truth("creep", "C_nl")
    r = record(t, SEED, n_samples=64)
    r.write_csv(tmp_path / "r.csv")
    text = (tmp_path / "r.csv").read_text(encoding="utf-8")
    assert text.splitlines()[0] == CSV_HEADER
    table = np.loadtxt(tmp_path / "r.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table, np.column_stack([r.time, r.V, r.x, r.i]))
    shown = text + repr(r.meta)
    assert not any(name in shown for name in effects())


def test_catalogue_and_wishes() -> None:
    """Catalogue lists places; impossible wishes are refused."""
    table = effects()
    assert table["hysteresis"] == ("C_nl", "k")
    assert table["delay"] == ("V_in", "x", "i")
    assert table["none"] == ()
    with pytest.raises(KeyError, match="Known"):
        draw_truth(1, "creep", "V_in")
    with pytest.raises(ValueError, match="Known"):
        draw_truth(1, "creep", "k", "huge")
