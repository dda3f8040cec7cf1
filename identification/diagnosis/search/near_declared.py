"""The model as it is, held near its declared values: a course that shows what bent its fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.parameter import Parameter
from bondgraph.support.errors import BondsightError
from identification.diagnosis.screening.carried import FAR, ratios
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.priors import LogNormal, Normal, Prior

TENFOLD = 10.0
"""Times a declared value from which a number rather does the work of a law that is missing."""
WITHIN = 1.5
"""Factor within which two thirds of all declared values are right."""
TOLD = 30.0
"""Independent samples that a misfit counts for: it is no noise, and tells little by its size."""
STEPS = 15
"""Steps of the fit: it need not end."""


def near_declared(nominal: Fit) -> Fit | None:
    """Return a fit held near the declared values, where the free one ended far from them.

    A large effect is taken up by values that nothing can have, and along the course that they make
    no law looks right: neither where it is nor how large. What is left counts as little as if it
    were noise of that size with a few independent samples, so that declared values speak as well.

    Returns
    -------
    Fit or None
        Of the same problem from declared values on, its misfit by the same noise; None where the
        free fit did not go far, or where this one cannot be made.
    """
    if nominal.chi2("train") <= FAR or not _moved_far(nominal):
        return None
    begun = replace(nominal.problem, starts={}, correction=None)
    missed = np.sqrt(np.mean(nominal.residuals("train") ** 2, axis=0))
    rows = int(begun.data.mask("train").sum())
    loud = np.maximum(begun.data.floor, missed * np.sqrt(max(1.0, rows / TOLD)))
    priors = {
        f.parameter.name: p
        for f in begun.free
        if f.parameter.name in begun.graph.parameters and (p := _prior(f.parameter)) is not None
    }
    weak = replace(
        begun, data=replace(begun.data, floor=loud), priors={**priors, **begun.priors}
    )  # fmt: skip
    try:
        held = fit(weak, max_iterations=STEPS, judged=False)
        if held.status is FitStatus.BROKEN:
            return None
        found = fit(begun, start=held.point, max_iterations=0)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None
    return found if found.status is not FitStatus.BROKEN and np.isfinite(found.cost) else None


def _moved_far(nominal: Fit) -> bool:
    moved = ratios(nominal, nominal.problem.graph.parameters)
    return any(r > 0.0 and not 1.0 / TENFOLD < r < TENFOLD for r in moved.values())


def _prior(p: Parameter) -> Prior | None:
    if p.positive and p.value > 0.0:
        return LogNormal(p.value, WITHIN)
    return Normal(p.value, (WITHIN - 1.0) * abs(p.value)) if p.value else None
