"""All trials against each other, and in words why each one lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.localisation.recording.region import multiple
from identification.diagnosis.search.candidates import Candidate
from identification.report.numbers import times_noise
from identification.report.words import spaced
from identification.statistics.blocks import paired_z


@dataclass(frozen=True)
class Standing:
    """One trial in the table.

    Attributes
    ----------
    role : str
        ``winner``, ``alike``, ``lost`` or ``locates`` (an unnamed curve).
    why : str
        Why it won or lost.
    z : float
        Standard errors by which it lies behind the best one.
    share : float
        Part of the excess misfit that it explains.
    """

    trial: Candidate
    role: str
    why: str
    z: float
    share: float


def standings(d: Diagnosis, step: Decision | None = None) -> tuple[Standing, ...]:
    """Every trial of a step (of the first when not given), best held-out score first."""
    step = step or d.decision
    trials = (step.trials if step else ()) or (d.trials if step is d.decision else ())
    if d.nominal is None or not trials or step is None:
        return ()
    nominal = nominal_misfit(d, step)
    chosen = step.chosen
    ranked = sorted(
        (_same(t, chosen) for t in trials), key=lambda t: (not np.isfinite(t.test), t.test)
    )
    first = chosen or ranked[0]
    # a floor that was read too high must not make shares of more than everything
    excess = nominal - min(1.0, first.test)
    found = []
    for t in ranked:
        share = (nominal - t.test) / excess if excess > 0 else 0.0
        z = paired_z(t.blocks, first.blocks) if t.blocks.size == first.blocks.size else float("nan")
        found.append(Standing(t, *_why(d, step, t, nominal, z, share), z, share))
    return tuple(found)


def nominal_misfit(d: Diagnosis, step: Decision) -> float:
    """Held-out misfit before a step, over the floor."""
    if np.isfinite(step.nominal):
        return float(step.nominal)
    return d.nominal.chi2("test") if d.nominal is not None else float("nan")


def _same(t: Candidate, chosen: Candidate | None) -> Candidate:
    """Return `t`; the chosen effect is shown as refitted on all training samples."""
    return chosen if chosen is not None and t.label == chosen.label else t


def strength_shown(t: Candidate) -> bool:
    """Whether one of the parameters that make the effect differs from zero at 95 %."""
    found = {e.name: e.ci95 for e in t.fit.estimates}
    return any(n in found and (found[n][0] > 0 or found[n][1] < 0) for n in t.insertion.strengths)


def _why(
    d: Diagnosis, step: Decision, t: Candidate, nominal: float, z: float, share: float
) -> tuple[str, str]:
    chosen = step.chosen
    if t is chosen:
        named = d.kind == "missing_physics" and step.kind == "missing_physics"
        if named and step.answer not in ("exact", "approximate"):
            return "winner", "the best of what may be named"
        return "winner", "named" if named else "closest, but not certain enough for a name"
    if t.effect == "unknown":
        return "locates", "a curve without a name: shows where, not what"
    if any(t is x for x in step.same_place):
        return "alike", "same effect, equally good here: these sensors cannot tell"
    if any(t is x for x in step.rivals):
        return "alike", "as good on held-out data: not excluded"
    if not strength_shown(t):
        return "lost", UNSURE if share > LITTLE else "its strength does not differ from zero"
    if t.test >= 0.98 * nominal:
        return "lost", "does not improve the held-out samples"
    if chosen is None:
        if share > ALMOST:
            return "lost", "explains nearly all of the misfit, but not certain enough for a name"
        return "lost", f"explains only {100 * share:.0f} % of the misfit"
    if t.insertion.contains(chosen.insertion):
        return "lost", f"richer, yet hardly better than {spaced(chosen.effect)}"
    if z < -d.limits.z:
        return "lost", f"leaves less, yet a freer form at {chosen.element} does better than it"
    if t.test <= chosen.test * 1.02 and not t.home:
        return "lost", "an unusual place for it, and no clear gain over the usual one"
    if t.test <= chosen.test * 1.02:
        return "lost", "not clearly better than the simpler one"
    if z < 0.5:
        return "lost", "about as good on average, but the named one is simpler or more usual"
    if not t.test > 1.0:
        return "lost", f"leaves more than {spaced(chosen.effect)}"  # neither lies above the noise
    return "lost", f"leaves {multiple(times_noise(t.test) / times_noise(chosen.test))} as much"


ALMOST = 0.985
"""Share that is nearly all."""
LITTLE = 0.1
"""Share of the misfit below which what an effect explains is no reason to wonder."""
UNSURE = "its parameters are not determined: the interval of each reaches zero"
"""Why one that explains more than that is no name."""


def title(t: Candidate) -> str:
    """Text such as ``dry friction at F_v``."""
    what = "unnamed curve" if t.effect == "unknown" else spaced(t.effect)
    return f"{what} at {t.element}"
