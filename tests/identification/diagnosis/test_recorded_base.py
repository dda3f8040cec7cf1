"""An accelerometer on a body whose base is recorded by its displacement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph import BondGraph, C, Da, I, One, R, Sf, Zero
from bondgraph.signals.recording import Recording, Split
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.screening.observation import traced
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.estimation.estimate import estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import start_point
from identification.study.study import Study
from tests.identification.study.general_plants import general
from tests.settled import simulate

N, FS, FINE = 1200, 200.0, 8
OPTIONS = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)


def shaken(given: str, stiffness: float = 200.0, damping: float = 0.8) -> BondGraph:
    with BondGraph("shaken") as g:
        unit = "m" if given == "integral" else "m/s"
        base, s, gap, body = Sf("b", unit=unit, given=given), Zero("s"), One("gap"), One("body")
        base >> s >> body >> I("m", 0.3, unit="kg", fixed=True)
        s >> gap >> C("k", stiffness=stiffness, unit="N/m")
        gap >> R("d", damping, unit="N*s/m")
        body >> Da("a", unit="m/s^2")
    return g


def measured(noise: float = 0.0) -> Recording:
    """Simulated on a grid eight times finer, by the velocity; noise over the base's spread."""
    rng = np.random.default_rng(1)
    t = np.arange(N * FINE) / (FS * FINE)
    f, phase = np.linspace(0.7, 20, 30), rng.uniform(0, 6.28, 30)
    w = 2 * np.pi * f
    speed = np.cos(np.outer(t, w) + phase) @ (1e-3 * w / f)
    way = np.sin(np.outer(t, w) + phase) @ (1e-3 / f)
    a = np.asarray(simulate(shaken("value"), t, {"b": speed})["a"])[::FINE]
    b = (way - way[0])[::FINE]
    a = a + 1e-3 * a.std() * rng.standard_normal(N)
    b = b + noise * b.std() * rng.standard_normal(N)
    return Recording("run", np.asarray(t[::FINE]), {"b": b, "a": a}, {"b": "m", "a": "m/s^2"})


def test_windows_do_not_cut_the_spline_of_the_base() -> None:
    """Where a window begins the base is on its way: its speed there is not that at an end."""
    t = np.arange(60) / FS
    split = Split(slice(0, 60), slice(60, 60), "all")
    b = {"b": 0.01 * np.sin(40 * t) * t}
    data = Data("run", t, b, np.sin(30 * t)[:, None], ("a",), np.ones(1), split)
    graph = shaken("integral")
    asked = Problem(graph, data, window=20, built=general(graph))
    posed = replace(asked, data=replace(data, breaks=(20, 40), cuts=(20, 40)), window=None)
    fits = [
        Fit(p, start_point(p), FitStatus.CONVERGED, 1.0, 0, data.readings) for p in (asked, posed)
    ]
    for seen in (
        [f.problem.inputs for f in fits],
        [probes(f)._base_inputs for f in fits],
        [np.array(traced(f, "k")) for f in fits],
    ):
        assert np.isfinite(seen[0]).all()
        np.testing.assert_allclose(seen[1], seen[0], atol=1e-12 * np.abs(seen[0]).max())


def test_nothing_is_missing_where_nothing_is() -> None:
    graph = shaken("integral", 220.0, 1.0)
    made = estimate(Study(graph, measured()))
    assert abs(made.values["k"] / 200.0 - 1) < 1e-3
    assert abs(made.values["d"] / 0.8 - 1) < 1e-2
    d = diagnose(graph, measured(), options=OPTIONS)
    assert d.kind == "parameters_only"
    assert not any("every second sample" in n for n in d.notes)


def test_a_rate_that_noise_hides_is_told_with_what_to_record() -> None:
    made = estimate(Study(shaken("integral"), measured(0.02)))
    (line,) = (c for c in made.notes if "every second sample" in c)
    assert line.startswith("b acts by the rate")
    assert "given='rate'" in line
