"""One effect after the other: screen, fit, decide, repair; then whether each is still needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from identification.diagnosis.catalogue import UNNAMED, Effect
from identification.diagnosis.evidence.decision import Decision, Thresholds, activity, decide
from identification.diagnosis.evidence.residual_pattern import ResidualPattern, strongest
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.mixups import gross
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, screen
from identification.diagnosis.search.base import Base, base_of
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    blocks_of,
    finish,
    search,
)
from identification.estimation.single_record import Fit

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class SelectionStage:
    """Decisions in order, with the scene and the screening they started from."""

    decisions: tuple[Decision, ...]
    scene: FittedModel
    ranking: tuple[Screened, ...]


class _Screenings:
    """Screenings made so far: what is left beside a repair is where the next step begins."""

    def __init__(self, catalogue: tuple[Effect, ...], plain: BondGraph) -> None:
        self.catalogue, self.plain = catalogue, plain
        self.known: dict[int, tuple[Fit, FittedModel, list[Screened]]] = {}

    def of(self, fit: Fit) -> tuple[FittedModel, list[Screened]]:
        """Scene and ranking of one fit."""
        if id(fit) not in self.known:
            seen = scene(fit)
            self.known[id(fit)] = (fit, seen, screen(seen, probes(fit, self.plain), self.catalogue))
        return self.known[id(fit)][1:]


def steps(
    base: Base,
    options: DiagnosisOptions,
    limits: Thresholds,
    declared: float,
    classes: Isolability,
    say: Progress,
) -> SelectionStage:
    """Look for one effect after another until nothing more shows."""
    decisions: list[Decision] = []
    done = _Screenings((*options.catalogue, UNNAMED), base.fit.problem.with_offsets)
    first: tuple[FittedModel, tuple[Screened, ...]] | None = None
    whole = base.fit.chi2("test")
    for number in range(max(1, options.effects)):
        low = 0.12 + 0.8 * number / max(1, options.effects)
        say("screening every effect at every port", low)
        seen, ranked = done.of(base.fit)
        if first is None:
            first = seen, tuple(ranked)
        decision = _step(base, done, options, limits, declared, classes, say, low, number, whole)
        decisions.append(decision)
        if decision.chosen is None or not (
            decision.kind == "missing_physics" or _promising(decision, number, options)
        ):
            break
        base = base_of(decision.chosen.fit)
        declared = float("inf")
    assert first is not None
    return SelectionStage(_together(decisions, limits), *first)


def _promising(decision: Decision, number: int, options: DiagnosisOptions) -> bool:
    """Whether one of two effects may have been found: a clear lead, but not enough alone."""
    alone = decision.kind == "unknown_physics" and not decision.rivals and decision.share > HALF
    return number == 0 and alone and options.effects > 1


HALF = 0.3
"""Part of the excess that the stronger one of two effects explains at least."""


def _together(decisions: list[Decision], limits: Thresholds) -> tuple[Decision, ...]:
    """Name the first effect after all if a second one explains the rest of the misfit."""
    first = decisions[0]
    if first.kind == "missing_physics" or len(decisions) < 2:
        return tuple(decisions)
    named = [d for d in decisions[1:] if d.kind == "missing_physics" and d.chosen is not None]
    if not named or len(named) < len([d for d in decisions[1:] if d.kind != "explained"]):
        return (first,)
    last = named[-1].chosen
    assert last is not None
    level = min(1.0, *(t.test for d in decisions for t in d.trials))
    share = (first.nominal - last.test) / max(first.nominal - level, 1e-12)
    if share < limits.share:
        return (first,)
    sure = replace(
        first, kind="missing_physics", confidence=0.9 * min(d.confidence for d in named),
        reasons=(*first.reasons, f"together with {last.label} it explains {100 * share:.0f} %"),
        complete=True,
    )  # fmt: skip
    return (sure, *decisions[1:])


def _step(
    base: Base,
    done: _Screenings,
    options: DiagnosisOptions,
    limits: Thresholds,
    declared: float,
    classes: Isolability,
    say: Progress,
    low: float,
    number: int,
    whole: float,
) -> Decision:
    seen, ranked = done.of(base.fit)
    nominal = base.fit.chi2("test")
    before = strongest(ranked, limits.pattern_z)
    span = 0.8 / max(1, options.effects)

    def tell(text: str, fraction: float) -> None:
        say(text, low + span * fraction)

    # without a pattern there is nothing to explain: what is left is noise
    certain = robust_misfit(base.fit) if base.fit.problem.data.floor_measured else 0.0
    if nominal > limits.certain and (activity(base.fit) > limits.loud or gross(base.fit)):
        certain = max(certain, nominal)
    # after a repair only a clear rest is worth another search
    little = number > 0 and (before.share < limits.pattern or before.z < limits.z)
    faint = (
        little or (before.z < limits.z and before.share < 0.2) or before.share < 0.5 * limits.drop
    )
    if faint and certain < limits.certain:
        return Decision(
            "explained", None, (), (), 0.0, 0.0,
            (f"held-out misfit {nominal:.3g} times the floor, no pattern in the residual",),
            left=before, nominal=nominal,
        )  # fmt: skip
    trials = search(seen, base.template, ranked, options, tell)
    trials = _finished(trials, options)

    def remaining(trial: Candidate) -> ResidualPattern:
        return strongest(done.of(trial.fit)[1], limits.pattern_z)

    return decide(
        nominal, blocks_of(base.fit), trials, limits, declared=declared,
        before=before, certain=certain, further=number > 0, whole=whole, remaining=remaining,
        classes=classes,
    )  # fmt: skip


def robust_misfit(fit: Fit) -> float:
    """Mean square over the floor as the median tells it: a few outliers are no misfit."""
    r = fit.residuals("test") / fit.problem.data.floor
    return float((np.median(np.abs(r)) / 0.6745) ** 2)


def _finished(trials: list[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Fit the best few to the end: those that the decision will compare."""
    if not trials:
        return trials
    best = min(t.train for t in trials)
    close = [t for t in trials if t.train < 1.5 * best][:4]
    done = [finish(t, options.final_iterations, options.holds) for t in close]
    rest = [t for t in trials if not any(t is c for c in close)]
    return sorted([*done, *rest], key=lambda t: t.test)
