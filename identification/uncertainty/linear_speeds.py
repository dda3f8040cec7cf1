"""Time constants of a model's small motions, and which free parameters decide them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.study.problem import Problem

MOVES = 0.05


@dataclass(frozen=True, slots=True)
class Speed:
    """An eigenvalue (1/s) at the start values, and the free parameters that move it."""

    rate: complex
    names: tuple[str, ...]


def speeds(problem: Problem) -> tuple[Speed, ...]:
    """Return the eigenvalues about the rest under the mean commands, slowest first.

    A parameter decides an eigenvalue if doubling it would move that by more than about 5 %.
    """
    p, dynamics, mean = np.array(problem.start_vector), problem.dynamics, problem.mean_inputs
    rates = dynamics.small_signal(p, mean).eigenvalues()
    moved: dict[int, list[str]] = {}
    for f in problem.free:
        i = dynamics.parameter_names.index(f.parameter.name)
        changed = p.copy()
        step = 1e-4 * (abs(p[i]) or f.scale)
        changed[i] += step
        other = dynamics.small_signal(changed, mean).eigenvalues()
        for k, rate in enumerate(rates if other.size else ()):
            near = other[np.argmin(np.abs(other - rate))]
            if abs(near - rate) > MOVES * 1e-4 * abs(rate) > 0:
                moved.setdefault(k, []).append(f.parameter.name)
    found = [Speed(complex(r), tuple(moved.get(k, ()))) for k, r in enumerate(rates)]
    return tuple(sorted(found, key=lambda s: abs(s.rate)))
