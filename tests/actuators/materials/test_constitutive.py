"""Four forms, Voigt notation, rotation, coupling factors, and the stack made of the material."""

from __future__ import annotations

import doctest
from importlib import import_module
from itertools import product
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

from actuators import stack_bond_graph, stack_lumped
from actuators.materials.ceramics import material
from actuators.materials.constitutive import FORMS, BadConstant, Piezoelectric
from actuators.materials.poled_ceramic import (
    StackConstants,
    coupling_factors,
    longitudinal_stack,
    stack_constants,
    transversely_isotropic,
)
from actuators.materials.voigt import (
    rotation_about,
    strain_from_voigt,
    strain_rotation,
    strain_to_voigt,
    stress_from_voigt,
    stress_rotation,
    stress_to_voigt,
)
from bondgraph import UnknownName, UnusableInput
from bondgraph.equations.derivation import equations
from tests.settled import simulate
from tests.symbols import closed

EPS = 8.8541878128e-12
# PZT-5H as tabulated by its manufacturer in the 1960s and in textbooks since
PZT_5H: dict[str, Any] = {
    "s11": 16.5e-12, "s12": -4.78e-12, "s13": -8.45e-12, "s33": 20.7e-12, "s44": 43.5e-12,
    "d31": -274e-12, "d33": 593e-12, "d15": 741e-12, "eps11": 3130 * EPS, "eps33": 3400 * EPS,
}  # fmt: skip
STEP = Rotation.from_euler("zxz", [0.3, -1.1, 2.0]).as_matrix()


@pytest.fixture(scope="module")
def ceramic() -> Piezoelectric:
    return transversely_isotropic(**PZT_5H)


@pytest.fixture(scope="module")
def symbolic() -> Piezoelectric:
    return transversely_isotropic(**{n: sp.Symbol(n) for n in PZT_5H})


def general() -> Piezoelectric:
    """Return a stable material without any symmetry."""
    rng = np.random.default_rng(3)
    root = np.eye(9) + 0.25 * rng.standard_normal((9, 9))
    scale = np.diag([4e-6] * 6 + [1e-4] * 3)
    w = scale @ root @ root.T @ scale
    return Piezoelectric("d", w[:6, :6], w[6:, :6], w[6:, 6:])


def distance(a: Piezoelectric, b: Piezoelectric) -> float:
    assert a.form == b.form
    pairs = ((a.elastic, b.elastic), (a.coupling, b.coupling), (a.dielectric, b.dielectric))
    return max(float(np.abs(x - y).max() / np.abs(y).max()) for x, y in pairs)


@pytest.mark.parametrize("module", ["voigt", "constitutive", "poled_ceramic"])
def test_examples_run(module: str) -> None:
    assert doctest.testmod(import_module(f"actuators.materials.{module}")).failed == 0


# -- forms --------------------------------------------------------------------------------
def test_published_constants_of_the_other_forms(ceramic: Piezoelectric) -> None:
    """The same tables print e, g, h, c and s at constant charge, rounded."""
    e, g, h = ceramic.to("e"), ceramic.to("g"), ceramic.to("h")
    assert e.elastic[0, 0] == pytest.approx(12.6e10, rel=0.02)
    assert e.elastic[2, 2] == pytest.approx(11.7e10, rel=0.02)
    assert e.elastic[3, 3] == pytest.approx(2.30e10, rel=0.02)
    assert e.coupling[2, 0] == pytest.approx(-6.55, rel=0.02)
    assert e.coupling[2, 2] == pytest.approx(23.3, rel=0.02)
    assert e.coupling[0, 4] == pytest.approx(17.0, rel=0.02)
    assert e.dielectric[2, 2] / EPS == pytest.approx(1470, rel=0.03)
    assert e.dielectric[0, 0] / EPS == pytest.approx(1700, rel=0.02)
    assert g.coupling[2, 2] == pytest.approx(19.7e-3, rel=0.01)
    assert g.coupling[2, 0] == pytest.approx(-9.11e-3, rel=0.01)
    assert g.coupling[0, 4] == pytest.approx(26.8e-3, rel=0.01)
    assert h.elastic[2, 2] == pytest.approx(15.7e10, rel=0.03)
    assert h.coupling[2, 2] == pytest.approx(1.80e9, rel=0.03)


@pytest.mark.parametrize("path", list(product(FORMS, repeat=3)))
def test_round_trips(path: tuple[Any, Any, Any]) -> None:
    begin = general().to(path[0])
    assert distance(begin.to(path[1]).to(path[2]).to(path[0]), begin) < 1e-13


def test_the_four_forms_are_one_material() -> None:
    """Any stress and field: all four forms give the strain and charge that belong to them."""
    rng = np.random.default_rng(0)
    d = general()
    stress, field = rng.standard_normal(6) * 1e7, rng.standard_normal(3) * 1e6
    strain = d.elastic @ stress + d.coupling.T @ field
    charge = d.coupling @ stress + d.dielectric @ field
    e, g, h = d.to("e"), d.to("g"), d.to("h")
    assert np.allclose(e.elastic @ strain - e.coupling.T @ field, stress, rtol=1e-10)
    assert np.allclose(e.coupling @ strain + e.dielectric @ field, charge, rtol=1e-10)
    assert np.allclose(g.elastic @ stress + g.coupling.T @ charge, strain, rtol=1e-10)
    assert np.allclose(-g.coupling @ stress + g.dielectric @ charge, field, rtol=1e-10)
    assert np.allclose(h.elastic @ strain - h.coupling.T @ charge, stress, rtol=1e-10)
    assert np.allclose(-h.coupling @ strain + h.dielectric @ charge, field, rtol=1e-10)


def test_symbolic_and_numeric_agree(symbolic: Piezoelectric, ceramic: Piezoelectric) -> None:
    numbers = {sp.Symbol(n): v for n, v in PZT_5H.items()}
    for form in FORMS:
        s, n = symbolic.to(form), ceramic.to(form)  # type: ignore[arg-type]
        for a, b in zip(
            (s.elastic, s.coupling, s.dielectric),
            (n.elastic, n.coupling, n.dielectric),
            strict=True,
        ):
            value = np.array(sp.Matrix(a.tolist()).subs(numbers).evalf(), dtype=float)
            assert np.abs(value - b).max() < 1e-12 * np.abs(b).max()


def test_symbolic_relations(symbolic: Piezoelectric) -> None:
    d33, eps33, s33, d15, s44 = sp.symbols("d33 eps33 s33 d15 s44")
    g = symbolic.to("g")
    assert sp.simplify(g.coupling[2, 2] - d33 / eps33) == 0
    assert sp.simplify(g.elastic[2, 2] - (s33 - d33**2 / eps33)) == 0
    assert sp.simplify(symbolic.to("e").coupling[0, 4] - d15 / s44) == 0
    back = symbolic.to("h").to("d")
    difference = sp.Matrix((back.elastic - symbolic.elastic).tolist())
    assert difference.applyfunc(sp.simplify) == sp.zeros(6, 6)


# -- Voigt and rotation -------------------------------------------------------------------
def test_voigt_round_trips_and_work() -> None:
    rng = np.random.default_rng(1)
    a, b = (m + np.swapaxes(m, -1, -2) for m in rng.standard_normal((2, 5, 3, 3)))
    assert np.allclose(stress_from_voigt(stress_to_voigt(a)), a)
    assert np.allclose(strain_from_voigt(strain_to_voigt(b)), b)
    work = np.einsum("nij,nij->n", a, b)
    assert np.allclose(np.sum(stress_to_voigt(a) * strain_to_voigt(b), axis=-1), work)
    s = sp.symbols("a:f")
    assert strain_from_voigt(np.array(s, dtype=object))[0, 1] == s[5] / 2


def test_bond_matrices_turn_tensors() -> None:
    rng = np.random.default_rng(2)
    a = rng.standard_normal((3, 3))
    a = a + a.T
    turned = STEP @ a @ STEP.T
    assert np.allclose(stress_rotation(STEP) @ stress_to_voigt(a), stress_to_voigt(turned))
    assert np.allclose(strain_rotation(STEP) @ strain_to_voigt(a), strain_to_voigt(turned))
    assert np.allclose(strain_rotation(STEP).T @ stress_rotation(STEP), np.eye(6))


@pytest.mark.parametrize("form", list(FORMS))
def test_rotation_against_full_tensors(form: Any) -> None:
    """The fourth- and third-rank tensors turned index by index."""
    m = general().to(form)
    compliance = form in "dg"
    factor = np.array([1.0, 1, 1, 2, 2, 2]) if compliance else np.ones(6)
    index = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (1, 2): 3, (0, 2): 4, (0, 1): 5}
    at = np.array([[index[min(i, j), max(i, j)] for j in range(3)] for i in range(3)])
    fourth = (m.elastic / np.outer(factor, factor))[at[:, :, None, None], at[None, None]]
    third = (m.coupling / factor)[:, at]
    turned = m.rotated(STEP)
    r = STEP
    fourth = np.einsum("ia,jb,kc,ld,abcd->ijkl", r, r, r, r, fourth)
    third = np.einsum("ia,jb,kc,abc->ijk", r, r, r, third)
    back_4 = (turned.elastic / np.outer(factor, factor))[at[:, :, None, None], at[None, None]]
    assert np.abs(back_4 - fourth).max() < 1e-13 * np.abs(fourth).max()
    assert np.abs((turned.coupling / factor)[:, at] - third).max() < 1e-13 * np.abs(third).max()
    assert np.allclose(turned.dielectric, r @ m.dielectric @ r.T, rtol=1e-12)


def test_rotation_commutes_with_conversion_and_returns() -> None:
    m = general()
    assert distance(m.rotated(STEP).to("h"), m.to("h").rotated(STEP)) < 1e-12
    assert distance(m.rotated(STEP).rotated(STEP.T), m) < 1e-13


def test_poled_ceramic_is_isotropic_about_its_axis(symbolic: Piezoelectric) -> None:
    turned = symbolic.rotated(rotation_about(3, sp.Symbol("theta", real=True)))
    for a, b in (
        (turned.elastic, symbolic.elastic),
        (turned.coupling, symbolic.coupling),
        (turned.dielectric, symbolic.dielectric),
    ):
        difference = sp.Matrix((a - b).tolist()).applyfunc(sp.simplify)
        assert difference == sp.zeros(*difference.shape)
    tilted = symbolic.rotated(rotation_about(1, sp.pi))
    assert sp.simplify(tilted.coupling[2, 2] + symbolic.coupling[2, 2]) == 0


# -- stability and coupling ----------------------------------------------------------------
def test_coupling_factors(ceramic: Piezoelectric, symbolic: Piezoelectric) -> None:
    k = coupling_factors(ceramic.to("h"))
    assert k.k33 == pytest.approx(0.752, abs=2e-3)
    assert k.k31 == pytest.approx(-0.388, abs=2e-3)
    assert k.k15 == pytest.approx(0.675, abs=2e-3)
    assert k.kp == pytest.approx(0.65, abs=5e-3)
    # e33 is a difference of rounded numbers, so its factor differs by 2 %
    assert k.kt == pytest.approx(0.505, rel=0.03)
    e, g, h = ceramic.to("e"), ceramic.to("g"), ceramic.to("h")
    assert k.k33**2 == pytest.approx(1 - g.elastic[2, 2] / ceramic.elastic[2, 2], rel=1e-12)
    assert k.kt**2 == pytest.approx(1 - e.elastic[2, 2] / h.elastic[2, 2], rel=1e-12)
    assert k.k15**2 == pytest.approx(1 - e.dielectric[0, 0] / ceramic.dielectric[0, 0], rel=1e-12)
    d33, s33, eps33 = sp.symbols("d33 s33 eps33")
    assert sp.simplify(coupling_factors(symbolic).k33 - d33 / sp.sqrt(s33 * eps33)) == 0


def test_stability(ceramic: Piezoelectric, symbolic: Piezoelectric) -> None:
    ceramic.check_stable()
    general().to("h").check_stable()
    wrong = transversely_isotropic(**{**PZT_5H, "d33": 900e-12})
    with pytest.raises(BadConstant, match=r"not stable: (E3, T3|T3, E3) together.*too large"):
        wrong.check_stable()
    with pytest.raises(BadConstant, match=r"k33 = 1\.14: a coupling factor lies below 1"):
        coupling_factors(wrong)
    with pytest.raises(BadConstant, match="put in numbers"):
        symbolic.check_stable()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("elastic", (0, 1), 1e-12), r"s\^E is not symmetric: s\^E_12 = 1e-12 but s\^E_21"),
        (("elastic", (2, 2), -1e-12), r"s\^E_33 = -1e-12 is not positive"),
        (("dielectric", (1, 1), 0.0), r"eps\^T_22 = 0 is not positive"),
        (("coupling", (2, 0), np.nan), r"d is not finite at entry \(3, 1\)"),
    ],
)
def test_errors_name_the_entry(ceramic: Piezoelectric, change: Any, words: str) -> None:
    field, at, value = change
    arrays = {n: np.array(getattr(ceramic, n)) for n in ("elastic", "coupling", "dielectric")}
    arrays[field][at] = value
    with pytest.raises(BadConstant, match=words):
        Piezoelectric("d", **arrays)


def test_wrong_shapes_forms_and_rotations(ceramic: Piezoelectric) -> None:
    with pytest.raises(BadConstant, match=r"d has shape \(6, 3\)"):
        Piezoelectric("d", ceramic.elastic, ceramic.coupling.T, ceramic.dielectric)
    with pytest.raises(UnknownName, match="no form 'x'"):
        ceramic.to("x")  # type: ignore[arg-type]
    with pytest.raises(UnusableInput, match=r"rows 1 and 1 have the product 4"):
        ceramic.rotated(2 * np.eye(3))
    with pytest.raises(UnusableInput, match=r"stress is not symmetric: entry \(1, 2\) = 1"):
        stress_to_voigt([[0, 1, 0], [0, 0, 0], [0, 0, 0]])
    with pytest.raises(UnusableInput, match="axis 4 does not exist"):
        rotation_about(4, 0.1)
    with pytest.raises(BadConstant, match=r"eps\^T is singular"):
        Piezoelectric("d", np.eye(6), np.zeros((3, 6)), np.ones((3, 3))).to("g")
    with pytest.raises(BadConstant, match=r"d holds None at entry \(1, 2\)"):
        Piezoelectric(
            "d", np.eye(6), np.array([[0, None, 0, 0, 0, 0], [0] * 6, [0] * 6]), np.eye(3)
        )
    full = Piezoelectric("d", np.full((6, 6), sp.Symbol("s")), np.zeros((3, 6)), np.eye(3))
    with pytest.raises(BadConstant, match=r"s\^E is singular"):
        full.to("e")
    with pytest.raises(ValueError, match="read-only"):
        ceramic.elastic[0, 0] = 1.0


# -- the stack ----------------------------------------------------------------------------
def test_stack_reduction(ceramic: Piezoelectric) -> None:
    n, area, thickness = 180, 25e-6, 100e-6
    stack = stack_constants(ceramic, n, area, thickness)
    assert stack.stiffness == pytest.approx(area / (20.7e-12 * n * thickness))
    assert stack.displacement_per_volt == pytest.approx(n * 593e-12)
    assert stack.free_capacitance == pytest.approx(n * 3400 * EPS * area / thickness)
    assert stack.capacitance == pytest.approx(
        stack.free_capacitance - stack.transducer**2 / stack.stiffness
    )
    g = ceramic.to("g")
    assert stack.open_stiffness == pytest.approx(area / (g.elastic[2, 2] * n * thickness))
    assert stack.coupling_squared == pytest.approx(coupling_factors(ceramic).k33 ** 2)


def test_stack_reduction_symbolic(symbolic: Piezoelectric) -> None:
    n, area, t = sp.symbols("n A t", positive=True)
    stack = stack_constants(symbolic, n, area, t)
    d33, s33, eps33 = sp.symbols("d33 s33 eps33")
    clamped = n * area / t * (eps33 - d33**2 / s33)
    assert sp.simplify(stack.capacitance - clamped) == 0
    assert sp.simplify(stack.transducer - area * d33 / (t * s33)) == 0
    assert sp.simplify(stack.coupling_squared - d33**2 / (s33 * eps33)) == 0


def frequency_response(graph: Any, parameters: dict[str, float], omega: float) -> Any:
    model = equations(graph)
    space, u = closed(model), closed(model).u
    values = {p.symbol: p.value for p in model.parameters.values()}
    values |= {model.parameters[n].symbol: v for n, v in parameters.items()}
    a, b = space.dxdt.jacobian(space.x), space.dxdt.jacobian(u)
    c, d = space.y.jacobian(space.x), space.y.jacobian(u)
    m = [np.array(x.subs(values).evalf(), dtype=float) for x in (a, b, c, d)]
    response = m[2] @ np.linalg.solve(1j * omega * np.eye(len(m[0])) - m[0], m[1]) + m[3]
    return dict(zip(model.output_names, response.ravel(), strict=True))


def test_both_models_take_the_constants(ceramic: Piezoelectric) -> None:
    """The lumped model and the general bond graph are the same linear stack."""
    stack = stack_constants(ceramic, 180, 25e-6, 100e-6)
    rest: dict[str, Any] = {"resistance": 5.0, "damping": 30.0, "mass": 2e-3}
    for f in (10.0, 8e3, 40e3):
        lumped = frequency_response(
            stack_lumped(sensors=("x", "i"), **rest), stack.as_lumped(), 2 * np.pi * f
        )
        graph = frequency_response(
            stack_bond_graph(sensors=("x", "i"), **rest), stack.as_bond_graph(), 2 * np.pi * f
        )
        for n in ("x", "i"):
            assert abs(lumped[n] - graph[n]) < 1e-9 * abs(graph[n])


def test_simulated_free_displacement(ceramic: Piezoelectric) -> None:
    stack = stack_constants(ceramic, 180, 25e-6, 100e-6)
    time = np.linspace(0.0, 1e-3, 11)
    run = simulate(stack_lumped(), time, {"V_in": np.full(11, 50.0)}, stack.as_lumped())
    assert run["x"][-1] == pytest.approx(180 * 593e-12 * 50.0, rel=1e-9)


def test_stack_of_a_ceramic_of_the_table() -> None:
    """PIC255 with the section and length that belong to 3.5 g of ceramics."""
    table = {n: material("PIC255").value(n) for n in ("s33", "d33", "eps33")}
    stack = longitudinal_stack(**table, layers=180, area=25e-6, layer_thickness=100e-6)
    assert stack.stiffness == pytest.approx(67.1e6, abs=5e4)
    assert stack.displacement_per_volt == pytest.approx(72e-9)
    assert stack.coupling_squared == pytest.approx(0.706**2, abs=1e-3)


def test_stack_refusals(ceramic: Piezoelectric) -> None:
    with pytest.raises(UnusableInput, match="area = -1"):
        stack_constants(ceramic, 10, -1.0, 1e-4)
    with pytest.raises(UnusableInput, match=r"capacitance = .* is not positive"):
        StackConstants.from_free(65e6, 1e-9, 3.5)
    # the printed numbers: clamped 1.309 uF behind 1.5 uF, coupling squared 0.127
    printed = StackConstants.from_free(65e6, 1.5e-6, 3.52)
    assert printed.capacitance == pytest.approx(1.309e-6, abs=5e-10)
