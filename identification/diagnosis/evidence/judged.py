"""A fit whose errors are counted on other held-out samples than those it was chosen by."""

from __future__ import annotations

from dataclasses import replace

from bondgraph.signals.recording import Split
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.study.joint import held_out_states
from identification.study.residual import evaluate, windows


def judged_on(f: Fit, split: Split) -> Fit:
    """Return a fit whose errors are counted on other held-out samples.

    Recordings of which it has seen nothing begin from states that are fitted to them, as those of
    other held-out recordings are; no parameter moves.
    """
    problem = replace(
        f.problem, data=replace(f.problem.data, split=split), built=f.problem.dynamics
    )
    known = f.problem.data.mask("train") | f.problem.data.mask("test")
    fresh = [i for i, w in enumerate(windows(problem)) if not known[w].any()]
    if not fresh or problem.window is not None or f.status is FitStatus.BROKEN:
        return replace(f, problem=problem)
    states = f.point.states.copy()
    states[fresh] = held_out_states(problem, f.point).states[fresh]
    point = replace(f.point, states=states)
    y = evaluate(problem, point, derivatives=False).y
    return replace(f, problem=problem, point=point, simulated=y)
