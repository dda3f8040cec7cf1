"""Fit every effect of the catalogue at every port where it makes sense, cheap ones first."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from bondgraph.errors import BondsightError
from bondgraph.simulate import HOLDS
from identification.diagnosis.effects import CATALOGUE, UNNAMED, Effect, Insertion
from identification.diagnosis.scene import Scene
from identification.fit import Fit, Status, fit, start_cost
from identification.problem import Data, Problem
from identification.residual import Point, evaluate

Array = np.ndarray
BLOCKS = 40
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Trial:
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


def blocks_of(result: Fit, part: str = "test") -> Array:
    """Mean square weighted residual on consecutive parts of the held-out samples."""
    r = result.residuals(part) / result.problem.data.floor
    square = np.mean(r**2, axis=1)
    count = min(BLOCKS, square.size)
    return np.array([float(b.mean()) for b in np.array_split(square, count)])


def paired_z(worse: Array, better: Array) -> float:
    """How many standard errors `better` lies below `worse`, block by block.

    The logarithm of each block's mean square is compared, so that a few blocks with a large misfit
    (peaks that saturate) neither carry nor drown the comparison.
    """
    d = np.log(np.maximum(worse, 1e-300)) - np.log(np.maximum(better, 1e-300))
    if d.size < 2:
        return 0.0
    spread = float(d.std(ddof=1)) / np.sqrt(d.size)
    if spread > 0:
        return float(d.mean() / spread)
    return float(np.copysign(np.inf, d.mean())) if d.any() else 0.0


def insertions(scene: Scene, catalogue: Sequence[Effect]) -> list[tuple[Effect, Insertion, bool]]:
    """Every effect at every place."""
    found = []
    for effect in catalogue:
        for element in effect.places(scene.graph):
            if element.name not in scene.past:
                continue
            found.append((effect, effect.insert(scene, element), effect.home(element)))
    return found


@dataclass(frozen=True)
class Options:
    """Cost of the search.

    Attributes
    ----------
    jobs : int
        Processes; -1 for all cores. The joblib backend in force is used.
    keep : int
        Candidates that are fitted to the end.
    """

    jobs: int = -1
    keep: int = 8
    screen_iterations: int = 14
    final_iterations: int = 40
    samples: int = 12000


def search(
    scene: Scene, template: Problem, options: Options, progress: Progress | None = None
) -> list[Trial]:
    """Return all trials, best held-out score first; the first `keep` are fitted to the end.

    `template` holds the data (thinned if that loses nothing) and how to score them.
    """
    todo = insertions(scene, (*CATALOGUE, UNNAMED))
    screened = _run(
        [
            (i, home, replace(template, graph=i.graph), options.screen_iterations, tuple(i.starts))
            for _, i, home in todo
        ],
        options, progress, 0.15, 0.6, "screening",
    )  # fmt: skip
    if not screened:
        return []
    order = sorted(screened, key=lambda t: t.test)
    again = []
    for t in order[: options.keep]:
        problem = replace(template, graph=t.insertion.graph, starts=dict(t.fit.problem.starts))
        again.append((t, problem, options.final_iterations))
    finished = _finish(again, options, progress)
    done = {(t.effect, t.element) for t in finished}
    rest = [t for t in screened if (t.effect, t.element) not in done]
    return sorted(finished, key=lambda t: t.test) + sorted(rest, key=lambda t: t.test)


def thinning(data: Data, samples: int) -> int:
    """Largest factor that keeps the commands and leaves at least `samples` samples."""
    factor = 1
    while data.n // (2 * factor) >= samples // 2 and data.n > samples:
        wider = 2 * factor
        if not all(_kept(v, wider) for v in data.commands.values()):
            break
        if not all(_kept(data.readings[:, c], wider) for c in range(data.readings.shape[1])):
            break
        factor = wider
    return factor


def _kept(v: Array, factor: int) -> bool:
    """Whether straight lines between every `factor`-th sample still follow `v`."""
    index = np.arange(v.size)
    off = np.abs(np.interp(index, index[::factor], v[::factor]) - v)
    return bool(np.quantile(off, 0.999) < 5e-3 * (np.ptp(v) or 1.0))


Task = tuple[Insertion, bool, Problem, int, tuple[Mapping[str, float], ...]]


def _run(
    tasks: Sequence[Task],
    options: Options,
    progress: Progress | None,
    begin: float,
    share: float,
    what: str,
) -> list[Trial]:
    found: list[Trial] = []
    jobs = Parallel(n_jobs=options.jobs, return_as="generator_unordered")(
        delayed(_alone)(attempt, *t) for t in tasks
    )
    for done, (label, trial) in enumerate(jobs, start=1):
        if trial is not None:
            found.append(trial)
        if progress is not None:
            progress(f"{what}: {label}", begin + share * done / len(tasks))
    order = {t[0].label: i for i, t in enumerate(tasks)}
    return sorted(found, key=lambda t: order[t.label])


def _alone(work: Callable[..., Any], *arguments: Any) -> Any:
    """Run one fit in its process: one thread, no overflow warnings from absurd trial steps."""
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", RuntimeWarning)
        return work(*arguments)


def _finish(
    tasks: Sequence[tuple[Trial, Problem, int]], options: Options, progress: Progress | None
) -> list[Trial]:
    found = []
    jobs = Parallel(n_jobs=options.jobs, return_as="generator_unordered")(
        delayed(_alone)(finish, *t) for t in tasks
    )
    for done, trial in enumerate(jobs, start=1):
        found.append(trial)
        if progress is not None:
            progress(f"fitting to the end: {trial.label}", 0.75 + 0.2 * done / len(tasks))
    return found


def finish(trial: Trial, problem: Problem, iterations: int) -> Trial:
    """Go on from where the screening stopped."""
    problem = replace(problem, n_sub=trial.fit.problem.n_sub)
    try:
        result = settled_fit(problem, iterations, trial.fit.point)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return trial
    if result.status is Status.BROKEN or not result.cost <= trial.fit.cost * 1.001:
        return trial
    result = with_best_hold(result, iterations)
    return Trial(
        trial.insertion,
        trial.home,
        result,
        result.chi2("train"),
        result.chi2("test"),
        blocks_of(result),
    )


def with_best_hold(result: Fit, iterations: int) -> Fit:
    """Return the fit under the behaviour of the commands between samples that suits it best.

    A missing lag or delay makes the plain model prefer the wrong behaviour, so every serious
    candidate chooses again; where the behaviour does not show, nothing is refitted.
    """
    best = result
    for hold in HOLDS:
        if hold == result.problem.data.hold:
            continue
        n_sub = max(result.problem.n_sub, 4 if hold == "band-limited" else 1)
        problem = replace(result.problem, data=replace(result.problem.data, hold=hold), n_sub=n_sub)
        there = evaluate(problem, result.point, derivatives=False).residual
        cost = float(np.mean(there**2))
        if not np.isfinite(cost) or abs(cost - result.cost) < 0.02 * result.cost:
            continue
        other = fit(problem, start=result.point, max_iterations=iterations)
        if other.status is not Status.BROKEN and other.cost < 0.97 * best.cost:
            best = other
    return best


def attempt(
    insertion: Insertion,
    home: bool,
    problem: Problem,
    iterations: int,
    starts: tuple[Mapping[str, float], ...],
) -> tuple[str, Trial | None]:
    """Fit one insertion from all its starts; None when it cannot be simulated."""
    short: list[Fit] = []
    for candidate in promising(problem, starts):
        try:
            short.append(fit(candidate, max_iterations=6))
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    short = [r for r in short if r.status is not Status.BROKEN and np.isfinite(r.cost)]
    results = []
    for r in sorted(short, key=lambda r: r.cost)[:2]:
        try:
            results.append(settled_fit(r.problem, iterations, r.point))
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    results = [r for r in results if r.status is not Status.BROKEN and np.isfinite(r.cost)]
    if not results:
        return insertion.label, None
    result = min(results, key=lambda r: r.cost)
    if not np.isfinite(result.simulated[result.problem.data.mask("test")]).all():
        return insertion.label, None
    return insertion.label, Trial(
        insertion, home, result, result.chi2("train"), result.chi2("test"), blocks_of(result)
    )


def promising(
    problem: Problem, starts: tuple[Mapping[str, float], ...], keep: int = 2
) -> list[Problem]:
    """Best starts, `keep` with the nominal fit's values and `keep` with the declared ones.

    A large effect may have bent the nominal parameters so far that no path leads back.
    """
    declared = {
        n: p.value
        for n, p in problem.graph.parameters.items()
        if n in problem.starts and not p.fixed
    }
    chosen: list[Problem] = []
    for base in (dict(problem.starts), {**problem.starts, **declared}):
        group = [replace(problem, starts={**base, **s}) for s in starts]
        costs = []
        for c in group:
            try:
                costs.append(start_cost(c))
            except (BondsightError, np.linalg.LinAlgError, ValueError):
                costs.append(np.inf)
        order = np.argsort(costs, kind="stable")
        chosen += [group[i] for i in order[:keep] if np.isfinite(costs[i])]
    return chosen


def settled_fit(problem: Problem, iterations: int, start: Point | None = None) -> Fit:
    """Fit, then refine the sub-steps until they no longer matter beside the residual."""
    result = fit(problem, max_iterations=iterations, start=start)
    if not problem.compiled.n_w and problem.data.hold != "band-limited":
        return result
    while result.problem.n_sub < 16 and result.status is not Status.BROKEN:
        finer = replace(result.problem, n_sub=2 * result.problem.n_sub)
        y = evaluate(finer, result.point, derivatives=False).y
        m = problem.data.mask("train") | problem.data.mask("test")
        change = float(np.mean(((y - result.simulated)[m] / problem.data.floor) ** 2))
        if not np.isfinite(change) or change < 0.02 * max(1.0, result.cost):
            return result
        result = fit(finer, max_iterations=iterations, start=result.point)
    return result
