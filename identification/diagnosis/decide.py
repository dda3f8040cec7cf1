"""Name, list look-alikes, or abstain: held-out data decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.diagnosis.effects import by_name
from identification.diagnosis.search import Trial, paired_z
from identification.diagnosis.structure import Structure

Array = np.ndarray


@dataclass(frozen=True)
class Thresholds:
    """Limits of the decision, set on development seeds of the virtual bench and then kept.

    Attributes
    ----------
    mismatch : float
        Held-out mean square over the floor above which the nominal model is in doubt.
    z : float
        Standard errors by which an improvement (or a lead over a rival) must show.
    share : float
        Part of the excess over the floor that a named effect must explain.
    floor : float
        Held-out mean square that counts as the floor, if `near` of the excess is explained.
    simpler : float
        A richer law must remove this part of what a simpler one leaves.
    rival : float
        Another effect within this factor of the best one's remaining excess is a rival.
    confidence : float
        Least confidence of a name.
    """

    mismatch: float = 1.10
    z: float = 3.0
    share: float = 0.9
    floor: float = 1.25
    near: float = 0.7
    simpler: float = 0.3
    rival: float = 1.25
    confidence: float = 0.6


@dataclass(frozen=True)
class Decision:
    """What the evidence supports.

    Attributes
    ----------
    kind : {"explained", "missing_physics", "unknown_physics"}
    chosen : Trial or None
        The named effect, or the best description when nothing may be named.
    richer : tuple of Trial
        Richer forms of the named effect that these data neither need nor exclude.
    same_place : tuple of Trial
        The same effect at other elements, not separable.
    rivals : tuple of Trial
        Other effects that explain the held-out data as well.
    share : float
        Part of the excess misfit that `chosen` explains.
    confidence : float
    reasons : tuple of str
    """

    kind: str
    chosen: Trial | None
    same_place: tuple[Trial, ...]
    rivals: tuple[Trial, ...]
    share: float
    confidence: float
    reasons: tuple[str, ...]
    richer: tuple[Trial, ...] = ()


def decide(
    nominal: float,
    nominal_blocks: Array,
    trials: Sequence[Trial],
    limits: Thresholds | None = None,
    *,
    declared: float = np.inf,
    classes: Structure | None = None,
) -> Decision:
    """Decide from the held-out mean squares of the nominal fit and of all trials.

    Parameters
    ----------
    declared : float
        Held-out mean square with the declared parameters: a repair must beat that too.
    classes : Structure, optional
        Ports that a residual alone cannot separate.
    """
    t = limits or Thresholds()
    excess = nominal - 1.0
    named = [x for x in trials if x.effect != "unknown" and x.home and _present(x)]
    if not named or nominal < t.mismatch:
        return Decision(
            "explained", None, (), (), 0.0, 0.0, (f"held-out misfit {nominal:.3g} times the floor",)
        )
    best = _simplest(min(named, key=lambda x: x.test), named, t)
    away = [x for x in trials if x.effect != "unknown" and not x.home and _present(x)]
    for x in sorted(away, key=lambda x: x.test):
        if x.test - 1 < (1 - t.simpler) * (best.test - 1) and paired_z(best.blocks, x.blocks) > t.z:
            best = x
            break
    gain = paired_z(nominal_blocks, best.blocks)
    drop = (nominal - best.test) / nominal
    if gain < t.z or drop < 0.05:
        reason = (
            f"no effect of the catalogue improves the held-out part clearly ({best.label}: "
            f"z {gain:.1f}, {100 * drop:.1f} %)"
        )
        kind = "explained" if nominal < 1.5 else "unknown_physics"
        return Decision(kind, None, (), (), 0.0, 0.0, (reason,))
    if declared < 1.02 * best.test:
        reason = (
            "the declared parameters already explain the held-out part as well as any effect does"
        )
        return Decision("explained", None, (), (), 0.0, 0.0, (reason,))
    share = (nominal - best.test) / excess if excess > 0 else 0.0
    same, rivals = _alike(best, trials, t)
    same = tuple(dict.fromkeys((*same, *_same_class(best, trials, nominal, share, classes))))
    reasons = [
        f"{best.label} lowers the held-out mean square from {nominal:.4g} to "
        f"{best.test:.4g} times the floor (z {gain:.1f})"
    ]
    enough = share >= t.share or (best.test < t.floor and share >= t.near)
    if not enough:
        reasons.append(
            f"it explains {100 * share:.0f} % of the excess, {100 * t.share:.0f} % are "
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
    richer = _richer(best, trials, t)
    if richer:
        reasons.append("not needed but not excluded: " + ", ".join(r.label for r in richer))
    return Decision(kind, best, same, rivals, min(share, 1.0), confidence, tuple(reasons), richer)


def _present(x: Trial) -> bool:
    """Whether the effect's strength differs from zero at 95 %."""
    found = {e.name: e for e in x.fit.estimates}
    for n in x.insertion.strengths:
        e = found.get(n)
        if e is not None and (e.ci95[0] > 0 or e.ci95[1] < 0):
            return True
    return False


def _simplest(best: Trial, named: Sequence[Trial], t: Thresholds) -> Trial:
    """Return a simpler effect at the same place when the richer one adds little."""
    for name in by_name(best.effect).simpler:
        for x in named:
            if x.effect == name and x.element == best.element:
                if (x.test - best.test) < t.simpler * max(
                    x.test - 1.0, 0.0
                ) or x.test < best.test * 1.02:
                    return x
    return best


def _alike(
    best: Trial, trials: Sequence[Trial], t: Thresholds
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    same, rivals = [], []
    richer = {x.effect for x in trials if best.effect in by_name(x.effect).simpler}
    for x in trials:
        if x is best or not _present(x):
            continue
        close = paired_z(x.blocks, best.blocks) < t.z or (x.test - 1) < t.rival * (best.test - 1)
        close = close and (x.test - 1) < 2.0 * max(best.test - 1, 0.05)
        if not close:
            continue
        if x.effect == best.effect:
            same.append(x)
        elif x.effect != "unknown" and x.effect not in richer and x.home:
            rivals.append(x)
    return tuple(same), tuple(rivals)


def _richer(best: Trial, trials: Sequence[Trial], t: Thresholds) -> tuple[Trial, ...]:
    return tuple(
        x
        for x in trials
        if x.element == best.element
        and best.effect in by_name(x.effect).simpler
        and x.test <= best.test * 1.02 + 0.02
    )


def _same_class(
    best: Trial, trials: Sequence[Trial], nominal: float, share: float, classes: Structure | None
) -> tuple[Trial, ...]:
    """Return the effect at other ports of the class, where it explains practically as much.

    Within a class only the shape of the law speaks; a percent or two of the misfit is no evidence
    for a place.
    """
    if classes is None or nominal <= 1:
        return ()
    group = classes.class_of(best.element)
    return tuple(
        x
        for x in trials
        if x.effect == best.effect
        and x.element != best.element
        and x.element in group
        and (nominal - x.test) / (nominal - 1) > max(0.9, share - 0.02)
    )


def _confidence(best: Trial, trials: Sequence[Trial], share: float, t: Thresholds) -> float:
    """From the lead over the best other effect and the share explained; at most 0.99."""
    # a richer form of the same law is no rival: it caps the confidence instead
    nested = {x.effect for x in trials if best.effect in by_name(x.effect).simpler}
    others = [x for x in trials if x.home and x.effect not in {best.effect, "unknown", *nested}]
    lead = min((paired_z(x.blocks, best.blocks) for x in others), default=10.0)
    certainty = 1.0 - 0.5 * float(np.exp(-max(lead, 0.0) / t.z))
    if _richer(best, trials, t):
        certainty = min(certainty, 0.7)
    return float(np.clip(certainty * min(1.0, 0.5 + 0.5 * share), 0.0, 0.99))
