"""Storages that a loop of bonds ties to what drives it, by hand."""

from __future__ import annotations

import pytest

from bondgraph import GY, TF, BondGraph, CausalConflict, De, I, One, R, Sf, Zero
from bondgraph.causality.assignment import assign_causality
from bondgraph.equations.derivation import equations
from bondgraph.graph.parameter import symbol


def ring(ohmic: bool = False) -> BondGraph:
    """A gyrator beside a 1-junction, whose loop leaves the inertia nothing but the source's flow.

    At `left` the flow ``f`` of `across` and that of the gyrator, ``e_right / r``, leave beside the
    one through the transformer; at `right` ``f + u + e_left / r = 0``, and `across` makes the two
    efforts equal. So the transformer carries ``-f - e_right / r``, which is
    ``u + e_left / r - e_right / r = u``.
    """
    with BondGraph("ring") as g:
        left, across, right, end = Zero("left"), One("across"), Zero("right"), One("end")
        left >> across >> right
        left >> TF("n", ratio=3.0) >> end
        left >> GY("r", ratio=2.0) >> right
        Sf("u") >> right
        end >> I("s", 0.5)
        if ohmic:
            end >> R("d", 0.1)
        left >> De("e")
    return g


@pytest.mark.parametrize("ohmic", [False, True])
def test_the_inertia_follows_the_source(ohmic: bool) -> None:
    g = ring(ohmic)
    with pytest.raises(CausalConflict):
        assign_causality(g)
    model = equations(g)
    assert model.order == 0
    n, s = (g.parameters[p].symbol for p in ("n", "s"))
    flow = n * symbol("u")
    assert (model.dependent["p_s"] - s * flow).simplify() == 0
    effort = s * n * symbol("d_u") + (g.parameters["d"].symbol * flow if ohmic else 0)
    assert (model.outputs[0] - n * effort).simplify() == 0


def test_two_sources_of_one_variable_stay_a_conflict() -> None:
    g = ring()
    with g:
        Sf("v") >> g["end"]
    with pytest.raises(CausalConflict):
        equations(g)
