"""Do fits reach the expected intervals? Simulated measurements, fitted again and again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, chi2

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.estimation import NO_NUISANCES, Nuisances, Study, estimate
from identification.experiments.design.expected import ExpectedTable
from identification.experiments.design.signal import Signal

ACCURACY = 1e-6
"""Of the simulated truth: its error is the same at every fit, so it must stay far below the noise
over the root of the number of samples."""


@dataclass(frozen=True, slots=True, eq=False)
class VerifiedIntervals:
    """Fits of simulated measurements beside what was expected of them.

    Parameters
    ----------
    names : tuple of str
        Parameters.
    errors : ndarray, shape (fits, n)
        Estimate less truth, over the expected standard deviation.
    """

    names: tuple[str, ...]
    errors: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Root mean square error over the expected standard deviation, shape (n,)."""
        return np.asarray(np.sqrt(np.mean(self.errors**2, axis=0)))

    @property
    def covered(self) -> FloatArray:
        """Share of the fits within the expected 95 % interval, shape (n,)."""
        return np.asarray(np.mean(np.abs(self.errors) < 1.96, axis=0))

    @property
    def plausible(self) -> bool:
        """Whether ratios and shares are those of exact predictions, at 0.1 % in each tail."""
        fits = self.errors.shape[0]
        low, high = np.sqrt(chi2.ppf([0.001, 0.999], fits) / fits)
        least = binom.ppf(0.001, fits, 0.95) / fits
        return bool(
            (self.ratio > low).all() and (self.ratio < high).all() and (self.covered >= least).all()
        )

    def __str__(self) -> str:
        """One line a parameter."""
        rows = [
            f"  {n}: error {r:.3f} of the expected sd, {100 * c:.1f} % within the expected 95 %"
            for n, r, c in zip(self.names, self.ratio, self.covered, strict=True)
        ]
        return "\n".join([f"{self.errors.shape[0]} simulated fits", *rows])


def verify(
    graph: BondGraph,
    signal: Signal,
    noise: Mapping[str, float],
    expected: ExpectedTable,
    *,
    initial: str = "free",
    offsets: bool = True,
    reference: bool = False,
    fits: int = 50,
    seed: int = 0,
) -> VerifiedIntervals:
    """Simulate measurements with `signal`, fit them, and compare the errors with `expected`.

    Parameters
    ----------
    graph : BondGraph
    noise : mapping of str to float
        White, of each sensor read, SI.
    expected : ExpectedTable
        Of a `Proposal` or a `Ranking`.
    initial, offsets
        As the design assumed. With ``"free"`` a periodic signal runs in for one period.
    reference : bool
        Compare with the reference column, where `signal` is the reference input.
    fits : int
        Number of simulated measurements.
    """
    names = tuple(r.name for r in expected.rows)
    run_in = signal.period if signal.period and initial == "free" else 0
    driven = signal.repeated(signal.periods + 1) if run_in else signal
    units = {s.name: s.unit or "1" for s in graph.of_type(Source)}
    clean = simulate(
        graph, driven.time, driven.commands, hold=signal.between, accuracy=ACCURACY, x0="rest"
    )
    exact = {n: clean[n][run_in:] for n in noise}
    truth = {r.name: float(r.value) for r in expected.rows}
    size = np.array([r.reference if reference else r.sd for r in expected.rows])
    if not np.isfinite(size).all():
        raise UnusableInput("verify: an expected standard deviation is infinite; nothing to check")
    rng = np.random.default_rng(seed)
    n = signal.values.size
    split = Split(slice(0, n), slice(n, n), "all samples fit")
    errors = np.empty((fits, len(names)))
    for k in range(fits):
        read = {o: y + noise[o] * rng.standard_normal(n) for o, y in exact.items()}
        record = Recording(
            f"simulated {k}", signal.time,
            {**{c: v[run_in:] for c, v in driven.commands.items()}, **read},
            {**units, **{s.name: s.unit or "1" for s in graph.of_type(Sensor) if s.name in noise}},
        )  # fmt: skip
        study = Study(
            graph, record, free=names, initial=initial, hold=signal.between,
            noise=dict(noise), splits=split,
            nuisances=Nuisances(offsets=True, lags=False) if offsets else NO_NUISANCES,
        )  # fmt: skip
        found = estimate(study)
        errors[k] = [found.values[q] - truth[q] for q in names]
    return VerifiedIntervals(names, errors / size)
