"""How the commands behave between samples: chosen for a fit, and how sure that is."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.evidence.block_score import BlockScore, score
from identification.diagnosis.search.beginnings import FIRST
from identification.estimation.holds import UNSURE, beyond, chosen, lateness, possible, tied
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, alone
from identification.estimation.sub_steps import finest_of, settled_fit, tried_from
from identification.estimation.threads import calm
from identification.report.numbers import quantity
from identification.study.problem import Problem
from identification.study.read_after import READ_AFTER
from identification.study.residual import Point, evaluate, slots


def with_best_hold(result: Fit, iterations: int, holds: Sequence[str]) -> Fit:
    """Return the fit under the behaviour of the commands between samples that suits it best.

    A missing lag or delay makes the plain model prefer the wrong behaviour, so every serious
    candidate chooses again; where the behaviour does not show, nothing is refitted.
    """
    best = result
    if not _moves(result):
        return result  # the ends of the record alone would choose
    for hold in possible(holds, result.problem):
        if hold == result.problem.data.hold:
            continue
        problem = _otherwise_held(result, hold, best.problem.n_sub)
        begun = point_under(best, hold)
        cost = evaluate(problem, begun, derivatives=False, scored=True).cost
        if not np.isfinite(cost) or abs(cost - best.cost) < 0.02 * best.cost:
            continue
        try:
            # half a sample more or less is made up for in a few steps, or the behaviour is wrong
            other = tried_from(problem, begun, FIRST)
            if other.status is FitStatus.BROKEN or not rather(other, best):
                continue
            other = settled_fit(problem, iterations, other.point)
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
        if other.status is not FitStatus.BROKEN and rather(other, best):
            best = other
    return best


def point_under(result: Fit, hold: str) -> Point:
    """Return where a fit under another behaviour begins.

    Delays that have made up for readings before or after a step are none there: a reading that
    jumps has a wrong minimum at some part of a sample.
    """
    if READ_AFTER not in (hold, result.problem.data.hold):
        return result.point
    theta = result.point.theta.copy()
    theta[slots(result.problem).lags] = 0.0
    return replace(result.point, theta=theta)


def _moves(result: Fit) -> bool:
    """Whether a command does anything between samples."""
    return any(float(np.ptp(u)) > 0.0 for u in result.problem.data.commands.values())


def rather(other: Fit, best: Fit) -> bool:
    """Whether the commands rather behave as in another fit."""
    return likeliest({f.problem.data.hold: f for f in (best, other)}) is other


def likeliest(fits: Mapping[str, Fit]) -> Fit:
    """Return the fit with the likeliest behaviour of the commands, of one with each."""
    costs = {h: f.cost for h, f in fits.items()}
    alike = tied(costs)
    late = {h: late_sensors(fits[h]) for h in alike} if len(alike) > 1 else {}
    return fits[chosen(costs, USUAL, late)]


def late_sensors(made: Fit) -> float:
    """Return the squared standard errors by which sensors of a fit are late."""
    stack, point = alone(made)
    with calm():
        return lateness(stack, stack.evaluate(point), point)


def hold_margin(result: Fit, holds: Collection[str]) -> str:
    """Say how surely the commands behave between samples as the fit says.

    What predicts better by less than would speak against the behaviour that was chosen
    (`estimation.holds`) is no better one: half a sample of a lag does as much.

    Parameters
    ----------
    holds : collection of str
        Behaviours that were possible.
    """
    own, holds = result.problem.data.hold, possible(holds, result.problem)
    others = [h for h in holds if h != own]
    if not others:
        return "as given"
    if not _moves(result):
        return "no command moves, so it does not show"
    own_score: BlockScore | None = None
    words: list[str] = []
    scored = int(result.problem.data.mask("train").sum()) * len(result.problem.data.names)
    for h in others:
        problem = _otherwise_held(result, h, result.problem.n_sub)
        cost = evaluate(problem, result.point, derivatives=False, scored=True).cost
        # no value moves by more standard errors than the root of what there is to gain
        if abs(cost - result.cost) * scored < UNSURE * result.cost:
            continue
        matters = abs(cost - result.cost) >= A_LITTLE * result.cost
        own_score = own_score or score(tried_from(result.problem, result.point, 0))
        try:
            z = score(tried_from(problem, result.point, A_FEW)).behind(own_score)
            told = _as_well(tried_from(problem, result.point, LONG), result) if z <= SURE else ""
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            z, told = np.inf, ""
        if matters or told:
            words.append(
                f"{h} predicts nothing" if not np.isfinite(z)
                else f"{h} predicts worse by {z:.0f} standard errors" if z > SURE
                else f"{h} predicts as well{told}"
            )  # fmt: skip
    return ", ".join(words) or "another behaviour would change next to nothing"


def _as_well(other: Fit, result: Fit) -> str:
    """Say what another behaviour that predicts as well needs, or else what it would change."""
    if late_sensors(other) > late_sensors(result) + UNSURE:
        delays = (e for e in other.nuisances if e.name.startswith("delay "))
        late = max(delays, key=lambda e: abs(e.value), default=None)
        if late is None:
            return ""
        return f", but only with {late.name} = {quantity(late.value, late.unit)}"
    moved = beyond(result.estimates, other.estimates)
    return f"; with it {moved}" if moved else ""


USUAL = "hold"
"""What a converter does."""
LONG = 30
"""Steps of a fit that says what another behaviour would change."""
A_LITTLE = 0.05
"""Part of the misfit by which another behaviour has to change it to matter."""
A_FEW = 2
"""Steps that make up for half a sample more or less, or the behaviour is wrong."""
SURE = 3.0
"""Standard errors by which another behaviour between samples must predict worse."""


def _otherwise_held(result: Fit, hold: str, n_sub: int) -> Problem:
    """Return the problem of a fit under another behaviour; a band-limited command needs more."""
    finer = max(n_sub, min(max(2 * n_sub, 4), finest_of(result.problem.data.n)))
    data = replace(result.problem.data, hold=hold)
    return replace(result.problem, data=data, n_sub=finer if hold == "band-limited" else n_sub)
