"""From the plant's part of a configuration to what stands on the bench."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hardware.simulators.bench_server.config import AirConfig, BenchConfig, PlantConfig
from hardware.simulators.gauge import GaugeConfig
from hardware.simulators.plant_contract import Plant
from hardware.simulators.plants import (
    AirPath,
    Creeping,
    Disturbance,
    Disturbed,
    HystereticPlant,
    PlatePlant,
    Press,
    SensorNoise,
    UltrasonicPlant,
    Vibration,
    conceal,
)


@dataclass(frozen=True, slots=True)
class Stand:
    """A plant, and the truth about it.

    Parameters
    ----------
    plant : Plant
        The plant, without disturbances.
    truth : mapping
        Plain values for JSON.
    noise_x, noise_i : float
        White noise of the readings (m, A); that of the displacement is left to the devices.
    press : Press, optional
        Force that somebody exerts, which a gauge reads.
    """

    plant: Plant
    truth: Mapping[str, Any] = field(default_factory=dict)
    noise_x: float = 0.0
    noise_i: float = 0.0
    press: Press | None = None


PlantMaker = Callable[[PlantConfig], Stand]
"""Makes a plant that this package does not know, for the one who starts the server."""


MACHINES: Mapping[str, PlantMaker] = {
    "m661": lambda p: Stand(UltrasonicPlant(p.seed or 0), noise_x=2e-9),
    "m661-gauge": lambda p: Stand(
        UltrasonicPlant(p.seed or 0, spring=GaugeConfig().spring), noise_x=2e-9
    ),
    "plate": lambda p: Stand(PlatePlant()),
}
"""The ultrasonic machine: a free stage, one pressed on the force gauge, the plate alone."""


def stand_of(config: BenchConfig, others: Mapping[str, PlantMaker] | None = None) -> Stand:
    """Return what stands on the bench, with its disturbances.

    Raises
    ------
    ValueError
        In one line, if the plant or its effect is unknown.
    """
    p = config.plant
    makers: dict[str, PlantMaker] = {"stack": _stack, **(others or {})}
    if p.name not in makers:
        raise ValueError(f"bench: unknown plant {p.name!r}; known: {', '.join(sorted(makers))}")
    bare = makers[p.name](p)
    plant = bare.plant
    if p.play_radii:
        plant = HystereticPlant(plant, p.play_radii, p.play_gains)
    if p.creep_ratios:
        plant = Creeping(plant, p.creep_ratios, p.creep_times)
    x = bare.noise_x if math.isnan(p.noise_x) else p.noise_x
    i = bare.noise_i if math.isnan(p.noise_i) else p.noise_i
    disturbances = _disturbances(p, config.air)
    if i:
        disturbances.append(SensorNoise(0.0, i, p.noise_seed))
    if bare.press is not None:
        disturbances.append(bare.press)
    if disturbances:
        plant = Disturbed(plant, *disturbances)
    return Stand(plant, bare.truth, x, i, bare.press)


def _disturbances(p: PlantConfig, air: AirConfig) -> list[Disturbance]:
    found: list[Disturbance] = []
    # what the sensors of the air see is the interferometer's business; this is what they miss
    if air.stir or air.swing:
        found.append(
            AirPath(air.dead_path, 0.0, air.swing, air.period, air.stir, seed=p.noise_seed)
        )
    if p.vibration:
        found.append(Vibration(p.vibration, p.noise_seed))
    return found


def _stack(p: PlantConfig) -> Stand:
    seed = secrets.randbits(62) if p.seed is None else p.seed
    effect = None if p.effect == "drawn" else p.effect
    try:
        drawn = conceal(seed, effect, p.place or None, p.strength or None)
    except (OSError, ValueError) as error:
        raise ValueError(f"bench: {error}") from None
    press = Press(p.press[0], p.press[1], drawn.case.parameters["k"]) if p.press else None
    return Stand(drawn.plant(span=p.drift_span), drawn.truth, *drawn.noise, press)
