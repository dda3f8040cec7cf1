"""Fits of simulated measurements reach the intervals that a design expects."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bondgraph.support.errors import UnusableInput
from identification.experiments.design import (
    ExpectedTable,
    optimal_multisine,
    rank_signals,
    reversal_curves,
)
from tests.identification.experiments.design.plants import NOISE, stage
from tests.identification.experiments.design.verification import verify
from tests.spring import spring


def test_fits_reach_the_expected_intervals() -> None:
    p = optimal_multisine(spring(), "F", NOISE, rate=50.0, period=500, band=(0.1, 15.0), periods=2)
    best = verify(spring(), p.signal, NOISE, p.expected, fits=16, offsets=False)
    flat = verify(spring(), p.flat, NOISE, p.expected, fits=16, offsets=False, reference=True)
    assert best.plausible, str(best)
    assert flat.plausible, str(flat)
    assert p.expected["d"].narrower > 3


@pytest.mark.long
def test_fits_of_a_memory_reach_the_expected_intervals() -> None:
    tour = reversal_curves(50.0, 4, 1000.0, slew=500.0, lowest=-50.0, name="F", unit="N")
    found = rank_signals(stage(), [tour], {"x": 2e-6}, initial="rest")
    done = verify(stage(), found.best, {"x": 2e-6}, found.expected, initial="rest", fits=8)
    assert done.plausible, str(done)


def test_a_wrong_prediction_is_not_plausible() -> None:
    p = optimal_multisine(spring(), "F", NOISE, rate=50.0, period=500, band=(0.1, 15.0))
    wrong = ExpectedTable(tuple(replace(r, sd=r.sd / 3) for r in p.expected.rows), "nothing")
    assert not verify(spring(), p.signal, NOISE, wrong, fits=5, offsets=False).plausible
    blind = ExpectedTable(tuple(replace(r, sd=float("inf")) for r in p.expected.rows), "nothing")
    with pytest.raises(UnusableInput, match="infinite"):
        verify(spring(), p.signal, NOISE, blind)
