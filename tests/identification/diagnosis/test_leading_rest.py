"""A rest that is not scored: no state that would be free to be anything runs away in it."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.drives import Drive
from bondgraph.laws import Coulomb, Law
from bondgraph.signals.recording import Recording
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.material import STILL, material_of
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import Fit
from tests.settled import simulate

REST, N, DT = 500, 1500, 4e-3


def swing(law: Law | None = None) -> BondGraph:
    """A shaft on a spring that may rub."""
    with BondGraph("swing") as g:
        shaft = One("shaft")
        Se("T", unit="N*m") >> shaft >> I("J", 0.01, unit="kg*m^2")
        shaft >> R("d", 0.05, unit="N*m*s/rad", law=law)
        shaft >> C("k", stiffness=2.0, unit="N*m/rad")
        shaft >> Dq("phi", unit="rad")
    return g


@pytest.fixture(scope="module")
def nominal() -> Fit:
    """The shaft as it is, fitted to one that rubs, whose command rests for 500 samples."""
    rng, t = np.random.default_rng(3), np.arange(N) * DT
    u, moving = np.zeros(N), t[REST:] - t[REST]
    for f in (0.5, 0.9, 1.3, 1.9, 2.6, 3.4):
        u[REST:] += 0.3 * np.sin(2 * np.pi * f * moving + rng.uniform(0.0, 6.0))
    made = simulate(swing(Coulomb(0.08)), t, {"T": u}, accuracy=1e-5)
    phi = made["phi"] + 2e-4 * rng.standard_normal(N)
    recording = Recording.from_arrays("rests", {"T[N*m]": u, "phi[rad]": phi}, fs=1.0 / DT)
    graph = swing()
    data = material_of(asked_of(graph, recording, None, None, {})).data
    return nominal_fit(graph, data, "hold")[1]


def test_a_state_does_not_run_away_in_a_rest_that_is_not_scored(nominal: Fit) -> None:
    data = nominal.problem.data
    rest, moving = nominal.simulated[:REST, 0], data.readings[REST:, 0]
    assert data.split.rest == slice(0, REST)
    assert np.isfinite(nominal.simulated).all()
    assert np.abs(rest).max() < 0.2 * np.abs(moving).max()


def test_histories_of_ports_are_of_the_size_of_what_was_recorded(nominal: Fit) -> None:
    spring = scene(nominal).past["k"]
    assert spring.n == N
    assert spring.half < 1.2 * np.abs(nominal.problem.data.readings).max()


def test_thinned_and_shorter_data_begin_where_the_rest_ends(nominal: Fit) -> None:
    data = nominal.problem.data
    assert data.begin == REST - STILL
    assert data.thinned(3).begin == (REST - STILL) // 3
    assert data.begun(REST // 2).begin < REST // 2
    assert data.first(N // 2).begin == 0


def test_a_late_command_rests_as_long_before(nominal: Fit) -> None:
    data = nominal.problem.data
    channels = {"T[N*m]": data.commands["T"], "phi[rad]": data.readings[:, 0]}
    recording = Recording.from_arrays("rests", channels, fs=1.0 / DT)
    graph = swing()
    with graph:
        graph.parameter("late", 40 * DT, unit="s")
    graph = graph.with_element("T", drive=Drive(delay="late"))
    late = material_of(asked_of(graph, recording, None, None, {})).data
    assert late.split.rest is not None
    assert late.begin == late.split.rest.stop - STILL - 40
