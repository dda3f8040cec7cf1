"""What stands as a function in printed equations is told by its formula, watched signals too."""

from __future__ import annotations

import pytest
import sympy as sp

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.equations.derivation import equations
from bondgraph.export.latex import latex
from bondgraph.export.notations import NOTATIONS
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import (
    Coulomb,
    FrictionAlongWay,
    FrictionUnderLoad,
    Hysteretic,
    Law,
    LettingGo,
    Polynomial,
    TableLaw,
)


def rubbing(law: Law) -> BondGraph:
    with BondGraph("rubbing") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 1.0, unit="kg")
        v >> C("k", stiffness=3.0, unit="N/m")
        v >> R("d", None if law.slope is not None else 1.0, law=law)
        v >> Dq("x", unit="m")
    return g


@pytest.mark.parametrize(
    ("law", "left", "right"),
    [
        (FrictionUnderLoad("e_k"), "d(f_v, e_k)", "mu_1_d*Abs(e_k)"),
        (FrictionAlongWay("q_k"), "d(f_v, q_k)", "F_1_d*(-centre_d + q_k)/half_d"),
        (LettingGo("q_k"), "d(f_v, q_k)", "(-gap_d + Abs(centre_d - q_k))/depth_d"),
        (Coulomb(), "d(f_v)", "F_c_d*sign(f_v) + d*f_v"),
        (Polynomial(orders=(3,)), "d(f_v)", "a_3_d*f_v**3 + d*f_v"),
    ],
)
def test_the_formula_stands_below_the_equations(law: Law, left: str, right: str) -> None:
    graph = rubbing(law)
    for text in (str(equations(graph)), NOTATIONS["closed"](graph)):
        (line,) = (line for line in text.splitlines() if line.startswith(f"{left} = "))
        assert right in line
        assert line.endswith(f"(law {law.name} of d)")
    assert f"e_d := {left}" in str(equations(graph))


@pytest.mark.parametrize("law", [Hysteretic(PrandtlIshlinskii((0.0, 1.0), (2.0, 1.0))), TableLaw()])
def test_what_has_no_short_formula_stays_a_name(law: Law) -> None:
    made = equations(rubbing(law))
    assert "e_d := d(f_v)" in str(made)
    assert all(len(line) < 220 for line in str(made).splitlines())


def test_closed_forms_have_what_is_watched_as_a_second_argument() -> None:
    made = equations(rubbing(FrictionUnderLoad("e_k")))
    (used,) = made.rates[0].atoms(sp.core.function.AppliedUndef)
    assert str(used) == "d_deviation(p_m/m, k*q_k)"
    assert r"\varphi_{d}{\left(\frac{p_{m}}{m},k q_{k} \right)}" in latex(made)


def test_a_watched_signal_that_follows_from_the_law_stays_a_name() -> None:
    made = equations(rubbing(FrictionUnderLoad("e_m")))
    assert "e_m" in {str(s) for s in made.rates[0].free_symbols}
