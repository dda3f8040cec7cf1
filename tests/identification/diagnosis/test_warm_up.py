"""A sensor whose zero settles while it warms up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.laws import WarmUp
from bondgraph.signals.recording import Recording
from bondgraph.support.ops import NUMPY
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate
from tests.spring import spring


def test_it_moves_to_its_height_with_its_time_constant() -> None:
    t = np.linspace(0.0, 20.0, 2001)
    course = np.asarray(WarmUp().deviation(NUMPY, 0.0, (t,), [2.0, 1.5, 0.0]))
    assert course[0] == 0.0
    assert course[-1] == pytest.approx(2.0, rel=1e-5)
    np.testing.assert_allclose(1.5 * np.gradient(course, t)[1:-1], 2.0 - course[1:-1], rtol=1e-3)


@pytest.mark.long
def test_a_reading_that_warms_up_is_a_drift_with_a_level() -> None:
    """No line and no parabola follows a time constant of a tenth of the record.

    A spring that yields under a load from before the record looks the same.
    """
    rng, t = np.random.default_rng(7), np.asarray(2e-3 * np.arange(3000), np.float64)
    force = np.repeat(rng.normal(size=60), 50)
    model = spring(1.0, 6.0, 100.0)
    x = np.asarray(simulate(model, t, {"F": force})["x"])
    drifting = x + 0.5 * x.std() * -np.expm1(-t / 0.6)
    noisy = drifting + 0.01 * x.std() * rng.normal(size=t.size)
    recording = Recording("run", t, {"F": force, "x": noisy}, {"F": "N", "x": "m"})
    options = DiagnosisOptions(jobs=1, keep=1, more=4, effects=1)
    unsure = diagnose(model, recording, options=options)
    assert {t.effect for t in unsure.findings[0].possible} == {"sensor_drift", "creep"}
    found = diagnose(model, recording, options=replace(options, without=("creep",)))
    (step,) = found.findings
    assert step.chosen is not None
    assert (step.answer, step.chosen.insertion.law) == ("exact", "warm_up")
    assert step.chosen.label == "sensor_drift at x"
    values = {e.name: e.ci95 for e in step.chosen.fit.estimates}
    for name, truth in (("h_x", 0.5 * x.std()), ("tau_x", 0.6)):
        low, high = values[name]
        assert low < truth < high, name
