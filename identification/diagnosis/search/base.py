"""The thinned data the search works on, and the repaired model on all training samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    thinning,
    trial_of,
)
from identification.diagnosis.search.hold_choice import with_best_hold
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.problem import Problem
from identification.study.residual import Point, slots


@dataclass(frozen=True, eq=False)
class Base:
    """Where a search starts: a fitted model, and the problem that candidates are built from."""

    fit: Fit
    template: Problem


def base_of(f: Fit) -> Base:
    """Start candidates where `f` ended."""
    problem = f.problem
    states = problem.dynamics.state_names
    known = {n: f.point.states[:, i] for i, n in enumerate(states)}
    offsets = tuple(float(v) for v in f.point.theta[slots(problem).offsets])
    start: dict[str, Any] = {
        "starts": dict(f.values),
        "known_states": known,
        "known_offsets": offsets,
        "built": None,
    }
    return Base(f, replace(problem, **start))


def thinned(template: Problem, nominal: Fit, options: DiagnosisOptions) -> Base:
    """Return the problem for the search on thinned data, with the nominal fit on the same data."""
    factor = thinning(template.data, options.samples)
    if factor == 1:
        return base_of(nominal)
    thin = replace(template, data=template.data.thinned(factor))
    return base_of(fit(thin, start=_lags_scaled(nominal, thin, factor), max_iterations=8))


def _lags_scaled(f: Fit, problem: Problem, factor: float) -> Point:
    """Return the point of a fit on another sampling grid: lags and delays count samples."""
    at = slots(problem)
    theta = f.point.theta.copy()
    theta[at.lags] /= factor
    theta[at.delays] /= factor
    return Point(theta, f.point.states)


def unthinned(
    decisions: Sequence[Decision], template: Problem, holds: Sequence[str] = ()
) -> tuple[Decision, ...]:
    """Refit the last named effect on all training samples, with what commands do between them.

    Held-out samples are not fitted here either, and unless the search worked on thinned samples
    nothing is but what commands do between them: it was chosen beside another noise or law, or
    between fewer samples. Without `holds` to choose from there is no time, and the fit stays.
    """
    last = max((i for i, d in enumerate(decisions) if d.chosen is not None), default=None)
    named = [i for i, d in enumerate(decisions) if d.kind == "missing_physics"]
    last = named[-1] if named else last
    if last is None:
        return tuple(decisions)
    chosen = decisions[last].chosen
    assert chosen is not None
    made = list(decisions)
    made[last] = replace(decisions[last], chosen=_refitted(chosen, template, holds))
    return tuple(made)


def _refitted(chosen: Candidate, template: Problem, holds: Sequence[str]) -> Candidate:
    old = chosen.fit
    factor = max(1, round(template.data.n / old.problem.data.n))
    if factor == 1:
        other = with_best_hold(old, MORE, holds)
        return chosen if other is old else trial_of(chosen.insertion, chosen.home, other)
    data = replace(template.data, hold=old.problem.data.hold, floor=old.problem.data.floor)
    least = 4 if data.hold == "band-limited" else 1
    problem = replace(old.problem, data=data, n_sub=max(old.problem.n_sub // factor, least))
    iterations = 10 if holds else 0
    result = fit(problem, start=_lags_scaled(old, problem, 1 / factor), max_iterations=iterations)
    test = template.data.mask("test")

    def sound(f: Fit) -> bool:
        return f.status is not FitStatus.BROKEN and bool(np.isfinite(f.simulated[test]).all())

    if not sound(result):
        return chosen
    other = with_best_hold(result, MORE, holds)
    return trial_of(chosen.insertion, chosen.home, other if sound(other) else result)


MORE = 30
"""Steps of a fit under another behaviour of the commands."""


def declared_fit(template: Problem, nominal: Fit) -> Fit:
    """Fit the nuisances alone, parameters as declared."""
    names = [n for n in template.graph.parameters if not n.startswith("offset_")]
    return fit(replace(template, fixed=tuple(names), starts={}), max_iterations=10)
