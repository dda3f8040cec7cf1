"""Any plant of the generator on the virtual bench: the same C code, its state carried on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.edges import EdgeDelay, as_edges
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.native import Row
from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.resuming import Going
from hardware.simulators.generator.sensing import SENSOR_LAWS
from hardware.simulators.generator.sizing import COARSEST, FINEST, CaseBench, Sized
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.plants.sensing import SensorCarried

_RAMP, _REST = 0.05, 1.0
"""From the working point to rest, and at rest before a bench begins (s)."""


@final
class GeneratedPlant:
    """A plant of the generator, at rest at 0 until it is driven.

    Parameters
    ----------
    name : str
        One of `generator.PLANTS`.
    values : mapping
        True parameters; those that are left out are nominal.
    effects : sequence of Sized
        What is concealed.
    sized_on : CaseBench, optional
        The record by which they have their sizes; needed if there are any.
    displacement : str, optional
        Sensor that the interferometer sees; by default the first that reads metres.
    current : str, optional
        Sensor that reads amperes; by default that of the plant, if there is one.
    step : float, optional
        Step (s); by default that of the generator at its coarsest.
    substeps : int
        Steps of the integrator in one of the plant, at least.
    span : float
        Time (s) in which what changes with time does so; it goes on after it.
    dead : float
        Dead time of the command (s) beside those of the effects.
    bias : float
        Command at the working point: there the plant is as the generator begins, and its laws have
        their centres. It is brought from there to rest at 0, where the displacement is 0.

    Raises
    ------
    ValueError
        A plant, sensor or parameter that does not exist, a plant without displacement, or an
        effect of a clock, which the devices of a bench have.
    """

    def __init__(
        self,
        name: str,
        values: Mapping[str, float] | None = None,
        effects: Sequence[Sized] = (),
        *,
        sized_on: CaseBench | None = None,
        displacement: str | None = None,
        current: str | None = None,
        step: float | None = None,
        substeps: int = 1,
        span: float = 10.0,
        dead: float = 0.0,
        bias: float = 0.0,
    ) -> None:
        plant = PLANTS[_known("plant", name, PLANTS)]
        for given in values or {}:
            _known(f"parameter of {name}", given, plant.nominal)
        self.x = _column(name, displacement, "m")
        if self.x is None:
            raise ValueError(f"plant {name}: no sensor reads metres")
        self.i = _column(name, current, "A")
        if any(e.hidden.place == "clock" for e in effects):
            raise ValueError(
                f"plant {name}: an effect of the clock; a bench has it in the clocks of its devices"
            )
        self.step = plant.step / COARSEST if step is None else step
        self.effects = tuple(effects)
        numbers = {n: v for n, (v, _) in plant.nominal.items()} | dict(values or {})
        rows, fastest, late = _rows(effects, sized_on)
        needed = int(np.ceil(self.step * fastest / 1.5))
        self._sub = min(FINEST // COARSEST, max(substeps, needed))
        begun = [numbers[n] for n in plant.nominal]
        self._state = Going(name, begun, rows, math.inf if bias else span)
        self._late = EdgeDelay((late + dead) / self.step, 0.0)
        sensors = list(plant.sensors)
        self._senses = [
            SensorCarried(e, sensors.index(e.hidden.place), self.step, span)
            for e in effects
            if e.hidden.law in SENSOR_LAWS
        ]
        self._done, self._bias, self._zero = 0, bias, 0.0
        if bias:
            self._settle()
            self._state.begin(span)

    def _settle(self) -> None:
        """Go smoothly from the working point to 0 and wait there."""
        edges = 500
        way = 0.5 * self._bias * (1.0 + np.cos(np.pi * np.arange(edges + 1) / edges))
        at = np.linspace(0.0, _RAMP / self.step, edges + 1)[1:]
        self.advance_edges(int(_RAMP / self.step) + 1, at, way)
        self.advance_edges(int(_REST / self.step), np.zeros(0), np.zeros(1))
        self._done = -1  # the last step before a bench begins: no sensor has drifted yet
        self._zero = float(self.advance_edges(1, np.zeros(0), np.zeros(1)).x[0])

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per command, ``(n,)``, in the unit of the plant's source.

        Raises
        ------
        ValueError
            If the motion grows beyond bounds.
        """
        return self.advance_edges(len(volts), *as_edges(np.asarray(volts, dtype=np.float64)))

    def advance_edges(self, count: int, at: Array, volts: Array) -> PlantMotion:
        """Go on by `count` steps with edges of the command inside them, see `EdgeDriven`."""
        if not count:
            return PlantMotion(np.zeros(0), np.zeros(0))
        at, u = self._late.pass_on(count, at, volts - self._bias)
        y = self._state.advance(count, at, u, self.step, self._sub)
        if y is None:
            raise ValueError("generated plant: the motion grew beyond bounds; drive it more gently")
        for each in self._senses:
            y[:, each.column] = each.read(y[:, each.column], self._done + 1)
        self._done += count
        current = np.full(count, np.nan) if self.i is None else y[:, self.i].copy()
        return PlantMotion(y[:, self.x] - self._zero, current)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        senses = [s.snapshot() for s in self._senses]
        return self._state.snapshot(), self._done, self._late.snapshot(), senses

    def restore(self, state: Any) -> None:
        """Put a state back."""
        inner, self._done, late, senses = state
        self._state.restore(inner)
        self._late.restore(late)
        for each, kept in zip(self._senses, senses, strict=True):
            each.restore(kept)


def _known(what: str, name: str, known: Mapping[str, Any]) -> str:
    if name not in known:
        raise ValueError(f"no {what} {name!r}; known: {', '.join(known)}")
    return name


def _column(plant: str, name: str | None, unit: str) -> int | None:
    sensors = PLANTS[plant].sensors
    if name is None:
        return next((k for k, u in enumerate(sensors.values()) if u == unit), None)
    return list(sensors).index(_known(f"sensor of {plant}", name, sensors))


def _rows(effects: Sequence[Sized], bench: CaseBench | None) -> tuple[list[Row], float, float]:
    """Return the effects in the C code, their fastest rate (1/s), the dead time of the command."""
    rows, fastest, late = [], 0.0, 0.0
    for e in effects:
        if e.hidden.law in SENSOR_LAWS:
            continue
        if e.hidden.law == "dead_time":
            late += next(iter(e.numbers.values()))
            continue
        if bench is None:
            raise ValueError(f"{e.hidden.law}: give the record on which it has its size")
        law, z = LAWS[e.hidden.law], bench.scale(e.hidden)
        rows.append(Row(law.kind, z.slot, law.states, tuple(e.numbers.values())))
        fastest = max(fastest, law.fastest(e.numbers, z))
    return rows, fastest, late
