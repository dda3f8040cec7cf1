"""Controllability and observability by causality against exact ranks of the equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from actuators.models.catalogue import MODELS
from bondgraph import (
    GY,
    TF,
    BondGraph,
    C,
    CausalConflict,
    De,
    Df,
    Dq,
    GraphError,
    I,
    One,
    R,
    Se,
    Sf,
    Zero,
)
from bondgraph.analysis.kalman import kalman_ranks, linear_skeleton
from bondgraph.analysis.structural import controllability, observability
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import MTF, Field
from bondgraph.graph.modulation import displacement
from bondgraph.graph.sensors import Da
from bondgraph.laws import Coulomb, Polynomial
from tests.properties.graphs import random_graph


def with_sensors(g: BondGraph, seed: int) -> BondGraph:
    """Return the graph with one or two sensors at random junctions."""
    rng = np.random.default_rng(seed + 1)
    junctions = g.of_type(One, Zero)
    for k in range(int(rng.integers(1, 3))):
        j = junctions[rng.integers(len(junctions))]
        kind: Any = De if isinstance(j, Zero) else Dq if rng.random() < 0.3 else Df
        g = g.with_branch(j.name, [kind(f"y_{k}")])
    return g


def rational_ranks(g: BondGraph, seed: int) -> tuple[int, int, int]:
    """Kalman ranks in SymPy's rational numbers, from the linearised closed equations."""
    model = equations(linear_skeleton(g))
    linear = model.linearise()
    rng = np.random.default_rng(seed)
    put = {
        p.symbol: sp.Rational(int(rng.integers(50, 5000)), int(rng.integers(50, 5000)))
        for p in model.parameters.values()
    }
    a, b, c = (sp.Matrix(m).xreplace(put) for m in (linear.a, linear.b, linear.c))
    n, u = len(linear.states), len(model.inputs)
    moved = b[:, :u]
    for j, name in enumerate(linear.inputs[u:], start=u):
        order = 1 if name.startswith("d_") else int(name[1])
        k = linear.inputs.index(name.split("_", 1)[1])
        moved[:, k] += a**order * b[:, j]
    up = sp.Matrix.hstack(*(a**k * moved for k in range(n)))
    down = sp.Matrix.vstack(*(c * a**k for k in range(n)))
    return up.rank(), down.rank(), n


@pytest.mark.parametrize(
    ("loops", "count"),
    [(True, 50), *(pytest.param(loops, 110, marks=pytest.mark.long) for loops in (False, True))],
)
def test_random_graphs_have_the_exact_ranks(loops: bool, count: int) -> None:
    """Causality alone gives the rank of [A B] and [A; C], and with paths the Kalman verdict."""
    told = {(q, v): 0 for q in ("controllability", "observability") for v in (True, False)}
    undecided = 0
    for seed in range(count):
        g = with_sensors(random_graph(seed, 25, loops), seed)
        try:
            moved, seen, n = kalman_ranks(g)
        except CausalConflict:
            assert loops  # a ring of junctions may determine nothing
            continue
        for answer, full in ((controllability(g), moved == n), (observability(g), seen == n)):
            if answer.structural_rank is None:
                undecided += 1
            else:
                assert answer.structural_rank == answer.exact_rank, (seed, str(answer))
            assert answer.holds == full, (seed, str(answer))
            assert bool(answer.problems) == (not full)
            told[answer.question, full] += 1
    assert min(told.values()) >= 15 * count // 110
    assert undecided <= (4 * count // 110 if loops else 0)


@pytest.mark.parametrize("seed", range(40))
def test_prime_field_ranks_are_rational_ranks(seed: int) -> None:
    g = with_sensors(random_graph(1000 + seed, 12, False), seed)
    if equations(g).order == 0:
        pytest.skip("no state")
    assert kalman_ranks(g) == rational_ranks(g, seed)


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("seed", range(40))
def test_what_is_tied_is_constant_or_unseen(seed: int) -> None:
    """At other values, in floating point: the directions without effect span the states named."""
    g = with_sensors(random_graph(seed, 15, False), seed)
    linear = equations(g).linearise()
    rng = np.random.default_rng(seed)
    a, _, c, _ = linear.numbers({n: float(rng.uniform(0.5, 2.0)) for n in g.parameters})
    seen = observability(g)
    null = len(seen.states) - seen.exact_rank
    assert len(seen.tied) == null
    if null:
        _, s, v = np.linalg.svd(np.vstack([a, c]))
        full = np.append(s, np.zeros(a.shape[1] - len(s)))
        assert (full[-null:] <= 1e-9 * full[0]).all()
        touched = {linear.states[j] for j in np.flatnonzero(np.abs(v[-null:]).max(axis=0) > 1e-9)}
        assert touched == {n for t in seen.tied for n in t}


def test_two_capacitors_in_one_loop() -> None:
    """The difference of their charges keeps its value; their voltages are seen only as a sum."""
    with BondGraph("pair") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 1.0)
        loop >> C("C_1", 1.0)
        loop >> C("C_2", 1.0)
        loop >> Df("i")
    moved, seen = controllability(g), observability(g)
    assert (moved.holds, seen.holds) == (False, False)
    assert moved.structural_rank == seen.structural_rank == 1
    assert moved.integral == ("C_2",)
    assert moved.tied == seen.tied == (("q_C_1", "q_C_2"),)
    assert not moved.separate
    assert "C_2 cannot take derivative causality" in str(moved)
    assert moved.paths["q_C_1"][0] == "V"
    assert moved.paths["q_C_1"][-1] == "q_C_1"
    assert "not controllable" in moved._repr_html_()


def test_a_source_imposes_its_variable_on_one_side_only() -> None:
    """Behind an imposed voltage the other branch is out of reach of the sensor, not of the source.

    Se holds the node; the current of one branch does not depend on the other branch.
    """
    with BondGraph("branches") as g:
        node, left, right = Zero("node"), One("left"), One("right")
        Se("V") >> node
        node >> left >> I("L_1", 1.0)
        left >> R("R_1", 1.0)
        node >> right >> I("L_2", 1.0)
        right >> R("R_2", 1.0)
        left >> Df("i")
    assert controllability(g).holds
    seen = observability(g)
    assert seen.separate == ("p_L_2",)
    assert seen.structural_rank == 2
    assert seen.problems == ("p_L_2: no causal path from it to a sensor",)


def test_mass_spring_chain_of_the_rank_condition() -> None:
    """A force moves both masses; a spring between them is seen, their common motion is not."""
    with BondGraph("free") as g:
        a, mid, b = One("a"), Zero("mid"), One("b")
        Se("F") >> a >> I("m_1", 1.0)
        a >> mid >> b
        mid >> C("k", stiffness=1.0)
        b >> I("m_2", 1.0)
        mid >> De("force")
    moved, seen = controllability(g), observability(g)
    assert moved.holds
    assert moved.dualised == ("F",)
    assert seen.separate == ()
    assert seen.structural_rank == 2
    assert seen.tied == (("p_m_1", "p_m_2"),)


def test_dc_motor() -> None:
    """Current sensor and voltage: everything is moved and seen; without friction as well."""
    for friction in (True, False):
        with BondGraph("motor") as g:
            loop, shaft = One("loop"), One("shaft")
            Se("u") >> loop >> R("R_a", 1.0)
            loop >> I("L_a", 1.0)
            loop >> GY("K", ratio=0.1) >> shaft >> I("J", 1.0)
            if friction:
                shaft >> R("b", 1.0)
            loop >> Df("i")
        assert controllability(g).holds
        assert observability(g).holds
        assert observability(g.with_branch("shaft", [C("k", 1.0)])).holds


def test_a_position_adds_what_a_speed_cannot_see() -> None:
    with BondGraph("carriage") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 1.0)
        body >> Dq("x")
    assert observability(g).holds
    assert controllability(g).holds
    assert kalman_ranks(g) == (2, 2, 2)


def test_a_source_called_like_a_constant_moves_states() -> None:
    with BondGraph("rc") as g:
        loop = One("loop")
        Se("one1") >> loop >> R("R_1", 1.0)
        loop >> C("C_1", 1.0)
    assert controllability(g).holds
    assert kalman_ranks(g)[0] == 1


def test_input_derivatives_do_not_hide_a_constant() -> None:
    """Two capacitors across a source: one state, which no voltage moves."""
    with BondGraph("divider") as g:
        loop = One("loop")
        Se("V") >> loop >> C("C_1", 1.0)
        loop >> C("C_2", 2.0)
    answer = controllability(g)
    assert not answer.holds
    assert answer.structural_rank == answer.exact_rank == 0
    assert kalman_ranks(g)[0] == 0


def test_laws_count_by_their_linear_part() -> None:
    with BondGraph("g") as g:
        a = One("a")
        Sf("v") >> Zero("n") >> TF("t", ratio=2.0) >> a
        a >> I("m", 1.0)
        a >> C("k", stiffness=1.0, law=Polynomial())
        a >> R("f", 0.0, law=Coulomb(1.0))
        a >> Df("y")
    plain = linear_skeleton(g)
    assert all(e.law is None for e in plain.of_type(C, R))
    assert controllability(g).states == controllability(plain).states


@pytest.mark.parametrize(
    "name",
    [n for n in MODELS if n != "stack_lumped_maxwell" and not MODELS[n]().of_type(Field)],
)
def test_catalogue_models_are_moved_and_seen(name: str) -> None:
    g = MODELS[name]()
    for answer in (controllability(g), observability(g)):
        # with an accelerometer the exact rank alone decides
        assert answer.structural_rank == (None if g.of_type(Da) else answer.exact_rank)
        assert answer.holds, str(answer)


def test_hysteresis_in_series_keeps_a_charge() -> None:
    """The printed Maxwell model has two storages on one current: their difference stays."""
    moved = controllability(MODELS["stack_lumped_maxwell"]())
    assert not moved.holds
    assert moved.structural_rank == moved.exact_rank == 2
    assert len(moved.tied) == 1
    assert observability(MODELS["stack_lumped_maxwell"]()).holds


ANGLE = displacement("k")


@pytest.mark.parametrize(
    ("back", "moved"),
    [(2 + sp.sin(ANGLE), True), (1 / sp.cos(ANGLE), False), (2.0, True)],
)
def test_ratios_that_follow_signals_are_generic(back: Any, moved: bool) -> None:
    """Two ways from a body to a spring: their difference moves it, unless they are one ratio."""
    with BondGraph("levers") as g:
        body, z = One("body"), Zero("z")
        Se("F") >> body >> I("m", 1.0)
        body >> MTF("a", ratio=sp.cos(ANGLE)) >> z
        z >> MTF("b", ratio=back) >> body
        z >> C("k", 1.0)
    assert kalman_ranks(g)[::2] == ((2, 2) if moved else (1, 2))
    assert controllability(g).holds == moved


def test_refusals() -> None:
    with BondGraph("lonely") as g:
        One("j") >> R("r", 1.0)
    with pytest.raises(GraphError, match="lonely"):
        controllability(g)


def test_nothing_is_moved_without_a_source() -> None:
    without = BondGraph("empty")
    with without:
        One("a") >> I("m", 1.0)
        without["a"] >> R("d", 1.0)
    answer = controllability(without)
    assert answer.separate == ("p_m",)
    assert not answer.holds
