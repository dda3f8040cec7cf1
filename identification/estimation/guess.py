"""Start values from the data: a user need not know any.

Measured frequency responses are matched by small motions of the model at thousands of parameter
sets, the best few are fitted for some iterations to the readings, and the least misfit wins; the
declared start takes part. Where that does not follow the readings, short windows with initial
states of their own that grow lead to the free run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.signals.recording import Split
from bondgraph.signals.split import whole
from bondgraph.support.arrays import Array
from bondgraph.support.spelled import spelled
from identification.estimation.guessing.law_trials import law_trials
from identification.estimation.guessing.matching import Matching, matched
from identification.estimation.guessing.measured import measured_response
from identification.estimation.levenberg_marquardt import Descent, minimise
from identification.estimation.threads import calm
from identification.study.free_parameters import clocks
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import parameters_at, values_at
from identification.study.study import Study

Progress = Callable[[str, float], None]
SAMPLES = 4000
"""Samples of each record that trials run over."""
TRIED = 4
"""Matches that are fitted to the readings."""
TRIAL = 10
"""Iterations of a trial."""
FAINT = 1e-2
"""Change of the logarithm of a response per unit of an unknown that small motions do not show."""
LINES = 12
"""Frequencies at which small motions are looked at."""
POOR = 0.1
"""A misfit above this share of the spread of the readings asks for windows too."""


@dataclass(frozen=True, eq=False)
class Guess:
    """Start values and how they were found.

    Attributes
    ----------
    study : Study
        The study with the start values; the given one if none are better.
    words : tuple of str
        What was done.
    cost_before, cost_after : float
        Mean square of the weighted training residuals at the start values, nuisances and initial
        states fitted; infinite if it cannot be simulated.
    """

    study: Study
    words: tuple[str, ...]
    cost_before: float
    cost_after: float

    @property
    def values(self) -> dict[str, float]:
        """Start values of the free parameters, SI."""
        return {n: self.study.starts[n] for n in self.study.free_names}

    def __str__(self) -> str:
        """Text: what was done, the misfit and the values, one a line."""
        lines = [*self.words, f"misfit {self.cost_before:.4g} -> {self.cost_after:.4g}"]
        return "\n".join([*lines, *(f"  {n} = {v:.4g}" for n, v in self.values.items())])


@spelled
def guess(study: Study, seed: int = 0, progress: Progress | None = None) -> Study:
    """Return `study` with start values found from its data; never worse than the declared ones.

    Parameters
    ----------
    study : Study
    seed : int
        Of the sequence of parameter sets; the same seed gives the same values.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.

    See Also
    --------
    explained_guess : the same with words and misfits.

    Examples
    --------
    >>> from actuators.models.textbook import thermal_lag
    >>> from bondgraph import Recording
    >>> from bondgraph import simulate
    >>> t = 0.02 * np.arange(1000)
    >>> u = np.sign(np.sin(2.0 * t) + np.sin(5.1 * t))
    >>> y = simulate(thermal_lag(resistance=2.0), t, {"u": u})["y"]
    >>> record = Recording.from_arrays("oven", {"t_s": t, "u[V]": u, "y[V]": y})
    >>> found = guess(Study(thermal_lag(gain=40.0, resistance=0.05), record, hold="hold"))
    >>> abs(found.starts["R_th"] / 2.0 - 1.0) < 0.01
    True
    """
    return explained_guess(study, seed, progress).study


def explained_guess(study: Study, seed: int = 0, progress: Progress | None = None) -> Guess:
    """Return start values found from the data, with words and misfits; see `guess`."""
    say = progress or (lambda text, fraction: None)
    with calm():
        made = _guessed(study, seed, say)
    say("start values found", 1.0)
    return made


def _guessed(study: Study, seed: int, say: Progress) -> Guess:
    brief = _shortened(study)
    stack = brief.stack()
    declared = stack.start()
    words: list[str] = []
    say("start values: measuring responses", 0.05)
    seen = _from_responses(stack, declared, seed, words)
    points = [declared.theta, *seen]
    near = points[1] if seen else points[0]
    say("start values: sizes of laws", 0.25)
    hidden = [i for i, s in enumerate(_shown(stack, near)) if 0.0 <= s < FAINT]
    points += law_trials(stack, near, hidden, seed)
    best: Descent | None = None
    for i, theta in enumerate(points):
        say(f"start values: trial {i + 1} of {len(points)}", 0.3 + 0.5 * i / len(points))
        begin = _resting(stack, replace(declared, theta=theta))
        trial = minimise(stack, begin, max_iterations=TRIAL, tolerance=1e-3)
        if best is None or trial.cost < best.cost:
            best = trial
    assert best is not None
    for theta in (best.point.theta, near):
        if not _good(stack, best):
            say("start values: growing windows", 0.8)
            best = min(best, _through_windows(brief, stack, theta, words), key=lambda d: d.cost)
    found = study.starting(_values(stack, best.point.theta))
    before, after = _misfit(study), _misfit(found)
    if not after < before:
        return Guess(study, (*words, "the declared start values are the best"), before, before)
    return Guess(found, tuple(dict.fromkeys(words)), before, after)


def _shortened(study: Study) -> Study:
    """Return the study over so many training samples of each record, nothing held out."""
    records, splits = [], []
    for r, split in zip(study.recordings, study.splits, strict=True):
        train = whole(split.train)
        start = train.start or 0
        stop = min(train.stop or r.n, start + SAMPLES)
        records.append(r.slice(0, stop))
        splits.append(Split(slice(start, stop), slice(stop, stop), "start values"))
    noise = study.noise if not isinstance(study.noise, str) else "white"
    hold = "linear" if study.hold == "estimate" else study.hold
    return study.changed(
        recordings=records, splits=splits, validation=(), noise=noise, hold=hold, window=None
    )


def _from_responses(
    stack: JointProblem, declared: JointPoint, seed: int, words: list[str]
) -> list[Array]:
    """Return unknowns that match the measured responses, best first; none where that fails."""
    measured = tuple(measured_response(p) for p in stack.problems)
    vary = np.flatnonzero(_shown(stack, declared.theta) > 0.0).tolist()
    entries = sum(m.count for m in measured if m is not None)
    if not vary or 2 * entries < len(vary):
        words.append("no frequency response could be measured")
        return []
    found, cost = matched(Matching(stack, measured), declared.theta, vary, seed)
    words.append(
        f"{entries} entries of measured responses matched by {len(vary)} parameters, "
        f"misfit {cost[0]:.3g} (1: to their errors)"
    )
    return list(found[:TRIED])


def _shown(stack: JointProblem, theta: Array) -> Array:
    """How far responses move with each unknown of the model, shape (n,); -1: it is none of it.

    The largest change of a logarithm of a response, between the commands and readings of all
    records, per unit of the unknown.
    """
    found = np.full(stack.n, -1.0)
    point = replace(stack.start(), theta=theta)
    for r, (p, at) in enumerate(zip(stack.problems, stack.columns, strict=True)):
        dynamics, local, mean = p.dynamics, stack.local(point, r).theta, p.mean_inputs
        vector, n_y = parameters_at(p, local), len(p.data.names)
        s = np.asarray(1j * np.geomspace(1.0 / p.data.n, 2.0, LINES) / p.data.dt, complex)
        drive = dynamics.drive(dynamics.commands, s)
        small = dynamics.small_signal(vector, mean)
        slopes = dynamics.small_signal_slopes(vector, mean, p.directions)
        with np.errstate(all="ignore"):
            size = np.abs(small.response(s, drive))[:, :n_y, :, None]
            moved = np.abs(small.response_slopes(slopes, s, drive))[:, :n_y] * p.slopes(local)
            change = np.nan_to_num(moved / size, nan=0.0).max(axis=(0, 1, 2), initial=0.0)
        for i, f, c in zip(at, p.free, change, strict=False):
            if f.parameter.name not in p.added:
                found[i] = max(found[i], float(c))
    return found


def _resting(stack: JointProblem, point: JointPoint) -> JointPoint:
    """Let the initial states move as the rests do from the start values to `point`."""
    states = []
    for r, (p, s) in enumerate(zip(stack.problems, point.states, strict=True)):
        vector = parameters_at(p, stack.local(point, r).theta)
        states.append(s + p.dynamics.rest(vector, p.inputs[0]) - p.rest_state)
    return replace(point, states=tuple(states))


def _good(stack: JointProblem, made: Descent) -> bool:
    """Whether every reading is followed."""
    if not np.isfinite(made.cost):
        return False
    for p, e in zip(stack.problems, made.evaluations, strict=True):
        m = p.data.mask("train")
        rest = (p.data.readings - e.y)[m].std(axis=0)
        spread = p.data.readings[m].std(axis=0)
        if (rest > np.maximum(POOR * spread, 3.0 * p.data.floor)).any():
            return False
    return True


def _through_windows(brief: Study, stack: JointProblem, theta: Array, words: list[str]) -> Descent:
    """Fit short windows with states of their own, longer ones next, at last the free run."""
    study = brief.starting(_values(stack, theta))
    trains = [whole(s.train) for s in brief.splits]
    span = min(t.stop - (t.start or 0) for t in trains)
    length = max(24, 8 * max(p.dynamics.n_x for p in stack.problems))
    # clocks reach over the edges of windows
    prompt = replace(study.nuisances, clock=0.0)
    held = {n: study.starts[n] for n in clocks(study.graph) & set(study.free_names)}
    while length < min(span // 3, 1000):
        windowed = study.changed(window=length, nuisances=prompt).fixing(held)
        own = windowed.stack()
        found = minimise(own, own.start(), max_iterations=12, tolerance=1e-3)
        if not np.isfinite(found.cost):
            break
        study = study.starting(_values(own, found.point.theta))
        length *= 4
    words.append("fitted to growing windows with initial states of their own")
    moved = _theta(stack, study)
    return minimise(stack, replace(stack.start(), theta=moved), max_iterations=20, tolerance=1e-3)


def _values(stack: JointProblem, theta: Array) -> dict[str, float]:
    """Values of the parameters, SI; of the first record where each has its own."""
    found: dict[str, float] = {}
    for p, at, factor in zip(stack.problems, stack.columns, stack.factors, strict=True):
        found = values_at(p, theta[at] * factor) | found
    return found


def _theta(stack: JointProblem, study: Study) -> Array:
    """Unknowns of `stack` at the start values of a study with others."""
    theta = stack.start().theta.copy()
    for i, f in stack.free.items():
        if (value := study.starts.get(f.parameter.name)) is not None:
            theta[i] = f.theta(value)
    return theta


def _misfit(study: Study) -> float:
    """Training misfit at the start values, nuisances and initial states fitted."""
    stack = study.stack()
    pinned = replace(stack, held=dict.fromkeys(stack.of_model, 0.0))
    return minimise(pinned, pinned.start(), max_iterations=4, tolerance=1e-3).cost
