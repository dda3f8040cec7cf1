"""The stack of the device bench: the generator's plant ``stack`` with the numbers of a P-840.1.

Drawn, sealed and judged as the demo is: one effect of the generator at one of its places, or
nothing, as large as its class says on a record like those of a bench.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from hardware.simulators.generator.case import DrawnCase, Hidden
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.showing import HIDES, NOTHING, left_over
from hardware.simulators.generator.sizing import CaseBench, Sized, bench_of
from hardware.simulators.generator.vocabulary import Choice
from hardware.simulators.plants.generated import GeneratedPlant

P840_1: Mapping[str, float] = MappingProxyType(
    {"R_a": 20.0, "C_a": 1.343e-6, "alpha": 2.902, "m": 0.108, "k": 53.73e6, "b": 200.0}
)
"""Nominal values (SI): 54 nm/V, 3.75 kHz on a current source, with 0.1 kg on it, 27 us of charging.

Of a stack of 1.5 uF, 0.036 m/C and 60 N/um at constant charge: ``C_a = C/(1 + k T^2 C)`` is its
capacitance at constant length, ``alpha = k T C_a`` and ``k_a = k - alpha^2/C_a`` its stiffness at
constant voltage.
"""

BIAS = 50.0
"""Working point (V), where laws and sensors have their centres."""

MEMORIES = ("hysteresis", "creep", "presliding_friction")
"""Effects whose laws have no centre: they have seen nothing before the bench leaves 0 V."""

SPREAD = math.log(1.2)
"""Half width of the spread of a true value, in natural logarithm."""

STRENGTHS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"weak": (3.8, 6.3), "medium": (13.0, 23.0), "strong": (65.0, 115.0)}
)
"""What an effect moves over the noise (rms), by class."""

QUIET = 0.2
"""Share of the draws that conceal nothing."""

SHOWS = 1.0
"""What is drawn is drawn again if other parameters leave less of it than that, over the noise."""

TOLERANCE_DB = 1.0
"""It is drawn again, too, if it moves more than its class by that: contacts begin suddenly."""

TURNS = 8
"""Draws at most: an effect that never leaves that much is shown as weak as it is."""

SAMPLES = 4096
"""Of the record on which an effect has its size: 0.8 s."""

STEP = 5e-6
"""Step of the plant (s): a fifth of the shortest charging time, 1/40 of a period."""

SUBSTEPS = 3
"""Steps of the integrator in one where something is concealed: a play turns at the end of one."""

ELECTRICAL = ("i", "R_a", "C_a")
"""Places whose effects the current shows and the length does not; drawn only on request."""


@dataclass(frozen=True, slots=True)
class ConcealedStack:
    """A drawn stack.

    Parameters
    ----------
    case : DrawnCase
        What was drawn.
    truth : mapping
        Plain values, as the demo's judge reads them.
    effects : tuple of Sized
        What is concealed, with its numbers.
    sized_on : CaseBench
        The record on which they have their sizes.
    """

    case: DrawnCase
    truth: Mapping[str, Any]
    effects: tuple[Sized, ...]
    sized_on: CaseBench

    @property
    def noise(self) -> tuple[float, float]:
        """White noise of length (m) and current (A)."""
        i, x = np.std(self.sized_on.base.readings[: self.case.samples], axis=0)
        share = 10.0 ** (-self.case.noise["snr_db"] / 20.0)
        return float(x * share), float(i * share)

    def plant(self, *, span: float = 10.0, step: float = STEP) -> GeneratedPlant:
        """Return it at rest at 0 V; sensors drift in `span` seconds as they do in the record."""
        centred = any(e.hidden.effect not in MEMORIES for e in self.effects)
        return GeneratedPlant(
            "stack", self.case.parameters, self.effects, sized_on=self.sized_on, step=step,
            substeps=SUBSTEPS if self.effects else 1, span=span, bias=BIAS if centred else 0.0,
        )  # fmt: skip


def plain_stack(**values: float) -> GeneratedPlant:
    """Return the nominal stack, which conceals nothing, with some values changed."""
    return GeneratedPlant("stack", {**P840_1, **values}, step=STEP)


@lru_cache(maxsize=8)
def conceal(
    seed: int, effect: str | None = None, place: str | None = None, strength: str | None = None
) -> ConcealedStack:
    """Draw a stack; what is not wished for is left to the seed.

    Without wishes nothing is concealed in `QUIET` of the draws, and the effects that the length
    shows, their places and the classes are as likely as each other.

    Parameters
    ----------
    seed : int
        The same seed is the same stack.
    effect, place, strength : str, optional
        Name of the vocabulary or ``"none"``, an element or sensor, one of `STRENGTHS`.

    Raises
    ------
    ValueError
        In one line: there is no such effect, place or class; the nearest are named.
    """
    choices = _choices(effect, place)
    if strength is not None:
        _known("strength", strength, STRENGTHS)
    quiet = effect is place is None and stream("bench", seed, "quiet").random() < QUIET
    for turn in range(TURNS):
        case = _draw(seed, choices, strength, turn)
        if quiet or effect == NOTHING:
            case = replace(case, cell="control", effects=(), control_kind="plain", sensors=("x",))
        _, truth = exam_record(case)
        larger = max((e["strength_db"] - e["wanted_db"] for e in truth["effects"]), default=0.0)
        if not case.effects or (larger <= TOLERANCE_DB and left_over(case, truth) >= SHOWS):
            break
    bench = bench_of(case)
    strengths = [e["strength"] for e in truth["effects"]]
    sized = tuple(bench.sized(*each) for each in zip(case.effects, strengths, strict=True))
    return ConcealedStack(case, truth, sized, bench)


def effects() -> tuple[str, ...]:
    """Return what the stack can conceal; the first is nothing."""
    return (NOTHING, *sorted({c.effect for c in _places()}))


def _places() -> list[Choice]:
    """Everything that the stack can conceal, but in clocks: those are of the bench's devices."""
    return [c for at in HIDES["stack"].values() for c in at if c.place != "clock"]


def _choices(effect: str | None, place: str | None) -> list[Choice]:
    found = _places()
    if place is not None:
        known = {c.place for c in found if effect in (None, NOTHING, c.effect)}
        _known("effect", effect or NOTHING, effects())
        _known(f"place of {effect}" if effect else "place", place, known)
        found = [c for c in found if c.place == place]
    elif shown := [c for c in found if c.place not in ELECTRICAL and effect in (None, c.effect)]:
        found = shown
    if effect in (None, NOTHING):
        return found
    _known("effect", effect, effects())
    return [c for c in found if c.effect == effect]


def _known(what: str, name: str, known: Collection[str]) -> None:
    if name in known:
        return
    near = difflib.get_close_matches(name, known, n=2, cutoff=0.4)
    meant = f"; did you mean {' or '.join(near)}" if near else ""
    raise ValueError(f"no {what} {name!r} on this bench{meant}; known: {', '.join(sorted(known))}")


def _draw(seed: int, choices: list[Choice], strength: str | None, turn: int) -> DrawnCase:
    rng = stream("bench", seed, turn)
    level = strength or list(STRENGTHS)[int(rng.integers(len(STRENGTHS)))]
    names = sorted({c.effect for c in choices})
    name = names[int(rng.integers(len(names)))]
    at = [c for c in choices if c.effect == name]
    chosen = at[int(rng.integers(len(at)))]
    low, high = STRENGTHS[level]
    moved = math.exp(rng.uniform(math.log(low), math.log(high)))
    hidden = Hidden(
        chosen.effect, chosen.place, chosen.law, 20.0 * math.log10(moved),
        tuple(float(x) for x in rng.random(3)),
    )  # fmt: skip
    return DrawnCase(
        id=f"bench-{seed}",
        plant="stack",
        sensors=("i",) if chosen.place in ELECTRICAL else ("x",),
        cell="single",
        effects=(hidden,),
        parameters={k: v * math.exp(rng.uniform(-SPREAD, SPREAD)) for k, v in P840_1.items()},
        noise={"kind": "white", "snr_db": float(rng.uniform(55.0, 65.0))},
        excitation="swings",
        level=1.0,
        samples=SAMPLES,
        hold="linear",
        seed=int(rng.integers(2**62)),
    )
