"""The simulated device takes its samples when its clock says."""

from __future__ import annotations

import numpy as np
import pytest

from hardware.simulators.rig import DeviceClock
from hardware.simulators.siosifm.run import CLOCK, START, MeasurementRun


@pytest.mark.parametrize("ppm", [-300.0, 0.0, 37.0])
@pytest.mark.parametrize("drift", [-20.0, 0.0, 50.0])
@pytest.mark.parametrize("offset", [0.0, 3.2e-4])
def test_samples_due_are_those_whose_instant_is_past(
    ppm: float, drift: float, offset: float
) -> None:
    clock = DeviceClock(ppm=ppm, drift_ppm=drift, offset=offset)
    run = MeasurementRun(clock, 3125.0, 0, 2.0, lambda first: (), lambda first: ())
    rng = np.random.default_rng(5)
    for now in 2.0 + np.concatenate([rng.uniform(0.0, 60.0, 50), [0.0, offset, 1.0]]):
        due = run.due(float(now))
        around = run.instants(max(due - 1, 0), 2)
        if due:
            assert around[0] <= now + 1e-9
            assert around[1] > now - 1e-9
        else:
            assert around[0] > now - 1e-9


def test_edges_before_arming_and_second_edges_do_not_count() -> None:
    edges = [0.5, 1.0]
    run = MeasurementRun(
        DeviceClock(), 1000.0, START, 1.0, lambda first: edges[first:], lambda first: (), 1e-3
    )
    assert run.due(5.0) == 0
    edges += [1.25, 1.5]
    assert run.begin() == 1.251
    assert run.due(1.2515) == 1
    assert run.due(1.75) == 500


def test_edges_may_jitter() -> None:
    edges = list(np.arange(1, 101) * 1e-3)
    clock = DeviceClock(offset=1e-5, jitter=1e-6)
    clocks: list[float] = []
    run = MeasurementRun(clock, 1000.0, CLOCK, 0.0, lambda first: (), lambda first: clocks[first:])
    clocks += edges
    assert run.due(0.05) == 49  # the 50th comes 10 us behind its edge
    late = run.instants(0, 49) - np.array(edges[:49])
    assert np.mean(late) == pytest.approx(1e-5, abs=1e-6)
    assert 0.5e-6 < np.std(late) < 2e-6
