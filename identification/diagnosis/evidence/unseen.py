"""What samples that no selection has seen say of a law that training found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.diagnosis.evidence.foretold import REFUTED
from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kinds_told import SHAPELESS
from identification.diagnosis.evidence.shares import ANYTHING


def refuted(rival: Scored, chosen: Scored, e: Evidence, t: Thresholds) -> bool:
    """Whether `chosen` predicts samples that no fit has seen, and a rival clearly does not.

    Beside a rest a rival's failure may be as much an accident as the gain is; beside a small one
    it is sure if the rival predicts worse than the model without it.
    """
    worse = rival.trial.test > REFUTED * chosen.trial.test
    least = t.noise * (SMALL if rival.trial.test > e.nominal else 1.0)
    sure = chosen.left.most <= least
    return worse and sure and replicated(chosen, e) and not replicated(rival, e)


SMALL = 2.0
"""Times the limit of noise that a rest may have and be small."""


def replicated(chosen: Scored, e: Evidence) -> bool:
    """Whether samples that no selection has seen gain as well, a part as much at least."""
    gained = e.trained - chosen.trial.train
    noise = min(1.0, chosen.trial.train)
    # the noise of unseen samples is none that could be gained, nor may all of them be called noise
    there = max(e.nominal - noise, 0.5 * e.nominal)
    least = 0.5 if e.named else 0.25
    return e.nominal - chosen.trial.test > least * min(gained, there)


def of_training(members: Sequence[Scored], e: Evidence, t: Thresholds) -> bool:
    """Whether only courses in time improve what is noise on either part: outliers do that."""
    quiet = e.before.is_noise(t.noise) and e.trained <= t.noise**2
    return quiet and all(s.trial.insertion.kind in SHAPELESS for s in members)


def agreed(members: Sequence[Scored], e: Evidence) -> bool:
    """Whether several recordings train, and every law in question does much in each of them.

    Then something of their kinds acts where they sit, though yet another recording wants other laws
    of it: one recording alone may mislead all of its stretches. What may follow anything says
    nothing.
    """
    rows = e.plain.out.rows
    run = np.searchsorted(members[0].trial.fit.problem.data.starts, rows.sample, side="right")
    count, before = np.bincount(run), np.bincount(run, e.plain.out.residual**2)
    left = [np.bincount(run, s.score.out.residual**2) for s in members]
    if np.count_nonzero(count) < 2 or any(s.trial.insertion.kind in ANYTHING for s in members):
        return False
    return bool(np.all(np.stack(left) <= MUCH * before))


MUCH = 0.5
"""Part of a recording's misfit that a law leaves at most if it does much there."""


def borne_out(law: Scored, e: Evidence, t: Thresholds) -> bool:
    """Whether held-out samples are no noise without a law, and do not contradict it.

    What shows in few stretches may leave a number of the law open: then it predicts badly, but can
    still be true of both parts. Of a mere course in time that says nothing.
    """
    if law.trial.insertion.kind in SHAPELESS or e.nominal <= t.noise**2:
        return False
    train = law.trial.train
    return train <= t.noise**2 and law.trial.added <= max(1.0, train)
