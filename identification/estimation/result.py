"""What a fit found: values with intervals, nuisances, simulated readings; frozen and printable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from typing import Any

import numpy as np

from bondgraph.drawing.panels import Panels
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import optional
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import require_known
from bondgraph.support.html import html_table
from identification.estimation.estimates import Estimate
from identification.estimation.filtered import Filtered
from identification.estimation.levenberg_marquardt import FitStatus
from identification.study.factors import gain_name
from identification.study.joint import JointPoint, JointProblem, refine_states
from identification.study.noise_floor import declared_noise
from identification.study.problem import Problem
from identification.study.residual import (
    Point,
    evaluate,
    offset_scale,
    slots,
    start_point,
    values_at,
)
from identification.study.scaled import Free
from identification.study.study import SettledSetting, Study
from identification.study.turns import around

FAR_ABOVE = 3.0
"""Times the noise from which a held-out error is no accident of it."""


@dataclass(frozen=True, eq=False)
class Estimation:
    """Result of `estimate`.

    Sizes: n unknowns (parameters and nuisances), N samples and n_y readings of a record.

    Attributes
    ----------
    study : Study
    setting : SettledSetting
        What was chosen from the data: noise, sub-steps, behaviour of the commands.
    method, optimiser : str
    status : FitStatus
        How it ended, in words.
    point : JointPoint
        Scaled unknowns and initial states of the fitted recordings.
    covariance : ndarray, shape (n, n)
        Of the scaled unknowns (``point.theta``).
    cost : float
        Mean square of the training residuals over the noise that the fit took.
    trace : tuple of float
        Cost at the start and after each iteration.
    estimates, nuisances : tuple of Estimate
        Values with 95 % intervals, SI.
    simulated : tuple of ndarray, shape (N, n_y) each
        Readings of the fitted model: of the fitted recordings, then of the validation ones.
    floors : tuple of ndarray, shape (n_y,) each
        Noise floors from the recordings alone, SI.
    notes : tuple of str
        What the reader should know.
    seconds : float
    filtered : Filtered or None
        Process noise, innovations and filtered states, where the method has a Kalman filter.
    run : str
        What `simulated` is of the fitted recordings, in words, where it is no free run.

    Examples
    --------
    >>> fit.status.value, [e.name for e in fit.estimates], [e.name for e in fit.nuisances]
    ('converged', ['m', 'd', 'k'], ['delay x', 'offset x'])
    """

    study: Study
    setting: SettledSetting
    method: str
    optimiser: str
    status: FitStatus
    point: JointPoint
    covariance: Array
    cost: float
    trace: tuple[float, ...]
    estimates: tuple[Estimate, ...]
    nuisances: tuple[Estimate, ...]
    simulated: tuple[Array, ...]
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    filtered: Filtered | None = None
    run: str = ""

    @property
    def noises(self) -> tuple[Estimate, ...]:
        """Process noise and noise of the readings, where a filter was fitted."""
        return () if self.filtered is None else self.filtered.noises

    @property
    def floors(self) -> tuple[Array, ...]:
        """Noise floors from the recordings alone, SI."""
        return self.study.first_setting.floors

    @cached_property
    def stack(self) -> JointProblem:
        """Problems of the fitted recordings."""
        return self.study.stack(self.setting)

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters of the model, SI; of the first recording where each has its own."""
        return self.values_of(0)

    def values_of(self, record: int) -> dict[str, float]:
        """All parameters of the model in one of the fitted recordings, SI."""
        problem = self.stack.problems[record]
        found = values_at(problem, self.stack.local(self.point, record).theta)
        return {n: v for n, v in found.items() if n not in problem.added}

    @cached_property
    def gains(self) -> dict[str, float]:
        """Fitted factors on readings and commands, by channel."""
        found: dict[str, float] = {}
        for r, p in enumerate(self.stack.problems):
            found |= values_at(p, self.stack.local(self.point, r).theta)
        return {n: found[gain_name(n)] for n in self.study.nuisances.gains if gain_name(n) in found}

    @property
    def record_names(self) -> tuple[str, ...]:
        """Names of the recordings, in the order of `simulated`."""
        return self.study.record_names

    def sensors(self, record: int = 0) -> tuple[str, ...]:
        """Names of the readings of a recording, in the order of the columns."""
        return self.problem(record).data.names

    def problem(self, record: int = 0) -> Problem:
        """Problem of one recording, validation ones included."""
        if record < len(self.stack.problems):
            return self.stack.problems[record]
        return self.study.problem(record, self.setting)

    def residuals(self, part: str = "train", record: int = 0) -> Array:
        """Measured less simulated on ``train`` or ``test`` of a recording, shape (n, n_y), SI."""
        data = self.problem(record).data
        m = data.mask(part)
        return np.asarray(data.readings[m] - self.simulated[record][m])

    def rmse(self, part: str = "train", record: int = 0) -> dict[str, float]:
        """Root mean square error of each reading, SI; NaN where nothing is scored."""
        r = self.residuals(part, record)
        with np.errstate(over="ignore", invalid="ignore"):
            return {
                n: float(np.sqrt(np.mean(r[:, c] ** 2))) if r.size else float("nan")
                for c, n in enumerate(self.sensors(record))
            }

    def chi2(self, part: str = "train") -> float:
        """Mean square residual over the noise floor, all recordings and readings."""
        with np.errstate(over="ignore", invalid="ignore"):
            squares = [
                np.ravel((self.residuals(part, r) / floor) ** 2)
                for r, floor in enumerate(self.floors)
            ]
            every = np.concatenate(squares)
            return float(np.mean(every)) if every.size else float("nan")

    def estimate_of(self, name: str) -> Estimate:
        """Estimate of one parameter, nuisance or noise by name."""
        known = {e.name: e for e in (*self.estimates, *self.nuisances, *self.noises)}
        require_known("estimate", self.study.graph.name, known, name)
        return known[name]

    @property
    def free(self) -> tuple[Free, ...]:
        """Free parameters of all recordings, in the order they have in ``point.theta``."""
        found = self.stack.free
        return tuple(found[i] for i in sorted(found))

    def graph(self) -> BondGraph:
        """Return the model with the fitted values, without what the measuring chain adds."""
        names = self.study.graph.parameters
        return self.study.graph.with_values({n: v for n, v in self.values.items() if n in names})

    def predict(self, recording: Recording, init: int = 0) -> Array:
        """Return the readings of the fitted model on another recording, shape (N, n_y), SI.

        They begin anew after each turn where the model says so.
        """
        noise = _noise_with_one(self.study)
        study = self.study.changed(validation=(recording,), init=init, noise=noise)
        problem = study.problem(len(study.recordings), _with_one(self.setting, study))
        straight = simulate_validation(problem, self, init)
        return around(straight, problem.data.names, study.turns)

    @property
    def mean_chain(self) -> dict[str, Array]:
        """Offset (SI), lag (s) and clock error of each sensor, mean over the fitted recordings.

        Zero where not fitted.
        """
        found: dict[str, list[Array]] = {}
        for r, p in enumerate(self.stack.problems):
            theta, at = self.stack.local(self.point, r).theta, slots(p)
            clocks = theta[at.clocks] * p.clock if p.clock else np.zeros(len(p.data.names))
            chain = (theta[at.offsets] * offset_scale(p), theta[at.lags] * p.data.dt, clocks)
            for n, own in zip(p.data.names, np.stack(chain, axis=1), strict=True):
                found.setdefault(n, []).append(own)
        return {n: np.asarray(np.mean(v, axis=0)) for n, v in found.items()}

    def to_pandas(self) -> Any:
        """Return estimates, nuisances and noises as a data frame (needs pandas)."""
        pd = optional("pandas", "to_pandas", "tables")
        rows = [
            (e.name, e.value, e.unit, *e.ci95, e.at_bound, kind)
            for kind, group in (
                ("parameter", self.estimates),
                ("nuisance", self.nuisances),
                ("noise", self.noises),
            )
            for e in group
        ]
        columns = ["name", "value", "unit", "lower95", "upper95", "at_bound", "kind"]
        return pd.DataFrame(rows, columns=columns).set_index("name")

    def __repr__(self) -> str:
        """Short text."""
        return (
            f"Estimation({self.study.graph.name!r}, {self.method}, {self.status.value}, "
            f"cost {self.cost:.4g})"
        )

    def __str__(self) -> str:
        """Values with intervals, errors and notes, one a line."""
        lines = [repr(self), *self._held_out_above_noise()]
        for e in (*self.estimates, *self.nuisances):
            mark = "  at its bound" if e.at_bound else ""
            low, high = e.ci95
            lines.append(
                f"  {e.name:24s} {e.value:12.6g} {e.unit:10s} [{low:.6g}, {high:.6g}]{mark}"
            )
        for r, name in enumerate(self.record_names):
            for part in ("train", "test"):
                for n, v in self.rmse(part, r).items():
                    if np.isfinite(v):
                        lines.append(f"  rms error of {n}, {part} of {name}: {v:.4g}")
        return "\n".join([*lines, *(f"  note: {n}" for n in self.notes)])

    def _held_out_above_noise(self) -> list[str]:
        """Say in a line that held-out errors are no noise: the cost may be 1 all the same."""
        over = [
            (float(v / floor), n, name)
            for r, (name, floors) in enumerate(zip(self.record_names, self.floors, strict=True))
            for (n, v), floor in zip(self.rmse("test", r).items(), floors, strict=True)
        ]
        times, n, name = max((o for o in over if np.isfinite(o[0])), default=(0.0, "", ""))
        if times < FAR_ABOVE:
            return []
        return [
            f"  held out, far above the noise: the error of {n} of {name} is {times:.3g} times "
            "what the recording shows as noise (the cost is over the noise that the fit took)"
        ]

    def plot(self, record: int = 0) -> Panels:
        """Draw the readings of a recording beside the fit; returns axes, shape (n_y, 2).

        What is left is drawn over the noise that was given, or that the recording declares; else
        over the noise that the fit took, which is large where the model fails.
        """
        from identification.report.readings import readings_drawn

        data = self.problem(record).data
        units = {s.name: s.unit for s in self.study.graph.of_type(Sensor)}
        given = {} if isinstance(self.study.noise, str) else self.study.noise
        declared = declared_noise(self.study.records[record], data.names)
        floor = [declared.get(n, v) if n not in given else v
                 for n, v in zip(data.names, data.floor, strict=True)]  # fmt: skip
        measures = {
            n: "the noise given" if n in given
            else "the noise declared" if n in declared
            else "the noise fitted (its rms)"
            for n in data.names
        }  # fmt: skip
        fits = [("fitted", self.simulated[record], np.asarray(floor))]
        return readings_drawn(data.time, data.readings, units, data.split, fits, measures)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        rows = [
            (e.name, f"{e.value:.6g}", e.unit, *(f"{v:.6g}" for v in e.ci95),
             "at its bound" if e.at_bound else "")
            for e in (*self.estimates, *self.nuisances)
        ]  # fmt: skip
        heads = ("name", "value", "unit", "95 % from", "to", "")
        notes = "".join(f"<p>{escape(n)}</p>" for n in self.notes)
        return html_table(repr(self), heads, rows) + notes


def _noise_with_one(study: Study) -> str | dict[str, float | list[float]]:
    """Return the noise of a study with one more recording in place of those that are only judged.

    Where it was given for each, the further one is as loud as those fitted are in the mean.
    """
    if isinstance(study.noise, str):
        return study.noise
    fitted = {n: np.asarray(v, float) for n, v in study.noise.items()}
    fitted = {n: v[: len(study.recordings)] if v.ndim else v for n, v in fitted.items()}
    return {n: [*map(float, v), float(v.mean())] if v.ndim else float(v) for n, v in fitted.items()}


def _with_one(setting: SettledSetting, study: Study) -> SettledSetting:
    """Return the setting with what one more recording needs."""
    fresh = study.first_setting
    n = len(study.recordings)
    return replace(
        setting,
        n_sub=(*setting.n_sub[:n], max(setting.n_fine)),
        n_fine=(*setting.n_fine[:n], max(setting.n_fine)),
        corrections=(*setting.corrections[:n], None),
        floors=(*setting.floors[:n], *fresh.floors[n:]),
        whitening=(*setting.whitening[:n], *fresh.whitening[n:]),
    )


def simulate_validation(problem: Problem, fitted: Estimation, init: int) -> Array:
    """Simulate a recording that is only judged; its initial state is fitted to `init` samples.

    Sensors keep the offsets, lags and clocks they had in the fitted recordings; commands have no
    offset.
    """
    gains = {gain_name(n): v for n, v in fitted.gains.items()}
    return free_run(problem, {**fitted.values, **gains}, init, fitted.mean_chain)


def free_run(
    problem: Problem,
    values: Mapping[str, float],
    init: int,
    chain: Mapping[str, Array] | None = None,
) -> Array:
    """Return the readings at given values, shape (N, n_y), SI; the state fitted to `init` samples.

    Parameters
    ----------
    chain : mapping of str to ndarray, shape (3,), optional
        Offset (SI), lag (s) and clock error of each sensor.
    """
    known = {n: v for n, v in values.items() if n in problem.dynamics.parameter_names}
    made = replace(problem, starts=known, source_offsets=False, window=None)
    at = slots(made)
    theta = np.zeros(at.size)
    theta[at.delays] = [values.get(n, 0.0) / made.data.dt for n in made.delays]
    offsets, lags, clocks = np.array([(chain or {}).get(n, np.zeros(3)) for n in made.data.names]).T
    theta[at.offsets], theta[at.lags] = offsets / offset_scale(made), lags / made.data.dt
    if made.clock:
        theta[at.clocks] = clocks / made.clock
    states = start_point(made).states
    point = Point(theta, states)
    if init and made.free_states.size:
        short = replace(made, data=made.data.first(init), window=None, correction=None)
        found = refine_states(short, Point(theta, states[:1]))
        point = Point(theta, np.tile(found.states[0], (states.shape[0], 1)))
    return evaluate(made, point, derivatives=False).y
