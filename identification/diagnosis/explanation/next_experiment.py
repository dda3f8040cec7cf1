"""The next experiment or sensor that would tell rival models apart, computed by simulating them.

Each candidate is simulated with every rival; what their parameters may still make up for is taken
off to first order, as far as the record leaves them free. The rest, in units of the floor, is the
separation to expect: T-optimality (Atkinson and Fedorov, Biometrika 62 (1975) 57). If one model is
right, the difference of the sums of squares has the mean d^2 and the deviation 2 d, so z = d / 2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from bondgraph.analysis.sensor_advice import unmeasured
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import De, Df, Sensor
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.simulation.dynamics import Dynamics, dynamics_of
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.explanation.candidate_inputs import CandidateInput, candidate_inputs
from identification.estimation.single_record import Fit
from identification.estimation.threads import single_threaded
from identification.study.factors import drives
from identification.study.joint import NUISANCE_LAG
from identification.study.problem import Problem
from identification.study.residual import parameters_at, read_out, slots, weighted, windows

EXTRA = "extra_"
LAG = NUISANCE_LAG


@dataclass(frozen=True)
class Experiment:
    """One experiment that could be made next.

    Attributes
    ----------
    words : str
        What to do, in the imperative.
    kind : str
        Kind of input (see `CandidateInput`), or ``sensor``.
    expected_z, now_z : float
        Separation of the two rivals that stay closest, then and on the record, in standard
        deviations.
    samples : int
    amplitude : float
        Half of the moving source's range, SI.
    rivals : tuple of str
        The two that stay closest.
    commands : mapping of str to ndarray, shape (samples,), SI
        All sources.
    """

    words: str
    kind: str
    expected_z: float
    now_z: float
    samples: int
    amplitude: float
    rivals: tuple[str, str]
    commands: Mapping[str, Array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def sentence(self) -> str:
        """For a list of advice."""
        a, b = self.rivals
        return (
            f"{self.words}: expected to tell {a} from {b} by {self.expected_z:.2g} standard errors "
            f"({self.now_z:.2g} now)"
        )


@dataclass(frozen=True, eq=False)
class _Rival:
    """A fitted model that can be run with all further sensors."""

    fit: Fit
    dynamics: Dynamics
    ready: Any
    slopes: Array
    further: tuple[int, ...]

    def run(self, commands: Mapping[str, Array]) -> tuple[Array, Array]:
        """Return readings (N, n) and their derivatives by scaled parameters and lags (N, n, k)."""
        problem = self.fit.problem
        u = self.dynamics.inputs(commands, problem.data.time)
        fine = self.dynamics.fine_inputs(u, problem.steps, problem.data.between)
        x0 = self.dynamics.rest(_vector(self.fit, self.dynamics), u[0])
        made = self.dynamics.run(self.ready, u, x0, fine, every_substep=bool(problem.delays))
        seen = read_out(problem, made, self.fit.point.theta, derivatives=True)
        step = problem.steps if problem.delays else 1
        picked = list(self.further)
        own, free = seen.y.shape[1], self.slopes.size
        y = np.hstack([seen.y, made.y[::step][:, picked]])
        tangents = np.zeros((*y.shape, free + own))
        tangents[:, :own, :free] = seen.tangent[:, :, :free] * self.slopes
        tangents[:, own:, :free] = made.dy[::step][:, picked, :free] * self.slopes
        if problem.fits_lags:
            for c in range(own):
                tangents[:, c, free + c] = seen.by_lag[:, c]
        return y, tangents


TOLD_APART = 2.0
"""Standard errors that an experiment has to promise to be worth the trouble."""
WORTH = 0.5
"""Share of the excess that rivals must explain before telling them apart means anything."""


def experiments_of(decisions: Sequence[Decision]) -> tuple[Experiment, ...]:
    """Return experiments that separate the best description from its rivals, if none is named.

    Where no input does, laws of another form may be the same model with other values.
    """
    decision = decisions[0]
    named = any(d.kind == "missing_physics" for d in decisions)
    if named or decision.kind != "unknown_physics":
        return ()
    rivals = [t for t in decision.rivals if t.effect != "unknown"]
    if decision.chosen is None or not rivals or decision.share < WORTH:
        return ()
    asked = [decision.chosen, rivals[0]]
    try:
        found = next_experiments([t.fit for t in asked], [t.label for t in asked])
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return ()
    return tuple(e for e in found if e.expected_z >= TOLD_APART)


@single_threaded
def next_experiments(
    fits: Sequence[Fit],
    labels: Sequence[str],
    *,
    envelopes: Mapping[str, DriveLimits] | None = None,
    sensors: bool = True,
    count: int = 8,
) -> tuple[Experiment, ...]:
    """Experiments ranked by how far they would separate the rivals, best first.

    Parameters
    ----------
    fits : sequence of Fit
        Two or more rivals, fitted to the same record.
    labels : sequence of str
        Their names, such as ``creep at k``.
    envelopes : dict of str to DriveLimits, optional
        What each source may do; the recorded range where it is not given.
    sensors : bool
        Try further sensors at the junctions too. Their floor relative to their signal is taken
        to be that of the sensors there are.
    count : int
        At most so many.

    Raises
    ------
    UnusableInput
        Fewer than two rivals, or labels that do not belong to them.

    Notes
    -----
    Parameters move to first order only: where a rival would have to move far, the real separation
    can be several times the expected one. Start from rest is assumed. Models that integrate are
    compared window by window, less a
    straight line in each: where a free run has drifted to tells nothing.
    """
    if len(fits) < 2 or len(labels) != len(fits):
        raise UnusableInput(
            f"next experiment: {len(fits)} fits with {len(labels)} labels; give two or more rivals "
            "and one label for each"
        )
    problem = fits[0].problem
    extra = _places([f.problem.graph for f in fits]) if sensors else {}
    try:
        rivals = [_rival(f, extra) for f in fits]
    except BondsightError:
        extra = {}
        rivals = [_rival(f, extra) for f in fits]
    names = (*problem.data.names, *extra)
    recorded = [r.run(problem.data.commands) for r in rivals]
    if not all(np.isfinite(y).all() and np.isfinite(dy).all() for y, dy in recorded):
        raise UnusableInput("next experiment: a rival cannot be simulated on the record")
    floor = _floors(problem, recorded[0][0])
    own = len(problem.data.names)
    base = [_scaled(problem, y[:, :own], dy[:, :own], floor) for y, dy in recorded]
    known = [t.T @ t for _, t in base]
    lags = [np.clip(f.point.theta[slots(f.problem).lags], -LAG, LAG) for f in fits]
    blank = np.zeros((problem.data.n, own, 0))
    fitted = [_scaled(problem, f.simulated, blank, floor)[0] for f in fits]
    now = {
        (a, b): 0.5 * float(np.linalg.norm(fitted[a] - fitted[b]))
        for a, b in combinations(range(len(fits)), 2)
    }
    found = []
    units = {s.name: s.unit or "" for s in drives(problem.graph)}
    for candidate in candidate_inputs(problem.data, units, envelopes):
        runs = [r.run(candidate.commands) for r in rivals]
        if all(np.isfinite(y).all() and np.isfinite(dy).all() for y, dy in runs):
            seen = [_scaled(problem, y[:, :own], dy[:, :own], floor) for y, dy in runs]
            found.append(_judged(candidate, seen, known, lags, now, labels))
    amplitude = max((0.5 * float(np.ptp(u)) for u in problem.data.commands.values()), default=0.0)
    for i, name in enumerate(names[own:], start=own):
        seen = [_scaled(problem, y[:, [i]], dy[:, [i]], floor[[i]]) for y, dy in recorded]
        words = f"measure {name.removeprefix(EXTRA)} too, with the recorded input"
        candidate = CandidateInput("sensor", words, problem.data.commands, amplitude)
        found.append(_judged(candidate, seen, known, lags, now, labels))
    found.sort(key=lambda e: -e.expected_z)
    best = {e.words if e.kind == "sensor" else e.kind: e for e in reversed(found)}
    return tuple(e for e in found if e in best.values())[:count]


def _judged(
    candidate: CandidateInput,
    seen: Sequence[tuple[Array, Array]],
    known: Sequence[Array],
    lags: Sequence[Array],
    now: Mapping[tuple[int, int], float],
    labels: Sequence[str],
) -> Experiment:
    """Separation of the closest two; what the record says already adds to it."""
    reached = {}
    for (a, b), before in now.items():
        difference = seen[b][0] - seen[a][0]
        # either may be the right one; the other then moves
        new = 0.5 * min(
            _distance(sign * difference, seen[i][1], known[i], lags[i])
            for sign, i in ((1.0, a), (-1.0, b))
        )
        reached[(a, b)] = float(np.hypot(new, before))
    a, b = min(reached, key=lambda pair: reached[pair])
    samples = next(iter(candidate.commands.values())).size
    return Experiment(
        candidate.words, candidate.kind, reached[(a, b)], now[(a, b)], samples,
        candidate.amplitude, (labels[a], labels[b]), candidate.commands,
    )  # fmt: skip


def _distance(difference: Array, tangents: Array, held: Array, lags: Array) -> float:
    """Length of a difference less what a model can make up for, held by the record.

    The last unknowns are lags; they stay within the bounds of a fit.
    """
    from scipy.optimize import lsq_linear

    total = float(difference @ difference)
    n = tangents.shape[1]
    size = np.sqrt(np.diag(tangents.T @ tangents) + np.diag(held)) + 1e-300
    values, vectors = np.linalg.eigh((tangents.T @ tangents + held) / np.outer(size, size))
    sound = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
    if not sound.any():
        return float(np.sqrt(total))
    root = (vectors[:, sound] * np.sqrt(values[sound])).T
    aim = (vectors[:, sound] / np.sqrt(values[sound])).T @ (tangents.T @ difference / size)
    low, high = np.full(n, -np.inf), np.full(n, np.inf)
    at = slice(n - lags.size, n)
    low[at] = (-LAG - lags - 1e-9) * size[at]
    high[at] = (LAG - lags + 1e-9) * size[at]
    made_up = root @ lsq_linear(root, aim, (low, high)).x
    return float(np.sqrt(max(total - 2 * float(made_up @ aim) + float(made_up @ made_up), 0.0)))


def _scaled(problem: Problem, y: Array, dy: Array, floor: Array) -> tuple[Array, Array]:
    """Return readings and tangents in units of the floor, as one vector and one matrix.

    Offsets of sensors are free; so is the state at the start of each window.
    """
    block = np.concatenate([y[:, :, None], dy], axis=2).transpose(1, 0, 2)
    if block.shape[0] == len(problem.data.names):
        block = weighted(problem, block.copy())
    else:
        block = block / floor[:, None, None]
    flat = _without_offsets(problem, block).reshape(-1, block.shape[2])
    return flat[:, 0], flat[:, 1:]


def _without_offsets(problem: Problem, block: Array) -> Array:
    """Take a constant out of each window, and of short ones a straight line; (n_y, N, columns).

    The first one reaches back to the first sample, which a new experiment scores as all others.
    """
    block = block.copy()
    degree = 0 if problem.window is None else 1
    first, *others = windows(problem)
    for w in (slice(0, first.stop), *others):
        part = block[:, w]
        n = part.shape[1]
        basis = np.polynomial.legendre.legvander(np.linspace(-1, 1, n), degree)
        q = np.linalg.qr(basis)[0]
        block[:, w] = part - np.einsum("nk,ykc->ync", q, np.einsum("nk,ync->ykc", q, part))
    return block


def _floors(problem: Problem, y: Array) -> Array:
    """Floors of all sensors, further ones as far below their signal as those there are."""
    floor = problem.data.floor
    ratio = float(np.median(floor / np.maximum(problem.data.readings.std(axis=0), floor)))
    further = np.maximum(ratio * y[:, floor.size :].std(axis=0), 1e-300)
    return np.concatenate([floor, further])


def _places(graphs: Sequence[BondGraph]) -> dict[str, tuple[str, str]]:
    """Further sensors that every rival can carry: name -> (junction, what it reads)."""
    first = graphs[0]
    found = {}
    for kind, junction in unmeasured(first):
        if all(isinstance(g.elements.get(junction.name), type(junction)) for g in graphs):
            letter = "f" if kind is Df else "e"
            found[f"{EXTRA}{letter}_{junction.name}"] = (junction.name, letter)
    return found


def _rival(fit: Fit, extra: Mapping[str, tuple[str, str]]) -> _Rival:
    problem = fit.problem
    graph = problem.with_chain
    for name, (junction, letter) in extra.items():
        graph = graph.with_branch(junction, [Df(name) if letter == "f" else De(name)])
    dynamics = dynamics_of(graph) if extra else problem.dynamics
    names = dynamics.parameter_names
    directions = [names.index(f.parameter.name) for f in problem.free]
    p = _vector(fit, dynamics)
    ready = dynamics.prepare(p, problem.data.dt, problem.steps, directions, True)
    slopes = problem.slopes(fit.point.theta)
    sensors = [s.name for s in graph.of_type(Sensor)]
    return _Rival(fit, dynamics, ready, slopes, tuple(sensors.index(n) for n in extra))


def _vector(fit: Fit, dynamics: Dynamics) -> Array:
    problem = fit.problem
    names = problem.dynamics.parameter_names
    values = dict(zip(names, map(float, parameters_at(problem, fit.point.theta)), strict=True))
    return dynamics.vector({n: v for n, v in values.items() if n in dynamics.parameter_names})
