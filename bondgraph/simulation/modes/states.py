"""What a new mode takes over from the old one: the contents of all storages, or a refusal."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.causality.assignment import storage_ports
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, CField
from bondgraph.graph.sensors import Dq
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.modes.watching import Watch, watched
from bondgraph.support.arrays import Array
from bondgraph.support.errors import GraphError

if TYPE_CHECKING:
    from bondgraph.equations.system import System
    from bondgraph.simulation.lure import Compiled

_ROUNDS = 8


class Mode:
    """The equations of a mode; what its storages hold and what guards watch are among its signals.

    Attributes
    ----------
    text : str
        Which junctions are on and off.
    model : System
    exact : Compiled or None
        For the exact step; None where it needs the general one.
    states, shown : tuple of str
        Names of its states, and of the sensors.
    conditions : tuple of ActiveGuard
    stores : tuple of str
        Contents of all storages, of those that depend on others, too.
    carried : tuple of str
        What goes over a switch: contents, and states that no storage has.
    taps : tuple of str
        Sensors of a displacement that is counted from the first sample of a mode on.
    remembering : frozenset of str
        Elements whose laws have memory.
    """

    def __init__(
        self, graph: BondGraph, mode: Mapping[str, bool], watch: Watch | None = None
    ) -> None:
        from bondgraph.equations.derivation import equations
        from bondgraph.simulation.lure import exact_form

        self.text = ", ".join(f"{n} {'on' if on else 'off'}" for n, on in mode.items())
        conditions = watch.conditions(mode) if watch else ()
        self.conditions = tuple(c for c, _ in conditions)
        readings = [r for _, r in conditions if r is not None]
        resolved = watched(in_mode(graph, mode), readings)
        try:
            found = exact_form(resolved)
            self.model: System = found.model if found is not None else equations(resolved)
        except GraphError as error:
            raise GraphError(f"mode {self.text}: {error}") from error
        model, self.name = self.model, self.model.name
        self.states = model.states
        hidden = {r.name for r in readings}
        self.shown = tuple(n for n in model.output_names if n not in hidden)
        stored = [
            f"{'q' if isinstance(e, C | CField) else 'p'}_{n}"
            for n, _, e in storage_ports(resolved)
        ]
        self.stores = tuple(s for s in stored if s in model.signals)
        self.taps = tuple(e.name for e in resolved.of_type(Dq) if e.law is None and not e.drift)
        shifted = {f"z_{s}" for s in self.stores}  # what they mean differs from mode to mode
        own = tuple(s for s in self.states if s not in self.stores and s not in shifted)
        self.carried = (*self.stores, *own)
        self.remembering = frozenset(use.element for use in model.laws if use.law.n_memory)
        self.exact: Compiled | None = found and replace(found, observed=self.carried)


def taken_over(
    mode: Mode,
    held: Mapping[str, float],
    largest: Mapping[str, float],
    holds: Callable[[Array], Mapping[str, float]],
    begin: float,
    tolerance: float,
) -> Array:
    """Return the state of `mode` in which every storage holds what it held.

    Parameters
    ----------
    held : mapping of str to float
        Contents of storages, other states, and readings (as ``y name``) at the end of the old mode.
    largest : mapping of str to float
        Largest magnitude of each so far.
    holds : callable
        Contents of the storages of `mode` in a given state.
    begin : float
        Time of the switch, s.
    tolerance : float
        Share of the largest value by which a content may differ.

    Raises
    ------
    GraphError
        No state fits: the switch needs an impulse.
    """
    # a displacement that a sensor begins to integrate goes on from its reading
    wanted = {n: held.get(n, held.get(f"y {n[2:]}")) for n in mode.carried}
    known = {n: v for n, v in wanted.items() if v is not None}
    if set(mode.states) <= set(mode.carried):
        x = np.array([wanted[n] or 0.0 for n in mode.states])
        if all(n in mode.states for n in mode.stores):
            return x
        _refuse_impulse(mode, begin, known, holds(x), largest, tolerance)
        return x
    names, target = list(known), np.array(list(known.values()))
    size = _sizes(mode, largest)

    def contents(x: Array) -> Array:
        got = holds(x)
        return np.array([got[n] for n in names])

    x = np.zeros(len(mode.states))
    for _ in range(_ROUNDS):  # one is exact unless a dependent storage has a law
        now = contents(x)
        slope = [contents(x + d) - now for d in np.diag(size)]
        matrix = np.stack(slope, axis=1) if slope else np.zeros((len(names), 0))
        rows = np.abs(matrix).max(axis=1, initial=0.0)
        rows[rows == 0.0] = 1.0
        step, *_ = np.linalg.lstsq(matrix / rows[:, None], (target - now) / rows, rcond=1e-12)
        x = x + size * step
        if np.abs(step).max(initial=0.0) <= 1e-9:
            break
    _refuse_impulse(mode, begin, known, holds(x), largest, tolerance)
    return x


def _sizes(mode: Mode, largest: Mapping[str, float]) -> Array:
    """Return a typical size for each state, greater than zero."""
    typical = [largest.get(n, largest.get(n.removeprefix("z_"), 0.0)) for n in mode.states]
    rest = max(typical, default=0.0) or 1.0
    return np.array([t or rest for t in typical])


def _refuse_impulse(
    mode: Mode,
    begin: float,
    old: Mapping[str, float],
    new: Mapping[str, float],
    largest: Mapping[str, float],
    tolerance: float,
) -> None:
    off = [
        n
        for n, a in old.items()
        if abs(a - new[n]) > tolerance * max(largest.get(n, 0.0), abs(a), abs(new[n]))
    ]
    if not off:
        return
    n = next((n for n in off if n not in mode.states), off[0])
    raise GraphError(
        f"{mode.name}: switching to {mode.text} at {begin:g} s needs an impulse: "
        f"the store {n[2:]} holds {n} = {old[n]:.6g} and would have to jump to about "
        f"{new[n]:.6g}; switch when it fits, or put a resistance (a compliance) beside it"
    )
