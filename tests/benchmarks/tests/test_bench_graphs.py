"""The benchmark of graphs: small sizes, right limits, blocks equal to steps."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.simulation.block_recursion import blocked_record
from tests.benchmarks.chain import FAMILIES, measure
from tests.benchmarks.graphs import limit_line


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_every_family_is_measured(family: str) -> None:
    found = measure(4, family)
    for stage in ("build", "equations", "numeric", "function", "closed", "numeric_total", "peak"):
        assert found[stage] > 0.0


def test_limits_say_whether_they_hold() -> None:
    assert limit_line("a", 1.0, 2.0).endswith("holds")
    assert limit_line("a", 3.0, 2.0).endswith("MISSED")
    assert limit_line("a", 3.0, 2.0, least=True).endswith("holds")
    assert limit_line("a", float("nan"), 2.0, least=True).endswith("MISSED")


@pytest.mark.parametrize(("n", "stride"), [(1, 1), (7, 1), (64, 2), (501, 3)])
def test_blocks_equal_steps(n: int, stride: int) -> None:
    rng = np.random.default_rng(n)
    phi = 0.4 * rng.normal(size=(5, 5)) / np.sqrt(5)
    g, c, d = rng.normal(size=(5, 4)), rng.normal(size=(2, 5)), rng.normal(size=(2, 4))
    v, x = rng.normal(size=(n, 4)), rng.normal(size=5)
    y, last = blocked_record(phi, g, c, d, v, x.copy(), stride)
    outputs = []
    for k in range(n):
        x = phi @ x + g @ v[k]
        outputs.append(c @ x + d @ v[k])
    right = np.array(outputs)[stride - 1 :: stride]
    assert y == pytest.approx(right, rel=1e-10, abs=1e-12)
    assert last == pytest.approx(x, rel=1e-10, abs=1e-12)


def test_a_chain_of_forty_states_runs_in_blocks_and_right() -> None:
    from scipy.integrate import solve_ivp

    from bondgraph import Df
    from bondgraph.equations.codegen import program
    from tests.benchmarks.chain import chain
    from tests.settled import simulate

    graph = chain(20).with_branch("v_20", [Df("end")])
    t = np.linspace(0.0, 2.0, 201)
    end = simulate(graph, t, {"F": np.ones_like(t)}, x0=np.zeros(40))["end"]
    made = program(graph)
    p, none = list(made.nominal), np.zeros(0)

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(made.rhs(0, x, none, [1.0], p, none, 0)[0].full()).ravel()

    found = solve_ivp(rate, (0, 2), np.zeros(40), t_eval=t, rtol=1e-9, atol=1e-12, method="LSODA")
    last = found.y[made.states.index("p_m_20")] / made.nominal[made.parameters.index("m_20")]
    assert end == pytest.approx(last, abs=1e-7)
