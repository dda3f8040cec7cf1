"""What a fit reaches that is told the effect and its place: the least error one can ask for."""

from __future__ import annotations

import math
import statistics
import time
import traceback
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bondgraph.signals.split import kept_back
from bondgraph.support.errors import BondsightError
from hardware.simulators.judging.outcome import ExamOutcome
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.judged import judged_on
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import attempt, finish, go_on
from identification.diagnosis.search.material import material_of
from identification.diagnosis.search.nominal import (
    held_to_residual,
    nominal_fit,
    seen_in_training,
)
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.study.factors import drives
from tests.proof.exam.said import read_each
from tests.proof.trial.commitment import verify
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import Progress, graph_of, recording_of, run_all
from tests.proof.trial.truths import Public

STEPS = 20
"""Further steps of a fit that has begun, and as many to finish it."""

KNOWN = frozenset(e.name for e in CATALOGUE)

Reached = Mapping[str, float]
"""Held-out rms of each reading, SI; nothing where the truth could not be fitted."""


@dataclass(frozen=True, slots=True)
class _Oracle:
    """Work for one recording; travels to the processes with the truths."""

    truths: Mapping[str, ExamTruth]

    def __call__(self, layout: Layout, public: Public, seed: int) -> dict[str, Any]:
        """Fit the true law at the true place."""
        begin = time.process_time()
        content: dict[str, Any] = {"id": public.id, "error": None, "rms": {}}
        effects = self.truths[public.id].effects
        try:
            with calm(), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                content["rms"] = told(layout, public, effects)
        except BondsightError as error:
            content["error"] = " ".join(str(error).split())
        except Exception:  # listed, and left out of the ratio
            content["error"] = traceback.format_exc(limit=-6)
        return content | {"cpu_seconds": round(time.process_time() - begin, 3)}


def told(layout: Layout, public: Public, effects: Sequence[ConcealedEffect]) -> Reached:
    """Return what the declared model with the true effects leaves, each at the best of its places.

    The strongest is fitted first; a further one that cannot be fitted is left out, as is one that
    does not gain.
    """
    asked = asked_of(graph_of(public), recording_of(layout, public), None, public.hold, {})
    material = material_of(asked)
    if material.reason:
        return {}
    problem = asked.problem(material.data)
    nominal = nominal_fit(asked.graph, material.data, asked.hold, problem)[1]
    nominal = held_to_residual(nominal, material.given)
    if material.usual:
        nominal = seen_in_training(problem, nominal, asked.hold, Thresholds().noise)
    # judged by the samples that a diagnosis shows its gain on
    seen, unseen = kept_back(nominal.problem.data.split)
    nominal = judged_on(nominal, seen)
    source = next((s.name for s in drives(asked.graph)), "")
    last = nominal
    for e in sorted(effects, key=lambda e: -e.moved):
        places = sorted({source if p == "clock" else p for p in e.places})
        fitted = [f for p in places if (f := _inserted(last, e.effect, p)) is not None]
        if last is not nominal:
            fitted.append(last)
        elif not fitted:
            return {}
        last = min(fitted, key=lambda f: f.chi2("test"))
    best = judged_on(last, unseen)
    left = {name: float(v) for name, v in best.rmse("test").items()}
    return left if all(map(math.isfinite, left.values())) else {}


def _inserted(last: Fit, effect: str, element: str) -> Fit | None:
    """Fit the effect at the element, begun where the screening points; None if it cannot be."""
    if effect not in KNOWN:
        return None
    seen, kind = scene(last), by_name(effect)
    ranked = [s for s in screen(seen, probes(last), (kind,)) if s.element.name == element]
    hint: Hint | None = ranked[0].hint if ranked else None
    try:
        made = kind.insert(seen, last.problem.graph[element], hint)
    except (BondsightError, KeyError):
        return None
    problem = replace(base_of(last).template, graph=made.graph)
    _, trial = attempt(made, True, problem)
    if trial is None:
        return None
    return finish(go_on(trial, STEPS)[1] or trial, STEPS, (problem.data.hold,)).fit


def to_ask(public: Sequence[Public], truths: Mapping[str, ExamTruth]) -> tuple[Public, ...]:
    """Return the recordings with one effect of the catalogue."""
    singles = {i for i, t in truths.items() if t.single and t.main and t.main.effect in KNOWN}
    return tuple(p for p in public if p.id in singles)


def ask_oracles(
    layout: Layout,
    public: Sequence[Public],
    truths: Mapping[str, ExamTruth],
    *,
    jobs: int = -1,
    progress: Progress | None = None,
) -> int:
    """Fit the truth of every recording with one effect of the catalogue; resumes.

    Raises
    ------
    UnusableInput
        Some are to be asked, and data or tool are not those of the commitment.
    """
    asked = to_ask(public, truths)
    if any(not (layout.oracle / f"{p.id}.json").exists() for p in asked):
        verify(layout)
    return run_all(layout, asked, layout.oracle, _Oracle(truths), jobs=jobs, progress=progress)


def read_oracles(layout: Layout) -> dict[str, Reached]:
    """Read what the oracles reached, by recording."""
    return read_each(layout.oracle, lambda content: content.get("rms") or {})


def repair_ratio(o: ExamOutcome, best: Reached) -> float:
    """Held-out error after the repair over the oracle's, geometric mean of the readings.

    Without a repair the error of the model as it is counts: abstention is no way round it.
    """
    return _over(o.answer.repaired or o.answer.nominal, best)


def oracle_ratio(o: ExamOutcome, best: Reached) -> float:
    """Held-out error of the oracle over the noise: how good the yardstick itself is."""
    return _over(best, o.truth.noise)


def _over(reached: Reached, best: Reached) -> float:
    """Geometric mean of the ratios of the readings that both have; nan without any."""
    both = [n for n in best if best[n] > 0 and reached.get(n, 0.0) > 0]
    logs = [math.log(reached[n] / best[n]) for n in both]
    return math.exp(sum(logs) / len(logs)) if logs else math.nan


def quantiles(values: Sequence[float]) -> dict[str, float]:
    """Return the 10th, 25th, 50th, 75th and 90th percentile; empty below two values."""
    if len(values) < 2:
        return {}
    cuts = statistics.quantiles(values, n=20, method="inclusive")
    return {f"{p} %": cuts[p // 5 - 1] for p in (10, 25, 50, 75, 90)}
