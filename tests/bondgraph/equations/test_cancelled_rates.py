"""Storages that a loop of bonds ties to what drives it, by hand."""

from __future__ import annotations

from typing import Any

import pytest

from bondgraph import GY, TF, BondGraph, C, CausalConflict, De, I, One, R, Se, Sf, Zero
from bondgraph.causality import assignment
from bondgraph.causality.assignment import _Table, assign_causality
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


def test_what_no_yielding_storage_resolves_is_refused_before_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Five pairs of resistors leave choices that are taken back in vain, whatever yields."""
    with BondGraph("vain") as g:
        last: One | Zero = One("root")
        Se("u") >> last
        for k in range(5):
            zero, one = Zero(f"za_{k}"), One(f"oa_{k}")
            last >> zero >> one
            zero >> R(f"a_{k}", 1.0)
            one >> R(f"b_{k}", 1.0)
            last = one
        root = g["root"]
        for k in range(5):
            zero, one = Zero(f"z_{k}"), One(f"o_{k}")
            root >> zero >> one
            one >> I(f"i_{k}", 1.0)
            one >> R(f"r_{k}", 1.0)
            zero >> C(f"c_{k}", 1.0)
            root = one
        x, y, m = Zero("x"), Zero("y"), Zero("m")
        last >> x >> One("p") >> y >> One("q") >> x
        y >> R("loss", 1.0)
        y >> GY("g", ratio=2.0) >> m >> GY("h", ratio=1.0) >> x
    made, plain, left = _Table.stroke, assignment.MOST_WORK, [0]

    def counted(*given: Any) -> None:
        left[0] += 1
        assert left[0] <= plain
        made(*given)

    monkeypatch.setattr(_Table, "stroke", counted)
    assert not list(assignment.with_dependent_storages(g))
