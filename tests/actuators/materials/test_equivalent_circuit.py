"""The equivalent circuit: formulas, bond graph, and its identification from a sweep."""

from __future__ import annotations

import doctest
from importlib import import_module
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

from actuators.materials.equivalent_circuit import Branch, EquivalentCircuit, circuit_graph
from actuators.materials.impedance_fit import NoResonance, fit_circuit
from actuators.materials.resonance import (
    characteristic_frequencies,
    effective_coupling,
    longitudinal_coupling,
    mechanical_quality,
    transverse_coupling,
)
from bondgraph import UnusableInput
from bondgraph.equations.derivation import equations
from tests.symbols import closed

ONE = EquivalentCircuit(1.3e-6, (Branch.from_resonance(18e3, 40.0, 2e-7),))
TWO = EquivalentCircuit(
    1.3e-6, (Branch.from_resonance(55e3, 60.0, 3e-8), Branch.from_resonance(18e3, 40.0, 2e-7))
)
SHARP = EquivalentCircuit(2e-9, (Branch.from_resonance(200e3, 1000.0, 1e-10),))


def noisy(circuit: EquivalentCircuit, f: Any, part: float, seed: int = 0) -> Any:
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    return circuit.impedance(f) * (1 + part * noise)


@pytest.mark.parametrize("module", ["equivalent_circuit", "resonance", "impedance_fit"])
def test_examples_run(module: str) -> None:
    assert doctest.testmod(import_module(f"actuators.materials.{module}")).failed == 0


# -- formulas -----------------------------------------------------------------------------
def test_limits_of_the_impedance() -> None:
    low, high = np.array([1.0]), np.array([1e9])
    total = 1.3e-6 + 2e-7 + 3e-8
    assert TWO.low_frequency_capacitance == pytest.approx(total)
    assert TWO.impedance(low)[0].imag == pytest.approx(-1 / (2 * np.pi * total), rel=1e-6)
    assert TWO.impedance(high)[0].imag == pytest.approx(-1 / (2e9 * np.pi * 1.3e-6), rel=1e-6)
    assert (TWO.impedance(np.geomspace(1, 1e7, 500)).real > 0).all()
    assert TWO.resonances == pytest.approx((18e3, 55e3))


def test_antiresonances_are_poles_of_the_lossless_circuit() -> None:
    b = ONE.branches[0]
    series = b.capacitance * ONE.capacitance / (b.capacitance + ONE.capacitance)
    assert ONE.antiresonances[0] == pytest.approx(
        1 / (2 * np.pi * np.sqrt(b.inductance * series)), rel=1e-12
    )
    for f in TWO.antiresonances:
        w = 2 * np.pi * f
        parts = [1 / (w * x.inductance - 1 / (w * x.capacitance)) for x in TWO.branches]
        assert abs(w * TWO.capacitance - sum(parts)) < 1e-9 * w * TWO.capacitance


def test_losses_part_the_frequencies() -> None:
    c = characteristic_frequencies(ONE)
    assert c.resonance is not None
    assert c.antiresonance is not None
    assert c.minimum < c.series < c.resonance < c.antiresonance < c.parallel < c.maximum
    f = np.linspace(15e3, 23e3, 400_001)
    z = np.abs(ONE.impedance(f))
    assert c.minimum == pytest.approx(f[z.argmin()], abs=0.03)
    assert c.maximum == pytest.approx(f[z.argmax()], abs=0.03)
    for zero in (c.resonance, c.antiresonance):
        assert abs(np.angle(ONE.impedance(zero))) < 1e-9
    # with high quality all of them meet
    s = characteristic_frequencies(SHARP)
    assert s.minimum == pytest.approx(s.series, rel=1e-4)
    assert s.maximum == pytest.approx(s.parallel, rel=1e-4)
    # the second mode of TWO is too damped to turn the phase
    assert characteristic_frequencies(TWO, 1).resonance is None
    with pytest.raises(UnusableInput, match="mode 2 does not exist"):
        characteristic_frequencies(TWO, 2)


def test_effective_coupling_is_the_share_of_the_branch() -> None:
    f_r, f_a = ONE.resonances[0], ONE.antiresonances[0]
    assert effective_coupling(f_r, f_a) ** 2 == pytest.approx(2e-7 / 1.5e-6, rel=1e-12)


@pytest.mark.parametrize("k", [0.2, 0.5, 0.69, 0.9])
def test_coupling_of_an_exact_rod(k: float) -> None:
    """``Z ~ 1 - k^2 tan(X)/X``: pole at X = pi/2, zero where tan(X)/X = 1/k^2."""
    zero = brentq(lambda x: np.sin(x) * k**2 - x * np.cos(x), 1e-3, np.pi / 2)
    assert longitudinal_coupling(zero, np.pi / 2) == pytest.approx(k, rel=1e-9)


@pytest.mark.parametrize("k", [0.2, 0.35, 0.6])
def test_coupling_of_an_exact_bar(k: float) -> None:
    """``Y ~ 1 - k^2 + k^2 tan(X)/X``: pole at X = pi/2, zero beyond it."""
    zero = brentq(lambda x: (1 - k**2) * np.cos(x) + k**2 * np.sin(x) / x, np.pi / 2, np.pi - 1e-9)
    assert transverse_coupling(np.pi / 2, zero) == pytest.approx(k, rel=1e-9)


def test_quality_from_the_curve() -> None:
    c = characteristic_frequencies(SHARP)
    least = float(np.abs(SHARP.impedance(c.minimum)))
    found = mechanical_quality(c.minimum, c.maximum, least, SHARP.low_frequency_capacitance)
    assert found == pytest.approx(1000.0, rel=0.01)


def test_refusals() -> None:
    with pytest.raises(UnusableInput, match="check which is the minimum"):
        effective_coupling(2.0, 1.0)
    with pytest.raises(UnusableInput, match="resistance = -1 must be positive"):
        Branch(1.0, -1.0, 1.0)
    with pytest.raises(UnusableInput, match="no branch"):
        EquivalentCircuit(1e-9, ())
    with pytest.raises(UnusableInput, match="leave out f = 0"):
        ONE.impedance([0.0, 1.0])


# -- bond graph ---------------------------------------------------------------------------
def transfer(model: Any, s: Any) -> Any:
    """Rational transfer function of the last output."""
    space, u = closed(model), closed(model).u
    a, b = space.dxdt.jacobian(space.x), space.dxdt.jacobian(u)
    c, d = space.y.jacobian(space.x), space.y.jacobian(u)
    return (c * (s * sp.eye(a.rows) - a).LUsolve(b) + d)[model.output_names.index("v")]


def response(model: Any, f: float) -> complex:
    """Transfer function of the voltage as a number."""
    values = {p.symbol: p.value for p in model.parameters.values()}
    space, u = closed(model), closed(model).u
    parts = (space.dxdt.jacobian(space.x), space.dxdt.jacobian(u), space.y.jacobian(space.x))
    a, b, c = (np.array(m.subs(values).evalf(), dtype=float) for m in parts)
    x = np.linalg.solve(2j * np.pi * f * np.eye(len(a)) - a, b)
    return complex((c @ x)[model.output_names.index("v"), 0])


def test_bond_graph_is_the_formula_symbolically() -> None:
    s = sp.Symbol("s")
    c0, l, r, c = sp.symbols("C_0 L_1 R_1 C_1", positive=True)
    formula = 1 / (s * c0 + 1 / (s * l + r + 1 / (s * c)))
    space = equations(circuit_graph(ONE))
    assert space.causality.derivative == ()
    assert sp.cancel(sp.together(transfer(space, s) - formula)) == 0


def test_bond_graph_of_two_modes_and_behind_a_resistance() -> None:
    plain = equations(circuit_graph(TWO))
    behind = equations(circuit_graph(TWO, source_resistance=10.0))
    for f in (1e3, 17.9e3, 19.3e3, 60e3):
        z = complex(TWO.impedance(f))
        assert response(plain, f) == pytest.approx(z, rel=1e-9)
        assert response(behind, f) == pytest.approx(z / (z + 10.0), rel=1e-9)


# -- identification -----------------------------------------------------------------------
@pytest.mark.parametrize("circuit", [ONE, TWO, SHARP])
def test_exact_data_give_the_circuit_back(circuit: EquivalentCircuit) -> None:
    f = np.geomspace(0.2 * circuit.resonances[0], 5 * circuit.resonances[-1], 2001)
    fit = fit_circuit(f, circuit.impedance(f), modes=len(circuit.branches))
    assert fit.circuit.capacitance == pytest.approx(circuit.capacitance, rel=1e-9)
    for found, true in zip(fit.circuit.branches, circuit.branches, strict=True):
        for n in ("inductance", "resistance", "capacitance"):
            assert getattr(found, n) == pytest.approx(getattr(true, n), rel=1e-8)
    assert fit.misfit < 1e-9


def test_uncertainties_are_honest() -> None:
    """Over many draws the errors are as large as the fit says."""
    f = np.geomspace(5e3, 60e3, 400)
    true = {"C_0": 1.3e-6, "R_1": ONE.branches[0].resistance, "C_1": 2e-7, "f_1": 18e3}
    score: dict[str, list[float]] = {n: [] for n in true}
    for seed in range(40):
        fit = fit_circuit(f, noisy(ONE, f, 0.02, seed))
        b = fit.circuit.branches[0]
        found = {"C_0": fit.circuit.capacitance, "R_1": b.resistance, "C_1": b.capacitance}
        found["f_1"] = b.resonance
        assert fit.misfit == pytest.approx(0.02, rel=0.15)
        for n, v in true.items():
            score[n].append((found[n] - v) / fit.errors[n])
    for n, z in score.items():
        assert 0.7 < np.std(z) < 1.35, n
        assert abs(np.mean(z)) < 0.6, n
    assert "+-" in str(fit)


def test_two_modes_in_noise() -> None:
    f = np.geomspace(2e3, 2e5, 1500)
    fit = fit_circuit(f, noisy(TWO, f, 0.03), modes=2)
    for found, true in zip(fit.circuit.branches, TWO.branches, strict=True):
        assert found.resonance == pytest.approx(true.resonance, rel=2e-3)
        assert found.capacitance == pytest.approx(true.capacitance, rel=0.1)


def test_absolute_noise() -> None:
    f = np.linspace(10e3, 30e3, 600)
    z = ONE.impedance(f)
    rng = np.random.default_rng(4)
    measured = z + 0.05 * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size))
    fit = fit_circuit(f, measured, sigma=0.05)
    assert fit.misfit == pytest.approx(1.0, abs=0.1)
    assert abs(fit.circuit.capacitance - 1.3e-6) < 4 * fit.errors["C_0"]


@pytest.mark.parametrize(
    ("low", "high", "part", "words"),
    [
        (1e3, 15e3, 0.0, "sweep further up"),
        (1e3, 15e3, 0.005, "sweep further up"),
        (1e3, 15e3, 0.02, "sweep further up|widen the sweep"),
        (20e3, 100e3, 0.0, "sweep further down"),
        (20e3, 100e3, 0.005, "sweep further down"),
        (20e3, 100e3, 0.02, "sweep further down|widen the sweep"),
    ],
)
def test_sweep_without_the_resonance(low: float, high: float, part: float, words: str) -> None:
    f = np.geomspace(low, high, 500)
    with pytest.raises(NoResonance, match=f"shows 0 of 1 resonances.*({words})"):
        fit_circuit(f, noisy(ONE, f, part))


def test_a_mode_too_many() -> None:
    f = np.geomspace(5e3, 60e3, 400)
    with pytest.raises(NoResonance, match="1 of 2 resonances"):
        fit_circuit(f, noisy(ONE, f, 0.01), modes=2)


@pytest.mark.parametrize(
    ("f", "z", "words"),
    [
        (np.arange(1.0, 5.0), np.ones(3), "two records of one length"),
        (np.arange(1.0, 5.0), np.ones(4) + 0j, "4 points cannot carry 1 modes"),
        (np.arange(1.0, 21.0), np.ones(20), "give complex Z"),
        (np.arange(20.0, 0.0, -1), np.ones(20) + 0j, "sort them"),
        (np.arange(1.0, 21.0), np.zeros(20) + 0j, "zero or not finite"),
    ],
)
def test_unusable_sweeps(f: Any, z: Any, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        fit_circuit(f, z)
