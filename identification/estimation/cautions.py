"""What makes the numbers of a fit doubtful, in words, and intervals that admit it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from sympy import Expr

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import map_argument
from bondgraph.signals.recorded_rates import slopes
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import unknown_name
from identification.estimation.estimates import Estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods.method import MethodSolution
from identification.estimation.moves import BIAS, moves_at
from identification.estimation.settling import corrected_steps, sizes
from identification.estimation.sub_steps import FINEST, Refinement
from identification.study.calibration import Known
from identification.study.factors import drives, gain_name, stated_gains
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation, offset_scale, slots, values_at
from identification.study.study import SettledSetting, Study

FAR = 100.0
ROUGH = 0.1
"""Difference of a rate taken from all samples and from half of them that is worth a word."""
BEYOND = 10.0
"""Times the largest reading from which an offset of its sensor is worth a word."""
ALIKE = 1e-6
"""Part of what an unknown does to the readings below which nothing of it is its own."""
STRAINED = 4.0
"""Cost from which residuals or priors contradict what was said of them."""


def doubts(
    study: Study, stack: JointProblem, found: Sequence[ResidualEvaluation], solution: MethodSolution
) -> list[str]:
    """Say what makes the numbers doubtful although the fit has ended."""
    rows, unknowns = sizes(stack)
    words = []
    if rows <= unknowns:
        words.append(
            f"{rows} training readings for {unknowns} unknowns: the noise could not be judged, and "
            "little is determined; record more samples or fix parameters"
        )
    cost = final_cost(stack, found, solution)
    ended = solution.status in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)
    if ended and np.isfinite(cost) and cost > STRAINED:
        words.append(
            f"cost {cost:.3g}, not 1: the misfit is above the noise given, or a prior, a start or "
            "an offset is far from what the readings say; give other starts or priors"
        )
    if solution.status is FitStatus.NO_PROGRESS and _misfit(study, stack, found) > STRAINED:
        words.append(
            "the descent is held at a kink (dry friction, stops, plays) above the noise: the "
            "intervals are those of this point, which may be no minimum; try "
            "method='multiple_shooting' or many_starts"
        )
    return words


def widened(
    study: Study,
    stack: JointProblem,
    found: Sequence[ResidualEvaluation],
    solution: MethodSolution,
    covariance: Array,
) -> tuple[Array, str]:
    """Widen what the noise cannot carry: too few readings, or noise given far too small."""
    rows, unknowns = sizes(stack)
    if rows <= unknowns:
        lower, upper = stack.bounds
        return np.diag(np.where(upper > lower, np.inf, 0.0)), ""
    cost = final_cost(stack, found, solution)
    if isinstance(study.noise, str) or not np.isfinite(cost) or cost <= STRAINED:
        return covariance, ""
    return cost * covariance, (
        f"the residuals are {np.sqrt(cost):.3g} times the noise given: the intervals are widened "
        "by as much"
    )


def _misfit(study: Study, stack: JointProblem, found: Sequence[ResidualEvaluation]) -> float:
    """Mean square training residual over the noise that the recordings show by themselves."""
    squares = []
    for p, e, floor in zip(stack.problems, found, study.first_setting.floors, strict=False):
        m = p.data.mask("train")
        squares.append(np.ravel(((p.data.readings - e.y)[m] / floor) ** 2))
    return float(np.mean(np.concatenate(squares)))


def coarse_steps(
    study: Study,
    setting: SettledSetting,
    stack: JointProblem,
    point: JointPoint,
    found: Sequence[ResidualEvaluation],
) -> tuple[str, ...]:
    """Say whether sub-steps that the user has fixed are too few."""
    if not all(np.isfinite(e.residual).all() for e in found):
        return ()
    if study.n_sub is None:
        return _unsettled(setting, stack, point, found)
    _, moved = corrected_steps(study.changed(n_sub=None), setting, stack, point, found)
    if not moved:
        return ()
    return (
        f"n_sub = {study.n_sub} is too few: twice as many move an unknown by more than {BIAS:g} of "
        "its standard error; study.changed(n_sub=None) lets the fit choose",
    )


def _unsettled(
    setting: SettledSetting,
    stack: JointProblem,
    point: JointPoint,
    found: Sequence[ResidualEvaluation],
) -> tuple[str, ...]:
    """Say where the largest number of sub-steps is not enough."""
    late = [r for r in range(len(stack.problems)) if setting.n_fine[r] >= FINEST]
    moves = moves_at(stack, found, point) if late else None
    if moves is None:
        return ()
    edges = np.cumsum([0, *(e.residual.size for e in found)])
    worst, name = 0.0, ""
    for r in late:
        p, local = stack.problems[r], stack.local(point, r)
        steps = Refinement(p, local)
        half, whole = (steps.foretold(n).residual for n in (FINEST // 2, FINEST))
        moved = moves.by(whole - half, slice(edges[r], edges[r + 1]))
        at = int(np.argmax(moved))
        if moved[at] > worst:
            worst, name = float(moved[at]), stack.names[at]
    if worst < 3.0:
        return ()
    return (
        f"{FINEST} sub-steps a sample leave {name} uncertain by {worst / 3.0:.2g} standard errors: "
        "sample faster, or its interval is too narrow",
    )


def cautions(study: Study) -> tuple[str, ...]:
    """Return what the study cannot do as it is asked."""
    said = []
    if study.window is not None and study.nuisances.lags:
        said.append("windows take no lags of sensors: they are held at zero")
    known = dict.fromkeys(c for r in study.records for c in r.channels)
    said += [
        f"{unknown_name('channel for sensor', s.name, 'any recording', known)}; it was left out: "
        f"name its channel by {map_argument(s.name)} or Recording.select, or leave it out of the "
        f"model: remove({s.name!r})"
        for s in study.graph.of_type(Sensor)
        if s.name not in known
    ]
    own = [v.name for v in study.free if v.own]
    if own and study.validation:
        said.append(
            f"validation recordings are simulated with {', '.join(own)} of "
            f"{study.record_names[0]}: parameters of single recordings are not fitted to them"
        )
    for r in study.records:
        said += rough_rates(study.graph, study.with_silence(r))
    return tuple(dict.fromkeys(said))


def far_levels(stack: JointProblem, point: JointPoint) -> tuple[str, ...]:
    """Say which offsets of sensors moved far beyond all that was read: they hide a wrong level."""
    said = []
    for r, p in enumerate(stack.problems):
        theta = stack.local(point, r).theta
        offsets = theta[slots(p).offsets] * offset_scale(p)
        fitted, declared = values_at(p, theta), values_at(p, np.zeros_like(theta))
        for c, n in enumerate(p.data.names):
            own = p.graph.channel_value(p.graph[n], "offset")
            if own is not None:
                offsets[c] += _number(own, fitted) - _number(own, declared)
            largest = float(np.abs(p.data.readings[:, c]).max())
            if largest > 0 and abs(offsets[c]) > BEYOND * largest:
                unit, times = getattr(p.graph[n], "unit", ""), abs(offsets[c]) / largest
                said.append(
                    f"the offset of {n} moved by {offsets[c]:.3g} {unit}, {times:.2g} times the "
                    f"largest reading of {p.data.name}: "
                    "the level of the model is far from what was recorded; check units, weights "
                    "and preloads, or declare the offset at the sensor"
                )
    return tuple(dict.fromkeys(said))


def same_as_starts(stack: JointProblem, found: Sequence[ResidualEvaluation]) -> tuple[str, ...]:
    """Say which offsets of sensors do to all readings what an initial state does.

    Of a mass that nothing holds the position at the start shifts its reading as the offset does.
    """
    lower, upper = stack.bounds
    said = []
    for p, at, e in zip(stack.problems, stack.columns, found, strict=True):
        known = e.jacobian.shape[1] == slots(p).size and np.isfinite(e.jacobian).all()
        if not known or not all(np.isfinite(columns).all() for _, columns in e.local):
            continue
        states = [p.dynamics.state_names[i] for i in p.free_states]
        offsets = range(*slots(p).offsets.indices(e.jacobian.shape[1]))
        for n, c in zip(p.data.names, offsets, strict=True):
            if upper[at[c]] > lower[at[c]] and (alike := _imitating(e, c)).any():
                named = [s for s, is_one in zip(states, alike, strict=True) if is_one]
                said.append(
                    f"the offset of {n} and the initial {' and '.join(named)} shift {n} alike: "
                    "only their sum is known, and the interval of the offset is that of a guess; "
                    f"fix one, by Nuisances(offsets=False) or initial={{{named[0]!r}: value}}"
                )
    return tuple(dict.fromkeys(said))


def _imitating(e: ResidualEvaluation, column: int) -> Array:
    """Which initial states together do what an unknown does, in every window; else none."""
    count = e.local[0][1].shape[1] if e.local else 0
    taken = np.zeros(count, bool)
    for rows, columns in e.local:
        moved = e.jacobian[rows, column]
        size = np.linalg.norm(columns, axis=0)
        made = np.linalg.lstsq(columns / np.where(size > 0, size, 1.0), moved, rcond=1e-10)[0]
        left = moved - columns / np.where(size > 0, size, 1.0) @ made
        norm = float(np.linalg.norm(moved))
        if not count or not norm or not np.linalg.norm(left) < ALIKE * norm:
            return np.zeros(count, bool)
        taken |= np.abs(made) > ALIKE * norm
    return taken


def _number(value: Expr, known: Mapping[str, float]) -> float:
    return float(value.subs({s: known[str(s)] for s in value.free_symbols}))


def rough_rates(graph: BondGraph, r: Recording, breaks: Sequence[int] = ()) -> tuple[str, ...]:
    """Say which recorded integrals do not show their rate: every second sample shows another."""
    said = []
    for s in drives(graph):
        if s.given != "integral" or s.name not in r.channels:
            continue
        rate = slopes(r[s.name], r.dt, breaks)[::2]
        other = slopes(r[s.name][::2], 2 * r.dt, [-(-b // 2) for b in breaks])
        share = float(np.std(rate - other) / (np.std(rate) + 1e-300))
        if share > ROUGH:
            said.append(
                f"{s.name} acts by the rate of what is recorded of it, of which every second "
                f"sample shows another by {100 * share:.2g} %: its noise, or motion too fast for "
                "its samples; record its rate (given='value') or the rate of that (given='rate')"
            )
    return tuple(said)


def miscalibrated(
    graph: BondGraph, gains: Mapping[str, Known], estimates: Iterable[Estimate]
) -> tuple[str, ...]:
    """Say which calibrations end at the bound that was stated for them: a finding, no nuisance."""
    ends = {e.name: e for e in estimates if e.at_bound}
    declared = {n: (p, graph.parameters[p].value) for n, p in stated_gains(graph).items()}
    asked = {n: (gain_name(n), known.value) for n, known in gains.items()}
    return tuple(
        f"the gain of {n} ends at its bound {ends[name].value:.4g}: its calibration is off by more "
        f"than {_off(ends[name].value, value)}, or the model lacks something that looks so; widen "
        "the bound to see how far it goes"
        for n, (name, value) in (declared | asked).items()
        if name in ends
    )


def _off(value: float, stated: float) -> str:
    return f"{100 * abs(value / stated - 1.0):.3g} %" if stated else "was stated"


def runs_away(stack: JointProblem, simulated: Sequence[Array]) -> bool:
    """Whether a training residual is far larger than the readings themselves move."""
    for p, y in zip(stack.problems, simulated, strict=True):
        m = p.data.mask("train")
        rest = (p.data.readings - y)[m]
        spread = p.data.readings[m].std(axis=0) + p.data.floor
        if rest.size and not (np.sqrt(np.mean(rest**2, axis=0)) < FAR * spread).all():
            return True
    return False


def final_cost(
    stack: JointProblem, found: Sequence[ResidualEvaluation], solution: MethodSolution
) -> float:
    """Return the mean square of the residuals over the noise that the fit took."""
    if solution.cost is not None:
        return solution.cost
    if solution.readings is not None or not solution.point.theta.size:
        return solution.trace[-1]
    return stack.cost(found, solution.point)
