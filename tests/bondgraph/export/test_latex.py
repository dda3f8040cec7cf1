"""LaTeX of equations."""

from __future__ import annotations

import pytest
import sympy as sp

from actuators import stack_bond_graph
from bondgraph import MTF, BondGraph, C, De, Df, I, MSe, One, R, Se, System, Zero
from bondgraph.equations.decimals import as_text
from bondgraph.equations.derivation import equations
from bondgraph.export.latex import latex, ordered_latex, pretty, tex
from bondgraph.export.notations import notation


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


def test_numbers_that_were_floats_are_decimals_in_text_and_latex() -> None:
    with BondGraph("hung") as g:
        body = One("body")
        _ = MSe("weight", -80 * 9.81, unit="N") >> body >> I("m", 80.0, unit="kg")
        _ = body >> MTF("half", ratio=sp.Rational(1, 2)) >> One("arm") >> R("d", 400.0)
    made = equations(g)
    closed = "\\frac{d p_{m}}{4 m} - 784.8"
    assert "e_weight := -784.8 " in str(made)
    assert "f_arm := f_body/2 " in str(made)
    assert "dp_m/dt = -d*p_m/(4*m) - 784.8" in notation(g, "closed")
    assert "e_weight := -784.8 " in notation(g, "text")
    assert closed in latex(made)
    assert closed in notation(g, "latex")
    assert "&:= -784.8 &&" in ordered_latex(made)


@pytest.mark.parametrize(
    ("number", "shown"),
    [
        ("1/2", "1/2"), ("-5/4", "-5/4"), ("10/19", "10/19"), ("355/113", "355/113"), ("80", "80"),
        ("3.7", "3.7"), ("0.01", "0.01"), ("1e-9", "1.0e-9"), ("9.8100000000000005", "9.81"),
        ("7848000000000001/30000000000000", "261.6"),
    ],
)  # fmt: skip
def test_long_fractions_are_shown_as_decimals(number: str, shown: str) -> None:
    x = sp.Symbol("x")
    assert as_text(sp.Rational(number)) == shown
    assert as_text(x**2 + sp.Rational(number)) in (f"x**2 + {shown}", f"x**2 - {shown[1:]}")


def test_ordered_assignments_carry_their_reasons() -> None:
    space = equations(stack_bond_graph())
    text = ordered_latex(space)
    assert r"e_{C_{nl}} &:= \frac{q_{C_{nl}}}{C_{nl}} && \text{C C\_nl stores q\_C\_nl}" in text
    assert text.count("&:=") == len(space.relations) + 3 + 1


def test_pseudo_inputs_do_not_confuse(drifting: System) -> None:
    for text in (latex(drifting), ordered_latex(drifting)):
        assert "one" not in text
        assert "ramp" not in text
        assert r"drift_{2} \, \bar{t}^{2}" in text
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


def test_long_names_stand_apart() -> None:
    leak, oil, belt, mu, p = sp.symbols("leak oil belt mu_1 p_J")
    assert tex(leak * oil / (1 + 2 * belt)) == r"\frac{leak \, oil}{2 \, belt + 1}"
    assert tex(mu * p) == r"\mu_{1} p_{J}"  # letters with subscripts are told apart
