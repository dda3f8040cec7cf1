"""Material for a judgement from the fits of this project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import BondsightError
from identification.estimation.estimates import Estimate
from identification.estimation.result import Estimation
from identification.estimation.settling import free_states, sizes
from identification.estimation.single_record import Fit
from identification.study.joint import stack_of
from identification.uncertainty.fitted import from_estimation as fit_view
from identification.uncertainty.pinned import pinned_groups
from identification.uncertainty.tied import Tied, remark_on, tied
from identification.validation.parameter_remarks import is_wide
from identification.validation.validation_data import (
    FREE_RUN,
    Number,
    ValidationData,
    ValidationRecord,
)


def from_fit(fit: Fit) -> ValidationData:
    """Material of a single-record fit."""
    problem = fit.problem
    data = problem.data
    units = tuple(
        str(e.unit or "") if isinstance(e := problem.graph[n], Sensor) else "" for n in data.names
    )
    record = ValidationRecord(
        data.name, data.time, data.names, units, data.readings, fit.simulated, data.floor,
        data.mask("train"), data.mask("test"), dict(data.commands), data.sha256,
    )  # fmt: skip
    run = FREE_RUN
    if problem.window is not None:
        run = f"windows of {problem.window} samples, each with an initial state of its own"
    stack = stack_of((problem,))
    return ValidationData(
        problem.graph.name, (record,), tuple(_numbers(fit.estimates, problem.graph)),
        sizes(stack)[1], fit.status.value, run,
        nuisances=tuple(map(number, fit.nuisances)), states=free_states(stack),
    )  # fmt: skip


def from_estimation(found: Estimation, kinds: Mapping[str, str] | None = None) -> ValidationData:
    """Material of an estimation: all its recordings, validation ones included.

    Parameters
    ----------
    kinds : mapping of str to str, optional
        What a profile said about a parameter, in a word, by name.
    """
    study, stack = found.study, found.stack
    numbers = _numbers(found.estimates, study.graph, kinds)
    together = _tied(found, numbers)
    numbers = [replace(n, only=remark_on(n.name, together)) for n in numbers]
    states = free_states(stack)
    orders = sum(max(v.size - 1, 0) for w in found.setting.whitening for v in w)
    at = [stack.names.index(e.name) for e in found.estimates]
    records = tuple(_record(found, r) for r in range(len(study.records)))
    return ValidationData(
        study.graph.name, records, tuple(numbers), sizes(stack)[1] + orders, found.status.value,
        _run_words(found), (), tuple(map(number, found.nuisances)),
        correlations(found.covariance)[np.ix_(at, at)], tuple(found.notes), together, states,
    )  # fmt: skip


def _numbers(
    estimates: Sequence[Estimate], graph: BondGraph, kinds: Mapping[str, str] | None = None
) -> list[Number]:
    """Return estimates with what was declared before the fit, and what a profile said."""
    declared = {n: float(p.value) for n, p in graph.parameters.items()}
    return [
        replace(
            number(e), nominal=declared.get(e.name.split(" @")[0], float("nan")),
            kind=(kinds or {}).get(e.name, ""),
        )
        for e in estimates
    ]  # fmt: skip


def _tied(found: Estimation, numbers: Sequence[Number]) -> tuple[Tied, ...]:
    """Return what is told only together; not looked for where every number is well known."""
    rest = pinned_groups(found.study.graph, found.study.free_names)
    if not rest and not any(n.at_bound or is_wide(n) for n in numbers):
        return ()
    try:
        return tied(fit_view(found), pinned=rest)
    except BondsightError:  # its method minimises another misfit, or the fit broke
        return ()


def _record(found: Estimation, r: int) -> ValidationRecord:
    study = found.study
    data = found.problem(r).data
    units = tuple(study.records[r].units[n] for n in data.names)
    whitening = found.setting.whitening[r] if r < len(study.recordings) else ()
    return ValidationRecord(
        found.record_names[r], data.time, data.names, units, data.readings, found.simulated[r],
        found.floors[r], data.mask("train"), data.mask("test"), dict(data.commands),
        study.records[r].sha256, tuple(whitening),
    )  # fmt: skip


def _run_words(found: Estimation) -> str:
    study = found.study
    said = found.run or FREE_RUN
    if study.window is not None:
        said = f"windows of {study.window} samples, each with an initial state of its own"
    if study.validation:
        start = (
            f"an initial state fitted to {study.init} samples that are not scored"
            if study.init
            else "rest"
        )
        said += f"; recordings that are only judged start from {start}"
    return said


def number(e: Estimate) -> Number:
    """Return an estimate as the judgement takes it."""
    low, high = (float(v) for v in e.ci95)
    return Number(e.name, float(e.value), e.unit, (low, high), bool(e.at_bound))


def correlations(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix of a covariance; zero where a variance is zero or not finite."""
    c = np.asarray(covariance, float)
    sd = np.sqrt(np.clip(np.diag(c), 0, None))
    sized = np.where(np.isfinite(sd) & (sd > 0), sd, np.inf)
    with np.errstate(invalid="ignore"):
        found = np.nan_to_num(c / np.outer(sized, sized))
    np.fill_diagonal(found, 1.0)
    return np.asarray(np.clip(found, -1.0, 1.0))
