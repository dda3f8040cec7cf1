"""A wave along many periods of a way that a free run loses: the recorded way leads to it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import Coulomb, Periodic
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from bondgraph.simulation.dynamics import dynamics_of
from bondgraph.support.arrays import FloatArray
from identification.diagnosis.catalogue.transduction.position_periodic_force import (
    periods,
    seen_to_repeat,
)
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.explanation.law_formula import meaning_of
from identification.diagnosis.screening.carried import astray, carried_away
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import fit
from identification.report.numbers import quantity
from identification.study.data import data_for
from identification.study.origins import own_origins
from identification.study.priors import Normal
from identification.study.problem import Problem
from tests.settled import simulate

N, DT = 3000, 2e-3
PERIOD = 2 * np.pi / 6
TIME = DT * np.arange(N)


def motor(spring: float = 0.0) -> BondGraph:
    with BondGraph("motor") as g:
        shaft = One("shaft")
        Se("M", unit="N*m") >> shaft >> I("J", 5e-4, unit="kg*m2")
        shaft >> R("b", 2e-3, unit="N*m*s/rad")
        if spring:
            shaft >> C("k", stiffness=spring, unit="N*m/rad")
        shaft >> Dq("phi", unit="rad")
    return g


def with_wave(g: BondGraph) -> BondGraph:
    return g.with_branch("shaft", [C("cogs", law=Periodic(PERIOD, 0.02, 20.0, "N*m", "rad"))])


def torque() -> FloatArray:
    tones = ((0.4, 0.0), (0.9, 1.0), (2.3, 2.0), (5.1, 0.5), (11.0, 4.0))
    return np.asarray(0.06 * sum(np.sin(2 * np.pi * f * TIME + p) for f, p in tones))


def recording(noise: float = 2e-4) -> Recording:
    held = with_wave(motor()).with_values({"J": 5.6e-4, "b": 2.6e-3, "a_cogs": 0.03, "b_cogs": 0.0})
    phi = np.asarray(simulate(held, TIME, {"M": torque()}, hold="linear")["phi"])
    phi = phi + noise * np.random.default_rng(7).standard_normal(N)
    return Recording.from_arrays("cogs", {"M[N*m]": torque(), "phi[rad]": phi}, fs=1 / DT)


@pytest.fixture(scope="module")
def recorded() -> Recording:
    return recording()


@pytest.mark.long
def test_a_wave_over_many_periods_is_named_with_its_amplitude(recorded: Recording) -> None:
    assert np.ptp(recorded["phi"]) > 14 * PERIOD
    found = diagnose(motor(), recorded, options=DiagnosisOptions(jobs=1))
    assert [d.chosen.label for d in found.findings if d.chosen] == ["position_periodic_force at J"]
    (chosen,) = (d.chosen for d in found.findings if d.chosen)
    known = {e.name: e for e in chosen.fit.estimates}
    size = np.hypot(known["a_ripple_J"].value, known["b_ripple_J"].value)
    assert size == pytest.approx(0.03, rel=0.01)
    said = f"with the cosine, the amplitude of the wave is {quantity(size, 'N*m')}"
    assert meaning_of("a_ripple_J", chosen).endswith(said)
    assert known["period_ripple_J"].value == pytest.approx(PERIOD, rel=1e-3)
    for name in ("a_ripple_J", "b_ripple_J"):
        low, high = known[name].ci95
        assert high - low < 0.01
    for name, true in (("J", 5.6e-4), ("b", 2.6e-3)):
        assert known[name].value == pytest.approx(true, rel=0.02)


def test_the_way_is_the_recorded_one(recorded: Recording) -> None:
    problem = _problem(recorded)
    fit = nominal_fit(motor(), problem.data)[1]
    seen = scene(fit)
    way = seen.past["J"].recorded
    assert way is not None
    assert np.array_equal(way, fit.problem.data.readings[:, 0])
    assert seen.past["M"].recorded is None
    assert np.abs(fit.simulated[:, 0] - way).max() > 0.1 * PERIOD  # where the fit went says less


def test_a_scan_resolves_what_the_samples_do() -> None:
    way = 100.0 * (1 - np.cos(np.linspace(0, np.pi, 8000))) / 2
    tried = periods(way)
    assert tried.min() < 1.0
    assert np.abs(np.diff(1 / tried)).max() * np.ptp(way) < 0.34  # of a turn, over the range
    slow = periods(np.linspace(0.0, 1.0, 50))
    assert slow.min() > 2 / 49


def test_short_periods_are_seen_to_repeat() -> None:
    """340 waves over a way that is gone at changing speeds, behind a lag."""
    rng = np.random.default_rng(4)
    speed = np.repeat(rng.uniform(20.0, 90.0, 16), 500)
    way = np.cumsum(speed) * 5e-4
    wave = np.sin(6.0 * way + 0.4)
    lagged = lfilter([0.05], [1.0, -0.95], wave) + 0.05 * rng.standard_normal(way.size)
    found = seen_to_repeat(way, lagged[:, None], float(periods(way).min()))
    assert np.abs(2 * np.pi / found - 6.0).min() < 0.01
    assert found.max() < periods(way).min()
    nothing = seen_to_repeat(np.zeros(100), np.ones((100, 1)), 1.0)
    assert nothing.size == 0


@pytest.mark.parametrize("spring", [0.0, 0.1])
def test_where_a_wave_begins_is_said_by_its_own_numbers(spring: float) -> None:
    names = dynamics_of(with_wave(motor(spring))).state_names
    assert [names[i] for i in _origins(with_wave(motor(spring)))] == ["q_cogs"]


def test_nothing_else_may_begin_anywhere() -> None:
    law = Coulomb(0.01)
    rubbing = motor(spring=0.1).with_branch("shaft", [R("dry", 1e-9, law=law, unit="N*m*s/rad")])
    assert _origins(rubbing) == ()


def test_a_reading_with_a_gain_tells_the_way_before_it(recorded: Recording) -> None:
    """Of an encoder that counts twice a turn the way is half of what it reads."""
    geared = motor().with_element("phi", gain=2.0)
    double = replace(recorded, channels={**recorded.channels, "phi": 2.0 * recorded["phi"]})
    data = data_for(geared, double, interleaved(0, N), {"phi": 4e-4})
    way = scene(fit(Problem(geared, data), max_iterations=1)).past["J"].recorded
    assert way is not None
    np.testing.assert_allclose(way, recorded["phi"])


def test_windows_and_known_positions_leave_it_free(recorded: Recording) -> None:
    g = with_wave(motor())
    data = data_for(g, recorded, interleaved(0, recorded.n), {"phi": 2e-4})
    names = dynamics_of(g).state_names
    assert "q_cogs" in names
    free = {
        "one run": Problem(g, data),
        "windows": Problem(g, data, window=200),
        "a reading without offset": Problem(g, data, offsets=False),
        "a known offset": Problem(g.with_element("phi", offset=0.0), data),
        "a known wave": Problem(g, data, fixed=("a_cogs",)),
        "a wave known before": Problem(g, data, priors={"b_cogs": Normal(0.01, 0.001)}),
    }
    held = {k: "q_cogs" not in [names[i] for i in p.free_states] for k, p in free.items()}
    assert [k for k, stays in held.items() if stays] == ["one run"]


def test_a_plant_that_ran_away_is_looked_at_from_declared_values(recorded: Recording) -> None:
    fit = nominal_fit(motor(), _problem(recorded).data)[1]
    assert not carried_away(fit)
    heavy = motor().with_values({"J": 5e-4 * 1e3, "b": 2e-3 * 1e3})
    assert not carried_away(nominal_fit(heavy, _problem(recorded).data)[1])  # two are not several
    assert not astray(fit)


def test_values_that_nothing_can_have_tell_no_place(recorded: Recording) -> None:
    g = motor(spring=1e-9).with_values({"J": 5e-4, "b": 2e-3})
    fit = nominal_fit(motor(), _problem(recorded).data)[1]
    moved = [replace(e, value=40.0 * e.value) for e in fit.estimates[:1]] * 3
    named = [replace(e, name=n) for e, n in zip(moved, ("J", "b", "k"), strict=True)]
    declared = {n: p.value for n, p in g.parameters.items()}
    lost: Any = SimpleNamespace(
        problem=SimpleNamespace(source_offsets=True, graph=g), chi2=lambda part: 1e4,
        estimates=[replace(e, value=40.0 * declared[e.name]) for e in named],
    )  # fmt: skip
    assert carried_away(lost)
    lost.estimates = lost.estimates[:2]
    assert not carried_away(lost)
    lost.estimates, lost.problem.source_offsets = lost.estimates * 2, False
    assert not carried_away(lost)


def _problem(recorded: Recording) -> Problem:
    g = motor()
    return Problem(g, data_for(g, recorded, interleaved(0, recorded.n), {"phi": 2e-4}))


def _origins(g: BondGraph) -> tuple[int, ...]:
    compiled = dynamics_of(g).lure
    assert compiled is not None
    return own_origins(compiled, {"a_cogs", "b_cogs"})
