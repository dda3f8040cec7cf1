"""Energy of every store, reciprocity and positivity: pencil and paper, and published mistakes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, C, GraphError, I, One, R, Se
from bondgraph.energy.definiteness import is_positive, shortened, sign_of, vanishes
from bondgraph.energy.law_energy import law_energy, law_energy_record
from bondgraph.energy.stores import (
    energy_problems,
    positivity,
    store_energy,
    store_names,
    stored_variables,
)
from bondgraph.graph.elements import CField, IField, RField
from bondgraph.graph.modulation import port_variables
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic, Polynomial, TableLaw
from bondgraph.support.ops import NUMPY
from tests.bondgraph.energy.energy_models import coupled, crank, plate, rlc
from tests.symbols import P, S


def with_field(kind: Any, **options: Any) -> BondGraph:
    with BondGraph("field") as g:
        a, b = One("a"), One("b")
        device = kind("device", **options)
        Se("u_1") >> a >> device
        Se("u_2") >> b >> device
    return g


def test_linear_stores() -> None:
    g = rlc()
    p, q = S("p_L q_C_1")
    inductance, capacitance = P("L C_1")
    assert store_energy(g, "L") == p**2 / (2 * inductance)
    assert store_energy(g, "C_1") == q**2 / (2 * capacitance)
    assert store_energy(coupled(), "k") == P("k") * S("q_k") ** 2 / 2
    assert store_names(g) == ("L", "C_1")
    assert stored_variables(plate(), "device") == ("q_device1", "q_device2")


def test_the_gradient_is_the_law() -> None:
    g = rlc().with_element("C_1", law=Polynomial(centre=0.3, half=2.0, orders=(2, 3, 5)))
    q, (a2, a3, a5) = S("q_C_1"), S("a_2_C_1 a_3_C_1 a_5_C_1")
    energy = store_energy(g, "C_1")
    z = (q - sp.Rational(3, 10)) / 2
    law = q / P("C_1") + a2 * z**2 + a3 * z**3 + a5 * z**5
    assert vanishes(energy.diff(q) - law)
    assert energy.subs(q, 0) == 0


TABLES = [
    TableLaw((-1.0, -0.2, 0.3, 1.0), (-9.0, -1.0, 2.0, 12.0), flat=False, reference=10.0),
    TableLaw((0.5, 1.0, 2.0), (1.0, -1.0, 4.0), flat=True, reference=0.0),
    TableLaw((0.5, 1.0, 2.0), (1.0, -1.0, 4.0), "linear", free=True, reference=2.0),
]


@pytest.mark.parametrize("law", TABLES)
def test_tables_in_closed_form_and_by_quadrature(law: TableLaw) -> None:
    s = sp.Symbol("s", real=True)
    p = law.values if law.free else ()
    energy = law_energy(law, s, p)
    at = np.linspace(-2.0, 3.0, 41)
    record = law_energy_record(law, at, p)
    closed = [float(energy.subs(s, v)) for v in at]
    np.testing.assert_allclose(record, closed, atol=1e-9)
    h = 1e-6
    for v in (-1.5, -0.5, 0.1, 0.77, 1.4, 2.5):
        slope = float(energy.subs(s, v + h) - energy.subs(s, v - h)) / (2 * h)
        assert slope == pytest.approx(float(law.deviation(NUMPY, v, (), p)), abs=1e-5)


def test_what_has_no_closed_form_stays_an_integral_with_the_right_value() -> None:
    law = TableLaw((-1.0, 0.0, 1.0, 2.0), (-2.0, 0.0, 1.0, 5.0), "pchip", flat=False, reference=0.0)
    energy = law_energy(law, sp.Symbol("s", real=True), ())
    assert isinstance(energy, sp.Integral)
    at = np.linspace(-1.5, 2.5, 100_001)
    w = np.asarray(law.deviation(NUMPY, at, (), ()))
    by_sum = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(at))])
    by_sum -= np.interp(0.0, at, by_sum)
    np.testing.assert_allclose(law_energy_record(law, at, ()), by_sum, atol=1e-8)


def test_a_law_with_memory_has_no_energy_of_its_own() -> None:
    g = rlc().with_element("C_1", law=Hysteretic(MaxwellResistiveCapacitor((1.0,), (1.0,))))
    with pytest.raises(GraphError, match="energy of C_1 depends on its past"):
        store_energy(g, "C_1")
    with pytest.raises(KeyError, match="Known: L, C_1"):
        store_energy(g, "R_1")


def test_the_published_moving_plate_is_caught_by_name() -> None:
    """The force c0 x0 Q^2 / (2 x^2) of the MTT report against its voltage Q x / (c0 x0)."""
    (line,) = energy_problems(plate(published=True))
    for part in ("device", "ports 1 and 2", "de1/dq2 = q1/(c0*x0)", "de2/dq1 = c0*q1*x0/q2**2"):
        assert part in line
    assert "\n" not in line
    with pytest.raises(GraphError, match="ports 1 and 2 are not reciprocal"):
        store_energy(plate(published=True), "device")


def test_the_right_moving_plate_passes_and_its_law_gives_the_energy_back() -> None:
    assert energy_problems(plate()) == ()
    q, x = port_variables("q", 2)
    with BondGraph("by_law") as g:
        c0, x0 = g.parameter("c0", 1e-9), g.parameter("x0", 1e-3)
        device = CField("device", law=(q * x / (c0 * x0), q**2 / (2 * c0 * x0)))
        Se("u_1") >> One("a") >> device
        Se("u_2") >> One("b") >> device
    assert energy_problems(g) == ()
    assert vanishes(store_energy(g, "device") - store_energy(plate(), "device"))
    # a plate capacitor is not convex: it pulls itself together
    found = positivity(g, "device", {"q_device1": 1e-8, "q_device2": 1e-3})
    assert found.sign == "indefinite"
    assert found.at == {"q_device1": 1e-8, "q_device2": 1e-3}


def test_a_trigonometric_field_is_recognised_as_reciprocal() -> None:
    """Salient pole machine: the inductance turns with sin^2 and cos(2 theta), one identity away."""
    p, theta = port_variables("p", 2)
    laws = (p * (1 - sp.cos(2 * theta)), 2 * p**2 * sp.sin(theta) * sp.cos(theta))
    assert energy_problems(with_field(IField, law=laws)) == ()
    wrong = (laws[0], 3 * p**2 * sp.sin(theta) * sp.cos(theta))
    (line,) = energy_problems(with_field(IField, law=wrong))
    assert "df1/dp2" in line
    assert "df2/dp1" in line


@pytest.mark.parametrize(
    ("kind", "matrix", "words"),
    [
        (CField, ((2.0, 1.0), (1.0, 3.0)), None),
        (CField, ((1.0, 1.0), (1.0, 1.0)), None),  # semidefinite is a stiff connection, allowed
        (CField, ((1.0, 2.0), (2.0, 1.0)), "no lowest energy"),
        (CField, ((1.0, 0.5), (0.25, 1.0)), "not reciprocal"),
        (IField, ((1.0, 1.001), (1.001, 1.0)), "no lowest energy"),
        (RField, ((1.0, 5.0), (-5.0, 1.0)), None),  # a gyrator's part makes no power
        (RField, ((1.0, 3.0), (0.0, 1.0)), "gives power"),
        (RField, ((0.0, 3.0), (-3.0, 0.0)), None),
    ],
)
def test_linear_fields_are_judged_exactly(kind: Any, matrix: Any, words: str | None) -> None:
    lines = energy_problems(with_field(kind, matrix=matrix))
    assert len(lines) == (0 if words is None else 1)
    if words:
        assert words in lines[0]
        assert lines[0].startswith("device")


def test_parameters_decide_a_coupled_coil_at_their_values() -> None:
    with BondGraph("coils") as g:
        gamma = g.parameter("gamma", 1.0)
        mutual = g.parameter("mutual", 0.9, positive=False)
        device = IField("device", matrix=((gamma, -mutual), (-mutual, gamma)))
        Se("u_1") >> One("a") >> device
        Se("u_2") >> One("b") >> device
    found = positivity(g, "device")
    assert (found.sign, found.exact) == ("positive definite", False)
    assert energy_problems(g) == ()
    over = g.with_values({"mutual": 1.0 + 1e-12})
    assert positivity(over, "device").sign == "indefinite"
    assert len(energy_problems(over)) == 1


def test_positivity_for_all_parameters() -> None:
    found = positivity(rlc(), "L")
    assert (found.sign, found.exact, found.at) == ("positive definite", True, {})
    bent = rlc().with_element("C_1", law=Polynomial(orders=(3,)))
    bent = bent.with_values({"C_1": 0.1})
    assert positivity(bent, "C_1", {"q_C_1": 0.5}).sign == "positive definite"
    with pytest.raises(KeyError):
        positivity(bent, "C_1", {"q_L": 0.5})


def test_nonlinear_resistive_fields() -> None:
    f1, f2 = port_variables("f", 2)
    good = with_field(RField, law=(f1 + f1**3, f2 - f1))
    assert energy_problems(good) == ()
    bad = with_field(RField, law=(f1**3 - f1, f2))
    assert "gives power" in energy_problems(bad)[0]


def test_a_nonlinear_field_that_misses_its_law_is_reported_not_raised() -> None:
    lines = energy_problems(with_field(CField))
    assert len(lines) == 1
    assert "needs one of energy, law or matrix" in lines[0]


def test_graphs_without_fields_have_no_problems() -> None:
    for g in (rlc(), coupled(), crank()):
        assert energy_problems(g) == ()


@pytest.mark.parametrize("seed", range(20))
def test_exact_sign_agrees_with_eigenvalues(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    half = rng.integers(-3, 4, size=(n, int(rng.integers(1, n + 1))))
    matrix = half @ half.T - int(rng.random() < 0.4) * np.diag(rng.integers(0, 3, size=n))
    smallest = np.linalg.eigvalsh(matrix).min()
    sign, exact = sign_of(sp.Matrix(matrix.tolist()), {}, may_vary=False)
    assert exact
    if smallest > 1e-9:
        assert sign == "positive definite"
    elif smallest < -1e-9:
        assert sign == "indefinite"
    else:
        assert sign == "positive semidefinite"


def test_zero_is_told_from_nearly_zero() -> None:
    x, y = S("x y")
    assert vanishes((x**2 - y**2) / (x - y) - x - y)
    assert vanishes(sp.cos(2 * x) - 1 + 2 * sp.sin(x) ** 2)
    assert not vanishes(sp.Rational(1, 10**25) * x)
    assert not vanishes(sp.sin(x) - x)
    assert vanishes(0.1 * sp.sin(x) ** 2 + 0.1 * sp.cos(x) ** 2 - 0.1)
    assert shortened(sp.exp(x) * y / sp.exp(x)) == y
    a, b = P("a b")
    assert is_positive((a**2 + a * b) / (a * b)) is True
    assert is_positive(-a) is False
    assert is_positive(a - b) is None


def test_an_infinite_hessian_is_refused() -> None:
    q1, q2 = port_variables("q", 2)
    g = with_field(CField, energy=q1**2 / q2)
    with pytest.raises(GraphError, match="no finite Hessian"):
        positivity(g, "device")
    assert positivity(g, "device", {"q_device1": 1.0, "q_device2": 1.0}).sign != "indefinite"


def test_stores_with_their_half_arrow_turned_round() -> None:
    with BondGraph("turned") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 1.0)
        C("C_1", 2.0) >> loop
        I("L", 1.0) >> loop
    assert store_energy(g, "C_1") == S("q_C_1") ** 2 / (2 * P("C_1"))
