"""Mistakes that no misfit tells: values far from those declared come back where one is undone.

A model whose parameters are all free makes up for a unit, and at times for columns that are
exchanged. Declared values are known all the same: one mistake that brings all of them back at once,
with no more misfit than before, is likelier than so many wrong ones.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.support.errors import BondsightError
from identification.diagnosis.screening.carried import MOVED
from identification.diagnosis.screening.forgotten_unit import LEAST, STAY, Suspect, suspects
from identification.diagnosis.screening.mixups import (
    ALIKE,
    ENOUGH,
    away,
    brief,
    fit_undone,
    gross,
    in_windows,
    relative_errors,
)
from identification.diagnosis.screening.undoing import Mixup, exchanges, in_unit, undone
from identification.diagnosis.screening.usual_units import conversions
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.study.data import Data

SEVERAL = 2
"""Values that are far off at least: a single one may be declared wrongly."""
BACK = 2.5
"""Factor within which all values are back."""
NO_WORSE = 1.2
"""Largest error over that without the mistake undone."""
CLOSELY = 1.5
"""The same within which what the search makes of the rest gives way."""
BESIDE = 2.0
"""Factor within which the values tell a unit."""


@calm()
def told_by_values(graph: BondGraph, nominal: Fit) -> tuple[Mixup, ...]:
    """Return the mistakes that bring all values back to what is declared, the best first.

    Nothing is fitted unless several values are far from it.

    Parameters
    ----------
    graph : BondGraph
        The model as declared.
    nominal : Fit
        Its fit to the recording.
    """
    off = away(nominal, graph.parameters)
    if sum(a > np.log(LEAST) for a in off.values()) < SEVERAL:
        return ()
    tried = partial(_tried, graph, nominal)
    found = [t for m in _other_units(graph, nominal) if (t := tried(m)) is not None]
    absurd = sum(a > np.log(MOVED) for a in off.values())
    if not found and absurd >= SEVERAL:
        found = [t for m in _in_windows(graph, nominal) if (t := tried(m)) is not None]
    return tuple(sorted(found, key=lambda m: m.beside))


def gives_way(kind: str, back: Collection[Mixup]) -> bool:
    """Whether a mistake is told instead of what a search beside it came to.

    Values that are back closely leave no doubt; a guess of several values may lie near some unit,
    and what is missing then is missing all the same.
    """
    closely = min((m.beside for m in back), default=np.inf) < np.log(CLOSELY)
    return kind != "parameters_only" and closely


def _tried(graph: BondGraph, nominal: Fit, mixup: Mixup) -> Mixup | None:
    """Return the mistake with what the values say of it; None if they do not come back."""
    try:
        fit = fit_undone(graph, nominal.problem.data, mixup)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None
    left = max(away(fit, graph.parameters).values())
    if fit.status is FitStatus.BROKEN or left > np.log(BACK) or gross(fit):
        return None
    if _worst(fit) > NO_WORSE * _worst(nominal):
        return None
    return replace(
        mixup, beside=left, values=_told(nominal, fit, graph.parameters),
        before=nominal.chi2("test"), after=fit.chi2("test"),
    )  # fmt: skip


def _other_units(graph: BondGraph, nominal: Fit) -> Iterator[Mixup]:
    """Yield usual units that would carry the values where they are."""
    for s in suspects(nominal, graph.parameters):
        if (made := in_usual_unit(nominal.problem.data, s)) is not None:
            yield made


def in_usual_unit(data: Data, s: Suspect) -> Mixup | None:
    """Return a channel as if it were in the usual unit next to its factor; None without one."""
    near = conversions(data.read_in.get(s.channels[0], ""))
    near = tuple(f for f in near if abs(np.log(f / s.factor)) < np.log(BESIDE))
    if not near:
        return None
    return in_unit(data, s.channels, min(near, key=lambda f: abs(float(np.log(f / s.factor)))))


def _in_windows(graph: BondGraph, nominal: Fit) -> Iterator[Mixup]:
    """Yield exchanges and usual units of a channel that short stretches allow.

    A fit that ended in a wrong valley does not point at the channel whose unit led it there.
    """
    data = brief(nominal.problem.data)
    most = ALIKE * max(in_windows(graph, data), ENOUGH)
    units = (
        in_unit(data, (n,), factor)
        for n in (*data.commands, *data.names)
        for factor in conversions(data.read_in.get(n, ""))
    )
    for m in (*exchanges(graph, data), *units):
        if in_windows(graph, undone(data, m)) <= most:
            yield m


def _worst(fit: Fit) -> float:
    errors = [e for e in relative_errors(fit).values() if np.isfinite(e)]
    return max(errors, default=np.inf)


def _told(before: Fit, after: Fit, declared: Mapping[str, Parameter]) -> str:
    far = [n for n, a in away(before, declared).items() if a > np.log(STAY)]
    pairs = ", ".join(
        f"{n} {_times(after, n, declared):.3g} (now {_times(before, n, declared):.3g})" for n in far
    )
    return f"the fitted values come back to those declared, at so many times them: {pairs}"


def _times(fit: Fit, name: str, declared: Mapping[str, Parameter]) -> float:
    value = next(e.value for e in fit.estimates if e.name == name)
    return value / declared[name].value
