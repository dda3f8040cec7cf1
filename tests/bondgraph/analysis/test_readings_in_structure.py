"""All kinds of readings and recorded inputs in ranks, redundancy relations and identifiability."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph
from bondgraph.analysis.kalman import kalman_ranks
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.redundancy import redundancy
from bondgraph.analysis.structural import controllability, observability
from bondgraph.equations.codegen import program
from bondgraph.export.linear import linear_model
from bondgraph.support.errors import BondsightError
from identification.uncertainty.structural import identifiability
from tests.bondgraph.readings_bench import bench, power, shaken, spring

GRAPHS = {
    "bench": bench(),
    "velocity": shaken("value"),
    "acceleration": shaken("rate"),
    "displacement": shaken("integral"),
    "encoder": spring(resolution=1e-3, natural_frequency=80.0, damping_ratio=0.3, lag=0.01),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_causality_and_equations_agree_on_what_is_seen_and_moved(name: str) -> None:
    graph = GRAPHS[name]
    seen, moved = observability(graph), controllability(graph)
    for answer, exact in zip((moved, seen), kalman_ranks(graph), strict=False):
        assert answer.structural_rank in (None, answer.exact_rank)
        assert answer.holds == (exact == len(answer.states)), answer
    assert seen.holds


def linear(graph: BondGraph) -> BondGraph:
    for e in graph.elements.values():
        for field in ("resolution", "offset"):
            if getattr(e, field, None) is not None:
                graph = graph.with_element(e.name, **{field: None})
    return graph


@pytest.mark.parametrize("name", [n for n in GRAPHS if n != "displacement"])
def test_relations_hold_for_responses_of_the_state_space(name: str) -> None:
    graph = GRAPHS[name]
    values = {n: p.value for n, p in graph.parameters.items()}
    m, s = linear_model(program(linear(graph))), 37j
    y = m.c @ np.linalg.solve(s * np.eye(len(m.states)) - m.a, m.b) + m.d
    at = dict(zip(m.outputs, y[:, 0], strict=True)) | {m.inputs[0]: 1.0, "one": 0.0}
    found = redundancy(graph)
    assert len(found.relations) == len(m.outputs)
    for r in found.relations:
        terms = []
        for n, c in r.known.items():
            put = {v: s if v == LAPLACE else values[str(v)] for v in c.free_symbols}
            terms.append(complex(c.subs(put)) * at[n])
        assert abs(sum(terms)) < 1e-9 * max(map(abs, terms)), r


def test_what_an_accelerometer_says_beside_a_position_symbol_by_symbol() -> None:
    (relation,) = (r for r in redundancy(bench()).relations if r.name == "a")
    names = {str(v): v for c in relation.known.values() for v in c.free_symbols}
    w, z, g_a, g_x, o, s = (
        names[n]
        for n in ("natural_frequency_a", "damping_ratio_a", "gain_a", "gain_x", "offset_a", "s")
    )
    scale = relation.known["a"].subs(s, 0)
    wanted = {"a": s**2 / w**2 + 2 * z * s / w + 1, "x": -g_a / g_x * s**2, "one": -o}
    assert relation.known.keys() == wanted.keys()  # blind to all that moves the mass
    for n, c in wanted.items():
        assert sp.simplify(relation.known[n] / scale - c) == 0, n


def test_a_monitor_is_compared_with_the_command_alone() -> None:
    (relation,) = (r for r in redundancy(bench()).relations if r.name == "monitor")
    assert relation.known.keys() == {"monitor", "F", "one"}


def test_what_readings_tell_about_the_parameters() -> None:
    free = ["m", "d", "k", "gain_F"]
    assert identifiability(spring({"gain": 1.5}), free).missing == 1
    weighed = identifiability(bench(), free)
    assert set(weighed.determined) == set(free)
    # a position alone does not know its own factor, an acceleration beside it does
    assert "gain_x" not in identifiability(bench(), [*free, "gain_x", "gain_a"]).determined
    assert "gain_x" in identifiability(bench(), [*free, "gain_x"]).determined


def test_products_are_refused_in_one_line() -> None:
    for ask in (observability, redundancy):
        with pytest.raises(BondsightError, match=r"P.*(not linear|multiplies)"):
            ask(power())
