"""Fit a study: method, noise, sub-steps and behaviour between samples, until all is settled."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from bondgraph.simulation.start import HOLDS
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput, require_known
from bondgraph.support.spelled import spelled
from identification.estimation.cautions import (
    cautions,
    coarse_steps,
    doubts,
    far_levels,
    final_cost,
    miscalibrated,
    runs_away,
    same_as_starts,
    widened,
)
from identification.estimation.covariance import interval_covariance
from identification.estimation.estimates import estimates_of
from identification.estimation.holds import UNSURE, beyond, chosen, lateness, possible, tied, usual
from identification.estimation.levenberg_marquardt import FitStatus, foreseen
from identification.estimation.methods import METHODS
from identification.estimation.methods.method import FitOptions, FitTask, Method, MethodSolution
from identification.estimation.near_start import FAR_OFF, near_start
from identification.estimation.result import Estimation, simulate_validation
from identification.estimation.settling import carried_setting, same_setting, settled_setting
from identification.estimation.threads import calm
from identification.study.factors import drives
from identification.study.joint import JointPoint, JointProblem, held_out_states
from identification.study.read_after import BEHAVIOURS, READ_AFTER
from identification.study.residual import ResidualEvaluation, evaluate
from identification.study.study import ESTIMATED, SettledSetting, Study

Progress = Callable[[str, float], None]
ROUNDS = 8
PATIENT = 1e-6
FEW = 4
"""Steps of nuisances alone before a fit."""
ROUGH = 1e-3
"""Tolerance while noise and sub-steps are not settled."""
DOUBLINGS = 6
"""Of the sub-steps, where the run at the start values is not finite."""


@spelled
def estimate(
    study: Study,
    method: str = "single_shooting",
    *,
    optimiser: str | None = None,
    start: Estimation | JointPoint | None = None,
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
    start : Estimation or JointPoint, optional
        Begin where another fit of a study with the same unknowns ended, or at a point of its stack.
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

    Examples
    --------
    >>> fit = estimate(study)
    >>> {name: float(f"{value:.3g}") for name, value in fit.values.items()}
    {'m': 0.54, 'd': 5.1, 'k': 2000.0}
    """
    begin = time.perf_counter()
    chosen = _method(method, optimiser, linear_solver)
    optimiser = optimiser or chosen.optimisers[0]
    _check(study, chosen)
    say = progress or (lambda text, fraction: None)

    def report(iteration: int, cost: float) -> None:
        share = min(0.95, iteration / max(max_iterations, 1))
        say(f"{chosen.name}: iteration {iteration}, cost {cost:.6g}", share)

    if max_iterations < 0 or not 0 <= tolerance < 1:
        raise UnusableInput(
            f"max_iterations = {max_iterations}, tolerance = {tolerance}: give a number of "
            "iterations and a relative change below 1, such as 1e-8"
        )
    options = FitOptions(optimiser, max_iterations, tolerance, report, linear_solver)
    # tiny matrices: threads of the linear algebra only get in each other's way
    try:
        with calm():
            made = _with_best_hold(study, chosen, options, start)
            result = _finished(study, chosen, optimiser, *made)
    except BondsightError:
        raise
    except (np.linalg.LinAlgError, ValueError) as error:
        # a library stumbles where numbers are not finite; what makes them so is said
        from identification.uncertainty.preflight import require_motion

        require_motion(study)
        declared = {n: p.value for n, p in study.graph.parameters.items()}
        zero = [n for n, v in {**declared, **study.starts}.items() if v == 0]
        raise UnusableInput(
            f"{study.graph.name}: its equations are not finite at the start values "
            f"({' '.join(str(error).split())[:120]}); "
            f"check {', '.join(zero) + ' = 0' if zero else 'values, units and bounds'}"
        ) from error
    say("done", 1.0)
    return replace(result, seconds=time.perf_counter() - begin)


def _method(name: str, optimiser: str | None, linear_solver: str) -> Method:
    require_known("method", "estimate", METHODS, name)
    chosen = METHODS[name]
    if optimiser is None:
        optimiser = chosen.optimisers[0]
    require_known("optimiser", "estimate", ("gauss_newton", "ipopt"), optimiser)
    if optimiser not in chosen.optimisers:
        raise UnusableInput(
            f"{name} runs with {' or '.join(chosen.optimisers)}, not with {optimiser}"
        )
    if linear_solver not in ("mumps", "spral"):
        raise UnusableInput(
            f"linear_solver = {linear_solver!r}: IPOPT is used with 'mumps' or 'spral' only"
        )
    return chosen


def _going(solution: MethodSolution) -> bool:
    return solution.status in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)


def _check(study: Study, method: Method) -> None:
    if study.hold == READ_AFTER and not method.reads_after:
        able = " or ".join(f"{n!r}" for n, m in METHODS.items() if m.reads_after)
        raise UnusableInput(
            f"{method.name} takes readings before the step of a held command, but hold = "
            f"{READ_AFTER!r}; use method={able}"
        )
    method.check(study)


Made = tuple[SettledSetting, JointProblem, MethodSolution]
Settled = tuple[SettledSetting, JointProblem, MethodSolution, tuple[str, ...]]


def _with_best_hold(
    study: Study,
    method: Method,
    options: FitOptions,
    start: Estimation | JointPoint | None,
    holds: Sequence[str] = BEHAVIOURS,
) -> Settled:
    """Fit with the usual behaviour between samples; anew where another of `holds` is better."""
    holds = holds if method.reads_after else HOLDS
    if study.hold != ESTIMATED:
        return (*_settled(study, method, options, start), ())
    if method.hears_noise and start is None:
        # a filter explains a wrong command by noise: free runs choose
        free_run = METHODS["single_shooting"]
        heard = _with_best_hold(study, free_run, replace(options, report=None), None, holds)
        return (*_settled(study, method, options, None, heard[0].hold), heard[3])
    first = None if isinstance(start, Estimation) else _usual(study)
    made = _settled(study, method, options, start, first)
    costs: dict[str, float] = {}
    with suppress(KeyboardInterrupt):
        known = isinstance(start, Estimation)
        costs = {} if known else _costs_of_holds(study, method, options, holds, *made)
    own = made[0].hold
    if costs and (hold := chosen(costs, own)) != own:
        again = _settled(study, method, options, start, hold)
        made = min((made, again), key=_level)
    made, late = _least_late(study, method, options, made, costs)
    hold = made[0].hold
    best = ", which fits best" if hold != own else ""
    note = f"the commands are taken as {_HOLD_WORDS[hold]} between samples{late or best}"
    return (*made, (note,))


def _usual(study: Study) -> str | None:
    """Return how the commands of a study usually behave, if they are not linear."""
    names = [s.name for s in drives(study.graph)]
    hold = usual(r[n] for r in study.recordings for n in names if n in r.channels)
    return hold if hold in possible(("hold",), study.problem(0, study.first_setting)) else None


def _least_late(
    study: Study, method: Method, options: FitOptions, made: Made, costs: Mapping[str, float]
) -> tuple[Made, str]:
    """Return a fit that is as good under another behaviour, and why, where that needs no delay."""
    own = made[0].hold
    others = [h for h in tied(costs) if h != own] if own in costs else []
    late = {own: _late(made)} if others else {}
    if late.get(own, 0.0) <= UNSURE:
        return made, _open(made, others) if late.get(own) == 0.0 else ""
    fits = {own: made}
    for hold in others:
        again = _settled(study, method, options, None, hold)
        if _going(again[2]):
            fits[hold], late[hold] = again, _late(again)
    level = {h: float(np.exp(_level(f) - _level(made))) for h, f in fits.items()}
    hold = chosen(level, own, late)
    if hold == own:
        return made, ""
    return fits[hold], f": as {_HOLD_WORDS[own]} ones they fit no better, and need a delay"


def _open(made: Made, others: Sequence[str]) -> str:
    """Say what another behaviour that fits as well would change, where no delay is free to tell."""
    setting, stack, solution = made
    if solution.readings is not None:
        return ""
    found, point = solution.evaluations or stack.evaluate(solution.point), solution.point
    own = estimates_of(stack, point, interval_covariance(stack, found, point)[0])[0]
    for hold in others:
        there = _otherwise_held(stack, hold, _at_least(setting.n_fine, hold))
        after = there.step(there.normal(there.evaluate(point), point), point, 0.0)
        other = estimates_of(there, after, np.zeros((stack.n, stack.n)))[0]
        if said := beyond(own, other):
            return f"; as {_HOLD_WORDS[hold]} ones they fit as well, with {said}"
    return ""


def _late(made: Made) -> float:
    _, stack, solution = made
    return lateness(stack, solution.evaluations or stack.evaluate(solution.point), solution.point)


_HOLD_WORDS = {
    "linear": "linear", "hold": "held constant", "band-limited": "band-limited",
    READ_AFTER: "held constant, with readings taken after their steps,",
}  # fmt: skip


def _costs_of_holds(
    study: Study,
    method: Method,
    options: FitOptions,
    holds: Sequence[str],
    setting: SettledSetting,
    stack: JointProblem,
    solution: MethodSolution,
) -> dict[str, float]:
    """Return the misfit that each behaviour would leave after one step of the unknowns.

    With the sub-steps that the fit came to: with few of them a wrong behaviour may fit best.
    """
    ended = solution.status is FitStatus.ITERATIONS and options.max_iterations > 0
    if not (_going(solution) or ended):
        return {}  # a wrong behaviour may be why it did not converge
    costs: dict[str, float] = {}
    for hold in possible(holds, *stack.problems):
        steps = _at_least(setting.n_fine, hold)
        if solution.readings is not None:  # no free run: the method itself has to say
            trial = replace(
                setting, hold=hold, n_sub=steps, n_fine=steps, corrections=(None,) * len(steps)
            )
            costs[hold] = _solve(study, method, options, trial, solution.point)[2].trace[-1]
            continue
        here = hold == setting.hold and steps == setting.n_sub
        there = stack if here else _otherwise_held(stack, hold, steps)
        found = (here and solution.evaluations) or there.evaluate(solution.point)
        left = foreseen(there, there.normal(found, solution.point), solution.point)
        if np.isfinite(left):
            costs[hold] = left / max(there.count(found), 1)
    return costs


def _at_least(steps: Sequence[int], hold: str) -> tuple[int, ...]:
    """Return the sub-steps, as many as a behaviour between samples needs."""
    return tuple(max(n, 2 if hold == "band-limited" else 1) for n in steps)


def _otherwise_held(stack: JointProblem, hold: str, steps: Sequence[int]) -> JointProblem:
    """Return the same problems with other commands between samples; scales of states are kept."""
    problems = tuple(
        replace(
            p, data=replace(p.data, hold=hold), n_sub=n, correction=None, known_scale=p.state_scale
        )
        for p, n in zip(stack.problems, steps, strict=False)
    )
    return replace(stack, problems=problems)


def _level(made: Made) -> float:
    """Log of the mean square misfit, whatever noise was taken from it."""
    setting, _, solution = made
    levels = np.concatenate([np.log(f) for f in setting.floors])
    return float(np.log(max(solution.trace[-1], 1e-300)) + 2.0 * levels.mean())


def _settled(
    study: Study,
    method: Method,
    options: FitOptions,
    start: Estimation | JointPoint | None,
    hold: str | None = None,
) -> Made:
    setting = study.first_setting
    if isinstance(start, Estimation):
        setting = carried_setting(study, start.setting, start.study)
    if hold is not None:
        steps = _at_least(setting.n_sub, hold)
        setting = replace(setting, hold=hold, n_sub=steps, n_fine=steps)
    point = start.point if isinstance(start, Estimation) else start
    rough = replace(options, tolerance=max(options.tolerance, ROUGH))
    if method.hears_noise:
        rough = options
    setting, stack, solution = _solve(study, method, rough, setting, point)
    if solution.status is FitStatus.BROKEN and (finer := _steps_that_run(study, setting, point)):
        setting, stack, solution = _solve(study, method, rough, finer, point)
    if not method.hears_noise and solution.trace[-1] > FAR_OFF and _going(solution):
        # far from the noise a slow valley is no end: noise taken from there would flatten it
        trace = solution.trace
        patient = replace(options, tolerance=max(options.tolerance, PATIENT))
        setting, stack, solution = _solve(study, method, patient, setting, solution.point)
        solution = replace(solution, trace=(*trace, *solution.trace[1:]))
    fine = False
    for _ in range(ROUNDS):
        if solution.status in (FitStatus.BROKEN, FitStatus.CANCELLED) or method.hears_noise:
            break
        try:
            heard, moved = settled_setting(study, setting, stack, solution)
            if fine and not moved and same_setting(setting, heard, 0.02):
                break
            fine = same_setting(setting, heard, 0.1)
            made = _solve(study, method, options if fine else rough, heard, solution.point)
        except KeyboardInterrupt:
            solution = replace(solution, status=FitStatus.CANCELLED)
            break
        trace = solution.trace
        setting, stack, solution = made
        solution = replace(solution, trace=(*trace, *solution.trace[1:]))
    return setting, stack, solution


def _steps_that_run(
    study: Study, setting: SettledSetting, point: JointPoint | None
) -> SettledSetting | None:
    """Return the fewest sub-steps with which a run that breaks off arrives, if there are such.

    Steps that are too long for a law run away where the model itself does not.
    """
    if study.n_sub is not None:
        return None
    for _ in range(DOUBLINGS):
        steps = tuple(2 * n for n in setting.n_sub)
        setting = replace(setting, n_sub=steps, n_fine=steps)
        stack = study.stack(setting)
        begin = stack.start() if point is None or point.theta.size != stack.n else point
        if all(np.isfinite(e.residual).all() for e in stack.evaluate(begin, derivatives=False)):
            return setting
    return None


def _solve(
    study: Study,
    method: Method,
    options: FitOptions,
    setting: SettledSetting,
    point: JointPoint | None,
) -> Made:
    stack = study.stack(setting)
    begin, found = point, None
    if begin is None and method.name == "single_shooting":
        try:
            begin, found = near_start(stack, min(FEW, options.max_iterations))
        except KeyboardInterrupt:
            still = replace(options, max_iterations=0)
            made = method.solve(FitTask(study, setting, stack, stack.start(), still))
            return setting, stack, replace(made, status=FitStatus.CANCELLED)
    if begin is None or begin.theta.size != stack.n:
        begin = stack.start()
    return setting, stack, method.solve(FitTask(study, setting, stack, begin, options, found))


def _finished(
    study: Study,
    method: Method,
    optimiser: str,
    setting: SettledSetting,
    stack: JointProblem,
    solution: MethodSolution,
    notes: tuple[str, ...],
) -> Estimation:
    from identification.uncertainty.pinned import pinned  # which knows estimations

    point = solution.point
    found = solution.evaluations or stack.evaluate(point)
    covariance, words = solution.covariance, ""
    if covariance is None:
        covariance, words = interval_covariance(stack, found, point)
        if words.startswith("the residuals") and study.noise == "white":
            words += (
                "; where samples are few or laws have a memory, they may still be a few per cent "
                "short of 95 %: noise='coloured' fits the colour too"
            )
    covariance, doubt = widened(study, stack, found, solution, covariance)
    estimates, nuisances = estimates_of(stack, point, covariance)
    simulated = list(solution.readings or _simulated(stack, found, point))
    status = solution.status
    if status is not FitStatus.CANCELLED and runs_away(stack, simulated):
        status = FitStatus.RUNAWAY
    result = Estimation(
        study, setting, method.name, optimiser, status, point, covariance,
        final_cost(stack, found, solution), solution.trace, estimates, nuisances, tuple(simulated),
        (
            *notes, *solution.notes, *(w for w in (words, doubt) if w),
            *doubts(study, stack, found, solution), *cautions(study),
            *miscalibrated(study.graph, study.nuisances.gains, (*estimates, *nuisances)),
            *coarse_steps(study, setting, stack, point, found), *far_levels(stack, point),
            *same_as_starts(stack, found), *pinned(study.graph, study.free_names),
        ),
        filtered=solution.filtered, run=solution.run,
    )  # fmt: skip
    judged = [
        simulate_validation(result.problem(i), result, study.init)
        for i in range(len(study.recordings), len(study.records))
    ]
    return replace(result, simulated=(*simulated, *judged))


def _simulated(
    stack: JointProblem, found: Sequence[ResidualEvaluation], point: JointPoint
) -> tuple[Array, ...]:
    """Return the readings of the free run; held-out windows get states of their own too."""
    if all(p.window is None for p in stack.problems):
        return tuple(e.y for e in found)
    return tuple(
        evaluate(p, held_out_states(p, stack.local(point, r)), derivatives=False).y
        for r, p in enumerate(stack.problems)
    )
