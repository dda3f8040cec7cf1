"""Fits of simulated measurements reach the intervals that a design expects."""

from __future__ import annotations

import numpy as np
from scipy.stats import binom, chi2

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import FloatArray
from identification.estimation import NO_NUISANCES, Nuisances, Study, estimate
from identification.experiments.design import (
    ExpectedTable,
    Signal,
    optimal_multisine,
    rank_signals,
    reversal_curves,
)
from tests.identification.experiments.design.plants import NOISE, stage
from tests.spring import spring


def errors_of(
    graph: BondGraph, signal: Signal, noise: dict[str, float], names: list[str], fits: int,
    initial: str = "free", offsets: bool = False,
) -> FloatArray:  # fmt: skip
    """Estimate less truth of simulated measurements with new noise each, shape (fits, n)."""
    run_in = signal.period if signal.period and initial == "free" else 0
    driven = signal.repeated(signal.periods + 1) if run_in else signal
    # the error of the simulated truth is the same at every fit: far below the noise
    clean = simulate(
        graph, driven.time, driven.commands, hold=signal.between, accuracy=1e-6, x0="rest"
    )
    rng, n = np.random.default_rng(0), signal.values.size
    units = {e.name: e.unit or "1" for e in graph.of_type(Source, Sensor)}
    found = []
    for k in range(fits):
        read = {o: clean[o][run_in:] + noise[o] * rng.standard_normal(n) for o in noise}
        channels = {signal.name: driven.values[run_in:], **read}
        record = Recording(f"simulated {k}", signal.time, channels, units)
        study = Study(
            graph, record, free=names, initial=initial, hold=signal.between, noise=noise,
            splits=Split(slice(0, n), slice(n, n), "all samples fit"),
            nuisances=Nuisances(lags=False) if offsets else NO_NUISANCES,
        )  # fmt: skip
        values = estimate(study).values
        found.append([values[q] - graph.parameters[q].value for q in names])
    return np.array(found)


def plausible(errors: FloatArray, sd: list[float]) -> bool:
    """Whether the errors are those of exact predictions, at 0.1 % in each tail."""
    over, fits = errors / np.array(sd), errors.shape[0]
    ratio, covered = np.sqrt(np.mean(over**2, axis=0)), np.mean(np.abs(over) < 1.96, axis=0)
    low, high = np.sqrt(chi2.ppf([0.001, 0.999], fits) / fits)
    least = binom.ppf(0.001, fits, 0.95) / fits
    return bool((ratio > low).all() and (ratio < high).all() and (covered >= least).all())


def names_of(expected: ExpectedTable) -> list[str]:
    return [r.name for r in expected.rows]


def test_fits_reach_the_expected_intervals() -> None:
    p = optimal_multisine(spring(), "F", NOISE, rate=50.0, period=500, band=(0.1, 15.0), periods=2)
    rows = p.expected.rows
    best = errors_of(spring(), p.signal, NOISE, names_of(p.expected), fits=16)
    flat = errors_of(spring(), p.flat, NOISE, names_of(p.expected), fits=16)
    assert plausible(best, [r.sd for r in rows]), str(best)
    assert plausible(flat, [r.reference for r in rows]), str(flat)
    assert p.expected["d"].narrower > 3


def test_fits_of_a_memory_reach_the_expected_intervals() -> None:
    tour = reversal_curves(50.0, 4, 1000.0, slew=500.0, lowest=-50.0, name="F", unit="N")
    found = rank_signals(stage(), [tour], {"x": 2e-6}, initial="rest")
    names = names_of(found.expected)
    done = errors_of(stage(), found.best, {"x": 2e-6}, names, 8, initial="rest", offsets=True)
    assert plausible(done, [r.sd for r in found.expected.rows]), str(done)


def test_a_wrong_prediction_is_not_plausible() -> None:
    p = optimal_multisine(spring(), "F", NOISE, rate=50.0, period=500, band=(0.1, 15.0))
    wrong = [r.sd / 3 for r in p.expected.rows]
    assert not plausible(errors_of(spring(), p.signal, NOISE, names_of(p.expected), 5), wrong)
