"""Thresholds that nobody measured set a scale: what rests on them is said."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, One, R, Se, Zero
from bondgraph.laws import Parametrised, StopSum
from bondgraph.signals.recording import Recording
from bondsight import Study, estimate, identifiability, judge
from identification.uncertainty.pinned import pinned
from tests.settled import simulate

T = np.asarray(2e-5 * np.arange(400))
V = 50 * np.sin(2 * np.pi * 190 * T) + 20 * np.sin(2 * np.pi * 630 * T + 1)
SAYS = (
    "thresholds_1_C_p and 1 more are fixed and set a scale that no reading tells: without them R_s "
    "and C_p are told only as R_s*C_p; values and intervals of each of these alone are those of "
    "the chosen thresholds"
)


def charged(current: bool = False, fixed: bool = True) -> BondGraph:
    """A capacitor with memory behind a resistor; its voltage is read, its charge may be."""
    law = StopSum((2e-5, 8e-5), height=4e4, unit="1/F")
    with BondGraph("charged") as g:
        loop, node = One("loop"), Zero("node")
        Se("V", unit="V") >> loop >> R("R_s", 50.0, unit="ohm")
        lifted = Parametrised(law, ("thresholds",), ("C",)) if fixed else None
        loop >> node >> C("C_p", 3e-6, unit="F", law=lifted)
        node >> De("V_p", unit="V")
        if current:
            loop >> Df("i", unit="A")
    return g


def test_values_that_rest_on_thresholds_are_told_by_fit_and_structure() -> None:
    g = charged()
    assert pinned(g, ("R_s", "C_p", "h_1_C_p", "h_2_C_p")) == (SAYS,)
    y = simulate(g, T, {"V": V})["V_p"] + 0.02 * np.random.default_rng(0).standard_normal(T.size)
    made = estimate(Study(g, Recording("r", T, {"V": V, "V_p": y}, {"V": "V", "V_p": "V"})))
    assert SAYS in made.notes
    (together,) = judge(made).material.tied
    assert together.only == "R_s*C_p"
    low, high = together.told[0].ci95
    assert low < 150e-6 < high
    structure = identifiability(g)
    assert not structure.groups  # beside its thresholds the law tells each of them
    assert f"  but {SAYS}" in str(structure)


@pytest.mark.parametrize("graph", [charged(current=True), charged(fixed=False)])
def test_where_a_reading_tells_the_scale_nothing_rests_on_thresholds(graph: BondGraph) -> None:
    free = [n for n, p in graph.parameters.items() if not p.fixed]
    assert pinned(graph, free) == ()
    assert "but" not in str(identifiability(graph, free))
