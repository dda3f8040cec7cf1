"""Draw the cases of a trial; seeds of the trial and of development never meet."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hardware.simulators.generator.case import DrawnCase, Hidden
from hardware.simulators.generator.lookalikes import PAIRS
from hardware.simulators.generator.parameters import PLANTS, SPREAD
from hardware.simulators.generator.vocabulary import FORMS, OUTSIDE, SINGLES, Choice, choices

COUNTS: Mapping[str, Mapping[str, int]] = {
    "trial": {
        "control": 160,
        "single": 252,
        "outside": 124,
        "form": 96,
        "lookalike": 48,
        "pair": 76,
    },
    "reduced": {"control": 6, "single": 6, "outside": 3, "form": 3, "lookalike": 4, "pair": 2},
}
"""How many cases of each cell; development has the shares of the trial."""

CONTROLS = (
    "plain",
    "wrong_parameters",
    "coloured_noise",
    "outliers",
    "offset",
    "declared_delay",
)

_EXCITATIONS = ("multisine", "steps", "sweep", "noise", "closed_loop")
_SHARES = (0.40, 0.15, 0.10, 0.20, 0.15)
_LOCAL_EFFECTS = ("sensor_", "quantisation", "periodic_error", "clock_skew", "delay")


def stream(kind: str, entropy: str | int, index: int | str) -> np.random.Generator:
    """Return the generator of random numbers of one case; kinds are separated by their name."""
    digest = hashlib.sha256(f"{kind}|{entropy}|{index}".encode()).digest()
    return np.random.default_rng(np.random.SeedSequence(int.from_bytes(digest, "big")))


def _values(plant: str, rng: np.random.Generator, spread: float = SPREAD) -> dict[str, float]:
    nominal = PLANTS[plant].nominal
    return {k: float(v * np.exp(rng.uniform(-spread, spread))) for k, (v, _) in nominal.items()}


def _samples(short: bool, rng: np.random.Generator) -> int:
    return int(np.exp(rng.uniform(np.log(2000), np.log(3000 if short else 20000))))


def _subset(plant: str, needed: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Return all sensors, or in three of ten cases some of them."""
    names = tuple(PLANTS[plant].sensors)
    if rng.random() >= 0.3:
        return names
    kept = set(rng.choice(names, rng.integers(1, len(names)), replace=False)) | set(needed)
    return tuple(k for k in names if k in kept)


def _noise(rng: np.random.Generator) -> dict[str, float | str]:
    kind = str(rng.choice(["white", "coloured", "quantised"], p=[0.6, 0.25, 0.15]))
    return {"kind": kind, "snr_db": float(rng.uniform(30, 60))}


def _hidden(c: Choice, db: float, rng: np.random.Generator) -> Hidden:
    return Hidden(c.effect, c.place, c.law, db, tuple(float(x) for x in rng.random(3)))


def _measured(effects: Sequence[Hidden]) -> bool:
    """Whether an effect sits in a sensor or a clock, which the controller does not look through."""
    return any(e.effect.startswith(_LOCAL_EFFECTS) for e in effects)


def _case(
    cell: str, plant: str, effects: Sequence[Hidden], short: bool, rng: np.random.Generator
) -> DrawnCase:
    """Return a case of a plant with effects, everything else drawn."""
    needed = [e.place for e in effects if e.place in PLANTS[plant].sensors]
    kind = str(rng.choice(_EXCITATIONS, p=_SHARES))
    if kind == "closed_loop" and _measured(effects):
        kind = "multisine"
    timed = any(e.effect in ("slew_limit", "delay") for e in effects)
    if timed and kind == "closed_loop":
        kind = "noise"
    # a held command jumps: a limit of its rate would be seen at every sample, and a current that
    # jumps with it has no value at the samples
    even = timed or plant == "stack" or rng.random() < 0.4
    hold = "linear" if kind != "closed_loop" and even else "zero"
    return DrawnCase(
        id="",
        plant=plant,
        sensors=_subset(plant, needed, rng),
        cell=cell,
        effects=tuple(effects),
        parameters=_values(plant, rng),
        noise=_noise(rng),
        excitation=kind,
        level=float(np.exp(rng.uniform(np.log(0.6), np.log(1.5)))),
        samples=_samples(short, rng),
        hold=hold,
        seed=int(rng.integers(2**62)),
    )


def _control(index: int, short: bool, rng: np.random.Generator) -> DrawnCase:
    plant = list(PLANTS)[int(rng.integers(len(PLANTS)))]
    kind = CONTROLS[index % len(CONTROLS)]
    case = replace(_case("control", plant, (), short, rng), control_kind=kind)
    match kind:
        case "wrong_parameters":
            return replace(case, parameters=_values(plant, rng, 0.4))
        case "coloured_noise":
            return replace(case, noise={**case.noise, "kind": "coloured"})
        case "declared_delay":
            # in twentieths of an interval, so that the jumps of a held command fall between steps
            delay = float(rng.integers(6, 100)) * PLANTS[plant].step / 20
            # the controller was designed without it
            open_loop = "noise" if case.excitation == "closed_loop" else case.excitation
            return replace(case, excitation=open_loop, extra={"declared_delay": delay})
        case _:
            return case


def _of(
    table: Sequence[tuple[str, str, Mapping[str, Sequence[str]]]],
    cell: str,
    index: int,
    order: np.random.Generator,
    short: bool,
    rng: np.random.Generator,
) -> DrawnCase:
    """Return a case with one effect; the table is gone through in a drawn order."""
    laws = choices(table)
    turn = order.permutation(len(laws))
    key = list(laws)[turn[index % len(laws)]]
    by_plant = sorted({c.plant for c in laws[key]})
    plant = by_plant[int(rng.integers(len(by_plant)))]
    places = [c for c in laws[key] if c.plant == plant]
    effect = _hidden(places[int(rng.integers(len(places)))], float(rng.uniform(-10, 30)), rng)
    return _case(cell, plant, (effect,), short, rng)


def _two(short: bool, rng: np.random.Generator) -> DrawnCase:
    """Return a case with two effects of the catalogue in one plant, even at one place."""
    plant = list(PLANTS)[int(rng.integers(len(PLANTS)))]
    laws = [[c for c in each if c.plant == plant] for each in choices(SINGLES).values()]
    laws = [each for each in laws if each]
    a, b = (laws[k] for k in rng.choice(len(laws), 2, replace=False))
    first, second = (each[int(rng.integers(len(each)))] for each in (a, b))
    strong = (float(rng.uniform(0, 30)), float(rng.uniform(0, 30)))
    effects = [_hidden(c, db, rng) for c, db in zip((first, second), strong, strict=True)]
    return _case("pair", plant, effects, short, rng)


def _lookalike(index: int, short: bool, rng: np.random.Generator) -> DrawnCase:
    """Return a member of a pair, with decisive or indecisive excitation."""
    pair, member, decisive = PAIRS[index // 4], index % 2, (index // 2) % 2 == 0
    effect, law, place = pair.members[member]
    db = float(rng.uniform(14, 28) if decisive else rng.uniform(-2, 8))
    hidden = [_hidden(Choice(effect, law, pair.plant, place), db, rng)] if effect else []
    case = _case("lookalike", pair.plant, hidden, short, rng)
    values = dict(case.parameters)
    if not effect:
        values[place] = PLANTS[pair.plant].nominal[place][0] * float(rng.choice([0.7, 1.35]))
    slow = effect in ("creep", "leakage")
    rich = "steps" if slow else str(rng.choice(["multisine", "noise"]))
    return replace(
        case,
        sensors=pair.sensors,
        parameters=values,
        pair_id=f"{index // 4 + 1:02d}",
        decisive=decisive,
        excitation=rich if decisive else "tone",
        level=1.2 if decisive else 0.3,
        samples=max(case.samples, 2500 if short else 8000) if decisive else 2500,
        noise={"kind": "white", "snr_db": float(rng.uniform(45, 60) if decisive else 40)},
        hold="linear",
    )


def _one(
    cell: str, i: int, order: np.random.Generator, short: bool, g: np.random.Generator
) -> DrawnCase:
    match cell:
        case "control":
            return _control(i, short, g)
        case "lookalike":
            return _lookalike(i, short, g)
        case "pair":
            return _two(short, g)
        case _:
            table = {"single": SINGLES, "form": FORMS, "outside": OUTSIDE}[cell]
            return _of(table, cell, i, order, short, g)


def _shares(count: int | None, kind: str) -> dict[str, int]:
    """Return how many cases of each cell."""
    if kind == "reduced" or count is None:
        return dict(COUNTS["reduced" if kind == "reduced" else "trial"])
    whole = COUNTS["trial"]
    total = sum(whole.values())
    out = {cell: n * count // total for cell, n in whole.items()}
    out["single"] += count - sum(out.values())
    return out


def draw(kind: str, entropy: str | int, count: int | None = None) -> list[DrawnCase]:
    """Return the cases of a trial in a drawn order.

    Parameters
    ----------
    kind : str
        ``"trial"``, ``"development"`` or ``"reduced"``; each has random numbers of its own.
    entropy : str or int
        Salt of the trial from the operating system in hexadecimal digits; for development any
        integer.
    count : int, optional
        Number of cases in development; for the trial and the reduced one it is fixed.

    Raises
    ------
    ValueError
        If the kind is unknown, or a trial is asked for with an integer instead of a salt.
    """
    if kind not in ("trial", "development", "reduced"):
        raise ValueError(f"draw: unknown kind {kind!r}; use trial, development or reduced")
    if kind == "trial" and (not isinstance(entropy, str) or len(entropy) < 32):
        raise ValueError("draw: a trial needs a salt; use secrets.token_hex(32)")
    short = kind == "reduced"
    cases: list[DrawnCase] = []
    for cell, n in _shares(count if kind == "development" else None, kind).items():
        # a small draw of look-alikes takes whole pairs, from a drawn one on
        first = 4 * int(stream(kind, entropy, "pairs").integers(len(PAIRS)))
        for i in range(n):
            rng = stream(kind, entropy, f"{cell}{i}")
            at = (first + i) % (4 * len(PAIRS)) if cell == "lookalike" else i
            cases.append(_one(cell, at, stream(kind, entropy, cell), short, rng))
    turn = stream(kind, entropy, "order").permutation(len(cases))
    return [replace(cases[k], id=f"r{i:04d}") for i, k in enumerate(turn)]
