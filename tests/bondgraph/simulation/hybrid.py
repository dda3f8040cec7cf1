"""A hybrid automaton by SciPy: the truth beside switched graphs, written without the project."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Number = Callable[[float, Any], float]


@dataclass(frozen=True)
class Location:
    """A mode: its rates, and where it is left: ``signal(t, x)`` rises above zero, and to which."""

    rates: Callable[[float, Any], Any]
    exits: Mapping[str, Number] = field(default_factory=dict)


def simulated(
    modes: Mapping[str, Location],
    mode: str,
    x: Any,
    times: Any,
    switches: Mapping[float, str] = {},
) -> tuple[Any, list[tuple[float, str]]]:
    """States at the times, shape (N, n_x), and when which mode began; `switches` are forced."""
    states, begun = [np.asarray(x, float)], []
    stops = sorted({*times, *switches})
    kept = set(times)
    for a, b in pairwise(stops):
        if a in switches:
            mode = switches[a]
            begun.append((a, mode))
        now = a
        while now < b:
            there = modes[mode]
            names = list(there.exits)
            holding = [n for n in names if there.exits[n](now, x) > 1e-13]
            if holding:
                mode = holding[0]
                begun.append((now, mode))
                continue
            events = [_event(there.exits[n]) for n in names]
            made = solve_ivp(there.rates, (now, b), x, method="DOP853", rtol=1e-12, atol=1e-14,
                             events=events)  # fmt: skip
            now, x = float(made.t[-1]), made.y[:, -1]
            if made.status == 1:
                mode = next(n for n, t in zip(names, made.t_events, strict=True) if t.size)
                begun.append((now, mode))
        if b in kept:
            states.append(x)
    return np.array(states), begun


def _event(signal: Number) -> Any:
    def event(t: float, x: Any) -> float:
        return signal(t, x)

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = 1.0  # type: ignore[attr-defined]
    return event
