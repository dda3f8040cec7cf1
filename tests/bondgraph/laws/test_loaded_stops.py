"""Stops that were loaded before a run begins."""

import numpy as np
import pytest

from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.graph.drives import Drive
from bondgraph.laws import StopSum
from bondgraph.laws.along import along
from bondgraph.simulation.simulate import simulate_general
from tests.settled import simulate
from tests.spring import spring

ENDS = (0.5, 1.0, 4.0)
HEIGHTS = (2.0, 1.0, 0.5)
BEGUN = ("relaxed", "virgin", "risen", "fallen")
T = np.linspace(0.0, 2.0, 401)
WAY = 2.0 + 6.0 * np.sin(np.pi * T)


@pytest.mark.parametrize(
    ("begun", "first"), [("relaxed", 0.0), ("virgin", 3.0), ("risen", 4.0), ("fallen", -4.0)]
)
def test_what_came_before_is_what_a_long_way_leaves(begun: str, first: float) -> None:
    """At two a virgin bank holds 0.5, 1 and 2 of its ways; a long way leaves all of them."""
    before = {"relaxed": [2.0], "virgin": [0.0], "risen": [-99.0], "fallen": [99.0]}[begun]
    led = along(StopSum(ENDS), np.array([*before, 2.0, *WAY]), 1.0, HEIGHTS)[-WAY.size :]
    found = along(StopSum(ENDS, begun=begun), WAY, 1.0, HEIGHTS)
    assert found[0] == pytest.approx(first)
    np.testing.assert_allclose(found, led, atol=1e-12)


def test_a_large_way_wipes_out_how_they_began() -> None:
    courses = [along(StopSum(ENDS, begun=b), WAY, 1.0, HEIGHTS) for b in BEGUN]
    last = T > 1.6  # the way has gone from its top to its bottom
    assert np.ptp([c[0] for c in courses]) > 3.0
    assert np.ptp([c[last] for c in courses], axis=0).max() < 1e-12


@pytest.mark.parametrize("begun", BEGUN)
def test_a_model_rests_on_them_and_its_ledger_closes(begun: str) -> None:
    law = StopSum((0.009, 0.02, 0.05), height=30.0, begun=begun)
    g = spring(m=0.2).with_element("k", law=law)
    t = np.linspace(0.0, 4.0, 801)
    given = (t, {"F": 5.0 + 3.0 * np.sin(2.0 * t)})
    run = simulate(g, *given, observed=observables(g))
    again = simulate_general(g, *given, x0="rest", hold="linear", accuracy=1e-6)
    assert np.ptp(run["x"][:2]) < 1e-4 * np.ptp(run["x"])  # at rest under the first force
    np.testing.assert_allclose(again["x"], run["x"], atol=2e-4 * np.ptp(run["x"]))
    account = ledger(g, run)
    assert account.closes


def test_a_drive_may_be_loaded_too() -> None:
    u = 5.0 + 5.0 * np.sin(np.pi * T)
    ends = {}
    for begun in BEGUN:
        law = StopSum((1.0, 3.0), height=0.1, sign=-1.0, begun=begun)
        run = simulate(spring(m=0.2).with_element("F", drive=Drive(law=law)), T, {"F": u})
        ends[begun] = float(run["x"][0])
    assert ends["virgin"] == pytest.approx(ends["risen"])
    assert ends["risen"] < ends["relaxed"] < ends["fallen"]
