"""Make a recording of a case: size its effects, simulate, add noise and nuisances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.parameters import ALL_PLANTS
from hardware.simulators.generator.sizing import CaseBench, Sized, bench_of, size

Array = NDArray[np.float64]

UNIT = 2.4
"""Unit of a coarse converter in parts of the rms of the noise; such a converter is declared."""


def noisy(case: DrawnCase, clean: Array, e: Array, std: Array) -> Array:
    """Add noise; with a coarse converter part of its rms is rounding."""
    if case.noise["kind"] != "quantised":
        return np.asarray(clean + e * std)
    unit = UNIT * std
    return np.asarray(unit * np.round((clean + 0.72 * e * std) / unit))


COARSE = 3.5
"""Largest unit of a converter in parts of the rms of the noise: a laboratory takes a finer one."""

BOW = 0.2
"""Largest bow of a converter's line in parts of the rms of the noise, and half a unit at most."""


def converted(case: DrawnCase, y: Array, std: Array) -> tuple[Array, Array]:
    """Return what a converter of the drawn width makes of the readings, and its units.

    Its range holds the largest reading with the drawn headroom; its line is bowed a little. The
    width grows by two bits where a unit would hide the noise.
    """
    largest = case.extra["headroom"] * np.max(np.abs(y), axis=0) + 1e-300
    unit = 2 * largest / 2 ** case.extra["bits"]
    finer = np.ceil(np.log2(np.maximum(unit / (COARSE * std), 1)) / 2)
    unit = unit / 4**finer
    bow = case.extra["bow"] * np.minimum(BOW * std, unit / 2)
    part = y / np.max(np.abs(y), axis=0).clip(1e-300)
    return unit * np.round((y + bow * part * (1 - part**2) * 2.6) / unit), unit


def disturbed(
    case: DrawnCase, y: Array, std: Array, rng: np.random.Generator
) -> tuple[Array, Mapping[str, Any]]:
    """Return the readings with the nuisance of a control, and what was done."""
    if case.control_kind == "outliers":
        hits = rng.random(y.shape) < rng.uniform(0.001, 0.005)
        return y + hits * rng.normal(size=y.shape) * 20 * std, {"outliers": int(hits.sum())}
    if case.control_kind == "offset":
        offset = np.std(y, axis=0) * rng.uniform(-0.3, 0.3, y.shape[1])
        return y + offset, {"offset": offset.tolist()}
    return y, {}


def record(case: DrawnCase) -> tuple[dict[str, Array | str], dict[str, Any]]:
    """Return what the tool may see of a case, and the truth.

    Returns
    -------
    channels : dict
        ``time`` and the channels as arrays, and ``plant``, ``hold``, ``declared_delay`` (s),
        ``declared_resolution`` (unit of each sensor's converter, 0 if fine).
    truth : dict
        Plain values for JSON.
    """
    plant = ALL_PLANTS[case.plant]
    bench = bench_of(case)
    plain = bench.simulate([])
    assert plain is not None
    names = list(plant.sensors)
    kept = [names.index(k) for k in case.sensors]
    std = np.std(plain[1], axis=0) * 10 ** (-case.noise["snr_db"] / 20)

    def excess(samples: Array) -> float:
        ratio = np.mean((samples - plain[1]) ** 2, axis=0) / std**2
        return float(10 * np.log10(np.mean(ratio[kept]) + 1e-12))

    found = [size(bench, hidden, excess) for hidden in case.effects]
    made, sized = together(bench, [e for e, _ in found])
    rng = np.random.default_rng(np.random.SeedSequence([case.seed, 1]))
    noise = bench.noise[: case.samples]
    y, nuisance = disturbed(case, noisy(case, made[1], noise, std), std, rng)
    channels: dict[str, Array | str] = {
        "time": np.asarray(plant.step * np.arange(case.samples)),
        plant.source[0]: made[0][: case.samples],
        **{k: y[:, names.index(k)] for k in case.sensors},
        "plant": case.plant,
        "hold": case.hold,
        "declared_delay": np.asarray(case.extra.get("declared_delay", 0.0)),
        "declared_resolution": UNIT * std[kept] * (case.noise["kind"] == "quantised"),
    }
    truth = {
        **case.plain(),
        "dt": plant.step,
        "effects": [
            {**_plain(e), "strength_db": excess_db, "wanted_db": e.hidden.strength_db}
            for e, (_, excess_db) in zip(sized, found, strict=True)
        ],
        "excess_db": excess(made[1]) if sized else None,
        "noise_std": dict(zip(names, std.tolist(), strict=True)),
        "nuisance": nuisance,
    }
    return channels, truth


def _plain(e: Sized) -> dict[str, Any]:
    h = e.hidden
    return {
        "effect": h.effect,
        "place": h.place,
        "law": h.law,
        "strength": e.strength,
        "numbers": {k: v for k, v in e.numbers.items() if not k.startswith("_")},
    }


def together(bench: CaseBench, effects: list[Sized]) -> tuple[tuple[Array, Array], list[Sized]]:
    """Simulate all effects; where two together run away, both become weaker."""
    while (made := bench.simulate(effects)) is None:
        effects = [bench.sized(e.hidden, e.strength / 3) for e in effects]
    return (made[0].command, made[1]), effects
