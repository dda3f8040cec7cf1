"""What a fit settles beside its unknowns: noise, colours and the size of the sub-steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from identification.estimation.methods.method import MethodSolution
from identification.estimation.moves import BIAS, moves_at
from identification.estimation.sub_steps import (
    FINEST,
    Refinement,
    corrected,
    fewest,
    finest_of,
    small_correction,
    still_to_come,
)
from identification.statistics.autoregression import innovations, whitening_filter
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation
from identification.study.study import ESTIMATED, SettledSetting, Study

AGAIN = 10.0
NEAR = 1.0
"""A correction holds while no unknown has moved by more standard errors than this."""
WITHOUT_FREE_RUN = 8
"""Sub-steps where no free run can tell how many are enough."""


def settled_setting(
    study: Study, setting: SettledSetting, stack: JointProblem, solution: MethodSolution
) -> tuple[SettledSetting, bool]:
    """Return the setting that the fit asks for, and whether the sub-steps ask for another fit."""
    if solution.readings is not None:
        fine = _finer(study, setting, stack)
        return _reweighted(study, fine, stack, solution.readings), fine is not setting
    now = solution.evaluations or stack.evaluate(solution.point)
    finer, moved = corrected_steps(study, setting, stack, solution.point, now)
    return _reweighted(study, finer, stack, tuple(e.y for e in now)), moved


def carried_setting(study: Study, setting: SettledSetting, before: Study) -> SettledSetting:
    """Return the setting to begin with where the fit of another study ended.

    What `study` says itself holds; what it leaves to be estimated begins as it ended. Corrections
    are those of certain readings and steps: they stay with these alone.

    Parameters
    ----------
    setting : SettledSetting
        Of the study `before`; nothing of it is taken where the sensors of the recordings differ.
    """
    fresh = study.first_setting
    sensors = [_sensors(study, r) for r in study.records]
    if sensors != [_sensors(before, r) for r in before.records]:
        return fresh
    hold = setting.hold if study.hold == ESTIMATED else study.hold
    least = 2 if hold == "band-limited" else 1
    n_sub, n_fine = fresh.n_sub, fresh.n_fine
    if study.n_sub is None:
        n_sub = tuple(max(n, least) for n in setting.n_sub)
        n_fine = tuple(max(n, least) for n in setting.n_fine)
    known = study.noise if not isinstance(study.noise, str) else {}
    coloured = study.noise == "coloured"
    # levels beside a colour are those of innovations
    levels = setting.floors if coloured == (before.noise == "coloured") else fresh.floors
    floors = tuple(
        np.array([f if n in known else v for n, f, v in zip(names, first, level, strict=True)])
        for names, first, level in zip(sensors, fresh.floors, levels, strict=True)
    )
    kept = (
        (hold, n_sub, study.window) == (setting.hold, setting.n_sub, before.window)
        and all(_same(r, s) for r, s in zip(study.records, before.records, strict=True))
    )  # fmt: skip
    return SettledSetting(
        hold, n_sub, floors, setting.whitening if coloured else fresh.whitening, n_fine,
        setting.corrections if kept else fresh.corrections,
        setting.corrected_at if kept else None,
    )  # fmt: skip


def _sensors(study: Study, recording: Recording) -> list[str]:
    return [s.name for s in study.graph.of_type(Sensor) if s.name in recording.channels]


def _same(a: Recording, b: Recording) -> bool:
    """Whether two recordings have the same samples."""
    return a is b or (
        a.channels.keys() == b.channels.keys()
        and np.array_equal(a.time, b.time)
        and all(np.array_equal(a[n], b[n]) for n in a.channels)
    )


def _finer(study: Study, setting: SettledSetting, stack: JointProblem) -> SettledSetting:
    """Return more sub-steps for readings of a method of its own, unless the step is exact."""
    if all(p.exact for p in stack.problems) or study.n_sub is not None:
        return setting
    steps = tuple(max(n, WITHOUT_FREE_RUN) for n in setting.n_sub)
    same = steps == setting.n_sub
    return setting if same else replace(setting, n_sub=steps, n_fine=steps)


def corrected_steps(
    study: Study,
    setting: SettledSetting,
    stack: JointProblem,
    point: JointPoint,
    now: Sequence[ResidualEvaluation],
) -> tuple[SettledSetting, bool]:
    """Correct the readings for the size of the sub-steps, and say whether that moves the unknowns.

    A misfit that all samples share counts with the root of their number, so the change of the
    readings is judged by the step of the unknowns that it makes.
    """
    if all(p.exact for p in stack.problems) or study.n_sub is not None:
        return setting, False
    moves = moves_at(stack, now, point)
    if moves is None:
        return setting, False
    before, moved_by = setting.corrected_at, np.inf
    if before is not None:
        moved_by = float(np.abs((point.theta - before) / moves.error).max(initial=0.0))
    if moved_by < NEAR:
        return setting, False
    few, moved = list(setting.n_sub), False
    fine, corrections = list(setting.n_fine), list(setting.corrections)
    at = 0
    for r, (p, e) in enumerate(zip(stack.problems, now, strict=True)):
        rows = slice(at, at + e.residual.size)
        at = rows.stop
        local = stack.local(point, r)

        step, steps = partial(moves.most, rows=rows), Refinement(p, local)
        n = max(fine[r], 4 * p.n_sub)
        # near the end the number of sub-steps is judged again: far off it was judged loosely
        if fine[r] == p.n_sub or moved_by < AGAIN:
            n = fewest(n, FINEST, partial(_enough, steps, step, still_to_come(p.dynamics.jumps)))
        found = steps.foretold(n)
        if not np.isfinite(found.residual).all():
            continue
        if step(found.residual - e.residual) > BIAS:
            better = corrected(p, e.y, found.y)
            # where a law jumps, readings of few sub-steps are rough in the unknowns, by about as
            # much as their correction: it holds at one point and not beside it
            rough = p.dynamics.jumps and step(found.residual - steps.run(p.n_sub).residual) > NEAR
            if (rough and few[r] < finest_of(p.data.n)) or not small_correction(better):
                few[r] = fine[r] = min(max(2 * few[r], WITHOUT_FREE_RUN), FINEST)
                corrections[r] = None
                moved = moved or few[r] > setting.n_sub[r]
            else:
                corrections[r], fine[r], moved = better.correction, n, True
        else:
            fine[r] = max(fine[r], p.n_sub)
    finest = max(fine[: len(stack.problems)], default=1)
    # recordings that are only judged run with many sub-steps in place of an extrapolation
    finest = min(4 * finest, FINEST) if finest > 1 else 1
    judged = [max(n, finest) for n in setting.n_fine[len(stack.problems) :]]
    fine = [*fine[: len(stack.problems)], *judged]
    n_sub = (*few[: len(stack.problems)], *judged)
    chosen = replace(
        setting, n_sub=n_sub, n_fine=tuple(fine), corrections=tuple(corrections),
        corrected_at=point.theta if moved else setting.corrected_at,
    )  # fmt: skip
    return chosen, moved


def _enough(steps: Refinement, moved: Callable[[Array], float], ahead: float, n: int) -> bool:
    """Whether more sub-steps move no unknown by much, or leave nothing that is a number."""
    now, half = steps.foretold(n).residual, steps.foretold(n // 2).residual
    return ahead * moved(now - half) < BIAS or not np.isfinite(steps.foretold(2 * n).residual).all()


def _reweighted(
    study: Study, setting: SettledSetting, stack: JointProblem, readings: Sequence[Array]
) -> SettledSetting:
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
                polynomial = whitening_filter(heard)
                heard = innovations(heard - heard.mean(), polynomial)
            if n not in known:
                least = 1e-9 * float(np.ptp(p.data.readings[:, c]))
                level[c] = max(inflated * float(np.sqrt(np.mean(heard**2))), least, 1e-300)
            colours.append(polynomial)
        floors[r] = level
        whitening[r] = tuple(colours) if study.noise == "coloured" else ()
    return replace(setting, floors=tuple(floors), whitening=tuple(whitening))


def _inflation(stack: JointProblem) -> float:
    """Noise over residuals, which are smaller as unknowns follow them; infinite if too many do."""
    rows, unknowns = sizes(stack)
    return float(np.sqrt(rows / (rows - unknowns))) if rows > unknowns else np.inf


def sizes(stack: JointProblem) -> tuple[int, int]:
    """Return the number of training readings and that of unknowns, initial states included."""
    rows = sum(int(p.data.mask("train").sum()) * len(p.data.names) for p in stack.problems)
    lower, upper = stack.bounds
    return rows, int((upper > lower).sum()) + free_states(stack)


def free_states(stack: JointProblem) -> int:
    """Return how many initial states training samples are fitted with."""
    return sum(p.free_states.size * len(stack.scored(r)) for r, p in enumerate(stack.problems))


def same_setting(a: SettledSetting, b: SettledSetting, share: float) -> bool:
    """Whether noise and colours differ by less than `share`."""
    floors = zip(a.floors, b.floors, strict=True)
    level = all(np.allclose(x, y, rtol=share, atol=0) for x, y in floors)
    pairs = zip(a.whitening, b.whitening, strict=True)
    return level and all(
        len(x) == len(y)
        and all(v.size == w.size and np.abs(v - w).max() < share for v, w in zip(x, y, strict=True))
        for x, y in pairs
    )
