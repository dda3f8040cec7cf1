"""Fit what the screening found promising: every serious effect at every serious place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from bondgraph.support.parallel import results
from bondgraph.support.spelled import spelled
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED, Effect, Insertion
from identification.diagnosis.catalogue.measurement.sensor_gain import SensorGainEffect
from identification.diagnosis.evidence.replication import added, scatter
from identification.diagnosis.screening.carried import FAR, astray
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.beginnings import (
    FIRST,
    best_first,
    freed,
    misfit_at,
    promising,
    resting,
    tells_early,
)
from identification.diagnosis.search.hold_choice import with_best_hold
from identification.diagnosis.search.nominal import GOOD, to_its_end
from identification.diagnosis.search.windowed import through_windows
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit, judge
from identification.estimation.sub_steps import (
    begun_from,
    eased,
    fit_from,
    refined,
    settled_fit,
)
from identification.estimation.threads import calm
from identification.report.numbers import times_noise
from identification.statistics.blocks import block_means
from identification.study.data import Data
from identification.study.factors import stated_gains
from identification.study.problem import Problem
from identification.study.read_after import BEHAVIOURS
from identification.study.residual import Point, start_point

BLOCKS = 40
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect at one place after its fit.

    Attributes
    ----------
    home : bool
        The place is a usual one for the effect.
    train, test : float
        Mean square residual over the floor.
    blocks : ndarray, shape (BLOCKS,)
        The same on consecutive parts of the held-out samples.
    """

    insertion: Insertion
    home: bool
    fit: Fit
    train: float
    test: float
    blocks: Array

    @property
    def label(self) -> str:
        """Text such as ``hysteresis at C_nl``."""
        return self.insertion.label

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.insertion.effect

    @property
    def element(self) -> str:
        """Place of the effect."""
        return self.insertion.element

    @property
    def itself(self) -> bool:
        """Whether the fitted law is still what its name says."""
        return self.insertion.is_itself(self.fit.values)

    @property
    def misstated(self) -> bool:
        """Whether it is a gain, beyond its bounds, of a sensor whose calibration was stated."""
        if self.effect != SensorGainEffect.name:
            return False
        return self.element in stated_gains(self.fit.problem.with_chain)

    @cached_property
    def added(self) -> float:
        """What held-out samples add to the misfit, beyond its scatter; see `replication.added`."""
        return added(self.fit) / (1.0 + SURE * scatter(self.fit))


SURE = 3.0
"""Standard deviations of the scatter that held-out samples may show."""


def blocks_of(result: Fit, part: str = "test") -> Array:
    """Mean square weighted residual on consecutive parts of the held-out samples."""
    r = result.residuals(part) / result.problem.data.floor
    square = np.mean(r**2, axis=1)
    return block_means(square, BLOCKS)


@spelled
@dataclass(frozen=True)
class DiagnosisOptions:
    """Cost of the search and what may be named.

    Attributes
    ----------
    jobs : int
        Processes; -1 for all cores. The joblib backend in force is used.
    keep : int
        Candidates of the linear screening that are fitted first.
    more : int
        Rivals of the best one that are fitted after them.
    samples : int
        A longer record is thinned for the search where that loses nothing.
    effects : int
        How many effects are looked for, one after the other.
    without : tuple of str
        Effects that may not be named.
    extra : tuple of Effect
        Effects of the user beside the catalogue.
    holds : tuple of str
        Behaviours of the commands between samples that may be chosen; one where it is known.

    Examples
    --------
    >>> quick = DiagnosisOptions(effects=1, without=("coulomb_friction",))
    >>> quick.effects, quick.samples
    (1, 24000)
    """

    jobs: int = -1
    keep: int = 8
    more: int = 4
    final_iterations: int = 30
    samples: int = 24000
    effects: int = 3
    without: tuple[str, ...] = ()
    extra: tuple[Effect, ...] = ()
    holds: tuple[str, ...] = BEHAVIOURS

    @property
    def catalogue(self) -> tuple[Effect, ...]:
        """Effects that may be named."""
        return (*(e for e in CATALOGUE if e.name not in self.without), *self.extra)


def search(
    scene: FittedModel,
    template: Problem,
    ranked: Sequence[Screened],
    options: DiagnosisOptions,
    progress: Progress | None = None,
) -> list[Candidate]:
    """Fit the best of `ranked`, then the rivals of the best one; best held-out score first.

    `template` holds the data (thinned if that loses nothing) and how to score them.
    """
    first = _selection(ranked, options.keep, scene.nominal.chi2("train") > OFF)
    plain = [s for s in first if s.effect.plain]
    trials = fitted(scene, template, plain, options, progress, 0.0, 0.15) if plain else []
    rest = [s for s in first if s not in plain]
    ahead = min(trials, key=lambda t: t.train, default=None)
    beat = np.inf if ahead is None else ahead.train
    if ahead is not None and beat < EXPLAINED:
        # a linear element was left out: what looks like it, two others and the curve are enough
        alike = _alike(ahead, ranked)
        rest = [
            s for k, s in enumerate(rest)
            if k < FEW or s.effect.name in alike or s.effect.name == UNNAMED.name
        ]  # fmt: skip
    first = [*plain, *rest]
    trials += fitted(scene, template, rest, options, progress, 0.15, 0.65, beat)
    named = [t for t in trials if t.effect != UNNAMED.name]
    if named:
        best = min(named, key=lambda t: t.train)
        done = {(t.effect, t.element) for t in trials} | {
            (s.effect.name, s.element.name) for s in first
        }
        second = rivals_of(best, ranked, done, options.more)
        trials += fitted(scene, template, second, options, progress, 0.65, 1.0, best.train)
    test = scene.data.mask("test")
    trials = [t for t in trials if np.isfinite(t.fit.simulated[test]).all()]
    return sorted(trials, key=lambda t: t.test)


EXPLAINED = 1.3
"""Training misfit, over the noise's, that is hardly more than noise."""
FEW = 2
"""Others that are fitted beside a linear element that explains everything."""
COSTLY = 4
"""Place in the ranking up to which costly effects are fitted."""


def _selection(ranked: Sequence[Screened], keep: int, far: bool) -> list[Screened]:
    """Best ones, not more than four of a kind, the best unnamed curve, and what is plain.

    That is where the model is `far` off: its course may be one of a model without it.
    """
    chosen: list[Screened] = []
    for place, s in enumerate(ranked):
        if s.effect.name == UNNAMED.name or s.hint is None or (s.effect.costly and place >= COSTLY):
            continue
        if sum(c.effect.name == s.effect.name for c in chosen) < 4:
            chosen.append(s)
        if len(chosen) == keep:
            break
    chosen += [s for s in ranked if s.effect.name == UNNAMED.name and s.hint is not None][:1]
    plain = [s for s in ranked if far and s.effect.plain and s not in chosen]
    return [*chosen, *plain[:PLAIN]]


OFF = 4.0
"""Training misfit from which a whole element may be lacking that the screening ranks late."""
PLAIN = 4
"""Linear elements that a model may lack altogether, at most: they are quickly fitted."""


def rivals_of(
    best: Candidate, ranked: Sequence[Screened], done: set[tuple[str, str]], more: int
) -> list[Screened]:
    """Return what is known to be confused with the best, and the same effect elsewhere."""
    alike = _alike(best, ranked)
    top = max((s.share for s in ranked), default=0.0)
    left = [
        s
        for s in ranked
        if (s.effect.name, s.element.name) not in done
        and s.effect.name != UNNAMED.name
        and not s.effect.costly
    ]
    here = [s for s in left if s.effect.name in alike and s.element.name == best.element]
    same = [s for s in left if s.effect.name == best.effect and s.share > 0.5 * top]
    near = [s for s in left if s.effect.name in alike and s.share > 0.5 * top]
    return list(dict.fromkeys([*here, *same, *near]))[:more]


def _alike(best: Candidate, ranked: Sequence[Screened]) -> set[str]:
    """Effects confused with one, either way, simpler and richer forms included."""
    found = {*best.insertion.confused_with, *best.insertion.simpler}
    return found | {
        s.effect.name for s in ranked if best.effect in (*s.effect.confused_with, *s.effect.simpler)
    }


def fitted(
    scene: FittedModel,
    template: Problem,
    todo: Sequence[Screened],
    options: DiagnosisOptions,
    progress: Progress | None = None,
    begin: float = 0.0,
    end: float = 1.0,
    beat: float = np.inf,
) -> list[Candidate]:
    """Fit in rounds: all a little, the better half more, the best to the end.

    `beat` is the training misfit of what is fitted already.
    """
    made = []
    for s in todo:
        for hint in s.hints:
            with suppress(BondsightError):
                made.append((s.effect.insert(scene, s.element, hint), s.home))
    return each_once(fitted_insertions(scene, template, made, options, progress, begin, end, beat))


def each_once(trials: Sequence[Candidate]) -> list[Candidate]:
    """Return the better fit of every law at every place."""
    best: dict[tuple[str, str], Candidate] = {}
    for t in trials:
        at = (t.effect, t.element)
        if at not in best or t.train < best[at].train:
            best[at] = t
    return list(best.values())


def fitted_insertions(
    scene: FittedModel,
    template: Problem,
    made: Sequence[tuple[Insertion, bool]],
    options: DiagnosisOptions,
    progress: Progress | None = None,
    begin: float = 0.0,
    end: float = 1.0,
    beat: float = np.inf,
) -> list[Candidate]:
    """Fit insertions as `fitted` does, each with whether it is at a usual place."""
    far, lost, plain = scene.nominal.chi2("train") > FAR, astray(scene.nominal), misfit_at(template)
    early = not lost and tells_early(scene.nominal)
    quick = replace(eased(template), built=None, known_scale=template.known_scale)
    tasks = [
        (m, home, replace(quick, graph=m.graph), far, lost, plain, early, template.n_sub)
        for m, home in made
    ]
    alive = _round(attempt, tasks, options, progress, begin, begin + 0.5 * (end - begin))
    done: list[Candidate] = []
    for number, iterations in enumerate(ROUNDS, start=1):
        alive.sort(key=lambda t: t.train)
        best = min([beat, *(t.train for t in alive)])
        keep = max(4, len(alive) // 2)
        # what is far above a fit at the floor will not get there
        hopeful = [t for t in alive[:keep] if t.train < HOPELESS[number - 1] * best + 0.5]
        done += [t for t in alive if not any(t is h for h in hopeful)]
        rest = [(t, iterations) for t in hopeful]
        low = begin + (end - begin) * (0.5 + 0.5 * (number - 1) / len(ROUNDS))
        alive = _round(go_on, rest, options, progress, low, low + 0.25 * (end - begin))
    return [*alive, *done]


ROUNDS = (8, 14)
"""Further steps of the fits that go on after the first short ones."""
HOPELESS = (10.0, 4.0)
"""Training misfit, over the best one's, from which a candidate is not followed."""


def _round(
    work: Callable[..., tuple[str, Candidate | None]],
    tasks: Sequence[tuple[Any, ...]],
    options: DiagnosisOptions,
    progress: Progress | None,
    begin: float,
    end: float,
) -> list[Candidate]:
    found: list[tuple[str, Candidate]] = []
    made = results((delayed(alone)(work, *t) for t in tasks), options.jobs)
    for done, (label, trial) in enumerate(made, start=1):
        if trial is not None:
            found.append((label, trial))
        if progress is not None:
            level = "" if trial is None else f": {times_noise(trial.train):.4g} times the noise"
            progress(f"fitting {label}{level}", begin + (end - begin) * done / len(tasks))
    return [t for _, t in sorted(found, key=lambda pair: pair[0])]


def alone(work: Callable[..., Any], *arguments: Any) -> Any:
    """Run one fit in its process: one thread, no overflow warnings from absurd trial steps."""
    with calm():
        return work(*arguments)


def attempt(
    insertion: Insertion,
    home: bool,
    problem: Problem,
    far: bool = True,
    lost: bool = False,
    plain: float = np.inf,
    early: bool = False,
    n_sub: int | None = None,
) -> tuple[str, Candidate | None]:
    """Fit one insertion a few steps from its best starts; None when it cannot be simulated.

    `far`: the nominal fit may be bent so much that the declared values are tried as well. `lost`:
    it does not follow the readings at all, so that the fit starts from short windows too. `plain`:
    what `start_cost` says of the model without the law. `early`: the first samples of a long record
    tell which start is the best. `n_sub`: sub-steps of what is found, where starts are tried with
    fewer.
    """
    short: list[Fit] = []
    begin = begun_from if n_sub in (None, problem.n_sub) else beside
    try:
        problem = replace(problem, built=problem.dynamics)
    except BondsightError:
        return insertion.label, None
    starts = promising(problem, insertion, far, plain)
    loses_way = problem.source_offsets or bool(insertion.courses)
    quick = early and not loses_way
    begun = best_first(starts) if quick else [(p, None) for p in starts]
    for number, (candidate, point) in enumerate(begun):
        try:
            short.append(begin(candidate, point or start_point(candidate), FIRST))
            held = problem.dynamics.jumps and problem.source_offsets
            if far and held and problem.initial == "free":
                still = resting(candidate)
                short.append(begin(still, start_point(still), FIRST))
            if point is not None and sound(short[0]):
                break  # the others only where it runs away on the rest of the record
            # windows forgive a start: one way through them is enough of the fitted values, one of
            # the declared ones; where the fit follows nothing no start is known to be any good,
            # but those of a lacking element are of every size already
            either = number in (0, len(begun) - 1)
            if (lost and not insertion.plain) or ((lost or loses_way) and either):
                again = through_windows(candidate, 3 * FIRST, insertion)
                short.append(begin(again, start_point(again), FIRST))
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    short = [r for r in short if sound(r)]
    if not short:
        return insertion.label, None
    best = min(short, key=lambda r: r.cost)
    if n_sub is not None and n_sub != problem.n_sub:
        whole = replace(best.problem, n_sub=n_sub, correction=None, built=problem.dynamics)
        best = begun_from(whole, best.point, FIRST)
        if not sound(best):
            return insertion.label, None
    return insertion.label, trial_of(insertion, home, judge(best))


def beside(problem: Problem, start: Point, iterations: int) -> Fit:
    """Go a few steps beside the correction that a problem has."""
    return fit(problem, start=start, max_iterations=iterations, judged=False)


def go_on(trial: Candidate, iterations: int) -> tuple[str, Candidate | None]:
    """Continue a fit, with sub-steps as fine as its residual asks for."""
    try:
        if trial.fit.status in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS):
            result = refined(trial.fit, iterations)
        else:
            result = settled_fit(trial.fit.problem, iterations, trial.fit.point)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return trial.label, trial
    better = sound(result) and result.cost <= trial.fit.cost * 1.05
    return trial.label, trial_of(trial.insertion, trial.home, result) if better else trial


def trial_of(insertion: Insertion, home: bool, result: Fit) -> Candidate:
    """Score a finished fit."""
    return Candidate(
        insertion, home, result, result.chi2("train"), result.chi2("test"), blocks_of(result)
    )


def sound(r: Fit) -> bool:
    """Whether a fit came to an end with a finite misfit."""
    return r.status is not FitStatus.BROKEN and bool(np.isfinite(r.cost))


def finished(trials: Sequence[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Go on with every trial from where the search stopped, in their order."""
    work = (delayed(alone)(finish, t, options.final_iterations, options.holds) for t in trials)
    return list(Parallel(n_jobs=options.jobs)(work))


def finish(trial: Candidate, iterations: int, holds: Sequence[str] = BEHAVIOURS) -> Candidate:
    """Go on from where the search stopped."""
    try:
        # a new start may still lead on from where a descent crept, but not where it was stuck
        if trial.fit.status is FitStatus.NO_PROGRESS:
            result = refined(trial.fit, iterations)
        else:
            result = settled_fit(trial.fit.problem, iterations, trial.fit.point)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return trial
    if result.status is FitStatus.BROKEN:
        return trial
    # few sub-steps may flatter the wrong behaviour of a command: then another one is right
    best = freed(with_best_hold(result, iterations, holds), iterations)
    better = best.cost <= trial.fit.cost * 1.001
    return trial_of(trial.insertion, trial.home, best) if better else trial


def to_their_ends(trials: Sequence[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Go on with the best, and those near it, that ran out of steps while they still came closer.

    What a valley leaves half way is no second effect, and its values are nobody's.
    """
    best = min((t.train for t in trials), default=np.inf)
    going = [
        t for t in trials
        if t.fit.status is FitStatus.ITERATIONS and t.train < NEAR * best and t.train > GOOD
    ]  # fmt: skip
    work = (delayed(alone)(_on, t) for t in going)
    made = dict(zip((t.label for t in going), Parallel(n_jobs=options.jobs)(work), strict=True))
    return [made.get(t.label, t) for t in trials]


NEAR = 1.5
"""Times the misfit of the best law up to which another one is as likely to be it."""


def _on(trial: Candidate) -> Candidate:
    try:
        return trial_of(trial.insertion, trial.home, to_its_end(trial.fit))
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return trial


def not_worse(trials: Sequence[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Fit laws again that do worse than one they contain: from where that one ended.

    A law that holds another as a special case cannot explain less; its fit stopped too early. So
    may have done that of a simpler law than the best one: what the richer law has more may be
    nothing.
    """
    best = min(trials, key=lambda t: t.train, default=None)
    ends = {i: _simpler_ended(t, trials) or _richer_ended(t, best) for i, t in enumerate(trials)}
    work = {i: (trials[i], end) for i, end in ends.items() if end is not None}
    found = Parallel(n_jobs=options.jobs)(
        delayed(alone)(_from_there, *w, options.final_iterations) for w in work.values()
    )
    again = dict(zip(work, found, strict=True))
    return [again.get(i, t) for i, t in enumerate(trials)]


STOPPED = 0.999
"""Part of a law's misfit below which a law it contains shows that its fit stopped early."""


def _simpler_ended(trial: Candidate, trials: Sequence[Candidate]) -> Fit | None:
    """Return where the best simpler law that does better ended."""
    better = [
        s for s in trials
        if trial.insertion.contains(s.insertion)
        and s.train < STOPPED * trial.train
    ]  # fmt: skip
    return min(better, key=lambda s: s.train).fit if better else None


def _richer_ended(trial: Candidate, best: Candidate | None) -> Fit | None:
    """Return where the best law ended, if it holds this one as a special case and does better."""
    if best is None or not best.insertion.contains(trial.insertion):
        return None
    return best.fit if best.train < STOPPED * trial.train else None


def _from_there(trial: Candidate, end: Fit, iterations: int) -> Candidate:
    """Fit a law from where another one ended, with as many sub-steps as that."""
    hold = end.problem.data.hold
    known = {n: v for n, v in end.values.items() if n in trial.fit.problem.graph.parameters}
    problem = replace(
        trial.fit.problem, n_sub=4 if hold == "band-limited" else 1, correction=None,
        data=replace(trial.fit.problem.data, hold=hold),
        starts={**trial.fit.problem.starts, **known},
    )  # fmt: skip
    many = max(trial.fit.problem.n_sub, end.problem.n_sub)
    for begun in dict.fromkeys((problem.n_sub, many)):  # few may run away where many do not
        try:
            again = settled_fit(replace(problem, n_sub=begun), iterations)
            if sound(again) and again.problem.n_sub < many:
                again = fit_from(replace(again.problem, n_sub=many), again.point, iterations)
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
        if sound(again):
            better = again.cost < trial.fit.cost
            return trial_of(trial.insertion, trial.home, again) if better else trial
    return trial


def thinning(data: Data, samples: int) -> int:
    """Largest factor that keeps the commands and leaves at least `samples` samples."""
    factor, shortest = 1, min(np.diff((0, *data.breaks, data.n)))
    while data.n // (2 * factor) >= samples // 2 and data.n > samples:
        wider = 2 * factor
        if shortest < FEWEST * wider or not all(_kept(v, wider) for v in data.commands.values()):
            break
        if not all(_kept(data.readings[:, c], wider) for c in range(data.readings.shape[1])):
            break
        factor = wider
    return factor


FEWEST = 10
"""Samples that every recording or window keeps."""


def _kept(v: Array, factor: int) -> bool:
    """Whether straight lines between every `factor`-th sample still follow `v`."""
    index = np.arange(v.size)
    off = np.abs(np.interp(index, index[::factor], v[::factor]) - v)
    return bool(np.quantile(off, 0.999) < 5e-3 * (np.ptp(v) or 1.0))
