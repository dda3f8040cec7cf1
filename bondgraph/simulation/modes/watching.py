"""Guards bound to a graph: checked once, and what they watch in each mode as readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from bondgraph.equations.bond_signals import SignalNames, signal_called
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.renaming import apart, declared_parameters, rebuilt
from bondgraph.graph.elements import X0, Value
from bondgraph.graph.modulation import effort, flow
from bondgraph.graph.sensors import Reading, Sensor
from bondgraph.simulation.modes.guards import Guard, When
from bondgraph.simulation.modes.resolve import mode_of, off_source
from bondgraph.support.arrays import Array
from bondgraph.support.errors import (
    GraphError,
    UnusableInput,
    real_number,
    require_known,
    unknown_name,
)


@dataclass(frozen=True)
class ActiveGuard:
    """What may switch a junction in one mode.

    Attributes
    ----------
    junction : str
        The junction it switches.
    reading : str
        The output that it compares; "" where the signal is a constant in this mode.
    above, below : float
        Levels, SI; infinite where there is none.
    constant : float
        The signal where it is a constant.
    """

    junction: str
    reading: str
    above: float
    below: float
    constant: float = 0.0

    @property
    def size(self) -> float:
        """The larger of its levels."""
        return max(abs(v) for v in (self.above, self.below, 0.0) if np.isfinite(v))

    def margin(self, signal: Array) -> Array:
        """Return how far the condition is beyond its level, above zero where it holds."""
        return np.maximum(signal - self.above, self.below - signal)


class Watch:
    """Guards of a graph.

    Raises
    ------
    BondsightError
        Unknown names, levels that contradict each other, a junction that is switched twice.
    """

    def __init__(
        self,
        graph: BondGraph,
        guards: Sequence[Guard],
        scheduled: Iterable[str] = (),
        parameters: Mapping[str, float] | None = None,
    ) -> None:
        self.graph = graph
        self.guards = _checked_junctions(graph, guards, set(scheduled))
        self.numbers = {n: p.value for n, p in graph.parameters.items()} | dict(parameters or {})
        self._held_back = {
            (flow(n) if isinstance(graph[n], X0) else effort(n)): n for n in mode_of(graph)
        }
        names = SignalNames(graph)
        for guard in self.guards.values():
            for when in (guard.on, guard.off):
                if when is not None:
                    self._check_signal(names, guard.junction, when)
            self._check_levels(guard)

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self.guards)

    def conditions(
        self, mode: Mapping[str, bool]
    ) -> tuple[tuple[ActiveGuard, Reading | None], ...]:
        """Return what may switch in a mode, with the reading to be added for it, if one is."""
        found = []
        with apart():
            for guard in self.guards.values():
                when = guard.off if mode[guard.junction] else guard.on
                if when is not None:
                    found.append(self._condition(guard.junction, when, mode))
        return tuple(found)

    def _condition(
        self, junction: str, when: When, mode: Mapping[str, bool]
    ) -> tuple[ActiveGuard, Reading | None]:
        above, below = self._levels(junction, when)
        if isinstance(when.signal, str):
            return ActiveGuard(junction, when.signal, above, below), None
        signal = sp.sympify(when.signal).xreplace(
            {s: self._open(n, mode[n]) for s, n in self._held_back.items()}
        )
        own = {p.symbol for p in self.graph.parameters.values()}
        if signal.free_symbols <= own:
            return ActiveGuard(junction, "", above, below, self._number(junction, signal)), None
        name = f"guard_of_{junction}"
        while name in self.graph.elements or name in self.graph.parameters:
            name += "_"
        return ActiveGuard(junction, name, above, below), Reading(name, signal)

    def _open(self, name: str, on: bool) -> sp.Expr:
        """Return what an open junction holds back: what its zero source has to balance."""
        if on:
            return sp.S.Zero
        given = flow if isinstance(self.graph[name], X0) else effort
        return -given(off_source(name))

    # -- levels -----------------------------------------------------------------------------
    def _levels(self, junction: str, when: When) -> tuple[float, float]:
        above = np.inf if when.above is None else self._number(junction, when.above)
        below = -np.inf if when.below is None else self._number(junction, when.below)
        if above < below:
            raise UnusableInput(
                f"{self.graph.name}: guard of {junction}: {when!r} always holds: above {above:g} "
                f"or below {below:g}; swap the levels"
            )
        return above, below

    def _number(self, junction: str, value: Value) -> float:
        where = f"{self.graph.name}: level of the guard of {junction}"
        if isinstance(value, str):
            require_known("parameter", where, self.numbers, value)
            return real_number(where, self.numbers[value])
        if isinstance(value, sp.Basic):
            known = {p.symbol: n for n, p in self.graph.parameters.items()}
            for s in sorted(value.free_symbols, key=str):
                if s not in known:
                    raise unknown_name("parameter", s, where, self.numbers)
            value = value.xreplace({s: sp.Float(self.numbers[n], 17) for s, n in known.items()})
        return real_number(where, value)

    def _check_levels(self, guard: Guard) -> None:
        """Refuse levels of one signal at which both conditions would hold."""
        for when in (w for w in (guard.on, guard.off) if w is not None):
            self._levels(guard.junction, when)
        if guard.on is None or guard.off is None or guard.on.signal != guard.off.signal:
            return
        on, off = (self._levels(guard.junction, w) for w in (guard.on, guard.off))
        both = on[0] < off[1] or off[0] < on[1]
        for i in (0, 1):  # above two levels, or below two
            both = both or bool(np.isfinite(on[i]) and np.isfinite(off[i]))
        if both:
            raise UnusableInput(
                f"{self.graph.name}: guard of {guard.junction}: on={guard.on!r} and "
                f"off={guard.off!r} can hold at once; the wrong way round? The levels need a band "
                "between them, such as on below 19 and off above 21"
            )

    # -- signals ----------------------------------------------------------------------------
    def _check_signal(self, names: SignalNames, junction: str, when: When) -> None:
        graph = self.graph
        if isinstance(when.signal, str):
            sensors = {s.name: s for s in graph.of_type(Sensor)}
            require_known(
                "sensor", f"{graph.name} for the guard of {junction}", sensors, when.signal
            )
            sensor = sensors[when.signal]
            if sensor.delay or sensor.clock:
                raise UnusableInput(
                    f"{graph.name}: guard of {junction}: the sensor {sensor.name} is late or has "
                    "a clock of its own, which is applied behind a simulation; watch the signal "
                    "that it reads, as an expression"
                )
            return
        own = {p.symbol for p in graph.parameters.values()}
        for s in sorted(sp.sympify(when.signal).free_symbols - own, key=str):
            if s not in self._held_back:
                signal_called(names, str(s), graph, f"guard of {junction}")


def watched(graph: BondGraph, readings: Sequence[Reading]) -> BondGraph:
    """Return a graph with more readings."""
    if not readings:
        return graph
    with apart():
        pairs = [(b.tail, b.head) for b in graph.bonds]
        elements = [*graph.elements.values(), *readings]
        return rebuilt(graph, elements, pairs, declared_parameters(graph))


def _checked_junctions(
    graph: BondGraph, guards: Sequence[Guard], scheduled: set[str]
) -> dict[str, Guard]:
    found: dict[str, Guard] = {}
    known = mode_of(graph)
    for guard in guards:
        if not isinstance(guard, Guard):
            raise GraphError(f"{graph.name}: events={guard!r}; give Guard(...)s")
        require_known("switched junction", graph.name, known, guard.junction)
        if guard.junction in found:
            raise GraphError(
                f"{graph.name}: {guard.junction} has two guards; give on and off in one"
            )
        if guard.junction in scheduled:
            raise GraphError(
                f"{graph.name}: {guard.junction} is switched by the schedule and by a guard; leave "
                "one out, or put two switched junctions one behind the other"
            )
        found[guard.junction] = guard
    return found
