"""The general bond graph of the stack against the hand derivation, symbol by symbol."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp

from actuators import stack_bond_graph
from bondgraph.equations.derivation import equations
from bondgraph.laws import Polynomial
from tests.symbols import closed, same

Re, l, T, k, m, Rn = sp.symbols("R_e l T k m R_nl", positive=True)
Vin, Fe, dFe, p, x1, mom = sp.symbols("V_in F_e dF_e q_C_nl q_k p_m", real=True)
C_nl = sp.Function("C_nl")
v = mom / m


@pytest.fixture(scope="module")
def space() -> Any:
    return closed(
        equations(stack_bond_graph(Polynomial(), sensors=("x", "i"), external_force=True))
    )


@pytest.fixture(scope="module")
def rates(space: Any) -> dict[Any, Any]:
    return dict(zip(space.x, space.dxdt, strict=True))


def along(expression: Any, rates: dict[Any, Any]) -> Any:
    """Derivative by time along the dynamics; the voltage is constant, the force is not."""
    total = expression.diff(Fe) * dFe
    return total + sum(expression.diff(s) * rate for s, rate in rates.items())


def test_states(space: Any) -> None:
    assert list(space.x) == [p, x1, mom]
    assert set(space.u) == {Vin, Fe}


def test_rates(rates: Any) -> None:
    drop = Vin - l * C_nl(p) + k * T * x1
    assert same(rates[p], l / Re * drop)
    assert same(rates[x1], v - T / Re * drop)
    assert same(rates[mom] / m, (Fe - k * x1 - Rn * v) / m)


def test_outputs(space: Any, rates: Any) -> None:
    i, x = space.y
    assert same(x, x1 + T * p / l)
    assert same(along(x, rates), v)
    assert same(i, rates[p] / l)


def test_power_balance(space: Any, rates: Any) -> None:
    stored = sp.Function("W")(p)
    energy = mom**2 / (2 * m) + k * x1**2 / 2 + stored
    flow = along(energy, rates).subs(stored.diff(p), C_nl(p))
    i = space.y[0]
    assert same(flow, Vin * i - Re * i**2 + Fe * v - Rn * v**2)


def test_inversion_formulas(space: Any, rates: Any) -> None:
    x = space.y[1]
    d1 = along(x, rates)
    d2 = along(d1, rates)
    d3 = along(d2, rates)
    assert same(l / T * (x + (m * d2 + Rn * d1 - Fe) / k), p)
    field = Vin / l + T / l * (Fe - Rn * d1 - m * d2)
    field -= Re / (T * l) * (d1 + (m * d3 + Rn * d2 - dFe) / k)
    assert same(field, C_nl(p))


def test_open_circuit_stiffness_and_clamped_body() -> None:
    """The printed form with E_2 = +F T / l would create power; here a positive voltage expands."""
    model = equations(stack_bond_graph())
    space = closed(model)
    values = {q.symbol: q.value for q in model.parameters.values()}
    a = space.dxdt.jacobian(space.x).subs(values)
    b = space.dxdt.jacobian(space.u).subs(values)
    rest = -a.inv() * b
    free = (space.y[0].subs(values)).subs(dict(zip(space.x, rest, strict=True)))
    assert float(free) == pytest.approx(0.0327 * 1.65e-6, rel=1e-9)  # T C per volt
    assert all(complex(e).real < 0 for e in a.evalf().eigenvals(multiple=True))
