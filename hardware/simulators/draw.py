"""From a seed to the truth of a bench: parameters, concealed effect, noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.effects import (
    CATALOGUE,
    NONE,
    RATIO_RANGES,
    STRENGTHS,
    EffectEntry,
    HiddenEffect,
    effects,
    entry,
)
from hardware.simulators.excitation import N_SAMPLES, voltage
from hardware.simulators.plant import NOMINAL, PlantParameters
from hardware.simulators.simulation import sense, simulate

_COARSE = 3
_TARGETS: Mapping[str, tuple[float, float]] = {
    "weak": (3.8, 6.3),
    "medium": (13.0, 23.0),
    "strong": (65.0, 115.0),
}
_LEAST_LEFT = 1.0
"""Rms over noise that other values of the parameters leave of what is concealed, at least."""
_SEARCH_STEPS = 30
_LARGEST_AMPLITUDE = 30.0


@dataclass(frozen=True, slots=True)
class ChannelNoise:
    """White noise and constant offset of the two sensors.

    Parameters
    ----------
    x_rms, i_rms
        Standard deviations (m, A).
    x_offset, i_offset
        Constant offsets (m, A).
    """

    x_rms: float
    i_rms: float
    x_offset: float
    i_offset: float


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything that a recording conceals.

    Parameters
    ----------
    seed
        Seed of the draw.
    plant
        True parameters.
    effect
        Concealed effect.
    strength
        Class, empty for no effect.
    noise
        True noise.
    """

    seed: int
    plant: PlantParameters
    effect: HiddenEffect
    strength: str
    noise: ChannelNoise

    @property
    def place(self) -> str:
        """Place of the effect."""
        return self.effect.place

    def twin(self) -> Truth:
        """Give the same bench with nothing concealed."""
        return replace(self, effect=HiddenEffect(), strength="")

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and strings, for sealing."""
        return {
            "seed": self.seed,
            "plant": {f.name: getattr(self.plant, f.name) for f in fields(PlantParameters)},
            "effect": self.effect.name,
            "place": self.effect.place,
            "parameters": dict(self.effect.parameters),
            "strength": self.strength,
            "noise": {f.name: getattr(self.noise, f.name) for f in fields(ChannelNoise)},
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Truth:
        """Invert ``as_dict``."""
        parameters = tuple(sorted(data["parameters"].items()))
        return cls(
            seed=data["seed"],
            plant=PlantParameters(**data["plant"]),
            effect=HiddenEffect(data["effect"], data["place"], parameters),
            strength=data["strength"],
            noise=ChannelNoise(**data["noise"]),
        )


def draw_truth(
    seed: int,
    effect: str | None = None,
    place: str | None = None,
    strength: str | None = None,
) -> Truth:
    """Draw a bench.

    What is concealed shows: other values of the plant's parameters leave at least the size of the
    noise of it (`left_over`; delays and the amplifier's pole do by their range). Without wishes,
    nothing is concealed with probability 1/5 and every effect of the catalogue is as likely as
    the others, as are its places and the three classes.

    Parameters
    ----------
    seed
        Non-negative seed.
    effect, place, strength
        Wishes; None leaves them to the seed.

    Raises
    ------
    KeyError
        If the wished effect does not exist at the wished place.
    ValueError
        If the class is unknown.
    """
    rng = np.random.default_rng([seed, 0xD2A])
    plant = _draw_plant(rng)
    chosen = _choose(rng, effect, place)
    level = str(rng.choice(STRENGTHS))
    if strength is not None:
        if strength not in STRENGTHS:
            raise ValueError(f"strength {strength!r} is unknown. Known: {', '.join(STRENGTHS)}")
        level = strength
    noise = _draw_noise(rng, *_linear_bench(plant, seed)[1:])
    if chosen is None:
        return Truth(seed, plant, HiddenEffect(), "", noise)
    hidden = _size(rng, chosen, level, plant, noise, seed)
    return Truth(seed, plant, hidden, level, noise)


@lru_cache(maxsize=1)
def _linear_bench(plant: PlantParameters, seed: int) -> tuple[Array, Array, Array]:
    """Command (V) and undisturbed x and i (m, A) of the bench with nothing concealed."""
    command = voltage(seed, N_SAMPLES)
    plain = simulate(plant, HiddenEffect(), command, substeps=_COARSE)
    for shared in (command, plain.x, plain.i):
        shared.setflags(write=False)
    return command, plain.x, plain.i


@lru_cache(maxsize=1)
def _imitations(plant: PlantParameters, seed: int, noise: ChannelNoise) -> Array:
    command, *plain = _linear_bench(plant, seed)
    return imitations(plant, command, (plain[0], plain[1]), noise)


def deviation_ratio(
    changed: tuple[Array, Array], plain: tuple[Array, Array], noise: ChannelNoise
) -> float:
    """Rms deviation (mean removed) over noise, of the more touched of the channels x and i.

    Parameters
    ----------
    changed, plain
        Undisturbed (x, i) with and without the effect, m and A, ``(N,)`` each.
    noise
        Noise of the channels.
    """
    dx, di = changed[0] - plain[0], changed[1] - plain[1]
    return float(max(np.std(dx) / noise.x_rms, np.std(di) / noise.i_rms))


def left_over(
    changed: tuple[Array, Array],
    plain: tuple[Array, Array],
    noise: ChannelNoise,
    imitations: Array,
) -> float:
    """Rms over noise of what a combination of `imitations` leaves of a deviation.

    Parameters
    ----------
    changed, plain, noise
        As `deviation_ratio` takes them.
    imitations
        Changes of the readings by each parameter, over the noise, x before i, ``(2 N, p)``.
    """
    away = _over_noise((changed[0] - plain[0], changed[1] - plain[1]), noise)
    weights = np.linalg.lstsq(imitations, away, rcond=None)[0]
    left = (away - imitations @ weights).reshape(2, -1)
    return float(np.max(np.std(left, axis=1)))


def imitations(
    plant: PlantParameters, command: Array, plain: tuple[Array, Array], noise: ChannelNoise
) -> Array:
    """Return what one per cent of each parameter changes, over the noise, ``(2 N, p)``."""
    columns = []
    for f in fields(PlantParameters):
        other = replace(plant, **{f.name: 1.01 * getattr(plant, f.name)})
        run = simulate(other, HiddenEffect(), command, substeps=_COARSE)
        columns.append(_over_noise((run.x - plain[0], run.i - plain[1]), noise))
    return np.stack(columns, axis=1)


def _over_noise(pair: tuple[Array, Array], noise: ChannelNoise) -> Array:
    x, i = (d - np.mean(d) for d in pair)
    return np.concatenate([x / noise.x_rms, i / noise.i_rms])


def _draw_plant(rng: np.random.Generator) -> PlantParameters:
    """Log-uniform within 20 % of the nominal values."""
    spread = math.log(1.2)
    return PlantParameters(
        **{
            f.name: getattr(NOMINAL, f.name) * math.exp(rng.uniform(-spread, spread))
            for f in fields(PlantParameters)
        }
    )


def _choose(rng: np.random.Generator, effect: str | None, place: str | None) -> EffectEntry | None:
    nothing = rng.uniform() < 0.2
    candidates = CATALOGUE if place is None else [e for e in CATALOGUE if e.place == place]
    names = list(dict.fromkeys(e.name for e in candidates))
    drawn = str(rng.choice(names)) if names else NONE
    if effect == NONE or (effect is None and place is None and nothing):
        return None
    name = drawn if effect is None else effect
    places = [place] if place is not None else list(effects().get(name, ("",)))
    return entry(name, str(rng.choice(places)))


def _draw_noise(rng: np.random.Generator, x: Array, i: Array) -> ChannelNoise:
    """Noise 55 to 65 dB below the rms of the linear bench's signals."""
    x_rms = float(np.std(x)) * 10.0 ** (-rng.uniform(55.0, 65.0) / 20.0)
    i_rms = float(np.std(i)) * 10.0 ** (-rng.uniform(55.0, 65.0) / 20.0)
    return ChannelNoise(
        x_rms=x_rms,
        i_rms=i_rms,
        x_offset=float(rng.uniform(-50e-9, 50e-9)),
        i_offset=float(rng.uniform(-10.0, 10.0)) * i_rms,
    )


def _size(
    rng: np.random.Generator,
    chosen: EffectEntry,
    level: str,
    plant: PlantParameters,
    noise: ChannelNoise,
    seed: int,
) -> HiddenEffect:
    """Find the amplitude that leaves the drawn mark on the outputs of a coarse run."""
    command, *readings = _linear_bench(plant, seed)
    plain = (readings[0], readings[1])
    shape = chosen.shape(rng)
    if chosen.classes is not None:
        low, high = np.log(chosen.classes[level])
        return chosen.effect(shape, math.exp(rng.uniform(low, high)), plant)
    low, high = np.log(_TARGETS[level])
    target = math.exp(rng.uniform(low, high))

    def changed(amplitude: float) -> tuple[Array, Array]:
        hidden = chosen.effect(shape, amplitude, plant)
        if hidden.place in ("x", "i"):
            return sense(plain[0], hidden, "x"), sense(plain[1], hidden, "i")
        run = simulate(plant, hidden, command, substeps=_COARSE)
        return run.x, run.i

    def mark(amplitude: float) -> float:
        return deviation_ratio(changed(amplitude), plain, noise)

    like = _imitations(plant, seed, noise)

    def left(amplitude: float) -> float:
        return left_over(changed(amplitude), plain, noise, like)

    amplitude = _invert(mark, target, chosen.first_guess, RATIO_RANGES[level])
    if left(amplitude) < _LEAST_LEFT:
        amplitude = _invert(left, 1.1 * _LEAST_LEFT, amplitude, (_LEAST_LEFT, 1.5 * _LEAST_LEFT))
    return chosen.effect(shape, amplitude, plant)


def _invert(
    mark: Callable[[float], float], target: float, guess: float, allowed: tuple[float, float]
) -> float:
    """Solve mark(a) = target on logarithms, by secants kept inside a bracket."""
    low, high = 1e-6, _LARGEST_AMPLITUDE
    a, exponent = guess, 1.0
    previous: tuple[float, float] | None = None
    for n in range(_SEARCH_STEPS):
        value = mark(a)
        if math.isfinite(value) and abs(math.log(max(value, 1e-12) / target)) < 0.08:
            return a
        if not math.isfinite(value) or value > target:
            high = a
        else:
            low = a
        if math.isfinite(value) and value > 0.0:
            here = (math.log(a), math.log(value))
            if previous is not None and here[0] != previous[0]:
                slope = (here[1] - previous[1]) / (here[0] - previous[0])
                exponent = min(max(slope, 0.3), 30.0)
            previous = here
            proposal = math.exp(here[0] + (math.log(target) - here[1]) / exponent)
        else:
            proposal = math.sqrt(low * high)
        secant = low < proposal < high and n % 4 != 3
        a = proposal if secant else math.sqrt(low * high)
    if not allowed[0] <= mark(a) <= allowed[1]:
        raise RuntimeError(f"the effect cannot leave a mark of {target:.1f} times the noise")
    return a
