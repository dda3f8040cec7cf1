"""Time constants of the linear part of a model, and which free parameters decide them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from bondgraph.simulation.first_order_hold import blocks
from bondgraph.support.arrays import FloatArray
from identification.study.engine import ExactEngine
from identification.study.problem import Problem

MOVES = 0.05


@dataclass(frozen=True, slots=True)
class Speed:
    """An eigenvalue (1/s) at the start values, and the free parameters that move it."""

    rate: complex
    names: tuple[str, ...]


def speeds(problem: Problem) -> tuple[Speed, ...]:
    """Return the eigenvalues, slowest first; empty for models without a linear part.

    A parameter decides an eigenvalue if doubling it would move that by more than about 5 %.
    """
    if not isinstance(problem.engine, ExactEngine):
        return ()
    p = np.array(problem.start_vector)
    rates = _eigenvalues(problem.engine, p)
    moved: dict[int, list[str]] = {}
    for f in problem.free:
        i = problem.engine.parameter_names.index(f.parameter.name)
        changed = p.copy()
        step = 1e-4 * (abs(p[i]) or f.scale)
        changed[i] += step
        other = _eigenvalues(problem.engine, changed)
        for k, rate in enumerate(rates):
            near = other[np.argmin(np.abs(other - rate))]
            if abs(near - rate) > MOVES * 1e-4 * abs(rate) > 0:
                moved.setdefault(k, []).append(f.parameter.name)
    found = [Speed(complex(r), tuple(moved.get(k, ()))) for k, r in enumerate(rates)]
    return tuple(sorted(found, key=lambda s: abs(s.rate)))


def _eigenvalues(engine: ExactEngine, p: FloatArray) -> NDArray[np.complex128]:
    compiled = engine.compiled
    a = blocks(compiled, np.asarray(compiled.matrices(p).full(), float)).a
    if not a.size or not np.isfinite(a).all():
        return np.zeros(0, complex)
    balanced, _ = matrix_balance(a)
    return np.asarray(np.linalg.eigvals(balanced), complex)
