"""A push of unknown moments is read off what must have been added where relations locate it."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import Se
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue.outside.external_disturbance import while_it_lasts
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.identification.diagnosis.three_masses import (
    DAMPING,
    DT,
    MASS,
    NOISE,
    STIFFNESS,
    chain,
)
from tests.settled import simulate

N, BEGIN, END, FORCE = 800, 3.1, 4.4, 3.0


def leaned_on() -> Recording:
    """Three masses shaken at the last one, while for a second somebody leans on the first."""
    t = np.asarray(DT * np.arange(N), np.float64)
    rng = np.random.default_rng(0)
    tones, phases = rng.uniform(0.2, 8.0, 12), rng.uniform(0.0, 2 * np.pi, 12)
    force = 6.0 * np.sin(2 * np.pi * np.outer(t, tones) + phases).sum(axis=1)
    true = chain(MASS, STIFFNESS, DAMPING)
    true = true.with_branch("v1", [Se("P", unit="N")])
    x = simulate(true, t, {"F": force, "P": FORCE * ((t > BEGIN) & (t <= END))})
    seen = {n: x[n] + NOISE * rng.standard_normal(N) for n in ("x1", "x2", "x3")}
    return Recording("run", t, {"F": force, **seen}, {"F": "N", "x1": "m", "x2": "m", "x3": "m"})


@pytest.mark.parametrize("summed", [False, True])
def test_a_push_is_seen_in_noise(summed: bool) -> None:
    k = np.arange(1200)
    push = 2.0 * ((k >= 360) & (k < 516))
    noise = np.random.default_rng(0).standard_normal(k.size)
    course = np.cumsum(push) + 3.0 * noise + 0.1 * k if summed else push + noise + 5.0
    assert while_it_lasts(course, summed=summed) == pytest.approx((360, 516), abs=12)


@pytest.mark.long
def test_who_leaned_on_it_and_when() -> None:
    """Two processes: the relations are asked beside the search."""
    model = chain(1.2 * MASS, 0.85 * STIFFNESS, 0.8 * DAMPING)
    options = DiagnosisOptions(jobs=2, effects=1, keep=2, more=1)
    d = diagnose(model, leaned_on(), options=options)
    assert d.kind == "missing_physics"
    assert d.decision is not None
    assert d.decision.chosen is not None
    assert d.decision.chosen.label == "external_disturbance at m1"
    assert {r.ports for r in d.relations} >= {("m1", "k1", "b1"), ("m2",)}
    assert d.repaired is not None
    found = d.repaired.values
    assert found["t_0_outside_m1"] == pytest.approx(BEGIN, abs=2 * DT)
    assert found["t_1_outside_m1"] == pytest.approx(END, abs=2 * DT)
    assert abs(found["h_outside_m1"]) == pytest.approx(FORCE, rel=0.02)
