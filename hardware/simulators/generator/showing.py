"""What the demo shows: a virtual plant of development with one concealed effect, or nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.case import DrawnCase, Hidden
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.later_places import LATER_SINGLES
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.parameters import ALL_PLANTS, SPREAD
from hardware.simulators.generator.sizing import bench_of
from hardware.simulators.generator.vocabulary import Choice

Array = NDArray[np.float64]
Channels = dict[str, Array | str]

SHOWN: Mapping[str, str] = MappingProxyType(
    {
        "chain": "Three virtual masses hang in a row on springs; a force shakes the first.",
        "stack": "A virtual piezo stack moves a mass.",
        "motor": "A virtual motor turns a load through a gear and an elastic shaft.",
        "corner": "A virtual wheel rolls over a rough road and carries a car on its suspension.",
        "tanks": "Three virtual tanks stand in a row; water is pumped into the first.",
        "probe": "A virtual mass on a spring is shaken; a coil and a filter feel its motion.",
        "cylinder": "A virtual hydraulic cylinder moves a mass.",
        "servo": "A virtual servo motor turns a load through an elastic coupling.",
        "oven": "A virtual heater warms a chamber that loses heat to the room.",
        "frame": "A force shakes two virtual masses on springs; two accelerometers and a load "
        "cell watch.",
        "press": "A virtual press pushes two masses on springs; the first is known to harden.",
    }
)
"""Plants of the demo, each in a sentence; those that only sealed trials draw are not among them."""

NOTHING = "none"
"""Name of the control: nothing is concealed."""

HIDES: Mapping[str, Mapping[str, tuple[Choice, ...]]] = MappingProxyType(
    {
        plant: {
            effect: tuple(
                Choice(effect, law, plant, place)
                for name, law, places in LATER_SINGLES
                if name == effect
                for place in places.get(plant, ())
            )
            for effect, _, places in LATER_SINGLES
            if plant in places
        }
        for plant in SHOWN
    }
)
"""Laws and places of every effect that a plant can hide."""

QUIET = 0.2
"""Share of the draws that conceal nothing."""

STRENGTHS_DB = (10.0, 30.0)
"""Range of what an effect moves over the noise: 3 to 30 times."""

SHOWS = 3.0
"""What is drawn is drawn again if other values of the parameters leave less of it than that, over
the noise, in every reading."""

TURNS = 8
"""Draws at most: an effect that never leaves that much is shown as weak as it is."""

STEP = 0.01
"""Part of a parameter by which it is changed to see what it could imitate."""


def effects_of(plant: str | None = None) -> tuple[str, ...]:
    """Return the effects that a plant can hide, or any of them; the first is `NOTHING`."""
    plants = SHOWN if plant is None else (plant,)
    return (NOTHING, *sorted({effect for name in plants for effect in HIDES[name]}))


def plants_of(effect: str | None = None) -> tuple[str, ...]:
    """Return the plants that can hide an effect; all of them for none."""
    return tuple(p for p in SHOWN if effect in (None, NOTHING) or effect in HIDES[p])


def draw_shown(
    seed: int, plant: str | None = None, effect: str | None = None, turn: int = 0
) -> DrawnCase:
    """Return one case; plants, and the effects of a plant, are as likely as each other.

    Parameters
    ----------
    seed : int
        The same seed is the same case.
    plant, effect : str, optional
        Wishes; one of `SHOWN` and one of its `effects_of`.
    turn : int
        Another case of the same seed.
    """
    rng = stream("demo", seed, turn)
    quiet = rng.random() < QUIET
    hidden: tuple[Hidden, ...] = ()
    if effect == NOTHING or (effect is None and quiet):
        plant = plant or _one(plants_of(), rng)
    else:
        plant = plant or _one(plants_of(effect), rng)
        name = effect or _one(tuple(HIDES[plant]), rng)
        places = HIDES[plant][name]
        at = places[int(rng.integers(len(places)))]
        draws = tuple(float(x) for x in rng.random(3))
        strength = float(rng.uniform(*STRENGTHS_DB))
        hidden = (Hidden(at.effect, at.place, at.law, strength, draws),)
    known = ALL_PLANTS[plant]
    return DrawnCase(
        id=f"demo-{seed}",
        plant=plant,
        sensors=tuple(known.sensors),
        cell="single" if hidden else "control",
        effects=hidden,
        parameters={
            k: float(v * np.exp(rng.uniform(-SPREAD, SPREAD)))
            for k, (v, _) in known.nominal.items()
        },
        noise={"kind": "white", "snr_db": float(rng.uniform(45, 60))},
        excitation=_one(("multisine", "noise"), rng),
        level=float(np.exp(rng.uniform(np.log(0.8), np.log(1.3)))),
        samples=int(rng.integers(2000, 3000)),
        hold="linear",
        seed=int(rng.integers(2**62)),
        control_kind="" if hidden else "plain",
    )


def shown(
    seed: int, plant: str | None = None, effect: str | None = None
) -> tuple[Channels, dict[str, Any]]:
    """Return a recording and its truth, as `exam_record` does; what it conceals shows.

    Raises
    ------
    OSError
        Without gcc: the plants are C code.
    """
    for turn in range(TURNS):
        case = draw_shown(seed, plant, effect, turn)
        channels, truth = exam_record(case)
        if not case.effects or left_over(case, truth) >= SHOWS:
            break
        # the wish that the first draw made stays, so that weak effects are no rarer than others
        plant, effect = case.plant, case.effects[0].effect
    return channels, truth


def left_over(case: DrawnCase, truth: Mapping[str, Any]) -> float:
    """Return what small changes of all parameters leave of the effects, over the noise.

    The rms of the reading that shows it best.
    """
    bench = bench_of(case)
    names = list(ALL_PLANTS[case.plant].sensors)
    kept = [names.index(k) for k in case.sensors]
    noise = np.array([truth["noise_std"][k] for k in case.sensors])
    strengths = [e["strength"] for e in truth["effects"]]
    made = bench.simulate([bench.sized(*e) for e in zip(case.effects, strengths, strict=True)])
    assert made is not None, case.id

    def over_noise(readings: Array) -> Array:
        # a clock that is off is told beside more samples than it gives
        shown = slice(case.samples)
        away = (readings[shown, kept] - bench.base.readings[shown, kept]) / noise
        return np.asarray(away - away.mean(axis=0)).ravel()

    imitations = []
    for name, value in case.parameters.items():
        other = {**case.parameters, name: (1 + STEP) * value}
        imitations.append(over_noise(bench_of(replace(case, parameters=other)).base.readings))
    columns = np.stack(imitations, axis=1)
    away = over_noise(made[1])
    rest = away - columns @ np.linalg.lstsq(columns, away, rcond=None)[0]
    return float(np.sqrt(np.mean(rest.reshape(case.samples, -1) ** 2, axis=0)).max())


def _one(names: tuple[str, ...], rng: np.random.Generator) -> str:
    return names[int(rng.integers(len(names)))]
