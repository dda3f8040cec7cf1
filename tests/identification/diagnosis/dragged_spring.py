"""A spring whose damper drags, simulated with many more steps than a search takes."""

from __future__ import annotations

import numpy as np

from bondgraph.laws import QuadraticDrag
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate
from tests.spring import spring

N, RATE, FINER, NOISE = 4000, 50.0, 32, 2e-5
TRUE = {"m": 0.5, "d": 2.0, "k": 200.0, "c_2_d": 3.0}


def recorded(offset: float = 0.0) -> Recording:
    """Return force and position; the sensor reads `offset` where nothing moves."""
    t, draw = np.arange(N) / RATE, np.random.default_rng(1)
    lines = np.arange(0.3, 6.0, 0.37)
    phases = draw.uniform(0.0, 2 * np.pi, lines.size)
    u = 3.0 * np.sin(2 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
    fine = np.arange(N * FINER) / (RATE * FINER)
    plant = spring().with_element("d", law=QuadraticDrag())
    x = simulate(plant, fine, {"F": np.interp(fine, t, u)}, {"c_2_d": 3.0})["x"][::FINER]
    x = x + offset + NOISE * draw.standard_normal(N)
    return Recording.from_arrays("drag", {"F[N]": u, "x[m]": x}, fs=RATE)


def diagnosed(offset: float = 0.0) -> Diagnosis:
    """Diagnose it with its own effect alone."""
    others = tuple(e.name for e in CATALOGUE if e.name != "quadratic_drag")
    options = DiagnosisOptions(jobs=1, effects=1, keep=2, more=0, without=others)
    return diagnose(
        spring(m=0.55, d=2.3, k=180.0), recorded(offset), options=options, noise={"x": NOISE},
        hold="linear",
    )  # fmt: skip
