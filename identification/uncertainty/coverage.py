"""Coverage of 95 % intervals by simulation: how often they hold the truth, and how often not.

Every trial takes the same plant and input, draws new noise, fits from a start that is off, and asks
each kind of interval whether the truth is inside. The seed of a trial is its number, so the answer
does not depend on how many processes share the work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from zlib import crc32

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import BondsightError, UnusableInput, require_known
from bondgraph.support.parallel import results
from identification.estimation.estimate import estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.threads import single_threaded
from identification.study.specification import NO_NUISANCES, Vary
from identification.study.study import Study
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.profiles import profile_one, rise_at

Progress = Callable[[int, int, str], None]
KINDS = ("fisher", "sandwich", "profile")
WIDTHS = 3
"""Trials whose profiles are walked to their ends."""


@dataclass(frozen=True, eq=False)
class Case:
    """A known plant and how it is measured.

    Parameters
    ----------
    graph : BondGraph
        Its declared values are the truth.
    time : ndarray, shape (N,), s
    commands : dict of str to ndarray, shape (N,), SI
    noise : dict of str to float
        Standard deviation of each reading's noise, SI.
    free : tuple of str
    colour : float
        Correlation of the noise from sample to sample (first-order autoregressive); 0 is white.
    model : {"white", "coloured"}
        What the fit takes the noise for.
    off : float
        Starts lie up to this share away from the truth.
    """

    name: str
    graph: BondGraph
    time: FloatArray
    commands: Mapping[str, FloatArray]
    noise: Mapping[str, float]
    free: tuple[str, ...]
    colour: float = 0.0
    model: str = "white"
    off: float = 0.1

    def __post_init__(self) -> None:
        """Check names and colour."""
        if not -1 < self.colour < 1:
            raise UnusableInput(f"{self.name}: colour {self.colour} must lie between -1 and 1")
        require_known("parameter", self.graph.name, self.graph.parameters, *self.free)

    @cached_property
    def clean(self) -> dict[str, FloatArray]:
        """Readings without noise, SI."""
        return simulate(
            self.graph, self.time, self.commands, accuracy=1e-6, x0="rest", hold="linear"
        ).outputs

    @property
    def truth(self) -> dict[str, float]:
        """True values, SI."""
        return {n: self.graph.parameters[n].value for n in self.free}

    def recording(self, number: int) -> Recording:
        """Return the recording of a trial, with noise of its own."""
        # cases draw apart, so that bad luck in one is not bad luck in all
        rng = np.random.default_rng([20251, crc32(self.name.encode()), number])
        sensors = [s.name for s in self.graph.of_type(Sensor)]
        arrays = {n: np.asarray(v) for n, v in self.commands.items()}
        for n in sensors:
            arrays[n] = self.clean[n] + self.noise[n] * self._noise(rng)
        units = {e.name: e.unit or "1" for e in self.graph.of_type(Source, Sensor)}
        return Recording(f"trial {number}", self.time, arrays, units)

    def _noise(self, rng: np.random.Generator) -> FloatArray:
        from scipy.signal import lfilter

        run_in = 200
        drive = rng.standard_normal(self.time.size + run_in)
        a = self.colour
        return np.asarray(lfilter([np.sqrt(1 - a * a)], [1.0, -a], drive))[run_in:]

    def study(self, number: int) -> Study:
        """Return the study of a trial: all samples train, starts off the truth."""
        rng = np.random.default_rng([20252, number])
        n = self.time.size
        free = []
        for name, value in self.truth.items():
            p = self.graph.parameters[name]
            away = 1 + self.off * rng.uniform(-1, 1)
            free.append(Vary(name, start=value * away if value else self.off * (p.scale or 1.0)))
        return Study(
            self.graph,
            self.recording(number),
            tuple(free),
            hold="linear",
            noise=self.model,
            nuisances=NO_NUISANCES,
            splits=Split(slice(0, n), slice(n, n), "all samples"),
        )

    def __getstate__(self) -> dict[str, object]:
        """Travel with the clean readings, so that no worker simulates them again."""
        self.clean
        return dict(self.__dict__)


@dataclass(frozen=True, slots=True)
class Count:
    """How often one kind of interval of one parameter held the truth."""

    kind: str
    name: str
    hits: int
    trials: int
    width: float
    """Median width over the truth."""

    @property
    def share(self) -> float:
        """Share of hits."""
        return self.hits / self.trials if self.trials else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the true share (Wilson)."""
        from scipy.stats import binomtest

        if not self.trials:
            return 0.0, 1.0
        low, high = binomtest(self.hits, self.trials).proportion_ci(0.95, "wilson")
        return float(low), float(high)

    @property
    def holds(self) -> bool:
        """Whether 95 % lies in that interval."""
        low, high = self.interval
        return low <= 0.95 <= high


@dataclass(frozen=True)
class Coverage:
    """Result of `coverage`.

    Attributes
    ----------
    trials : int
        Trials that ended.
    failed : int
        Trials whose fit did not converge; they are not counted as hits or misses.
    counts : tuple of Count

    Examples
    --------
    >>> from identification.uncertainty.coverage import Case
    >>> case = Case("positioner", graph, t, {"F": force}, {"x": 2e-6}, ("m", "d", "k"))
    >>> counted = coverage(case, 5, kinds=("fisher",))
    >>> counted.trials, counted.failed
    (5, 0)
    """

    case: str
    trials: int
    failed: int
    counts: tuple[Count, ...]

    def of(self, kind: str) -> tuple[Count, ...]:
        """Return the counts of one kind of interval."""
        return tuple(c for c in self.counts if c.kind == kind)

    def overall(self, kind: str) -> float:
        """Return the share of hits over all parameters."""
        own = self.of(kind)
        return sum(c.hits for c in own) / max(sum(c.trials for c in own), 1)

    def __str__(self) -> str:
        """Table: nominal and actual."""
        lines = [f"{self.case}: {self.trials} trials, {self.failed} without a converged fit"]
        lines.append("  interval   parameter      nominal  actual   (95 % of that)     width/truth")
        for c in self.counts:
            low, high = c.interval
            mark = "" if c.holds else "  *"
            lines.append(
                f"  {c.kind:10s} {c.name:14s}   95.0 %  {100 * c.share:5.1f} %  "
                f"({100 * low:5.1f} .. {100 * high:5.1f} %)  {c.width:.3g}{mark}"
            )
        for kind in dict.fromkeys(c.kind for c in self.counts):
            lines.append(f"  {kind:10s} all              95.0 %  {100 * self.overall(kind):5.1f} %")
        if any(not c.holds for c in self.counts):
            lines.append("  * differs from 95 % beyond what so many trials leave open")
        return "\n".join(lines)


Outcome = dict[tuple[str, str], tuple[bool, float]]


@single_threaded
def trial(case: Case, number: int, kinds: Sequence[str] = KINDS, first: int = 0) -> Outcome | None:
    """Return (inside, width over truth) by kind and parameter; None if the fit failed.

    The truth is inside a profile interval if the misfit with the parameter held there has not risen
    beyond the threshold: one refit. Whole profiles, for their width, are walked in the first
    few trials only (from `first` on); elsewhere the width is NaN.
    """
    try:
        made = estimate(case.study(number))
        if made.status not in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS):
            return None
        fit = from_estimation(made)
    except BondsightError:
        return None
    found: Outcome = {}
    for name, true in case.truth.items():
        for kind in kinds:
            size = abs(true) or 1.0
            if kind == "profile":
                rise, limit = rise_at(fit, name, true)
                width = float("nan")
                if number - first < WIDTHS:
                    low, high = profile_one(fit, name, most=20).interval
                    width = (high - low) / size
                found[kind, name] = (rise <= limit, width)
            else:
                low, high = (fit.plain if kind == "fisher" else fit.robust).interval(name)
                found[kind, name] = (low <= true <= high, (high - low) / size)
    return found


@single_threaded
def coverage(
    case: Case,
    trials: int = 200,
    *,
    kinds: Sequence[str] = KINDS,
    jobs: int = 1,
    first: int = 0,
    progress: Progress | None = None,
) -> Coverage:
    """Run the trials and count.

    Parameters
    ----------
    case : Case
    trials : int
    kinds : sequence of {"fisher", "sandwich", "profile"}
    jobs : int
        Processes (joblib).
    first : int
        Number of the first trial.
    progress : callable, optional
        Called with trials done, trials in all and a text; Ctrl-C keeps the finished trials.

    Examples
    --------
    >>> from identification.uncertainty.coverage import Case
    >>> case = Case("positioner", graph, t, {"F": force}, {"x": 2e-6}, ("m", "d", "k"))
    >>> coverage(case, 5, kinds=("fisher",)).overall("fisher") >= 0.6  # of five trials
    True
    """
    from joblib import delayed

    require_known("kind of interval", "coverage", KINDS, *kinds)
    outcomes: list[Outcome | None] = []
    case.clean
    work = (delayed(trial)(case, first + i, tuple(kinds), first) for i in range(trials))
    try:
        for made in results(work, jobs, ordered=True):
            outcomes.append(made)
            if progress is not None:
                progress(len(outcomes), trials, case.name)
    except KeyboardInterrupt:
        pass
    good = [o for o in outcomes if o is not None]
    counts = []
    for kind in kinds:
        for name in case.free:
            pairs = [o[kind, name] for o in good]
            widths = [w for _, w in pairs if np.isfinite(w)]
            width = float(np.median(widths)) if widths else float("nan")
            counts.append(Count(kind, name, sum(h for h, _ in pairs), len(pairs), width))
    return Coverage(case.name, len(outcomes), len(outcomes) - len(good), tuple(counts))
