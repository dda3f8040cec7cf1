"""Recordings whose commands are held at rates of their own, diagnosed together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.laws import Law, Polynomial
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.material import material_of
from identification.study.joined import between_samples, picked
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point
from tests.settled import simulate
from tests.spring import spring

OPTIONS = DiagnosisOptions(jobs=1, effects=1, keep=4, more=2)
NOISE = {"x": 1e-5, "v": 5e-4}
CUBIC = Polynomial(orders=(3,), size=1.0)


def recorded(
    dt: float,
    law: Law | None = None,
    noise: float = 1.0,
    hold: str = "hold",
    end: float = 1.5,
    cubic: float = 2e6,
) -> Recording:
    """A new force at every sample; other samples at another rate."""
    rng = np.random.default_rng(round(1e6 * dt))
    t = np.asarray(dt * np.arange(round(end / dt)), np.float64)
    force = np.asarray(rng.uniform(-40, 40, t.size), np.float64)
    force[0] = 0.0  # all begins at rest
    if hold != "hold":
        force = np.asarray(20 * np.sin(2 * np.pi * (1.0 + 8.0 * t) * t), np.float64)
    values = {"a_3_k": cubic} if law is not None else {}
    run = simulate(
        spring(k=800.0, law=law, speed="v"), t, {"F": force}, values, hold=hold, accuracy=1e-7
    )
    read = {
        n: np.asarray(np.asarray(run[n]) + noise * s * rng.standard_normal(t.size))
        for n, s in NOISE.items()
    }
    return Recording(f"at {dt}", t, {"F": force, **read}, {"F": "N", "x": "m", "v": "m/s"})


@pytest.mark.parametrize("law", [None, CUBIC])
@pytest.mark.parametrize("rates", [(1e-3, 2e-3), (3e-3, 1e-3), (1e-3, 1.25e-3)])
@pytest.mark.parametrize("hold", ["hold", "linear"])
def test_a_command_is_followed_between_the_samples_that_are_taken(
    hold: str, rates: tuple[float, float], law: Law | None
) -> None:
    """The model with the true values reads what was simulated at the rates of the commands."""
    given = [recorded(dt, law, 0.0, hold) for dt in rates]
    graph = spring(k=800.0, law=law, speed="v")
    if law is not None:
        graph = graph.with_values({"a_3_k": 2e6})
    asked = asked_of(graph, given, None, hold, NOISE)
    data = replace(material_of(asked).data, hold=hold)
    assert data.n == sum(-(-r.n // round(max(rates) / r.dt)) for r in given)
    problem = Problem(graph, data, n_sub=72, lags=False)
    point = start_point(problem)
    made = evaluate(problem, point, derivatives=False).y
    away = (made - data.readings) / data.readings.std(axis=0)
    assert np.abs(away).max() < (1e-3 if law else 1e-9)


@pytest.mark.sampled(every=3)
@pytest.mark.slow
@pytest.mark.parametrize("rates", [(1e-3, 2e-3), (2e-3, 1e-3), (1e-3, 1.25e-3), (1.5e-3, 1e-3)])
def test_commands_held_at_two_rates(rates: tuple[float, float]) -> None:
    model = spring(m=0.6, d=1.5, k=700.0, speed="v")
    d = diagnose(model, [recorded(dt) for dt in rates], options=OPTIONS)
    assert d.kind == "parameters_only"
    assert d.nominal is not None
    assert d.nominal.problem.data.hold == "hold"
    assert d.nominal.values["k"] == pytest.approx(800.0, rel=2e-3)
    assert [r.dt for r in d.study.recordings] == pytest.approx(list(rates))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cubic", "end"),
    [
        (2e4, 1.5),
        # a misfit so gross that the recordings are in question first
        pytest.param(2e6, 2.4, marks=pytest.mark.long),
    ],
)
def test_what_is_missing_is_named_across_the_rates(cubic: float, end: float) -> None:
    model = spring(m=0.6, d=1.5, k=700.0, speed="v")
    given = [recorded(dt, CUBIC, end=end, cubic=cubic) for dt in (1e-3, 2e-3)]
    d = diagnose(model, given, options=OPTIONS)
    (first, *_) = d.findings
    assert first.chosen is not None
    assert (first.chosen.effect, first.chosen.element) == ("nonlinear_stiffness", "k")


@pytest.mark.parametrize(
    ("rates", "steps"),
    [
        ((1e-3, 2e-3), [2, 1]), ((1e-3, 1.25e-3), [1, 1]), ((1e-3, 1.6e-3, 5e-3), [5, 3, 1]),
        ((1e-3, 1.4e-2), [14, 1]),
    ],
)  # fmt: skip
def test_rates_that_are_followed_are_never_twice_one_another(
    rates: tuple[float, ...], steps: list[int]
) -> None:
    given = [recorded(dt, noise=0.0) for dt in rates]
    made = picked(given)
    assert [k for k, _ in between_samples(given)] == steps
    assert all(0.5 < a.dt / b.dt < 2.0 for a in made for b in made)
    assert [r.dt for r in made] == pytest.approx(
        [k * dt for k, dt in zip(steps, rates, strict=True)]
    )
