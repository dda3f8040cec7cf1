"""Fit a study: method, noise, sub-steps and behaviour between samples, until all is settled."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats
from threadpoolctl import threadpool_limits

from bondgraph.errors import UnusableInput, unknown_name
from bondgraph.simulate import HOLDS
from identification.covariance import information_root, sandwich
from identification.estimation.methods import METHODS
from identification.estimation.methods.method import Method, Options, Solution
from identification.estimation.noise import autoregressive, innovations
from identification.estimation.result import Estimation, estimates_of, simulate_validation
from identification.estimation.study import ESTIMATED, Setting, Study
from identification.levenberg_marquardt import Status
from identification.problem import Problem
from identification.residual import Evaluation, Point, evaluate
from identification.stack import Stack, Stacked, held_out_states

__all__ = ["estimate"]

Array = np.ndarray
Progress = Callable[[str, float], None]
ROUNDS = 8
ROUGH = 1e-3
"""Tolerance while noise and sub-steps are not settled."""
FINEST = 64
FAR = 100.0
AGAIN = 10.0
NEAR = 1.0
"""A correction holds while no unknown has moved by more standard errors than this."""
STRAINED = 4.0
"""Cost from which residuals or priors contradict what was said of them."""
LARGEST_CORRECTION = 0.02
"""Share of a reading's range that a correction may have; more sub-steps if it is larger."""
WITHOUT_FREE_RUN = 8
"""Sub-steps where no free run can tell how many are enough."""
BIAS = 0.2
"""Doubling the sub-steps may move no unknown by more than this share of its standard error."""


def estimate(
    study: Study,
    method: str = "single_shooting",
    *,
    optimiser: str | None = None,
    start: Estimation | None = None,
    max_iterations: int = 60,
    tolerance: float = 1e-8,
    linear_solver: str = "mumps",
    progress: Progress | None = None,
) -> Estimation:
    """Fit the free parameters of `study` to its recordings.

    Noise levels (and colours) are estimated in turn with the parameters, the sub-steps are doubled
    until the readings settle, and Ctrl-C ends the fit with the best values so far.

    Parameters
    ----------
    method : str
        ``single_shooting``, ``multiple_shooting``, ``collocation``, ``prediction_error`` or
        ``frequency_domain``; see `identification.estimation.methods.METHODS`.
    optimiser : {"gauss_newton", "ipopt"}, optional
        The first that the method runs with, if left out.
    start : Estimation, optional
        Begin where another fit of a study with the same unknowns ended.
    tolerance : float
        Converged if an iteration lowers the cost by less, relatively.
    linear_solver : {"mumps", "spral"}
        Of IPOPT.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.

    Raises
    ------
    UnknownName, UnusableInput
        One line that says what cannot be used, and what to do.
    """
    begin = time.perf_counter()
    chosen = _method(method, optimiser, linear_solver)
    optimiser = optimiser or chosen.optimisers[0]
    chosen.check(study)
    say = progress or (lambda text, fraction: None)

    def report(iteration: int, cost: float) -> None:
        share = min(0.95, iteration / max(max_iterations, 1))
        say(f"{chosen.name}: iteration {iteration}, cost {cost:.6g}", share)

    if max_iterations < 0 or not 0 <= tolerance < 1:
        raise UnusableInput(
            f"max_iterations = {max_iterations}, tolerance = {tolerance}: give a number of "
            "iterations and a relative change below 1, such as 1e-8"
        )
    options = Options(optimiser, max_iterations, tolerance, report, linear_solver)
    # tiny matrices: threads of the linear algebra only get in each other's way
    try:
        with warnings.catch_warnings(), threadpool_limits(1):
            warnings.simplefilter("ignore", RuntimeWarning)
            made = _settled(study, chosen, options, start)
            result = _finished(study, chosen, optimiser, *made)
    except np.linalg.LinAlgError as error:
        declared = {n: p.value for n, p in study.graph.parameters.items()}
        zero = [n for n, v in {**declared, **study.starts}.items() if v == 0]
        raise UnusableInput(
            f"{study.graph.name}: its equations are not finite at the start values ({error}); "
            f"check {', '.join(zero) + ' = 0' if zero else 'values, units and bounds'}"
        ) from error
    say("done", 1.0)
    return replace(result, seconds=time.perf_counter() - begin)


def _method(name: str, optimiser: str | None, linear_solver: str) -> Method:
    if name not in METHODS:
        raise unknown_name("method", name, "estimate", METHODS)
    chosen = METHODS[name]
    if optimiser is None:
        optimiser = chosen.optimisers[0]
    if optimiser not in ("gauss_newton", "ipopt"):
        raise unknown_name("optimiser", optimiser, "estimate", ("gauss_newton", "ipopt"))
    if optimiser not in chosen.optimisers:
        raise UnusableInput(
            f"{name} runs with {' or '.join(chosen.optimisers)}, not with {optimiser}"
        )
    if linear_solver not in ("mumps", "spral"):
        raise UnusableInput(
            f"linear_solver = {linear_solver!r}: IPOPT is used with 'mumps' or 'spral' only"
        )
    return chosen


Made = tuple[Setting, Stack, Solution]


def _settled(
    study: Study, method: Method, options: Options, start: Estimation | None
) -> tuple[Setting, Stack, Solution, tuple[str, ...]]:
    setting = study.first_setting if start is None else _fitting(study, start.setting)
    point = None if start is None else start.point
    notes: list[str] = []
    rough = replace(options, tolerance=max(options.tolerance, ROUGH))
    if method.hears_noise:
        rough = options
    if study.hold == ESTIMATED:
        setting, stack, solution = _best_hold(study, method, rough, setting, point)
        notes.append(f"the commands are {_HOLD_WORDS[setting.hold]} between samples: fits best")
    else:
        setting, stack, solution = _solve(study, method, rough, setting, point)
    fine = False
    for _ in range(ROUNDS):
        if solution.status in (Status.BROKEN, Status.CANCELLED) or method.hears_noise:
            break
        try:
            heard, moved = _heard(study, setting, stack, solution)
            if fine and not moved and _same(setting, heard, 0.02):
                break
            fine = _same(setting, heard, 0.1)
            made = _solve(study, method, options if fine else rough, heard, solution.point)
        except KeyboardInterrupt:
            solution = replace(solution, status=Status.CANCELLED)
            break
        trace = solution.trace
        setting, stack, solution = made
        solution = replace(solution, trace=(*trace, *solution.trace[1:]))
    return setting, stack, solution, tuple(notes)


_HOLD_WORDS = {"linear": "linear", "hold": "held", "band-limited": "band-limited"}


def _fitting(study: Study, setting: Setting) -> Setting:
    """Return a setting of another study for this one; its own where the recordings differ."""
    fresh = study.first_setting
    sizes = [f.size for f in fresh.floors]
    return setting if [f.size for f in setting.floors] == sizes else fresh


def _solve(
    study: Study, method: Method, options: Options, setting: Setting, point: Stacked | None
) -> Made:
    stack = study.stack(setting)
    begin = stack.start() if point is None or point.theta.size != stack.n else point
    return setting, stack, method.solve(study, setting, stack, begin, options)


def _best_hold(
    study: Study, method: Method, options: Options, setting: Setting, point: Stacked | None
) -> Made:
    """Fit with each behaviour between samples; linear unless another is clearly better."""
    made: dict[str, Made] = {}
    for hold in HOLDS:
        steps = tuple(max(n, 2 if hold == "band-limited" else 1) for n in setting.n_sub)
        trial = replace(setting, hold=hold, n_sub=steps, n_fine=steps)
        made[hold] = _solve(study, method, options, trial, point)
        if made[hold][2].status is Status.CANCELLED:
            break

    def score(hold: str) -> float:
        return made[hold][2].trace[-1] * (0.98 if hold == "linear" else 1.0)

    return made[min(made, key=score)]


def _heard(
    study: Study, setting: Setting, stack: Stack, solution: Solution
) -> tuple[Setting, bool]:
    """Return the setting that the fit asks for, and whether the sub-steps ask for another fit."""
    if solution.readings is not None:
        fine = _finer(study, setting, stack)
        return _reweighted(study, fine, stack, solution.readings), fine is not setting
    now = solution.evaluations or stack.evaluate(solution.point)
    finer, moved = _refined(study, setting, stack, solution.point, now)
    return _reweighted(study, finer, stack, tuple(e.y for e in now)), moved


def _finer(study: Study, setting: Setting, stack: Stack) -> Setting:
    """Return more sub-steps for readings of a method of its own, unless the step is exact."""
    exact = setting.hold != "band-limited" and all(p.engine.exact_step for p in stack.problems)
    if exact or study.n_sub is not None:
        return setting
    steps = tuple(max(n, WITHOUT_FREE_RUN) for n in setting.n_sub)
    same = steps == setting.n_sub
    return setting if same else replace(setting, n_sub=steps, n_fine=steps)


def _refined(
    study: Study, setting: Setting, stack: Stack, point: Stacked, now: Sequence[Evaluation]
) -> tuple[Setting, bool]:
    """Correct the readings for the size of the sub-steps, and say whether that moves the unknowns.

    A misfit that all samples share counts with the root of their number, so the change of the
    readings is judged by the step of the unknowns that it makes.
    """
    system = stack.normal(now, point)
    if study.n_sub is not None or not np.isfinite(system.factor).all():
        return setting, False
    jacobian = stack.projected(now, point)
    inverse = information_root(stack, system.factor)
    # standard errors with the misfit as it is, not with the noise that was expected
    level = max(1.0, float(np.sqrt(stack.cost(now, point))))
    error = level * np.linalg.norm(inverse, axis=1) + 1e-300
    before, moved_by = setting.corrected_at, np.inf
    if before is not None:
        moved_by = float(np.abs((point.theta - before) / error).max(initial=0.0))
    if moved_by < NEAR:
        return setting, False
    few, moved = list(setting.n_sub), False
    fine, corrections = list(setting.n_fine), list(setting.corrections)
    at = 0
    for r, (p, e) in enumerate(zip(stack.problems, now, strict=True)):
        rows = slice(at, at + e.residual.size)
        at = rows.stop
        local = stack.local(point, r)

        def step(change: Array, rows: slice = rows) -> float:
            moves = inverse @ (inverse.T @ (jacobian[rows].T @ change))
            return float(np.abs(moves / error).max(initial=0.0))

        def run(n: int, p: Problem = p, local: Point = local) -> Evaluation:
            finer = replace(p, n_sub=n, correction=None)
            return evaluate(finer, local, derivatives=False)

        n = max(fine[r], 2 * p.n_sub)
        found = run(n)
        # near the end the number of sub-steps is judged again: far off it was judged loosely
        while (fine[r] == p.n_sub or moved_by < AGAIN) and n < FINEST:
            finer = run(2 * n)
            if not np.isfinite(finer.residual).all():
                break
            settled = step(finer.residual - found.residual) < BIAS
            found, n = finer, 2 * n
            if settled:
                break
        if not np.isfinite(found.residual).all():
            continue
        if step(found.residual - e.residual) > BIAS:
            old = corrections[r]
            change = found.y - (e.y if old is None else e.y - old)
            if _too_large(change, p):
                few[r] = fine[r] = min(max(2 * few[r], WITHOUT_FREE_RUN), FINEST)
                corrections[r] = None
                moved = moved or few[r] > setting.n_sub[r]
            else:
                corrections[r], fine[r], moved = change, n, True
        else:
            fine[r] = max(fine[r], p.n_sub)
    finest = max(fine[: len(stack.problems)], default=1)
    judged = [max(n, finest) for n in setting.n_fine[len(stack.problems) :]]
    fine = [*fine[: len(stack.problems)], *judged]
    steps = (*few[: len(stack.problems)], *judged)
    chosen = replace(
        setting, n_sub=steps, n_fine=tuple(fine), corrections=tuple(corrections),
        corrected_at=point.theta if moved else setting.corrected_at,
    )  # fmt: skip
    return chosen, moved


def _too_large(change: Array, p: Problem) -> bool:
    """Whether a correction is no small change any more: coarse steps, or an unstable plant."""
    train = p.data.mask("train")
    largest = np.abs(change[train]).max(axis=0)
    return bool((largest > LARGEST_CORRECTION * np.ptp(p.data.readings[train], axis=0)).any())


def _reweighted(study: Study, setting: Setting, stack: Stack, readings: Sequence[Array]) -> Setting:
    """Take noise levels, and colours if wanted, from the training residuals."""
    known = study.noise if not isinstance(study.noise, str) else {}
    floors, whitening = list(setting.floors), list(setting.whitening)
    inflated = _inflation(stack)
    if not np.isfinite(inflated):
        return setting  # nothing is left over that could tell the noise
    for r, (p, y) in enumerate(zip(stack.problems, readings, strict=True)):
        m = p.data.mask("train")
        rest = (p.data.readings - y)[m]
        if not np.isfinite(rest).all() or rest.shape[0] < 4:
            continue
        level, colours = setting.floors[r].copy(), []
        for c, n in enumerate(p.data.names):
            polynomial = np.ones(1)
            heard = rest[:, c]
            rounding = 1e-7 * float(np.ptp(p.data.readings[:, c]))
            if study.noise == "coloured" and np.sqrt(np.mean(heard**2)) > rounding:
                polynomial = autoregressive(heard)
                heard = innovations(heard - heard.mean(), polynomial)
            if n not in known:
                least = 1e-9 * float(np.ptp(p.data.readings[:, c]))
                level[c] = max(inflated * float(np.sqrt(np.mean(heard**2))), least, 1e-300)
            colours.append(polynomial)
        floors[r] = level
        whitening[r] = tuple(colours) if study.noise == "coloured" else ()
    return replace(setting, floors=tuple(floors), whitening=tuple(whitening))


def _inflation(stack: Stack) -> float:
    """Noise over residuals, which are smaller as unknowns follow them; infinite if too many do."""
    rows, unknowns = _sizes(stack)
    return float(np.sqrt(rows / (rows - unknowns))) if rows > unknowns else np.inf


def _sizes(stack: Stack) -> tuple[int, int]:
    """Return the number of training readings and that of unknowns, initial states included."""
    rows = sum(int(p.data.mask("train").sum()) * len(p.data.names) for p in stack.problems)
    lower, upper = stack.bounds
    unknowns = int((upper > lower).sum())
    unknowns += sum(p.free_states.size * len(stack.scored(r)) for r, p in enumerate(stack.problems))
    return rows, unknowns


def _same(a: Setting, b: Setting, share: float) -> bool:
    level = all(np.allclose(x, y, rtol=share) for x, y in zip(a.floors, b.floors, strict=True))
    pairs = zip(a.whitening, b.whitening, strict=True)
    return level and all(
        len(x) == len(y)
        and all(v.size == w.size and np.abs(v - w).max() < share for v, w in zip(x, y, strict=True))
        for x, y in pairs
    )


def _finished(
    study: Study,
    method: Method,
    optimiser: str,
    setting: Setting,
    stack: Stack,
    solution: Solution,
    notes: tuple[str, ...],
) -> Estimation:
    point = solution.point
    found = solution.evaluations or stack.evaluate(point)
    covariance, words = solution.covariance, ""
    if covariance is None:
        covariance, words = _covariance(stack, found, point)
    covariance, doubt = _widened(study, stack, found, solution, covariance)
    estimates, nuisances = estimates_of(stack, point, covariance)
    simulated = list(solution.readings or _simulated(stack, found, point))
    status = solution.status
    if status is not Status.CANCELLED and _runs_away(stack, simulated):
        status = Status.RUNAWAY
    result = Estimation(
        study, setting, method.name, optimiser, status, point, covariance,
        _cost(stack, found, solution), solution.trace, estimates, nuisances, tuple(simulated),
        (
            *notes, *solution.notes, *(w for w in (words, doubt) if w),
            *_doubts(study, stack, found, solution), *_cautions(study),
            *_coarse(study, setting, stack, point, found),
        ),
    )  # fmt: skip
    judged = [
        simulate_validation(result.problem(i), result.values, result.mean_offsets, study.init)
        for i in range(len(study.recordings), len(study.records))
    ]
    return replace(result, simulated=(*simulated, *judged))


def _doubts(
    study: Study, stack: Stack, found: Sequence[Evaluation], solution: Solution
) -> list[str]:
    """Say what makes the numbers doubtful although the fit has ended."""
    rows, unknowns = _sizes(stack)
    words = []
    if rows <= unknowns:
        words.append(
            f"{rows} training readings for {unknowns} unknowns: the noise could not be judged, and "
            "little is determined; record more samples or fix parameters"
        )
    cost = _cost(stack, found, solution)
    ended = solution.status in (Status.CONVERGED, Status.NO_PROGRESS)
    if ended and np.isfinite(cost) and cost > STRAINED:
        words.append(
            f"cost {cost:.3g}, not 1: the misfit is above the noise given, or a prior, a start or "
            "an offset is far from what the readings say; give other starts or priors"
        )
    if solution.status is Status.NO_PROGRESS and _misfit(study, stack, found) > STRAINED:
        words.append(
            "the descent is held at a kink (dry friction, stops, plays) above the noise: the "
            "intervals are those of this point, which may be no minimum; try "
            "method='multiple_shooting' or many_starts"
        )
    return words


def _widened(
    study: Study,
    stack: Stack,
    found: Sequence[Evaluation],
    solution: Solution,
    covariance: Array,
) -> tuple[Array, str]:
    """Widen what the noise cannot carry: too few readings, or noise given far too small."""
    rows, unknowns = _sizes(stack)
    if rows <= unknowns:
        lower, upper = stack.bounds
        return np.diag(np.where(upper > lower, np.inf, 0.0)), ""
    cost = _cost(stack, found, solution)
    if isinstance(study.noise, str) or not np.isfinite(cost) or cost <= STRAINED:
        return covariance, ""
    return cost * covariance, (
        f"the residuals are {np.sqrt(cost):.3g} times the noise given: the intervals are widened "
        "by as much"
    )


def _misfit(study: Study, stack: Stack, found: Sequence[Evaluation]) -> float:
    """Mean square training residual over the noise that the recordings show by themselves."""
    squares = []
    for p, e, floor in zip(stack.problems, found, study.first_setting.floors, strict=False):
        m = p.data.mask("train")
        squares.append(np.ravel(((p.data.readings - e.y)[m] / floor) ** 2))
    return float(np.mean(np.concatenate(squares)))


def _simulated(stack: Stack, found: Sequence[Evaluation], point: Stacked) -> tuple[Array, ...]:
    """Return the readings of the free run; held-out windows get states of their own too."""
    if all(p.window is None for p in stack.problems):
        return tuple(e.y for e in found)
    return tuple(
        evaluate(p, held_out_states(p, stack.local(point, r)), derivatives=False).y
        for r, p in enumerate(stack.problems)
    )


def _coarse(
    study: Study, setting: Setting, stack: Stack, point: Stacked, found: Sequence[Evaluation]
) -> tuple[str, ...]:
    """Say whether sub-steps that the user has fixed are too few."""
    if not all(np.isfinite(e.residual).all() for e in found):
        return ()
    if study.n_sub is None:
        return _unsettled(setting, stack, point, found)
    _, moved = _refined(study.changed(n_sub=None), setting, stack, point, found)
    if not moved:
        return ()
    return (
        f"n_sub = {study.n_sub} is too few: twice as many move an unknown by more than {BIAS:g} of "
        "its standard error; leave n_sub out",
    )


def _unsettled(
    setting: Setting, stack: Stack, point: Stacked, found: Sequence[Evaluation]
) -> tuple[str, ...]:
    """Say where the largest number of sub-steps is not enough."""
    factor = stack.normal(found, point).factor
    late = [r for r in range(len(stack.problems)) if setting.n_fine[r] >= FINEST]
    if not late or not np.isfinite(factor).all():
        return ()
    jacobian, root = stack.projected(found, point), information_root(stack, factor)
    error = np.linalg.norm(root, axis=1) + 1e-300
    edges = np.cumsum([0, *(e.residual.size for e in found)])
    worst, name = 0.0, ""
    for r in late:
        p, local = stack.problems[r], stack.local(point, r)
        half, whole = (
            evaluate(replace(p, n_sub=n, correction=None), local, derivatives=False).residual
            for n in (FINEST // 2, FINEST)
        )
        moves = np.abs(root @ (root.T @ (jacobian[edges[r] : edges[r + 1]].T @ (whole - half))))
        at = int(np.argmax(moves / error))
        if moves[at] / error[at] > worst:
            worst, name = float(moves[at] / error[at]), stack.names[at]
    if worst < 1.0:
        return ()
    return (
        f"{FINEST} sub-steps a sample still move {name} by {worst:.2g} standard errors: sample "
        "faster, or its interval is too narrow",
    )


def _cautions(study: Study) -> tuple[str, ...]:
    """Return what the study cannot do as it is asked."""
    said = []
    if study.window is not None and study.nuisances.lags:
        said.append("windows take no lags of sensors: they are held at zero")
    own = [v.name for v in study.free if v.own]
    if own and study.validation:
        said.append(
            f"validation recordings are simulated with {', '.join(own)} of "
            f"{study.record_names[0]}: parameters of single recordings are not fitted to them"
        )
    return tuple(said)


def _runs_away(stack: Stack, simulated: Sequence[Array]) -> bool:
    """Whether a training residual is far larger than the readings themselves move."""
    for p, y in zip(stack.problems, simulated, strict=True):
        m = p.data.mask("train")
        rest = (p.data.readings - y)[m]
        spread = p.data.readings[m].std(axis=0) + p.data.floor
        if rest.size and not (np.sqrt(np.mean(rest**2, axis=0)) < FAR * spread).all():
            return True
    return False


def _cost(stack: Stack, found: Sequence[Evaluation], solution: Solution) -> float:
    if solution.cost is not None:
        return solution.cost
    if solution.readings is not None or not solution.point.theta.size:
        return solution.trace[-1]
    return stack.cost(found, solution.point)


def _covariance(stack: Stack, found: Sequence[Evaluation], point: Stacked) -> tuple[Array, str]:
    """Inverse information; the block sandwich where the residuals are coloured."""
    factor = stack.normal(found, point).factor
    if not np.isfinite(factor).all():
        return np.full((stack.n, stack.n), np.nan), ""
    root = information_root(stack, factor)
    inverse = root @ root.T
    if not _coloured(stack, found):
        return inverse, ""
    robust = sandwich(stack, found, point, inverse)
    return robust, "the residuals are coloured: intervals are robust ones (block sandwich)"


def _coloured(stack: Stack, found: Sequence[Evaluation], lags: int = 20) -> bool:
    """Whether a portmanteau test sees correlation in the residuals of a reading."""
    for p, e in zip(stack.problems, found, strict=True):
        rows = e.residual.size
        count = len(p.data.names)
        if p.window is not None or rows % max(count, 1):
            return True
        for r in e.residual.reshape(count, -1):
            n = r.size
            if n <= 2 * lags or not (power := float(r @ r)):
                continue
            rho = np.array([r[k:] @ r[:-k] for k in range(1, lags + 1)]) / power
            q = n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1)))
            if q > stats.chi2.ppf(0.999, lags):
                return True
    return False
