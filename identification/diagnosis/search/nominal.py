"""Fit the model as it is: what holds between samples, which windows, which minimum."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import eig

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.signals.recording import Split
from bondgraph.signals.split import interleaved, stretches
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.structural_classes import linear_part
from identification.diagnosis.search.hold_choice import A_LITTLE, likeliest, point_under
from identification.diagnosis.search.windowed import through_windows
from identification.estimation.holds import possible
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, best, fit
from identification.estimation.sub_steps import FINEST, fit_from, settled_fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.read_after import BEHAVIOURS
from identification.study.residual import evaluate


def integrates(graph: BondGraph) -> bool:
    """Whether a constant command makes a reading run away: an eigenvalue at zero that both reach.

    Springs in a ring leave a combination of displacements that nothing moves; it does no harm.
    """
    try:
        a, b, c, *_ = linear_part(graph)
    except (BondsightError, TypeError):
        return False
    if not a.size or not np.isfinite(a).all():
        return False
    values, left, right = eig(a, left=True, right=True)
    size = max(float(np.abs(values).max()), float(np.sqrt(np.abs(a).max())) or 1.0)
    for i in np.flatnonzero(np.abs(values) < 1e-9 * size):
        driven = np.abs(left[:, i].conj() @ b) > 1e-9 * np.linalg.norm(b, axis=0)
        seen = np.abs(c @ right[:, i]) > 1e-9 * np.linalg.norm(c, axis=1)
        if driven.any() and seen.any():
            return True
    return False


def nominal_fit(
    graph: BondGraph, data: Data, hold: str | None = None, asked: Problem | None = None
) -> tuple[Problem, Fit]:
    """Fit the model as it is; returns the problem to start candidates from, and the fit.

    `asked` says what is free, known and added by the measuring chain, where a study does.

    Every plant is judged on whole records, each from one initial state: short windows throw away
    what happens slowly. Those that integrate get an offset of each command, and start from windows;
    others are tried from the declared values, and through short windows that have no wrong minima
    when a resonance starts at the wrong frequency.
    """
    runs_away = integrates(graph)
    base = replace(asked or Problem(graph, data), graph=graph, data=data)
    base = replace(base, source_offsets=runs_away or base.source_offsets, built=None)
    base = replace(base, built=base.dynamics)
    result = _fine(_integrating(base) if runs_away else _first_fit(base))
    if hold:
        if hold != data.hold:
            result = held_otherwise(result, hold, base.n_sub)
        result = to_its_end(result)
        result = revived(result)
        return result.problem, result
    fits = {data.hold: result}
    for h in possible(BEHAVIOURS, base):
        if h not in fits and _shows(result, h, base.n_sub):
            fits[h] = held_otherwise(result, h, base.n_sub)
    # a converter holds; every law that is fitted later chooses again
    result = likeliest(fits)
    if result.problem.data.hold == "band-limited":
        problem = replace(result.problem, n_sub=max(4, result.problem.n_sub))
        finer = fit_from(problem, result.point, 25)
        if finer.cost < 0.98 * result.cost:
            result = finer
    result = revived(to_its_end(result))
    return result.problem, result


def revived(result: Fit) -> Fit:
    """Return a better fit in which what has vanished begins as declared again.

    A number whose logarithm has run far off changes nothing any more, so that no step brings it
    back; others have taken its place, delays of the sensors most of all: they wait.
    """
    base, lost = result.problem, _lost(result)
    if not lost:
        return result
    own = {n: v for n, v in result.values.items() if n in base.graph.parameters}
    kept = {n: v for n, v in own.items() if n not in lost}
    try:
        found = fit(replace(base, starts=kept, lags=False), max_iterations=LONG)
        if base.lags and found.status is not FitStatus.BROKEN:
            found = fit(
                replace(base, starts={n: found.values[n] for n in own}), max_iterations=LONG
            )
        if found.status is FitStatus.BROKEN:
            return result
        found = _fine(_rebased(base, found))
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return result
    rows = int(base.data.mask("train").sum()) * len(base.data.names)
    gained = rows * (result.cost - found.cost)
    return found if gained > max(1.0, found.cost) else result


FAR = 5.0
"""Times the declared value, or a part of it, from which a number that is not told is lost."""


def _lost(result: Fit) -> set[str]:
    """Return positive parameters far from their declared values that the data do not tell."""
    if result.status is FitStatus.BROKEN:
        return set()
    starts = {f.parameter.name: f.start for f in result.problem.free if f.log}
    return {
        e.name for e in result.estimates
        if e.name in starts and not 1.0 / FAR <= e.value / starts[e.name] <= FAR
        and not e.ci95[1] < np.exp(4.0) * e.ci95[0]
    }  # fmt: skip


def to_its_end(result: Fit) -> Fit:
    """Go on with a fit that ran out of steps: what a step more would mend is not missing."""
    if result.status is not FitStatus.ITERATIONS:
        return result
    again = fit_from(result.problem, result.point, LONG)
    return again if again.cost <= result.cost else result


LONG = 150
"""Steps in which a descent along a valley ends; most fits take a tenth of it."""


def seen_in_training(asked: Problem, nominal: Fit, hold: str | None, noise: float) -> Fit:
    """Divide the record into finer stretches if what the model misses is in held-out ones only.

    What happens rarely could not be fitted, and so not be named. The model as it is decides, before
    any effect is tried.

    Parameters
    ----------
    noise : float
        Residual over the noise up to which nothing is missed.
    """
    data = nominal.problem.data
    for split in _finer(data):
        if not _unseen(nominal, noise):
            break
        finer = nominal_fit(asked.graph, replace(data, split=split), hold, asked)[1]
        if finer.status is FitStatus.BROKEN or not np.isfinite(finer.cost):
            break
        nominal = finer
    return nominal


def split_that_shows(repaired: Fit, noise: float) -> Split | None:
    """Return finer stretches whose training samples show what only held-out ones do now.

    The coarsest that show a fair part of it; None where nothing hides, or where none show it.
    """
    if not _unseen(repaired, noise):
        return None
    found = None
    for split in _finer(repaired.problem.data):
        problem = replace(repaired.problem, data=replace(repaired.problem.data, split=split))
        seen = replace(repaired, problem=problem)
        if seen.chi2("train") > noise**2:
            found = split
            if seen.chi2("train") > FAIR * seen.chi2("test"):
                break
    return found


FAIR = 0.1
"""Misfit of the training samples over that of the others that tells enough of a law."""


def _unseen(result: Fit, noise: float) -> bool:
    """Whether training samples are at the noise, and held-out ones far above it."""
    return result.chi2("train") <= noise**2 and result.chi2("test") > 2 * noise**2


def _finer(data: Data) -> Iterator[Split]:
    train = stretches(data.split.train)
    begin, present = min(p.start for p in train), 1.5 * len(train)  # a third is held out
    for count in FINER:
        if count > present and data.n - begin >= SHORTEST * count:
            yield replace(interleaved(begin, data.n, count), rest=data.split.rest)


FINER = (90, 270)
"""Stretches tried in turn; thirty are usual."""
SHORTEST = 10
"""Samples of a stretch at least."""


def _with_hold(result: Fit, hold: str, n_sub: int) -> Problem:
    data = replace(result.problem.data, hold=hold)
    steps = max(n_sub, 2 if hold == "band-limited" else 1)
    return replace(result.problem, data=data, n_sub=steps)


def held_otherwise(result: Fit, hold: str, n_sub: int) -> Fit:
    """Fit again under another behaviour of the commands."""
    problem, begun = _with_hold(result, hold, n_sub), point_under(result, hold)
    return _fine(fit(problem, start=begun, max_iterations=25))


def _fine(result: Fit) -> Fit:
    """Refine the sub-steps of a model with laws: what a step gets wrong must not look missing."""
    if result.problem.dynamics.exact_step or result.status is FitStatus.BROKEN:
        return result
    return settled_fit(result.problem, 15, result.point, FINEST)


def _shows(result: Fit, hold: str, n_sub: int) -> bool:
    """Whether another behaviour between samples changes the misfit at all."""
    problem = _with_hold(result, hold, n_sub)
    cost = evaluate(problem, point_under(result, hold), derivatives=False, scored=True).cost
    # what a refit can gain is bounded by how much the misfit moves
    return np.isfinite(cost) and abs(cost - result.cost) > A_LITTLE * result.cost


def _first_fit(base: Problem) -> Fit:
    """Fit from the declared values, and through windows that grow, each with its own state."""
    fits = [fit(base, max_iterations=25)]
    if base.window is not None or fits[0].cost < GOOD:
        return fits[0]
    if not base.dynamics.exact_step:
        return _calmed(base, fits[0])
    length = max(24, 8 * base.dynamics.n_x)
    inside = np.flatnonzero(base.data.mask("train"))
    begin, end = int(inside[0]), int(inside[-1]) + 1
    few = slice(begin, min(end, begin + FEW))
    short = replace(base.data.split, train=few, test=slice(few.stop, few.stop))
    data = replace(base.data, split=short)
    values: dict[str, float] = {}
    while length < (end - begin) // 3 and length < 1000:
        brief = replace(
            base,
            data=data,
            window=length,
            initial="free",
            starts=values,
            lags=False,
            offsets=False,
            clock=0.0,  # clocks reach over the edges of windows
            fixed=(*base.fixed, *base.skews),
            built=base.dynamics,
        )
        found = fit(brief, max_iterations=8, judged=False)
        if found.status is FitStatus.BROKEN:
            break
        values = {k: v for k, v in found.values.items() if k in base.graph.parameters}
        length *= 5
    if values:
        fits.append(fit(replace(base, starts=values), max_iterations=25))
    result = best(fits)
    return result if result.problem is base else _rebased(base, result)


def _calmed(base: Problem, result: Fit) -> Fit:
    """Fit with weak laws first if those declared make the model run away from the readings.

    A law that pushes does that, and no step leads back: numbers of either sign, as coefficients
    are, begin near zero then. Another minimum has to be clearly the better one.
    """
    known = {**base.graph.parameters, **base.overrides}
    declared = {
        n: replace(p, scale=p.scale or abs(p.value))
        for n, p in known.items()
        if p.value and not (p.positive or p.fixed or n in base.fixed)
    }
    if not declared or result.cost < NO_USE * _spread(base.data):
        return result
    weak = {n: WEAK * p.value for n, p in declared.items()}
    calm = replace(base, starts={**base.starts, **weak}, overrides={**base.overrides, **declared})
    other = fit(calm, max_iterations=25)
    return other if other.cost < DEEPER * result.cost else result


WEAK = 1e-3
"""Part of a law's coefficients that is begun with where all of it runs away."""
NO_USE = 0.3
"""Part of the readings' own spread, squared, above which a fit explains next to nothing."""


def _spread(data: Data) -> float:
    """Variance of the readings over the squared floor, in the mean."""
    y = data.readings[data.mask("train")]
    return float(np.mean(np.var(y, axis=0) / data.floor**2))


def _integrating(base: Problem) -> Fit:
    """Fit a plant that runs away: on windows first, then in one piece from there."""
    fits = [fit(base, max_iterations=25)]
    from_there = through_windows(base, 25)
    if from_there is not base:
        fits.append(_rebased(base, fit(from_there, max_iterations=25)))
    return best([f for f in fits if f.status is not FitStatus.BROKEN] or fits)


def held_to_residual(result: Fit, given: Collection[str] = ()) -> Fit:
    """Lower every noise that was read higher than what the fit leaves, and fit again.

    No noise is larger than the residual of a model: a floor above it was read off something else,
    and weighs its reading too little.

    Parameters
    ----------
    given : collection of str
        Readings whose noise the user has stated: it stays.
    """
    for clearly in CLEARLY:
        floor, before = _left_of(result, given), result.problem.data.floor
        if (floor > clearly * before).all():
            return result
        again = weighed_by(result, np.where(floor > clearly * before, before, floor))
        if again.status is FitStatus.BROKEN:
            return result
        result = again
    return result


def _left_of(result: Fit, given: Collection[str]) -> Array:
    """Return every noise, no higher than what the fit leaves of its reading."""
    data, r = result.problem.data, result.residuals("train")
    freedom = len(result.problem.free) + result.point.states.size
    if r.shape[0] < FEWEST * freedom:
        return data.floor
    level = np.sqrt(np.sum(r**2, axis=0) / (r.shape[0] - freedom))
    least = np.maximum(data.readings.std(axis=0), np.finfo(float).tiny) * LEAST
    # a rounded reading says no more, even where the model rounds as well
    steps = np.array([data.resolution.get(n, 0.0) for n in data.names])
    least = np.maximum(least, steps / np.sqrt(12.0))
    known = np.array([n in given for n in data.names])
    return np.where(known, data.floor, np.fmin(data.floor, np.maximum(level, least)))


def weighed_by(result: Fit, floor: Array) -> Fit:
    """Fit again from there, every reading weighed by another noise, shape (n_y,)."""
    data = replace(result.problem.data, floor=floor)
    return fit_from(replace(result.problem, data=data), result.point, LONG)


def misread(best: Fit, given: Collection[str] = ()) -> Array | None:
    """Return the noise where the best law leaves far less of a reading than was read, else None.

    Such a reading has weighed too little in all fits and comparisons: they are made again.
    """
    before = best.problem.data.floor
    if (_left_of(best, given) > FAR_LESS * before).all():
        return None
    floor = held_to_residual(best, given).problem.data.floor
    return None if np.array_equal(floor, before) else floor


def as_searched(nominal: Fit, base: Fit) -> Fit:
    """Return the model as it is on all samples, as a search came to see it: fit and noise."""
    if base.problem.data.n == nominal.problem.data.n:
        return base
    hold = base.problem.data.hold
    if hold != nominal.problem.data.hold:
        nominal = held_otherwise(nominal, hold, nominal.problem.n_sub)
    found, floor = deeper(nominal, base.values) or nominal, base.problem.data.floor
    if np.array_equal(floor, found.problem.data.floor):
        return found
    again = weighed_by(found, floor)
    return found if again.status is FitStatus.BROKEN else again


FAR_LESS = 0.5
"""Part of a noise that a law leaves where the noise was misread."""


def deepest(
    first: Fit, lowered: Fit, problem_of: Callable[[Data], Problem], hold: str | None
) -> Fit:
    """Return the fit by the lowered noise from where it ended, or one that begins anew.

    A noise that was read too high calls a minimum good that is not: no other one was looked for.
    """
    data = first.problem.data
    if (lowered.problem.data.floor > CLEARLY[0] * data.floor).all():
        return lowered
    problem = problem_of(replace(data, floor=lowered.problem.data.floor))
    again = nominal_fit(problem.graph, problem.data, hold, problem)[1]
    sound = again.status is not FitStatus.BROKEN
    return again if sound and again.cost < DEEPER * lowered.cost else lowered


CLEARLY = (0.7, 0.95, 0.95)
"""Parts of a noise below which the residual contradicts it: as it was read, and once it has been
lowered, for what is weighed more is followed more closely."""
FEWEST = 10
"""Samples for each degree of freedom below which a residual says nothing of the noise."""
LEAST = 1e-6
"""Smallest noise over what moves: no reading is finer."""


def deeper(result: Fit, values: Mapping[str, float]) -> Fit | None:
    """Return a clearly better fit of the same model from other values; None if there is none.

    A candidate that explains the record may owe it to its parameters alone: the nominal fit was
    then caught in a minimum of its own (at a bound, or in a valley of parameters that the sensors
    do not tell apart), and nothing is missing.
    """
    base = result.problem
    own = {k: v for k, v in values.items() if k in base.graph.parameters}
    found = fit(replace(base, starts=own), max_iterations=40)
    if found.status is FitStatus.BROKEN or not found.cost < DEEPER * result.cost:
        return None
    return _rebased(base, found)


DEEPER = 0.9
"""Part of the misfit that another minimum leaves at most."""
GOOD = 1.3
"""Misfit over the floor at which no other minimum is looked for."""
FEW = 2000
"""Samples that the windows cover."""


def _rebased(base: Problem, result: Fit) -> Fit:
    """Express the fit from the declared start values, so that points can be shared."""
    theta, values = result.point.theta.copy(), result.values
    theta[: len(base.free)] = [f.theta(values[f.parameter.name]) for f in base.free]
    return replace(result, problem=base, point=replace(result.point, theta=theta))
