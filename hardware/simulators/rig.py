"""One virtual bench: a true time, a terminal voltage, a plant that follows it.

Time passes only by `wait`; reading does not make it pass. (A paced bench follows a clock instead.)
Devices in front of it have clocks of their own (`DeviceClock`) and ask for the state at instants
of the past.
"""

from __future__ import annotations

import heapq
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.device_clock import DeviceClock
from hardware.simulators.edges import push
from hardware.simulators.interpolation import cubic, linear
from hardware.simulators.plant_contract import Moved, Plant, Rewindable
from hardware.simulators.tape import GrowingTape

__all__ = ["DeviceClock", "Extremes", "Rig", "RigState"]

_LONGEST = 100_000
"""Steps made at once."""


@dataclass(frozen=True, slots=True, eq=False)
class RigState:
    """State at some instants: displacement (m), current (A), terminal voltage (V), ``(n,)``."""

    x: Array
    i: Array
    v: Array


@dataclass(frozen=True, slots=True)
class Extremes:
    """The worst that the actuator has met since the start.

    Parameters
    ----------
    lowest, highest : float
        Terminal voltage (V).
    largest_step : float
        Largest sudden change of the voltage (V).
    """

    lowest: float
    highest: float
    largest_step: float


@final
class Rig:
    """The bench itself.

    Parameters
    ----------
    plant : Plant
        What stands on it.
    keep : float
        Past that can still be asked for (s).
    """

    def __init__(self, plant: Plant, keep: float = 40.0) -> None:
        self._plant = plant
        self._step = plant.step
        self._keep = max(int(keep / self._step), 16)
        self._now = 0.0
        self._volts = 0.0
        self._steps = GrowingTape(2)
        self._steps.append(0.0, 0.0)
        self._edges = GrowingTape(2)
        self._edges.append(0.0, 0.0)
        self._used = 0  # number of the last edge that lies before the steps still to be made
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        self._entries = 0
        self._acting = False
        self._pace: Callable[[], float] | None = None
        self._extremes = Extremes(0.0, 0.0, 0.0)
        self._triggers: list[float] = []
        self.lock = threading.RLock()

    @property
    def now(self) -> float:
        """True time (s)."""
        with self.lock:
            self._follow()
            return self._now

    @property
    def volts(self) -> float:
        """Terminal voltage now (V)."""
        with self.lock:
            self._follow()
            return self._volts

    @property
    def extremes(self) -> Extremes:
        """Worst voltages so far."""
        return self._extremes

    @property
    def trigger_edges(self) -> tuple[float, ...]:
        """True instants (s) of all edges on the trigger line."""
        return tuple(self._triggers)

    @property
    def paced(self) -> bool:
        """Whether time passes by itself."""
        return self._pace is not None

    def trigger_edges_from(self, first: int) -> tuple[float, ...]:
        """Return the edges on the trigger line but for the `first` ones."""
        return tuple(self._triggers[first:])

    def trigger(self) -> None:
        """Put an edge on the trigger line now."""
        with self.lock:
            self._follow()
            self._triggers.append(self._now)

    def pace(self, time: Callable[[], float] | None) -> None:
        """Let time pass by itself: `time` gives the true time (s); None returns to `wait`."""
        with self.lock:
            self._follow()
            self._pace = time

    def follow(self) -> None:
        """Do what is due on a paced bench; every other access does so too."""
        with self.lock:
            self._follow()

    def at(self, instant: float, action: Callable[[], None]) -> None:
        """Do something when the true time reaches an instant (s); at once if it is past.

        The action sees `now` at that instant. It may drive, trigger and ask for further actions.
        """
        with self.lock:
            if instant <= self._now:
                self._act(action)
                return
            self._entries += 1
            heapq.heappush(self._agenda, (instant, self._entries, action))

    def wait(self, seconds: float) -> None:
        """Let time pass (s); on a paced bench it passes by itself and nothing is done."""
        with self.lock:
            if self._pace is None:
                self._pass_to(self._now + max(seconds, 0.0))

    def wait_until(self, instant: float) -> None:
        """Let time pass until a true instant (s); nothing if it is past."""
        with self.lock:
            if self._pace is None:
                self._pass_to(instant)

    def drive(self, volts: float) -> None:
        """Put a voltage (V) on the terminals from now on.

        Raises
        ------
        ValueError
            If it is no finite number: no terminal carries such a voltage.
        """
        volts = float(volts)
        if not math.isfinite(volts):
            raise ValueError(f"rig: {volts} V is no voltage; the simulated device let it through")
        with self.lock:
            self._follow()
            e = self._extremes
            self._extremes = Extremes(
                min(e.lowest, volts),
                max(e.highest, volts),
                max(e.largest_step, abs(volts - self._volts)),
            )
            if volts != self._volts:
                self._volts = volts
                self._edges.append(self._now, volts)

    def seen(self, instants: Array) -> RigState:
        """State at instants (s), ``(n,)``; later ones than now give the state now.

        The displacement is interpolated by cubics between steps, the current linearly; the voltage
        is exact.

        Raises
        ------
        ValueError
            If an instant is so long past that it is not kept.
        """
        with self.lock:
            self._follow()
            self._catch_up()
            t = np.minimum(np.asarray(instants, float), self._now)
            position = np.maximum(t / self._step, 0.0) - self._steps.first
            if t.size and position.min() < 0.0:
                raise ValueError(
                    f"rig: {self._now - t.min():g} s ago is not kept; read earlier or make the "
                    f"rig with more than keep={self._keep * self._step:g}"
                )
            x, i = self._columns(bool(t.size and position.max() > len(self._steps) - 3.0))
            at, volts = self._edges.column(0), self._edges.column(1)
            held = volts[np.maximum(np.searchsorted(at, t, side="right") - 1, 0)]
            return RigState(cubic(x, position), linear(i, position), np.asarray(held))

    def _follow(self) -> None:
        """Follow a time that passes by itself."""
        if self._pace is not None and not self._acting:
            self._pass_to(self._pace())

    def _pass_to(self, end: float) -> None:
        while self._agenda and self._agenda[0][0] <= end:
            instant, _, action = heapq.heappop(self._agenda)
            self._reach(instant)
            self._act(action)
        self._reach(end)

    def _act(self, action: Callable[[], None]) -> None:
        """Do it while time stands still."""
        nested, self._acting = self._acting, True
        try:
            action()
        finally:
            self._acting = nested

    def _reach(self, instant: float) -> None:
        self._now = max(self._now, instant)
        if self._now / self._step - self._steps.total > _LONGEST:
            self._catch_up()

    def _catch_up(self) -> None:
        """Advance the plant to the last whole step before now."""
        done = self._steps.total - 1
        last = int(self._now / self._step)
        while done < last:
            count = min(last - done, _LONGEST)
            motion = self._go_on(done, count)
            self._steps.append(motion.x, motion.i)
            done += count
            self._forget(done)

    def _forget(self, done: int) -> None:
        """Forget steps and edges too long past; the edge that still holds is kept."""
        edge = self._used - self._edges.first
        later = self._edges.column(0)[edge + 1 :]
        self._used += int(np.searchsorted(later, done * self._step, side="right"))
        surplus = len(self._steps) - self._keep - 4
        if surplus > self._keep // 8:
            self._steps.forget(surplus)
            oldest = self._steps.first * self._step
            gone = int(np.searchsorted(self._edges.column(0), oldest, side="right")) - 1
            self._edges.forget(min(gone, self._used - self._edges.first))

    def _go_on(self, start: int, count: int) -> Moved:
        """Advance the plant by steps `start` ..., with the edges that are known."""
        edge = self._used - self._edges.first
        at, volts = self._edges.column(0)[edge:], self._edges.column(1)[edge:]
        # in steps from the first one, so that late times lose no digits
        own = at[1:] / self._step - start
        inside = int(np.searchsorted(own, count, side="left"))
        return push(self._plant, count, np.maximum(own[:inside], 0.0), volts[: inside + 1].copy())

    def _columns(self, ahead: bool) -> tuple[Array, Array]:
        """Displacement and current by steps; with two steps ahead if `ahead`."""
        if not ahead:
            return self._steps.column(0), self._steps.column(1)
        if isinstance(self._plant, Rewindable):
            state = self._plant.snapshot()
            motion = self._go_on(self._steps.total - 1, 2)
            self._plant.restore(state)
            return self._steps.column(0, motion.x), self._steps.column(1, motion.i)
        x, i = self._steps.column(0), self._steps.column(1)
        slope = x[-1] - x[-2] if x.size > 1 else 0.0
        later = x[-1] + slope * np.array([1.0, 2.0])
        return self._steps.column(0, later), self._steps.column(1, np.full(2, i[-1]))
