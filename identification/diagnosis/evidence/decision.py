"""Name, list look-alikes, or abstain: held-out data decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import spearmanr

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.residual_pattern import ResidualPattern
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit
from identification.statistics.blocks import paired_z


@dataclass(frozen=True)
class Thresholds:
    """Limits of the decision, set on development seeds and then kept.

    Attributes
    ----------
    mismatch : float
        Held-out mean square over the floor above which the nominal model is in doubt.
    z : float
        Standard errors by which an improvement (or a lead over a rival) must show.
    drop : float
        Least part of the held-out misfit that an effect must remove.
    share : float
        Part of the explicable excess that a named effect must explain.
    simpler : float
        A richer law must remove this part of what a simpler one leaves.
    rival : float
        Another effect within this factor of the best one's remaining excess is a rival.
    pattern, pattern_z : float
        Part of the remaining misfit and standard errors from which a pattern is looked at.
    exact, exact_z : float
        A pattern beside a repair says that the law is another one, if it would remove this part of
        what the repair has removed, and shows by so many standard errors.
    still : float
        Part of the remaining misfit below which nothing is left but noise.
    least, clean : float
        Where only noise is left, a share of `least` of the excess over the floor counts as `clean`.
    active : float
        Standard errors by which what is left may follow the motion and still be noise.
    loud : float
        Standard errors from which a misfit that follows the motion is physics.
    again, part : float
        Least part of the held-out misfit, and of that before any effect, that a further one must
        remove: laws of real things are never quite those of the catalogue.
    strange : float
        Standard errors from which a pattern that no effect explains is physics, not noise.
    certain : float
        Robust misfit over a measured floor that is no noise, even if nothing explains it.
    confidence : float
        Least confidence of a name.
    """

    mismatch: float = 1.05
    z: float = 3.0
    drop: float = 0.02
    share: float = 0.85
    simpler: float = 0.3
    rival: float = 1.25
    pattern: float = 0.05
    pattern_z: float = 2.5
    exact: float = 0.03
    exact_z: float = 3.5
    still: float = 0.02
    least: float = 0.5
    clean: float = 0.95
    active: float = 2.5
    loud: float = 3.5
    again: float = 0.1
    part: float = 0.01
    strange: float = 3.5
    certain: float = 1.5
    confidence: float = 0.6


@dataclass(frozen=True, eq=False)
class Decision:
    """What the evidence supports.

    Attributes
    ----------
    kind : {"explained", "missing_physics", "unknown_physics"}
    chosen : Candidate or None
        The named effect, or the best description when nothing may be named.
    richer : tuple of Candidate
        Richer forms of the named effect that these data neither need nor exclude.
    same_place : tuple of Candidate
        The same effect at other elements, not separable.
    rivals : tuple of Candidate
        Other effects that explain the held-out data as well.
    share : float
        Part of the excess misfit that `chosen` explains.
    confidence : float
    reasons : tuple of str
    left : ResidualPattern or None
        What a second screening finds in the residual of `chosen`.
    trials : tuple of Candidate
        All that was fitted for this decision.
    nominal : float
        Held-out mean square over the floor before this decision.
    complete : bool
        `chosen` explains enough for a name; only its rivals may forbid one.
    ample : bool
        `chosen` removes as much of the misfit as a name needs, whatever else speaks against it.
    """

    kind: str
    chosen: Candidate | None
    same_place: tuple[Candidate, ...]
    rivals: tuple[Candidate, ...]
    share: float
    confidence: float
    reasons: tuple[str, ...]
    richer: tuple[Candidate, ...] = ()
    left: ResidualPattern | None = None
    trials: tuple[Candidate, ...] = ()
    nominal: float = float("nan")
    complete: bool = False
    ample: bool = False

    @property
    def possible(self) -> tuple[Candidate, ...]:
        """The best description and its rivals."""
        return self.rivals if self.chosen is None else (self.chosen, *self.rivals)

    @property
    def answer(self) -> str:
        """What kind of answer it is: ``exact``, ``family``, ``look_alikes`` or ``unknown``.

        A family or a set of look-alikes is an answer only if its members explain the misfit; where
        the exact law is another one, at most the family is.
        """
        if self.kind == "missing_physics":
            return "exact"
        alike = {t.effect for t in self.possible}
        if self.complete and alike:
            return (
                "family" if len(alike) == 1 else "look_alikes" if len(alike) <= MOST else "unknown"
            )
        return "family" if self.ample and self._families_agree else "unknown"

    @property
    def family(self) -> str:
        """Family of what is missing; ``outside`` where none can be given."""
        known = self.answer != "unknown" and self._families_agree
        return self.possible[0].insertion.family if known else "outside"

    @property
    def _families_agree(self) -> bool:
        return len({t.insertion.family for t in self.possible}) == 1


MOST = 3
"""More effects than this are no set of look-alikes but nothing known."""
Remaining = Callable[[Candidate], ResidualPattern]


def decide(
    nominal: float,
    nominal_blocks: Array,
    trials: Sequence[Candidate],
    limits: Thresholds | None = None,
    *,
    declared: float = np.inf,
    before: ResidualPattern | None = None,
    certain: float = 0.0,
    further: bool = False,
    whole: float = 0.0,
    remaining: Remaining | None = None,
    classes: Isolability | None = None,
) -> Decision:
    """Decide from the held-out mean squares of the nominal fit and of all trials.

    Parameters
    ----------
    declared : float
        Held-out mean square with the declared parameters: a repair must beat that too.
    before : ResidualPattern, optional
        What the screening finds in the nominal residual.
    certain : float
        Robust mean square of the nominal residual over a floor that was measured; 0 where the floor
        is only an estimate.
    further : bool
        Effects have been named before this one.
    whole : float
        Held-out mean square before any of them.
    remaining : callable, optional
        Screens the residual of a trial once more.
    classes : Isolability, optional
        Ports that a residual alone cannot separate.
    """
    t = limits or Thresholds()
    named = [x for x in trials if x.effect != UNNAMED.name and x.home]
    quiet = Decision("explained", None, (), (), 0.0, 0.0, (), nominal=nominal, trials=tuple(trials))
    if not named:
        return _without_name(
            quiet, nominal, before, certain, t, "no effect of the catalogue is present"
        )
    level = min(1.0, *(x.test for x in trials))
    best = _simplest(min(named, key=lambda x: x.test), named, level, t)
    away = [x for x in trials if x.effect != UNNAMED.name and not x.home]
    for x in sorted(away, key=lambda x: x.test):
        if (
            x.test - level < (1 - t.simpler) * (best.test - level)
            and paired_z(best.blocks, x.blocks) > t.z
        ):
            best = x
            break
    gain = paired_z(nominal_blocks, best.blocks)
    drop = (nominal - best.test) / nominal
    little = nominal - best.test < t.part * (whole - level) if further else drop < t.drop
    if further and drop < t.again:
        little = True
    if gain < t.z or little or nominal < t.mismatch * level:
        reason = (
            f"no effect of the catalogue improves the held-out part clearly ({best.label}: "
            f"z {gain:.1f}, {100 * drop:.1f} %)"
        )
        return _without_name(quiet, nominal, before, certain, t, reason)
    if declared < 1.02 * best.test:
        reason = (
            "the declared parameters already explain the held-out part as well as any effect does"
        )
        return replace(quiet, reasons=(reason,))
    left = remaining(best) if remaining else None
    share = explained_share(nominal, best, left, level, t)
    same, rivals = _alike(best, trials, level, t)
    same = tuple(dict.fromkeys((*same, *_same_class(best, trials, nominal, level, share, classes))))
    reasons = [
        f"{best.label} lowers the held-out mean square from {nominal:.4g} to "
        f"{best.test:.4g} times the floor (z {gain:.1f})"
    ]
    if left is not None and left.share > t.pattern:
        reasons.append(left.words())
    enough = share >= t.share
    beside = 0.0 if left is None or left.z < t.exact_z else left.share * best.test
    if enough and beside > t.exact * (nominal - best.test):
        enough = False
        reasons.append("what is left follows a pattern: the law is another one, or not the only")
    bare = _better_without_name(best, trials, t)
    if enough and bare is not None:
        enough = False
        reasons.append(
            f"an unnamed curve at {bare.element} describes the held-out part better "
            f"({bare.test:.4g} times the floor): the law is another one"
        )
    if not enough:
        reasons.append(
            f"it explains {100 * share:.0f} % of what can be explained, {100 * t.share:.0f} % are "
            "needed for a name"
        )
    if rivals:
        reasons.append("as good on held-out data: " + ", ".join(r.label for r in rivals))
    confidence = _confidence(best, trials, share, t) if enough and not rivals else 0.0
    sure = confidence >= t.confidence
    if enough and not rivals and not sure:
        reasons.append(
            f"the lead over the next effect is too small for a name (confidence {confidence:.2f})"
        )
    kind = "missing_physics" if sure else "unknown_physics"
    richer = _richer(best, trials)
    if richer:
        reasons.append("not needed but not excluded: " + ", ".join(r.label for r in richer))
    return Decision(
        kind, best, same, rivals, min(share, 1.0), confidence, tuple(reasons), richer, left,
        tuple(trials), nominal, enough, share >= t.share,
    )  # fmt: skip


def _without_name(
    quiet: Decision,
    nominal: float,
    before: ResidualPattern | None,
    certain: float,
    t: Thresholds,
    reason: str,
) -> Decision:
    """Nothing of the catalogue helps: noise, or physics outside of it."""
    strange = before is not None and before.z > t.strange and before.share > 0.05
    if strange and nominal > 1.3:
        assert before is not None
        return replace(quiet, kind="unknown_physics", reasons=(reason, before.words()), left=before)
    if certain > t.certain:
        above = f"the misfit of {certain:.3g} times the floor is no noise"
        return replace(quiet, kind="unknown_physics", reasons=(reason, above), left=before)
    return replace(quiet, reasons=(reason,))


def explained_share(
    nominal: float, best: Candidate, left: ResidualPattern | None, level: float, t: Thresholds
) -> float:
    """Part of the excess that `best` explains.

    The excess counts from the floor (from `level`, if something comes below it), or from what is
    left when no pattern shows in it any more: coloured noise lies above a floor that was read from
    the top of the spectrum.
    """
    share = (nominal - best.test) / max(nominal - level, 1e-12)
    noise = left is not None and left.share < t.still and not best.fit.problem.data.floor_measured
    if noise and share > t.least and activity(best.fit) < t.active:
        share = max(share, t.clean)
    return share


def activity(fit: Fit) -> float:
    """Return the standard errors by which the misfit is larger where more moves.

    Noise does not know what the model does; physics left out mostly follows it.
    """
    data = fit.problem.data
    inside = data.mask("train") | data.mask("test")
    r = ((data.readings - fit.simulated)[inside] / data.floor) ** 2
    found = []
    for c in range(r.shape[1]):
        y = fit.simulated[inside, c]
        stretches = [s for s in np.array_split(np.arange(y.size), ACTIVITY) if s.size > 4]
        misfit = np.array([np.log(np.mean(r[s, c]) + 1e-300) for s in stretches])
        for signal in (y - np.mean(y), np.gradient(y)):
            motion = np.array([np.mean(signal[s] ** 2) for s in stretches])
            if np.ptp(motion) > 0:
                rho = float(spearmanr(motion, misfit).statistic)
                found.append(rho * np.sqrt(len(stretches) - 1))
    return max(found, default=0.0)


ACTIVITY = 40
"""Stretches in which motion and misfit are compared."""


def _better_without_name(
    best: Candidate, trials: Sequence[Candidate], t: Thresholds
) -> Candidate | None:
    """Return the unnamed curve that beats the best law clearly, if there is one."""
    for x in trials:
        gap = best.test - x.test
        ahead = x.effect == UNNAMED.name and gap > t.simpler * max(best.test - 1.0, 0.02)
        if ahead and paired_z(best.blocks, x.blocks) > t.z:
            return x
    return None


def _simplest(
    best: Candidate, named: Sequence[Candidate], level: float, t: Thresholds
) -> Candidate:
    """Return a simpler effect at the same place when the richer one adds little."""
    for name in best.insertion.simpler:
        for x in named:
            if x.effect == name and x.element == best.element:
                if (x.test - best.test) < t.simpler * max(
                    x.test - level, 0.0
                ) or x.test < best.test * 1.02:
                    return x
    return best


def _alike(
    best: Candidate, trials: Sequence[Candidate], level: float, t: Thresholds
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    same, rivals = [], []
    nested = richer_names(best, trials)
    for x in trials:
        if x is best:
            continue
        above, own = x.test - level, best.test - level
        close = paired_z(x.blocks, best.blocks) < t.z or above < t.rival * own
        close = close and above < 2.0 * max(own, 0.05 * level)
        if not close:
            continue
        if x.effect == best.effect:
            same.append(x)
        elif x.effect != UNNAMED.name and x.effect not in nested and x.home:
            rivals.append(x)
    return tuple(same), tuple(rivals)


def richer_names(best: Candidate, trials: Sequence[Candidate]) -> set[str]:
    """Names of effects among `trials` that contain the best one as a special case."""
    return {
        x.effect for x in trials if x.effect != UNNAMED.name and best.effect in x.insertion.simpler
    }


def _richer(best: Candidate, trials: Sequence[Candidate]) -> tuple[Candidate, ...]:
    nested = richer_names(best, trials)
    return tuple(
        x
        for x in trials
        if x.element == best.element and x.effect in nested and x.test <= best.test * 1.02 + 0.02
    )


def _same_class(
    best: Candidate,
    trials: Sequence[Candidate],
    nominal: float,
    level: float,
    share: float,
    classes: Isolability | None,
) -> tuple[Candidate, ...]:
    """Return the effect at other ports of the class, where it explains practically as much.

    Within a class only the shape of the law speaks; a percent or two of the misfit is no evidence
    for a place.
    """
    if classes is None or nominal <= level:
        return ()
    group = classes.class_of(best.element)
    return tuple(
        x
        for x in trials
        if x.effect == best.effect
        and x.element != best.element
        and x.element in group
        and (nominal - x.test) / (nominal - level) > max(0.9, share - 0.02)
    )


def _confidence(best: Candidate, trials: Sequence[Candidate], share: float, t: Thresholds) -> float:
    """From the lead over the best other effect and the share explained; at most 0.99."""
    # a richer form of the same law is no rival: it caps the confidence instead
    nested = richer_names(best, trials)
    others = [x for x in trials if x.home and x.effect not in {best.effect, UNNAMED.name, *nested}]
    lead = min((paired_z(x.blocks, best.blocks) for x in others), default=10.0)
    certainty = 1.0 - 0.5 * float(np.exp(-max(lead, 0.0) / t.z))
    if _richer(best, trials):
        certainty = min(certainty, 0.7)
    return float(np.clip(certainty * min(1.0, 0.5 + 0.5 * share), 0.0, 0.99))
