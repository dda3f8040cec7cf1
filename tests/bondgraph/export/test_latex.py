"""LaTeX of equations."""

from __future__ import annotations

import pytest

from actuators import stack_bond_graph
from bondgraph import BondGraph, C, De, Df, I, One, R, Se, System, Zero
from bondgraph.equations.derivation import equations
from bondgraph.export.latex import latex, ordered_latex, pretty


@pytest.fixture
def drifting() -> System:
    """Circuit with a constant added to its source and a sensor that drifts."""
    with BondGraph("rc") as g:
        g.parameter("V_off", 0.1, "V", positive=False)
        g.parameter("drift_1", 0.0, "A", positive=False)
        g.parameter("drift_2", 0.0, "A", positive=False)
        loop, node = One("loop"), Zero("node")
        _ = Se("V", unit="V", offset="V_off") >> loop >> R("R_1", 1e3, unit="ohm")
        _ = loop >> node >> C("C_1", 1e-6, unit="F")
        _ = loop >> Df("i", unit="A", drift=("drift_1", "drift_2"))
        _ = node >> De("u", unit="V")
    return equations(g)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("q_C_nl", "q_{C_{nl}}"), ("k", "k"), ("tau_m", r"\tau_{m}"), ("R_1", "R_{1}")],
)
def test_pretty(name: str, expected: str) -> None:
    assert pretty(name) == expected


def test_closed_equations_of_the_stack() -> None:
    text = latex(equations(stack_bond_graph(sensors=("x", "i"))))
    assert text.startswith(r"\begin{aligned}")
    assert text.endswith(r"\end{aligned}")
    assert r"\frac{\mathrm{d}}{\mathrm{d}t}\, q_{C_{nl}} &= " in text
    assert r"x &= \frac{T q_{C_{nl}}}{l} + q_{k}" in text
    assert text.count("&=") == 5


def test_ordered_assignments_carry_their_reasons() -> None:
    space = equations(stack_bond_graph())
    text = ordered_latex(space)
    assert r"e_{C_{nl}} &:= \frac{q_{C_{nl}}}{C_{nl}} && \text{C C\_nl stores q\_C\_nl}" in text
    assert text.count("&:=") == len(space.relations) + 3 + 1


def test_pseudo_inputs_do_not_confuse(drifting: System) -> None:
    for text in (latex(drifting), ordered_latex(drifting)):
        assert "one" not in text
        assert "ramp" not in text
        assert r"drift_{2} \bar{t}^{2}" in text
        assert "V_{off}" in text


def test_balanced_braces(drifting: System) -> None:
    for text in (latex(drifting), ordered_latex(drifting)):
        assert text.count("{") == text.count("}")


def test_laws_show_as_functions() -> None:
    from bondgraph.laws import Coulomb

    with BondGraph("spring") as g:
        loop = One("loop")
        _ = Se("F") >> loop >> C("k", stiffness=1.0)
        _ = loop >> I("m", 1.0)
        _ = loop >> R("d_s", 0.0, law=Coulomb())
    assert r"\varphi_{d_{s}}{\left(" in latex(equations(g))
