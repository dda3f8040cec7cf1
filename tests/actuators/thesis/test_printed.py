"""The printed sets as data, what they give, and the findings that can be recomputed."""

from __future__ import annotations

import inspect
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from actuators.stack.loop_width import loop_of
from actuators.stack.lumped import stack_lumped
from actuators.thesis import (
    ERRORS,
    FINDINGS,
    NOT_REPRODUCIBLE,
    PRINTED_MODELS,
    TABLE_3_1,
    TABLE_6_1,
    TABLE_6_2,
    ang_inverse_scaled,
    ang_recovered_scaled,
    named,
    set_6_2,
    set_6_3,
    set_6_5,
    table_6_4,
)
from actuators.thesis.constants import breakaways_as_printed, slip_points, threshold_gaps
from actuators.thesis.models import stack_bond_graph_ang, stack_lumped_maxwell
from actuators.thesis.refits import bond_graph_operator, lumped_operator, refit_lumped
from actuators.thesis.steady import sine, steady_loop, triangle
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    AngInverse,
    DeadZones,
    MaxwellResistiveCapacitor,
    PrandtlIshlinskii,
)
from bondgraph.support.errors import UnknownName
from tests.settled import simulate


def test_tables() -> None:
    assert [q.value for q in TABLE_6_1] == [65e6, 16e-3, 80.0, 1.5e-6, 3.52]
    assert [q.value for q in TABLE_6_2] == [65e6, 16e-3, 3.52, 18e-3, 1.13e-4, 5.0]
    assert [q.value for q in TABLE_3_1] == [15e-6, 100, 1000, 50, 57e6, 1.5e-6, 12.5, 18e3, 32e-3]
    assert [round(1e9 * q.value, 2) for q in ERRORS] == [
        86.17, 76.79, 33.88, 39.21, 72.50, 86.92, 28.63, 34.05,
        95.51, 105.35, 29.59, 35.44, 167.31, 163.3, 87.36, 83.69,
    ]  # fmt: skip
    with pytest.raises(UnknownName, match=r"table 6\.1"):
        named(TABLE_6_1, "c")


def test_sets_are_the_operators() -> None:
    assert {q.symbol: round(q.value * (1e9 if q.unit == "m" else 1), 4) for q in set_6_2()} == {
        "J": 10, "alpha": 8.11, "q": 18.42, "sigma_r": 5.28, "beta": 0.047, "c": 1.21,
    }  # fmt: skip
    weights = [round(1e9 * q.value, 2) for q in set_6_3() if q.symbol.startswith("wf")]
    assert weights == [9.84, 11.13, 1.26, 2.04, 1.27, 1.45, 1.16, 1.20, 1.09, 0.85, 1.38]
    assert named(set_6_3(), "d_1") == pytest.approx(342.58e-9)
    assert len(set_6_5()) == 13 + 13 + 2 + 2
    elements = table_6_4()
    assert len(elements) == 30
    assert named(elements, "C_9") == pytest.approx(229.64e-6)
    assert named(elements, "v_14") == pytest.approx(2.80)


def test_lumped_defaults_are_table_6_1() -> None:
    defaults = {n: p.default for n, p in inspect.signature(stack_lumped).parameters.items()}
    assert defaults["capacitance"] == named(TABLE_6_1, "C")
    assert defaults["transducer"] == named(TABLE_6_1, "T")
    assert defaults["stiffness"] == named(TABLE_6_1, "k")
    assert defaults["mass"] == pytest.approx(named(TABLE_6_1, "m") / 3)
    assert defaults["damping"] == named(TABLE_6_1, "b")


def test_forward_operator_behind_the_printed_inverse() -> None:
    found = ang_recovered_scaled()
    steps = np.diff(found.play.thresholds)
    assert steps.mean() == pytest.approx(0.2298, abs=5e-5)
    assert np.abs(steps / steps.mean() - 1).max() < 0.006
    assert steps == pytest.approx(threshold_gaps())
    assert found.play.thresholds[-1] == pytest.approx(2.757, abs=5e-4)
    expected = (
        2.381, 3.175, 0.306, 0.444, 0.406, 0.371, 0.271, 0.304, 0.369, 0.385, 0.036, 0.007, 2e-4,
    )  # fmt: skip
    assert found.play.weights == pytest.approx(expected, abs=6e-4)
    assert found.dead_zone.thresholds == pytest.approx((0, 42.19), abs=5e-3)
    assert found.dead_zone.weights == pytest.approx((0.0595, 0.1632), abs=5e-5)
    again, printed = found.inverse(), ang_inverse_scaled()
    assert again.play.weights == pytest.approx(printed.play.weights, rel=1e-9)
    assert again.play.thresholds == pytest.approx(printed.play.thresholds, rel=1e-9)


def test_rounding_of_the_printed_inverse_leaves_more_than_3_percent() -> None:
    """Half a unit of the last digit of wf_0 and wf_1 alone moves the top by more than 3 %."""
    printed = ang_inverse_scaled()
    field = 1e-3 * sine() / 18e-3

    def top(step: float) -> float:
        w = list(printed.play.weights)
        w[0], w[1] = w[0] + step, w[1] + step
        plays = PrandtlIshlinskii(printed.play.thresholds, tuple(w))
        return float(AngInverse(printed.dead_zone, plays).inverse().run(field)[0].max())

    assert top(-0.005) / top(0.005) > 1.06


def test_segments_and_breakaways_of_table_6_4() -> None:
    ends = np.array(slip_points())
    expected = [
        1.9, 5.9, 14.3, 23.6, 33.6, 44.2, 55.4, 66.6, 78.1, 89.9, 102.8, 113.1, 126.5, 138.8, 147.9,
    ]  # fmt: skip
    assert 1e6 * ends == pytest.approx(expected, abs=0.05)
    assert [round(v, 1) for v in 1e6 * np.diff(ends)][:2] == [3.9, 8.4]
    assert round(1e6 * np.diff(ends).max(), 1) == 13.4
    table = MaxwellResistiveCapacitor.stack_2hz()
    assert sum(table.breakaways) == pytest.approx(16.70, abs=5e-3)
    wrong = breakaways_as_printed(table)
    assert wrong[0] == 0.0
    assert sum(wrong) == pytest.approx(11.8, abs=0.05)
    # the rise of the loading curve over each segment is not f_i either
    curve = np.interp(np.array([0.0, *ends]), *_loading(table))
    assert np.diff(curve)[:3] == pytest.approx([2.24, 1.67, 2.5], abs=0.05)


def _loading(table: MaxwellResistiveCapacitor) -> tuple[Any, Any]:
    q = np.linspace(0.0, 160e-6, 160001)
    return q, table.run(q)[0]


def test_sign_form_of_the_maxwell_element_drops_held_samples() -> None:
    """With sgn(0) = 0 a held sample of a slipping element has no force; the stop keeps it."""
    x, k, f = [0.0, 3.0, 3.0, 2.5], 1.0, 1.0
    anchor, printed = 0.0, [0.0]
    for before, now in pairwise(x):
        stretch = k * (now - anchor)
        if abs(stretch) >= f:
            stretch = f * np.sign(now - before)
            anchor = now - stretch / k
        printed.append(float(stretch))
    stop = MaxwellResistiveCapacitor((k,), (f,))
    assert stop.run(x)[0].tolist() == [0.0, 1.0, 1.0, 0.5]
    assert printed == [0.0, 1.0, 0.0, -0.5]


@pytest.mark.parametrize(
    ("name", "bottom", "top", "thickness"),
    [
        ("stack_al_janaideh", 506.8, 4914.7, 790.0),
        ("stack_ang", 475.5, 4873.2, 766.0),
        ("stack_bond_graph_ang", 513.7, 5062.0, 779.0),
        ("stack_lumped_maxwell", 510.9, 4511.6, 531.0),
    ],
)
def test_printed_models_as_bond_graphs(
    name: str, bottom: float, top: float, thickness: float
) -> None:
    """Simulated with inertia, damping and leads at 2 Hz, third period."""
    per = 1000
    time = np.arange(3 * per + 1) * (0.5 / per)
    volt = 50.0 - 50.0 * np.cos(4.0 * np.pi * time)
    graph = PRINTED_MODELS[name]()
    assert graph.check() == ()
    x = 1e9 * simulate(graph, time, {"V_in": volt}, accuracy=1e-5)["x"][2 * per :]
    assert (x.min(), x.max()) == pytest.approx((bottom, top), abs=0.6)
    assert loop_of(volt[2 * per :], x).thickness == pytest.approx(thickness, abs=1.2)


def test_transducer_of_the_models() -> None:
    refitted = refit_lumped()
    assert refitted == pytest.approx(3.82, abs=5e-3)
    assert steady_loop(lumped_operator(refitted)).top > 4.8e-6
    assert stack_lumped_maxwell(refitted).parameters["T"].value == refitted
    assert stack_bond_graph_ang(1.0).parameters["T"].value == 1.0
    # T of the bond graph with this C_nl only scales the displacement
    a, b = steady_loop(bond_graph_operator(3.0)), steady_loop(bond_graph_operator(3.3))
    assert b.top / a.top == pytest.approx(1.1, rel=1e-9)
    assert b.ratio == pytest.approx(a.ratio, rel=1e-6)


def test_inputs() -> None:
    for u in (sine(), triangle()):
        assert u.shape == (12001,)
        assert (u.min(), u[0], u[2000], u.max()) == pytest.approx((0, 0, 100, 100), abs=1e-9)
    assert np.abs(np.abs(np.diff(triangle())) - 0.05).max() < 1e-9


def text(where: str) -> str:
    return " ".join(f.finding for f in FINDINGS if where in f.where)


def test_finding_gauge_of_6_2() -> None:
    o, u, scale = AlJanaideh.stack_2hz(), sine(), 3.3
    other = AlJanaideh(
        o.q / scale, o.c * scale, o.sigma * scale, o.alpha / scale, o.beta / scale, o.count
    )
    assert np.abs(other.run(u)[0] - o.run(u)[0]).max() < 1e-11 * 1e-6
    assert "c L" in text("(5.6)")


def test_finding_clocks() -> None:
    """Both branches are shifted in time by the drift; at the middle the slope is largest."""
    loop = steady_loop(AlJanaideh.stack_2hz())
    drift = 1e-4 * 32768 / 3125
    for f, expected in ((2.0, 58e-9), (100.0, 2.9e-6)):
        false = 2.0 * drift * np.pi * f * (loop.top - loop.bottom)
        assert false == pytest.approx(expected, rel=0.01)
    assert "58 nm" in text("6.6")
    assert "2.9 um" in text("6.6")


def test_finding_interferometer() -> None:
    assert 632.8 / 2 / 256 == pytest.approx(1.24, abs=5e-3)
    assert 632.8 / 2 / 512 == pytest.approx(0.62, abs=5e-3)
    assert 632.8e-9 / 4 * 1e6 == pytest.approx(158e-3, abs=5e-4)
    assert all(word in text("4.3") for word in ("1.24", "0.62", "158"))


def reference_7_3() -> np.ndarray:
    t = np.linspace(0.0, 3.0, 3001)
    wave = np.sin(2 * np.pi * t - np.pi / 2)
    return np.asarray(1e-9 * np.where(t < 0.5, 2000 * wave + 2000, 1500 * wave + 2500))


def test_finding_7_1() -> None:
    """Without the term of q' the error is larger than the stroke."""
    plant, z = AlJanaideh.stack_2hz(), reference_7_3()
    right = plant.inverse()
    wrong = PrandtlIshlinskii(right.thresholds, (0.0, *right.weights[1:]))
    error = np.abs(plant.run(wrong.run(z)[0])[0] - z).max()
    assert error == pytest.approx(8.7e-6, abs=0.05e-6)
    assert "larger than the" in text("(7.1)")


def test_finding_7_2() -> None:
    """An actuator with a past, inverted as if it had none: volts at first."""
    plant = Ang.stack_2hz()
    _, memory = plant.run([0.0, 90.0, 20.0, 60.0])
    z, _ = plant.run(60.0 + 20.0 * np.sin(np.linspace(0, 4 * np.pi, 500)), memory)
    right, _ = plant.inverse().run(z, plant.inverse_memory(memory))
    wrong, _ = plant.inverse().run(z, (0.0,) * plant.n_memory)
    assert 1.0 < np.abs(right - wrong).max() < 20.0


def test_finding_mass_and_resonance() -> None:
    area = np.pi * 6e-3**2
    assert area == pytest.approx(named(TABLE_6_2, "A"), rel=2e-3)
    assert "10.1 kHz becomes 17.6 kHz" in " ".join(text("tables 6.1").split())


def test_dead_zone_of_the_printed_inverse_begins_at_the_end_of_the_loop() -> None:
    dipole = 1e8 * steady_loop(bond_graph_operator()).top * 18e-3 / 3.52
    assert dipole == pytest.approx(ang_inverse_scaled().dead_zone.thresholds[1], rel=0.04)
    assert isinstance(ang_inverse_scaled().dead_zone, DeadZones)


def test_findings_are_short_and_complete() -> None:
    assert len(FINDINGS) >= 25
    assert len({(f.where, f.printed) for f in FINDINGS}) == len(FINDINGS)
    for f in FINDINGS:
        assert f.where
        assert f.printed
        assert 20 < len(f.finding) < 320
        assert f.finding.isascii()
    for word in ("not public", "6.4", "weights", "two clocks"):
        assert word in NOT_REPRODUCIBLE
    assert "every model here" not in NOT_REPRODUCIBLE, "operators that depend on rate are here"
    assert 'clocked = "fast"' in text("4.2.2")
