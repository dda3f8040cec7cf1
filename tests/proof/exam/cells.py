"""The cells of the exam, how many recordings each has, and the draw of their cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hardware.simulators.generator.case import DrawnCase, Hidden
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.exam_places import Table
from hardware.simulators.generator.parameters import ALL_PLANTS, PLANTS, SPREAD
from hardware.simulators.generator.vocabulary import Choice, choices
from tests.proof.exam.world import EXAM, World

CELLS: Mapping[str, int] = {
    "control": 108,
    "single": 72,
    "form": 30,
    "rewritten": 30,
    "outside": 30,
    "two": 30,
    "three": 14,
    "weak_further": 26,
    "rare": 26,
    "slow": 20,
    "broadband": 18,
    "disturbed": 16,
}
"""Recordings of each cell in an exam of the usual size."""

CONTROLS: Mapping[str, int] = {
    "plain": 3,
    "wrong_parameters": 4,
    "coloured_noise": 4,
    "outliers": 2,
    "coarse": 3,
    "offset": 1,
    "declared_delay": 1,
}
"""What disturbs a control instead of missing physics, with shares."""

QUIET_EVERY = 4
"""In slow and broadband records every fourth conceals nothing."""

_EXCITATIONS = ("multisine", "steps", "sweep", "noise", "closed_loop")
_EXCITATION_SHARES = (0.40, 0.15, 0.10, 0.20, 0.15)
_MEASURED = ("sensor_", "quantisation", "periodic_error", "clock_skew", "delay")
_TIMED = ("rate_limit", "uneven_rate_limit", "dead_time", "sensor_dead_time", "amplifier_slew")
_WHOLE = ("absolute_value",)
"""Laws without a strength: they cannot be weak."""

_RESTLESS = ("cylinder", "corner")
"""Plants whose command is a flow: a long step of it carries them away."""

_DIRECT = ("stack", "frame")
"""Plants with a reading that jumps with a held command: it has no value at the samples."""

Rng = np.random.Generator


def shares(count: int, cells: Mapping[str, int] = CELLS) -> dict[str, int]:
    """Return the recordings of each cell in an exam of `count`; what is left over goes in turn.

    Examples
    --------
    >>> sum(shares(37).values()), shares(420) == dict(CELLS)
    (37, True)
    """
    total = sum(cells.values())
    exact = {cell: n * count / total for cell, n in cells.items()}
    out = {cell: int(x) for cell, x in exact.items()}
    nearest = sorted(exact, key=lambda cell: out[cell] - exact[cell])
    for cell in nearest[: count - sum(out.values())]:
        out[cell] += 1
    return out


def draw_exam(seed: int, count: int) -> list[DrawnCase]:
    """Return the cases of an exam in a drawn order; the same for the same two numbers."""
    return draw_cells("exam", seed, shares(count), EXAM)


def draw_cells(
    kind: str, entropy: str | int, cells: Mapping[str, int], world: World
) -> list[DrawnCase]:
    """Return cases in a drawn order: so many of each cell, from what a world has.

    Parameters
    ----------
    kind : str
        Draws of different kinds never meet, whatever their entropy.
    """
    cases = []
    for cell, n in cells.items():
        for i in range(n):
            order = stream(kind, entropy, cell)
            case = _one(cell, i, order, stream(kind, entropy, f"{cell}{i}"), world)
            cases.append(case)
    turn = stream(kind, entropy, "order").permutation(len(cases))
    return [replace(cases[k], id=f"{kind[0]}{i:04d}") for i, k in enumerate(turn)]


def _one(cell: str, i: int, order: Rng, rng: Rng, world: World) -> DrawnCase:
    match cell:
        case "control":
            return _control(i, rng, world)
        case "two" | "three":
            return _several(cell, 2 if cell == "two" else 3, rng, world)
        case "weak_further":
            return _weak_further(i, order, rng, world)
        case "rare":
            table = world.tables[cell]
            plant, effects = _effect(table, i, order, rng, float(rng.uniform(0, 30)))
            return drawn_case(cell, plant, effects, rng, "rare")
        case "slow":
            return _slow(i, order, rng, world)
        case "broadband":
            return _broadband(i, order, rng, world)
        case "mixed_up":
            case = drawn_case(cell, *_effect(world.tables[cell], i, order, rng, 30.0), rng)
            return replace(case, sensors=tuple(ALL_PLANTS[case.plant].sensors))
        case _:
            plant, effects = _effect(world.tables[cell], i, order, rng, _strength(rng))
            return drawn_case(cell, plant, effects, rng)


def _strength(rng: Rng) -> float:
    """Return what an effect shall move over the noise: 0.5 to 100 in amplitude, in dB."""
    return float(20 * rng.uniform(np.log10(0.5), np.log10(100)))


def _effect(
    table: Table, i: int, order: Rng, rng: Rng, db: float
) -> tuple[str, tuple[Hidden, ...]]:
    """Return a plant and one effect; the table is gone through in a drawn order."""
    laws = choices(table)
    key = list(laws)[order.permutation(len(laws))[i % len(laws)]]
    plants = sorted({c.plant for c in laws[key]})
    plant = plants[int(rng.integers(len(plants)))]
    places = [c for c in laws[key] if c.plant == plant]
    return plant, (_hidden(places[int(rng.integers(len(places)))], db, rng),)


def _hidden(c: Choice, db: float, rng: Rng) -> Hidden:
    return Hidden(c.effect, c.place, c.law, db, tuple(float(x) for x in rng.random(3)))


def _values(plant: str, rng: Rng, spread: float = SPREAD) -> dict[str, float]:
    nominal = ALL_PLANTS[plant].nominal
    return {k: float(v * np.exp(rng.uniform(-spread, spread))) for k, (v, _) in nominal.items()}


def _sensors(plant: str, effects: Sequence[Hidden], rng: Rng) -> tuple[str, ...]:
    """Return all sensors, or in three of ten cases some of them."""
    names = tuple(ALL_PLANTS[plant].sensors)
    if rng.random() >= 0.3:
        return names
    kept = set(rng.choice(names, rng.integers(1, len(names)), replace=False))
    kept |= {e.place for e in effects}
    return tuple(k for k in names if k in kept)


def _excitation(plant: str, effects: Sequence[Hidden], rng: Rng) -> str:
    kind = str(rng.choice(_EXCITATIONS, p=_EXCITATION_SHARES))
    if kind == "steps" and plant in _RESTLESS:
        return "multisine"
    # only the plants of the trial have a controller, and it does not look through a bad sensor
    looped = plant in PLANTS and not any(
        e.effect.startswith(_MEASURED) or e.law in _TIMED for e in effects
    )
    return "noise" if kind == "closed_loop" and not looped else kind


def drawn_case(
    cell: str, plant: str, effects: Sequence[Hidden], rng: Rng, excitation: str = ""
) -> DrawnCase:
    """Return a case of a plant with effects, everything else drawn."""
    sensors = _sensors(plant, effects, rng)
    kind = excitation or _excitation(plant, effects, rng)
    # a held command jumps: a limit of its rate would be seen at every sample, and a current that
    # jumps with it has no value at the samples
    even = plant in _DIRECT or any(e.law in _TIMED for e in effects) or rng.random() < 0.4
    noise = str(rng.choice(["white", "coloured", "quantised"], p=[0.55, 0.27, 0.18]))
    return DrawnCase(
        id="",
        plant=plant,
        sensors=sensors,
        cell=cell,
        effects=tuple(effects),
        parameters=_values(plant, rng),
        noise={"kind": noise, "snr_db": float(rng.uniform(35, 65))},
        excitation=kind,
        level=float(np.exp(rng.uniform(np.log(0.6), np.log(1.5)))),
        samples=int(np.exp(rng.uniform(np.log(2000), np.log(8000)))),
        hold="linear" if kind != "closed_loop" and even else "zero",
        seed=int(rng.integers(2**62)),
    )


def _control(i: int, rng: Rng, world: World) -> DrawnCase:
    plant = _plant(world, rng)
    kinds = [kind for kind, n in CONTROLS.items() for _ in range(n)]
    # neighbours in the list differ, so that a short exam has every kind
    kind = kinds[7 * i % len(kinds)]
    case = replace(drawn_case("control", plant, (), rng), control_kind=kind)
    match kind:
        case "wrong_parameters":
            return replace(case, parameters=_values(plant, rng, 0.4))
        case "coloured_noise":
            return replace(case, noise={**case.noise, "kind": "coloured"})
        case "coarse":
            return replace(case, noise={**case.noise, "kind": "quantised"})
        case "declared_delay":
            # in twentieths of an interval, so that the jumps of a held command fall between steps
            delay = float(rng.integers(6, 100)) * ALL_PLANTS[plant].step / 20
            open_loop = "noise" if case.excitation == "closed_loop" else case.excitation
            return replace(case, excitation=open_loop, extra={"declared_delay": delay})
        case _:
            return case


def _plant(world: World, rng: Rng) -> str:
    return world.plants[int(rng.integers(len(world.plants)))]


def _others(plant: str, table: Table, without: Sequence[Hidden]) -> list[list[Choice]]:
    """Return the choices of each law of a plant whose effect is not there yet."""
    known = {e.effect for e in without}
    found = [[c for c in each if c.plant == plant] for each in choices(table).values()]
    return [
        each for each in found if each and each[0].effect not in known and each[0].law not in _WHOLE
    ]


def _further(
    plant: str, effects: tuple[Hidden, ...], levels: Sequence[float], rng: Rng, world: World
) -> tuple[Hidden, ...]:
    """Return the effects with further ones of the catalogue, each of another name."""
    for db in levels:
        laws = _others(plant, world.tables["single"], effects)
        at = laws[int(rng.integers(len(laws)))]
        effects = (*effects, _hidden(at[int(rng.integers(len(at)))], db, rng))
    return effects


def _several(cell: str, n: int, rng: Rng, world: World) -> DrawnCase:
    plant = _plant(world, rng)
    levels = [float(x) for x in rng.uniform(6, 36, n)]
    return drawn_case(cell, plant, _further(plant, (), levels, rng, world), rng)


def _weak_further(i: int, order: Rng, rng: Rng, world: World) -> DrawnCase:
    """Return one strong effect with one or two of 1 to 5 % of its mean square."""
    strong = float(rng.uniform(20, 40))
    plant, effects = _effect(world.inside, i, order, rng, strong)
    parts = 10 ** rng.uniform(-2, np.log10(0.05), int(rng.integers(1, 3)))
    levels = [strong + 10 * float(np.log10(x)) for x in parts]
    return drawn_case("weak_further", plant, _further(plant, effects, levels, rng, world), rng)


def _slow(i: int, order: Rng, rng: Rng, world: World) -> DrawnCase:
    plants = [name for name in world.plants if name not in _RESTLESS]
    effects: tuple[Hidden, ...] = ()
    if i % QUIET_EVERY == 0:
        plant = plants[int(rng.integers(len(plants)))]
    else:
        table = [
            (e, law, {p: at for p, at in places.items() if p in plants})
            for e, law, places in world.tables["slow"]
        ]
        plant, effects = _effect(table, i, order, rng, _strength(rng))
    case = drawn_case("slow", plant, effects, rng, "slow")
    return replace(case, samples=max(case.samples, 4000))


def _broadband(i: int, order: Rng, rng: Rng, world: World) -> DrawnCase:
    """Return a record that begins in motion: its first tenth is cut off."""
    effects: tuple[Hidden, ...] = ()
    if i % QUIET_EVERY == 0:
        plant = _plant(world, rng)
    else:
        plant, effects = _effect(world.inside, i, order, rng, _strength(rng))
    case = drawn_case("broadband", plant, effects, rng, "broadband")
    return replace(case, extra={"lead": float(case.samples // 10)})
