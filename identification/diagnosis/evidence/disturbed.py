"""The decision where the rates of a model move at random: one-step predictions confirm or refute.

Free runs find what may be missing; under process noise they also find what is not, for they wander
off. Each finding has to predict held-out samples one step ahead surely better than the model
without it does, each with process noise of its own; rivals that do as well stay in the set. What
free runs have not told is named only where it leaves innovations without memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from joblib import Parallel, delayed

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.answer import Decision, probability
from identification.diagnosis.evidence.decision import MOST
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.predicted import Predicted, predicted
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.study.study import Study

RIVALS = 9
"""Best trials of a step that are held against what it found."""
NEARLY = 0.8
"""Part of the best one's gain from which what free runs have chosen stays in the set."""


@dataclass(frozen=True, eq=False)
class PredictedDecisions:
    """Decisions after one-step predictions were asked, with those of the last model.

    Attributes
    ----------
    decisions : tuple of Decision
        The last one may say that nothing more shows.
    last : Predicted
        By the model with everything that was named.
    """

    decisions: tuple[Decision, ...]
    last: Predicted


def disturbed(
    study_of: Callable[[Fit], Study],
    nominal: Fit,
    decisions: Sequence[Decision],
    limits: Thresholds,
    jobs: int = 1,
) -> PredictedDecisions:
    """Judge decisions that free runs have made by one-step predictions.

    Parameters
    ----------
    study_of : callable
        Returns the study of a fitted model, with its process noise.
    nominal : Fit
        The model as it is.
    """
    base = predicted(study_of(nominal))
    told: list[Decision] = []
    for step in decisions:
        if step.kind == "explained":
            break
        pool = _pool(step)
        found = Parallel(n_jobs=jobs)(delayed(_alone)(study_of, t.fit) for t in pool)
        scores = {t.label: p for t, p in zip(pool, found, strict=True) if p is not None}
        tried = [t for t in pool if t.label in scores]
        decided = _decided(step, tried, scores, base, limits)
        told.append(decided)
        if decided.kind != "missing_physics" or decided.chosen is None:
            break
        base = scores[decided.chosen.label]
    if not told:
        told.append(_nothing(decisions[-1], base))
    return PredictedDecisions(tuple(told), base)


def _pool(step: Decision) -> list[Candidate]:
    """Return what a step found, and the best of what it tried beside."""
    own = [t for t in step.possible if t.effect != UNNAMED.name]
    more = [t for t in step.trials if t.home and t.itself and t.effect != UNNAMED.name]
    return list({t.label: t for t in (*own, *more[:RIVALS])}.values())


def _alone(study_of: Callable[[Fit], Study], fit: Fit) -> Predicted | None:
    """Return the predictions of one model; None where no filter can carry it."""
    with calm():
        try:
            return predicted(study_of(fit))
        except (BondsightError, ArithmeticError, ValueError):
            return None


def _decided(
    step: Decision,
    tried: Sequence[Candidate],
    scores: Mapping[str, Predicted],
    base: Predicted,
    t: Thresholds,
) -> Decision:
    best = min(tried, key=lambda c: scores[c.label].loss, default=None)
    if best is None:
        return _nothing(step, base)
    if base.behind(scores[best.label]) < t.z:
        return _nothing(step, base, base.behind(scores[best.label]))
    top = scores[best.label]
    members = [c for c in tried if c is best or _stays(c, step, scores[c.label], base, top, t)]
    chosen = step.chosen if any(c is step.chosen for c in members) else best
    assert chosen is not None
    # what contains the chosen law is not excluded, and no rival
    rivals = tuple(
        c for c in members if c is not chosen and chosen.effect not in c.insertion.simpler
    )
    reason = (
        f"with {chosen.label} one-step predictions of held-out samples are better by "
        f"{base.behind(scores[chosen.label]):.1f} standard errors, beside process noise at "
        f"{scores[chosen.label].levels}"
    )
    if rivals:
        reason += "; these do as well: " + ", ".join(c.label for c in rivals)
    found = replace(
        step, chosen=chosen, rivals=rivals, reasons=(reason, *step.reasons),
        answer=_answer(chosen, rivals, step, scores[chosen.label]),
        places=tuple(dict.fromkeys(c.element for c in (chosen, *rivals))),
    )  # fmt: skip
    kinds = {c.insertion.kind for c in (chosen, *rivals)}
    named = found.answer in ("approximate", "family")
    found = replace(
        found, kind="missing_physics" if named else "unknown_physics",
        physics=chosen.insertion.kind if len(kinds) == 1 else "",
    )  # fmt: skip
    return replace(found, confidence=probability(found))


def _stays(
    c: Candidate, step: Decision, own: Predicted, base: Predicted, top: Predicted, t: Thresholds
) -> bool:
    if own.behind(top) < t.z and base.behind(own) >= t.z:
        return True
    return c is step.chosen and base.loss - own.loss > NEARLY * (base.loss - top.loss)


def _answer(chosen: Candidate, rivals: Sequence[Candidate], step: Decision, own: Predicted) -> str:
    if not rivals:
        told = any(c is chosen for c in step.possible)
        return "approximate" if told or own.is_noise else "kind"
    families = {c.insertion.family for c in (chosen, *rivals)}
    if len(families) == 1 and all(c.element == chosen.element for c in rivals):
        return "family"
    return "look_alikes" if len({c.effect for c in (chosen, *rivals)}) <= MOST else "unknown"


def _nothing(step: Decision, base: Predicted, lead: float | None = None) -> Decision:
    """Nothing shows beside process noise, if that is all that is left."""
    reason = f"process noise at {base.levels} explains what free runs leave"
    if lead is not None:
        reason += f": no effect predicts better by more than {max(lead, 0.0):.1f} standard errors"
    quiet = replace(
        step, kind="explained", chosen=None, same_place=(), rivals=(), richer=(), share=0.0,
        confidence=0.0, answer="unknown", physics="", places=(), reasons=(reason,), kinds=(),
        law_fit=float("nan"),
    )  # fmt: skip
    if base.is_noise:
        return quiet
    reason = (
        f"process noise at {base.levels} does not explain it: the past of one-step predictions "
        f"foretells {100 * base.foreseen:.2g} % of what they miss, and no effect predicts better"
    )
    return replace(quiet, kind="unknown_physics", reasons=(reason,))
