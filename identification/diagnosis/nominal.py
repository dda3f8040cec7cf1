"""Fit the model as it is: what holds between samples, which windows, which minimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.discrete import blocks
from bondgraph.errors import BondsightError
from bondgraph.graph import BondGraph
from bondgraph.simulate import HOLDS, exact_form
from identification.fit import Fit, Status, best, fit
from identification.problem import Data, Problem
from identification.residual import evaluate

Array = np.ndarray


def integrates(graph: BondGraph) -> bool:
    """Whether a constant command makes an output run away (an eigenvalue at zero)."""
    values, size = _eigenvalues(graph)
    return bool((np.abs(values) < 1e-9 * size).any()) if values.size else False


def _eigenvalues(graph: BondGraph) -> tuple[Array, float]:
    """Eigenvalues of the linear part (about rest) and the size that zero is measured by."""
    compiled = exact_form(graph)
    if compiled is not None:
        a = blocks(compiled, np.asarray(compiled.matrices(compiled.nominal()).full(), float)).a
        values = np.linalg.eigvals(a) if a.size else np.zeros(0)
        least = np.sqrt(np.abs(a).max(initial=0.0)) or 1.0
        return values, max(float(np.abs(values).max(initial=0.0)), float(least))
    from bondgraph.analysis.linear import eigenvalues
    from bondgraph.deriving import system

    try:
        values = np.asarray(eigenvalues(system(graph)), complex)
    except BondsightError:
        return np.zeros(0), 1.0
    return values, max(float(np.abs(values).max(initial=0.0)), 1e-12)


def nominal_fit(graph: BondGraph, data: Data, hold: str | None = None) -> tuple[Problem, Fit]:
    """Fit the model as it is; returns the problem to start candidates from, and the fit.

    Integrating plants are scored on windows with their own initial state, because their free run
    only shows how far the drift has gone. Others are tried from the declared values, and through
    short windows that have no wrong minima when a resonance starts at the wrong frequency.
    """
    runs_away = integrates(graph)
    train = int(data.mask("train").sum())
    window = max(100, min(500, train // 20)) if runs_away else None
    base = Problem(graph, data, window=window, source_offsets=runs_away)
    base = replace(base, built=base.engine)
    result = _first_fit(base)
    if hold and hold != data.hold:
        return _held(result, hold)
    if hold:
        return result.problem, result
    fits = {data.hold: result}
    for h in HOLDS:
        if h not in fits and _shows(result, h):
            fits[h] = _held(result, h)[1]
    # linear unless another behaviour halves the misfit: a missing lag imitates a held command
    chosen = min(fits, key=lambda h: fits[h].cost * (0.5 if h == "linear" else 1.0))
    result = fits[chosen]
    if chosen == "band-limited":
        problem = replace(result.problem, n_sub=4)
        finer = fit(problem, start=result.point, max_iterations=25)
        if finer.cost < 0.98 * result.cost:
            result = finer
    return result.problem, result


def _held(result: Fit, hold: str) -> tuple[Problem, Fit]:
    data = replace(result.problem.data, hold=hold)
    n_sub = 2 if hold == "band-limited" else 1
    problem = replace(result.problem, data=data, n_sub=n_sub)
    found = fit(problem, start=result.point, max_iterations=25)
    return found.problem, found


def _shows(result: Fit, hold: str) -> bool:
    """Whether another behaviour between samples changes the misfit at all."""
    data = replace(result.problem.data, hold=hold)
    problem = replace(result.problem, data=data, n_sub=2 if hold == "band-limited" else 1)
    there = evaluate(problem, result.point, derivatives=False).residual
    cost = float(np.mean(there**2)) if there.size else np.inf
    # what a refit can gain is bounded by how much the misfit moves
    return np.isfinite(cost) and abs(cost - result.cost) > 0.05 * result.cost


def _first_fit(base: Problem) -> Fit:
    """Fit from the declared values, and through windows that grow, each with its own state."""
    fits = [fit(base, max_iterations=25)]
    if base.window is not None or not base.engine.exact_step or fits[0].cost < GOOD:
        return fits[0]
    length = max(24, 8 * base.engine.n_x)
    inside = np.flatnonzero(base.data.mask("train"))
    begin, end = int(inside[0]), int(inside[-1]) + 1
    few = slice(begin, min(end, begin + FEW))
    short = replace(base.data.split, train=few, test=slice(few.stop, few.stop))
    data = replace(base.data, split=short)
    values: dict[str, float] = {}
    while length < (end - begin) // 3 and length < 1000:
        brief = replace(
            base,
            data=data,
            window=length,
            starts=values,
            lags=False,
            offsets=False,
            built=base.engine,
        )
        found = fit(brief, max_iterations=8)
        if found.status is Status.BROKEN:
            break
        values = {k: v for k, v in found.values.items() if k in base.graph.parameters}
        length *= 5
    if values:
        fits.append(fit(replace(base, starts=values), max_iterations=25))
    result = best(fits)
    return result if result.problem is base else _rebased(base, result)


GOOD = 1.3
"""Misfit over the floor at which no other minimum is looked for."""
FEW = 2000
"""Samples that the windows cover."""


def _rebased(base: Problem, result: Fit) -> Fit:
    """Express the fit from the declared start values, so that points can be shared."""
    point = result.point
    theta = point.theta.copy()
    for i, f in enumerate(base.free):
        value = result.values[f.parameter.name]
        theta[i] = np.log(value / f.start) if f.log else (value - f.start) / f.scale
    return replace(result, problem=base, point=replace(point, theta=theta))
