"""Make a recording and its truth as exam, trial and demo judge it: what each effect moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.accepted import kinds_of, names_of, places_of
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.generator.making import UNIT, converted, disturbed, noisy, together
from hardware.simulators.generator.parameters import ALL_PLANTS
from hardware.simulators.generator.sensing import MISREAD
from hardware.simulators.generator.sizing import CaseBench, Sized, bench_of, following, size

Array = NDArray[np.float64]

STRETCHES = 40
"""Equal parts of a record in which an effect is called active or not."""

ACTIVE = 0.1
"""An effect is active in a stretch if it moves more than this part of what it moves at most."""


def active_stretches(moved: Array) -> int:
    """Return in how many of forty equal stretches something moved; `moved` ``(n, sensors)``.

    Examples
    --------
    >>> active_stretches(np.r_[np.zeros(380), np.ones(20)][:, None])
    2
    """
    parts = np.array_split(moved, STRETCHES)
    level = np.sqrt([np.mean(p**2, axis=0) for p in parts])
    largest = np.max(level, axis=0)
    return int(np.sum(np.any(level > ACTIVE * np.maximum(largest, 1e-300), axis=1)))


def exam_record(case: DrawnCase) -> tuple[dict[str, Array | str], dict[str, Any]]:
    """Return what the tool may see of a case, and the truth as plain values.

    The truth has for each effect the accepted ``names``, ``kinds`` and ``places``, the ``family``
    and ``moved``: rms of the readings with all effects less those without this one, over the
    noise, at the same parameters. ``noise_std`` (SI) is the rms of the noise as it came out,
    outliers included; ``moved`` and ``active`` are those of all effects together.
    """
    plant = ALL_PLANTS[case.plant]
    bench = bench_of(case)
    plain = _readings(bench, [])
    names = list(plant.sensors)
    kept = [names.index(k) for k in case.sensors]
    lead = int(case.extra.get("lead", 0))
    wanted = np.std(plain, axis=0) * 10 ** (-case.noise["snr_db"] / 20)

    def excess(samples: Array) -> float:
        ratio = np.mean((samples - plain)[lead:] ** 2, axis=0) / wanted**2
        return float(10 * np.log10(np.mean(ratio[kept]) + 1e-12))

    found = [size(bench, hidden, excess) for hidden in case.effects]
    (command, clean), sized = together(bench, [e for e, _ in found])
    rng = np.random.default_rng(np.random.SeedSequence([case.seed, 1]))
    level = noise_level(case.plant, wanted, sized)
    y = noisy(case, clean, bench.noise[: case.samples], level)
    noise = y - clean
    y, nuisance = disturbed(case, y, level, rng)
    units = UNIT * level * (case.noise["kind"] == "quantised")
    if "bits" in case.extra:
        y, read = converted(case, y, level)
        units = np.maximum(units, read)
    if case.control_kind == "outliers" or "bits" in case.extra:
        noise = y - clean - np.asarray(nuisance.get("offset", 0.0))
    std = np.sqrt(np.mean(noise[lead:] ** 2, axis=0))
    channels: dict[str, Array | str] = {
        "time": np.asarray(plant.step * np.arange(case.samples - lead)),
        plant.source[0]: command[lead : case.samples],
        **{k: y[lead:, names.index(k)] for k in case.sensors},
        "plant": case.plant,
        "hold": case.hold,
        "declared_delay": np.asarray(case.extra.get("declared_delay", 0.0)),
        "declared_resolution": units[kept],
    }

    def over_noise(difference: Array) -> dict[str, float]:
        level = np.sqrt(np.mean(difference[lead:] ** 2, axis=0)) / std
        return {k: float(f"{level[names.index(k)]:.6g}") for k in case.sensors}

    effects = []
    for k, (e, (_, made)) in enumerate(zip(sized, found, strict=True)):
        rest = [other for j, other in enumerate(sized) if j != k]
        moved = clean - (_readings(bench, rest) if rest else plain)
        effects.append(_effect(case.plant, e, made) | {"moved": over_noise(moved)})
    truth = {
        **case.plain(),
        "dt": plant.step,
        "effects": effects,
        "noise_std": {k: float(std[names.index(k)]) for k in case.sensors},
        "moved": over_noise(clean - plain),
        "active": active_stretches((clean - plain)[lead:][:, kept]) if effects else 0,
        "nuisance": nuisance,
    }
    return channels, truth


def noise_level(plant: str, wanted: Array, effects: Sequence[Sized]) -> Array:
    """Return the rms of the noise of each channel: it goes with its sensor, and with its unit."""
    level = wanted.copy()
    for e in effects:
        place, law = e.hidden.place, e.hidden.law
        k = list(ALL_PLANTS[plant].sensors).index(place) if law in MISREAD else 0
        if law == "swapped":
            other = following(plant, place)
            level[k], level[other] = level[other], level[k]
        elif law in MISREAD:
            level[k] *= abs(e.numbers.get("gain", 1.0) * e.numbers.get("factor", 1.0))
    return level


def _readings(bench: CaseBench, effects: Sequence[Sized]) -> Array:
    made = bench.simulate(effects)
    if made is None:
        raise RuntimeError(f"{bench.case.id}: the plant runs away with {len(effects)} effects")
    return made[1]


def _effect(plant: str, e: Sized, excess_db: float) -> dict[str, Any]:
    h = e.hidden
    kinds = kinds_of(h.effect, h.law)
    return {
        "effect": h.effect,
        "names": list(names_of(h.effect, h.law, h.draws)),
        "family": FAMILY_OF[h.effect],
        "kind": kinds[0],
        "kinds": list(kinds),
        "place": h.place,
        "places": list(places_of(plant, h.law, h.place)),
        "law": h.law,
        "strength": e.strength,
        "strength_db": excess_db,
        "wanted_db": h.strength_db,
        "numbers": {k: v for k, v in e.numbers.items() if not k.startswith("_")},
    }
