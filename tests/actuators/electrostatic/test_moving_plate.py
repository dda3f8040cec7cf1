"""The moving-plate capacitor: pull-in by eigenvalues, by simulation and by the formula."""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

from actuators.electrostatic.moving_plate import moving_plate, moving_plate_charge
from actuators.materials.ceramics import VACUUM_PERMITTIVITY
from bondgraph import BondsightError
from bondgraph.analysis.linear import eigenvalues
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.energy.stores import energy_problems
from bondgraph.equations.derivation import equations
from tests.settled import simulate

STIFFNESS, GAP = 1.0, 2e-6
EPS_A = VACUUM_PERMITTIVITY * 1.6e-7
# Nathanson et al., IEEE Trans. Electron Devices 14 (1967) 117: the rest at g/3 vanishes
V_PI = sqrt(8 * STIFFNESS * GAP**3 / (27 * EPS_A))


class PlateRest(NamedTuple):
    """A rest: displacement (m), charge (C), voltage (V)."""

    x: float
    charge: float
    voltage: float

    def at(self) -> dict[str, float]:
        return {"q_plate1": self.charge, "q_plate2": self.x, "V_in": self.voltage}


def plate_rest(x: float) -> PlateRest:
    """``q = sqrt(2 eps A k x)`` balances the spring, ``V = q (g - x)/(eps A)``."""
    charge = sqrt(2 * EPS_A * STIFFNESS * x)
    return PlateRest(x, charge, charge * (GAP - x) / EPS_A)


def slowest(model: Any, x: float, extra: dict[str, float] | None = None) -> float:
    """Largest real part of the eigenvalues at rest."""
    point = plate_rest(x).at() | (extra or {})
    return float(eigenvalues(model, at=point).real.max())


@pytest.mark.parametrize("resistance", [None, 1e6])
def test_pull_in_is_where_an_eigenvalue_vanishes(resistance: float | None) -> None:
    model = equations(moving_plate(resistance=resistance))
    assert slowest(model, 0.3 * GAP) < 0.0 < slowest(model, 0.37 * GAP)
    x = brentq(lambda v: slowest(model, v), 0.3 * GAP, 0.37 * GAP, xtol=1e-14)
    assert x == pytest.approx(GAP / 3, rel=1e-6)
    assert plate_rest(x).voltage == pytest.approx(V_PI, rel=1e-9)


def test_the_rest_is_one_of_the_model() -> None:
    model = equations(moving_plate())
    point = plate_rest(0.2 * GAP)
    values = {p.symbol: p.value for p in model.parameters.values()}
    values |= {sp.Symbol(n, real=True): v for n, v in point.at().items()}
    values[sp.Symbol("p_m", real=True)] = 0.0
    for expression in (*model.rates, *model.residuals):
        size = sum(abs(float(a.subs(values))) for a in sp.Add.make_args(expression.expand()))
        assert abs(float(expression.subs(values))) <= 1e-12 * size


def test_pull_in_follows_from_the_linearised_stiffness_in_symbols() -> None:
    """``det A = 0`` at rest gives ``x = g/3`` and the formula, for all parameters."""
    model = equations(moving_plate())
    q, x = sp.symbols("q_plate1 q_plate2", real=True)
    k, gap, area, eps = sp.symbols("k gap A eps", positive=True)
    residual, force = model.residuals[0], model.rates[1]
    slope = force.diff(x) - force.diff(q) * residual.diff(x) / residual.diff(q)
    at_rest = slope.subs(q**2, 2 * eps * area * k * x)
    assert sp.solve(sp.cancel(at_rest), x) == [gap / 3]
    voltage = sp.sqrt(2 * eps * area * k * x) * (gap - x) / (eps * area)
    formula = sp.sqrt(8 * k * gap**3 / (27 * eps * area))
    assert sp.simplify(voltage.subs(x, gap / 3) / formula) == 1


def test_a_slow_ramp_stands_below_and_falls_above() -> None:
    t = np.linspace(0.0, 3e-3, 301)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.minimum(t / 1.5e-3, 1.0))
    run = simulate(moving_plate(), t, {"V_in": 0.98 * V_PI * ramp})
    x = run["x"][-1]
    assert 0.2 * GAP < x < GAP / 3
    assert plate_rest(x).voltage == pytest.approx(0.98 * V_PI, rel=1e-3)
    # above it the plate falls until the law of the empty gap has no meaning
    try:
        above = simulate(moving_plate(), t, {"V_in": 1.05 * V_PI * ramp})
        fell = bool(above["x"].max() > 0.9 * GAP)
    except BondsightError as error:
        fell = "converge" in str(error) or "settle" in str(error)
    assert fell


def test_charge_drive_has_no_pull_in() -> None:
    model = equations(moving_plate_charge())
    for x in np.array([0.1, 1 / 3, 0.6, 0.95]) * GAP:
        point = plate_rest(x)
        at = {"q_plate1": point.charge, "q_plate2": point.x}
        real = np.sort(eigenvalues(model, at=at).real)
        assert real[-1] == pytest.approx(0.0, abs=1e-9)  # the charge stays where it is
        assert real[-2] < 0.0


def test_ledger_and_reciprocity() -> None:
    g = moving_plate(resistance=1e6, sensors=("x", "i"))
    assert energy_problems(g) == ()
    t = np.linspace(0.0, 2e-3, 2001)
    v = 0.9 * V_PI * np.sin(np.pi * t / 2e-3) ** 2
    run = simulate(g, t, {"V_in": v}, observed=observables(g), accuracy=1e-7)
    account = ledger(g, run)
    assert account.closes
    assert account.relative_residual < 2e-5
