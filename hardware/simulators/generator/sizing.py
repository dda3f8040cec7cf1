"""Simulation of a case for given strengths, and the strengths that make the wanted difference."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.case import DrawnCase, Hidden
from hardware.simulators.generator.excitation import LOOPS, command
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.native import OPEN_LOOP, Row, Run, run
from hardware.simulators.generator.parameters import ALL_PLANTS
from hardware.simulators.generator.scale import PlaceScale, scale_of
from hardware.simulators.generator.sensing import SENSOR_LAWS, over_for, sense, sensor_numbers

Array = NDArray[np.float64]
Numbers = Mapping[str, float]

COARSEST = 20
"""Fewest sub-steps between samples."""

FINEST = 600
"""Most sub-steps between samples."""


@dataclass(frozen=True, slots=True)
class Sized:
    """An effect with its numbers."""

    hidden: Hidden
    strength: float
    numbers: Numbers


@dataclass(frozen=True, slots=True)
class CaseBench:
    """A case with its command and noise, ready to be simulated with any effects.

    Parameters
    ----------
    case : DrawnCase
        What was drawn.
    command : (samples + pad,) array
        Command or reference.
    base : Run
        Run without any effect.
    noise : (samples + pad, sensors of the plant) array
        Noise of unit rms.
    loop_noise : float
        Rms of the noise of the sensor in the loop.
    """

    case: DrawnCase
    command: Array
    base: Run
    noise: Array
    loop_noise: float

    def scale(self, hidden: Hidden) -> PlaceScale:
        """Return the sizes at the effect's place."""
        values = self.case.parameters
        return scale_of(self.case.plant, hidden.place, values, self.base, self.case.samples)

    def sized(self, hidden: Hidden, strength: float) -> Sized:
        """Return the effect with its numbers for a strength between 0 and 1."""
        z = self.scale(hidden)
        if hidden.law in SENSOR_LAWS:
            names = list(ALL_PLANTS[self.case.plant].sensors)
            k = names.index(hidden.place) if hidden.place in names else 0
            largest = float(np.max(np.abs(self.base.readings[:, k])))
            numbers = sensor_numbers(hidden.law, strength, largest, z.step, hidden.draws)
        else:
            numbers = LAWS[hidden.law].build(strength, z, hidden.draws)
        return Sized(hidden, strength, {k: float(v) for k, v in numbers.items()})

    def simulate(self, effects: Sequence[Sized], *, refine: int = 1) -> tuple[Run, Array] | None:
        """Return the run and the samples of all sensors before noise, or None if it ran away.

        Parameters
        ----------
        effects : sequence of Sized
            What is concealed.
        refine : int
            Factor on the number of sub-steps.
        """
        plant = ALL_PLANTS[self.case.plant]
        rows, fastest = [], 0.0
        for e in effects:
            if e.hidden.law not in SENSOR_LAWS:
                law, z = LAWS[e.hidden.law], self.scale(e.hidden)
                rows.append(Row(law.kind, z.slot, law.states, tuple(e.numbers.values())))
                fastest = max(fastest, law.fastest(e.numbers, z))
        if delay := self.case.extra.get("declared_delay", 0.0):
            rows.append(Row(LAWS["dead_time"].kind, 100, 0, (delay,)))
        over = over_for([e.hidden.law for e in effects])
        sub = refine * min(FINEST, max(COARSEST, int(np.ceil(plant.step * fastest / 1.5))))
        made = self._run(rows, -(-sub // over), over)
        if made is None:
            return None
        columns = []
        for k, sensor in enumerate(plant.sensors):
            fine, rate = made.readings[:, k], over
            for e in effects:
                if e.hidden.law in SENSOR_LAWS and e.hidden.place in (sensor, "clock"):
                    fine, rate = sense(e.hidden.law, e.numbers, fine, rate, plant.step), 1
            columns.append(fine[::rate][: self.case.samples])
        for e in effects:
            if e.hidden.law == "swapped":
                k = list(plant.sensors).index(e.hidden.place)
                other = following(self.case.plant, e.hidden.place)
                columns[k], columns[other] = columns[other], columns[k]
        return made, np.stack(columns, axis=1)

    def _run(self, rows: Sequence[Row], sub: int, over: int) -> Run | None:
        case = self.case
        values = [case.parameters[k] for k in ALL_PLANTS[case.plant].nominal]
        loop, noise = OPEN_LOOP, None
        if case.excitation == "closed_loop":
            loop = (1.0, *LOOPS[case.plant])
            noise = self.loop_noise * self.noise[:, int(loop[1])]
        return run(
            case.plant,
            values,
            rows,
            self.command,
            sub=sub,
            over=over,
            hold=case.hold,
            loop=loop,
            noise=noise,
        )


def following(plant: str, sensor: str) -> int:
    """Return the number of the sensor after this one; after the last comes the first."""
    names = list(ALL_PLANTS[plant].sensors)
    return (names.index(sensor) + 1) % len(names)


def unit_noise(kind: str, n: int, columns: int, rng: np.random.Generator) -> Array:
    """Return noise of unit rms: white, or coloured by a pole."""
    e = rng.normal(size=(n, columns))
    if kind != "coloured":
        return e
    from scipy.signal import lfilter

    pole = rng.uniform(0.7, 0.97)
    return np.asarray(lfilter([np.sqrt(1 - pole**2)], [1, -pole], e, axis=0))


def bench_of(case: DrawnCase) -> CaseBench:
    """Return the command and the noise of a case, and its run without effects."""
    rng = np.random.default_rng(np.random.SeedSequence(case.seed))
    plant = ALL_PLANTS[case.plant]
    pad = 2 + int(0.006 * case.samples) if any(e.law == "skew" for e in case.effects) else 0
    n = case.samples + pad
    u = command(case.plant, case.excitation, n, case.level, rng)
    noise = unit_noise(case.noise["kind"], n, len(plant.sensors), rng)
    values = [case.parameters[k] for k in plant.nominal]
    open_run = run(case.plant, values, (), u, sub=COARSEST, hold=case.hold)
    assert open_run is not None, case.plant
    if case.excitation != "closed_loop":
        return CaseBench(case, u, open_run, noise, 0.0)
    k = int(LOOPS[case.plant][0])
    rms = float(np.std(open_run.readings[:, k])) * 10 ** (-case.noise["snr_db"] / 20)
    bench = CaseBench(case, u, open_run, noise, rms)
    closed = bench._run((), COARSEST, 1)
    assert closed is not None, case.plant
    return CaseBench(case, u, closed, noise, rms)


def _next(below: tuple[float, float], above: tuple[float, float]) -> float:
    """Return the next logarithm of the strength, from the last ones with their misses in dB."""
    (a, lack), (b, much) = below, above
    if np.isfinite(lack) and np.isfinite(much):
        # below the onset of a contact there is no difference at all: do not trust its depth
        lack, much = max(lack, -30.0), min(much, 30.0)
        share = -lack / (much - lack)
        return a + (b - a) * float(np.clip(share, 0.15, 0.85))
    if np.isfinite(much):
        return max(b - much / 20, (a + b) / 2)
    if np.isfinite(lack):
        return (a + b) / 2 if b < 0 else min(a - lack / 20, 0.0)
    return (a + b) / 2


def size(
    bench: CaseBench, hidden: Hidden, excess: Callable[[Array], float], *, runs: int = 12
) -> tuple[Sized, float]:
    """Return the effect at the strength whose difference comes nearest to the wanted one.

    Parameters
    ----------
    bench : CaseBench
        The case.
    hidden : Hidden
        The effect.
    excess : callable
        From the samples of all sensors to the difference over the noise, in dB.
    runs : int
        Most simulations.

    Returns
    -------
    sized, excess : Sized, float
        The effect and the difference that it makes, in dB.
    """
    below, above = (-5.0, -np.inf), (0.0, np.inf)
    best: tuple[float, Sized, float] | None = None
    x = -0.7
    for _ in range(runs):
        sized = bench.sized(hidden, 10**x)
        made = bench.simulate([sized])
        level = excess(made[1]) if made is not None else np.inf
        miss = level - hidden.strength_db
        if np.isfinite(level) and (best is None or abs(miss) < best[0]):
            best = abs(miss), sized, level
        if abs(miss) < 1.0 or not sized.numbers or (x == 0.0 and miss < 0):
            break
        if miss > 0:
            above = x, miss
        else:
            below = x, miss
        x = _next(below, above)
    assert best is not None, f"{hidden.law} at {hidden.place}: every strength ran away"
    return best[1], best[2]
