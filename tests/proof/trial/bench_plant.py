"""The plants of the sealed trial on a virtual bench: same C code, state carried on.

A bench drives it by steps of constant command. It satisfies the contract of a plant of the
virtual bench without importing it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput, unknown_name
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.drawing import draw
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.making import together
from hardware.simulators.generator.native import Row
from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.resuming import Going
from hardware.simulators.generator.sensing import SENSOR_LAWS
from hardware.simulators.generator.sizing import COARSEST, FINEST, CaseBench, Sized, bench_of, size
from tests.proof.trial.bench_sensing import LateEdges, SensorCarried


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """Readings at the ends of steps: displacement (m) and current (A, or NaN), ``(n,)``."""

    x: Array
    i: Array


@final
class TrialPlant:
    """A plant of the trial, nominal or as a case conceals it.

    Parameters
    ----------
    what : str or DrawnCase
        Name of a plant, or a case; its effects get the strengths they have in the trial.
    displacement : str, optional
        Sensor that the interferometer sees; by default the first that reads metres.
    current : str, optional
        Sensor that reads amperes; by default that of the plant, if there is one.
    parameters : mapping, optional
        True values that differ.
    span : float, optional
        Time (s) in which what changes with time does so; that of the case's record by default, or
        10 s.

    Raises
    ------
    UnknownName
        A plant or a sensor that does not exist.
    UnusableInput
        A plant without displacement, or an effect that belongs to a clock.
    """

    def __init__(
        self,
        what: str | DrawnCase,
        *,
        displacement: str | None = None,
        current: str | None = None,
        parameters: Mapping[str, float] | None = None,
        span: float | None = None,
    ) -> None:
        case = what if isinstance(what, DrawnCase) else None
        name = case.plant if case else str(what)
        if name not in PLANTS:
            raise unknown_name("plant", name, "sealed trial", PLANTS)
        plant = PLANTS[name]
        self._x = _column(name, displacement, "m")
        self._i = _column(name, current, "A") if current or "A" in plant.sensors.values() else None
        if self._x is None:
            raise UnusableInput(
                f"trial plant {name}: no sensor reads metres; take one of "
                f"{', '.join(n for n, p in PLANTS.items() if 'm' in p.sensors.values())}"
            )
        self._step = plant.step / COARSEST
        bench, self._sized = _sized(case) if case else (None, [])
        values = {n: v for n, (v, _) in plant.nominal.items()} | dict(
            case.parameters if case else {}
        )
        for n, v in (parameters or {}).items():
            if n not in values:
                raise unknown_name("parameter", n, name, values)
            values[n] = float(v)
        self._span = span or (case.samples * plant.step if case else 10.0)
        rows, self._sub, dead = _rows(case, bench, self._sized, self._step)
        self._state = Going(name, [values[n] for n in plant.nominal], rows, self._span)
        self._late = LateEdges(dead / self._step)
        names = list(plant.sensors)
        self._senses = [
            SensorCarried(e, names.index(e.hidden.place), self._step, self._span)
            for e in self._sized
            if e.hidden.law in SENSOR_LAWS
        ]
        self._done = 0

    @property
    def step(self) -> float:
        """Step (s)."""
        return self._step

    @property
    def truth(self) -> dict[str, Any]:
        """What is concealed, as plain values."""
        return {
            "effects": [
                {
                    "effect": e.hidden.effect,
                    "place": e.hidden.place,
                    "law": e.hidden.law,
                    "strength": e.strength,
                    "numbers": {k: v for k, v in e.numbers.items() if not k.startswith("_")},
                }
                for e in self._sized
            ]
        }

    def advance(self, volts: Array) -> Moved:
        """Go on by one step per command, ``(n,)``, in the unit of the plant's source.

        Raises
        ------
        ValueError
            If the motion grows beyond bounds.
        """
        u = np.asarray(volts, dtype=np.float64)
        changes = np.flatnonzero(np.diff(u)) + 1
        levels = np.concatenate([u[:1], u[changes]])
        return self.advance_edges(u.size, changes.astype(np.float64), levels)

    def advance_edges(self, count: int, at: Array, volts: Array) -> Moved:
        """Go on by `count` steps with edges of the command inside them.

        Parameters
        ----------
        count : int
            Steps.
        at : (m,) array
            Where the command changes, in steps from now, rising, in [0, count).
        volts : (m + 1,) array
            Command before the first change and after each.
        """
        if not count:
            return Moved(np.zeros(0), np.zeros(0))
        at, u = self._late.pass_on(count, at, volts)
        y = self._state.advance(count, at, u, self._step, self._sub)
        if y is None:
            raise ValueError("trial plant: the motion grew beyond bounds; drive it more gently")
        for sense_ in self._senses:
            y[:, sense_.column] = sense_.read(y[:, sense_.column], self._done + 1)
        self._done += count
        current = np.full(count, np.nan) if self._i is None else y[:, self._i].copy()
        return Moved(y[:, self._x].copy(), current)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return (
            self._state.snapshot(),
            self._done,
            self._late.state,
            [[line.copy() for line in s.carried] for s in self._senses],
        )

    def restore(self, state: Any) -> None:
        """Put a state back."""
        inner, self._done, self._late.state, carried = state
        self._state.restore(inner)
        for s, lines in zip(self._senses, carried, strict=True):
            s.carried = [line.copy() for line in lines]


def _column(plant: str, name: str | None, unit: str) -> int | None:
    sensors = PLANTS[plant].sensors
    if name is None:
        return next((k for k, u in enumerate(sensors.values()) if u == unit), None)
    if name not in sensors:
        raise unknown_name("sensor", name, f"trial plant {plant}", sensors)
    return list(sensors).index(name)


def _sized(case: DrawnCase) -> tuple[CaseBench | None, list[Sized]]:
    """Give the effects the strengths that they have in the case's record."""
    if not case.effects:
        return None, []
    if any(e.place == "clock" for e in case.effects):
        raise UnusableInput(
            "trial plant: an effect of the clock; a bench has it in the clocks of its devices"
        )
    bench = bench_of(case)
    plain = bench.simulate([])
    assert plain is not None
    names = list(PLANTS[case.plant].sensors)
    kept = [names.index(k) for k in case.sensors]
    std = np.std(plain[1], axis=0) * 10 ** (-case.noise["snr_db"] / 20)

    def excess(samples: Array) -> float:
        ratio = np.mean((samples - plain[1]) ** 2, axis=0) / std**2
        return float(10 * np.log10(np.mean(ratio[kept]) + 1e-12))

    return bench, together(bench, [size(bench, h, excess)[0] for h in case.effects])[1]


def _rows(
    case: DrawnCase | None, bench: CaseBench | None, sized: Sequence[Sized], step: float
) -> tuple[list[Row], int, float]:
    """Return the effects in the C code, sub-steps, and the dead time of the command (s)."""
    if case is None:
        return [], 1, 0.0
    rows, fastest = [], 0.0
    dead = float(case.extra.get("declared_delay", 0.0))
    for e in sized:
        if e.hidden.law in SENSOR_LAWS:
            continue
        assert bench is not None
        law, z = LAWS[e.hidden.law], bench.scale(e.hidden)
        if e.hidden.law == "dead_time":
            dead += next(iter(e.numbers.values()))
            continue
        rows.append(Row(law.kind, z.slot, law.states, tuple(e.numbers.values())))
        fastest = max(fastest, law.fastest(e.numbers, z))
    sub = min(FINEST // COARSEST, max(1, int(np.ceil(step * fastest / 1.5))))
    return rows, sub, dead


def drawn(seed: int, plant: str = "stack", cell: str = "single") -> TrialPlant:
    """Draw a case of the trial's development for a bench: one effect, none of a clock.

    Parameters
    ----------
    seed : int
        Seed; the same one gives the same case.
    plant : str
        Name of the plant.
    cell : str
        ``"single"`` for an effect of the catalogue, ``"outside"`` for one that is not in it.
    """
    for case in draw("development", seed, 400):
        if (case.plant, case.cell) == (plant, cell) and case.effects[0].place != "clock":
            return TrialPlant(case)
    raise UnusableInput(f"trial plant: seed {seed} draws no {cell} case of {plant}; take another")
