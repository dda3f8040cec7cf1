"""What a diagnosis could have known at best: the fit that is told the effect and its place."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    attempt,
    blocks_of,
    finish,
    go_on,
)
from identification.statistics.blocks import paired_z
from identification.study.problem import drives


@dataclass(frozen=True)
class OracleResult:
    """The fit that is told the truth.

    Attributes
    ----------
    test : float
        Held-out mean square over the floor.
    test_rmse : dict of str to float
        SI, by sensor.
    excess_db : float
        Excess of the nominal model over what the oracle leaves, in decibels of the latter.
    z : float
        Standard errors by which it leads the best other effect that was fitted.
    gain_z : float
        The same against the nominal model.
    """

    test: float
    test_rmse: dict[str, float]
    excess_db: float
    z: float
    gain_z: float


def oracle(
    d: Diagnosis, truths: Sequence[tuple[str, str]], options: DiagnosisOptions
) -> OracleResult | None:
    """Fit the true effects at their true places; None when that is not possible.

    Parameters
    ----------
    d : Diagnosis
        The finished diagnosis: its nominal fit is the start, its trials are the rivals.
    truths : sequence of (effect, element)
        In the order in which they are inserted.
    """
    if d.nominal is None or not d.steps:
        return None
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", RuntimeWarning)
        return _oracle(d, truths, options)


def _oracle(
    d: Diagnosis, truths: Sequence[tuple[str, str]], options: DiagnosisOptions
) -> OracleResult | None:
    assert d.nominal is not None
    fit, trial = d.nominal, None
    source = next((s.name for s in drives(d.graph)), "")
    truths = [(effect, source if place == "clock" else place) for effect, place in truths]
    for effect, element in truths:
        trial = _told(fit, effect, element, options)
        if trial is None:
            return None
        fit = trial.fit
    if trial is None:
        return None
    known = [t for t in d.trials if (t.effect, t.element) in truths] if len(truths) == 1 else []
    # the diagnosis may have found a better minimum for the very same effect
    best = min([trial, *known], key=lambda t: t.test)
    names = {e for e, _ in truths} | {"unknown"}
    rivals = [t for t in d.trials if t.effect not in names and t.home]
    rivals = [t for t in rivals if t.blocks.shape == best.blocks.shape]
    z = min((paired_z(t.blocks, best.blocks) for t in rivals), default=10.0)
    nominal = d.nominal.chi2("test")
    excess = max(nominal - best.test, 1e-9) / max(best.test, 1e-9)
    return OracleResult(
        best.test, best.fit.rmse("test"), float(10 * np.log10(excess)), z,
        paired_z(blocks_of(d.nominal), best.blocks),
    )  # fmt: skip


def _told(fit: object, effect: str, element: str, options: DiagnosisOptions) -> Candidate | None:
    from identification.estimation.single_record import Fit

    assert isinstance(fit, Fit)
    seen = scene(fit)
    kind = by_name(effect)
    ranked = [s for s in screen(seen, probes(fit), (kind,)) if s.element.name == element]
    hint: Hint | None = ranked[0].hint if ranked else None
    try:
        made = kind.insert(seen, fit.problem.graph[element], hint)
    except (BondsightError, KeyError):
        return None
    problem = replace(base_of(fit).template, graph=made.graph)
    _, trial = attempt(made, True, problem)
    return (
        None
        if trial is None
        else finish(go_on(trial, 20)[1] or trial, options.final_iterations, (problem.data.hold,))
    )
