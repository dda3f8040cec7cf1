"""Small motions about a rest: those of a linear twin, of differences, and of physics."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Df, One, R, Se, Zero
from bondgraph.simulation.dynamics import Dynamics, GeneralDynamics, dynamics_of
from bondgraph.simulation.radau.start import rests
from bondgraph.support.arrays import Array
from tests.identification.study.general_plants import coupled, general, motor, pendulum, tank
from tests.identification.study.test_dynamics import drum


def still(dynamics: Dynamics, **bias: float) -> Array:
    held = {n: np.full(2, bias.get(n, 0.0)) for n in dynamics.commands}
    return np.asarray(dynamics.inputs(held, np.arange(2.0))[0])


def test_twin_of_a_linear_graph() -> None:
    """Responses and their derivatives by parameters are those of the exact dynamics."""
    s = np.asarray(1j * np.geomspace(0.5, 60.0, 9), complex)
    made = []
    for dynamics in (dynamics_of(coupled()), general(coupled())):
        p, u, drive = dynamics.vector({}), still(dynamics, F=3.0), dynamics.drive(["F"], s)
        wanted = [dynamics.parameter_names.index(n) for n in ("k1", "k12", "m2", "d1")]
        small = dynamics.small_signal(p, u)
        slopes = dynamics.small_signal_slopes(p, u, wanted)
        made.append((small.response(s, drive), small.response_slopes(slopes, s, drive)))
        assert np.sort_complex(small.eigenvalues()) == pytest.approx(
            np.sort_complex(dynamics_of(coupled()).small_signal(p, u).eigenvalues()), rel=1e-9
        )
    for exact, other in zip(*made, strict=True):
        assert other == pytest.approx(exact, rel=1e-9, abs=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("graph", "bias"),
    [(pendulum(), {"T": 1.5}), (motor(), {"V": 2.0}), (tank(), {"Q": 4e-3})],
)
def test_slopes_are_exact(graph: BondGraph, bias: dict[str, float]) -> None:
    """Against differences of linearisations, each about the rest of its own parameters."""
    dynamics = dynamics_of(graph)
    assert isinstance(dynamics, GeneralDynamics)
    p, u = dynamics.vector({}), still(dynamics, **bias)
    small = dynamics.small_signal(p, u)
    slopes = dynamics.small_signal_slopes(p, u, range(p.size))
    for i, slope in enumerate(slopes):
        h = 1e-6 * p[i] * np.eye(p.size)[i]
        ends = dynamics.small_signal(np.stack([p + h, p - h]), u)
        for name in "abcd":
            both, size = getattr(ends, name), np.abs(getattr(small, name)).max(initial=0.0)
            numeric = (both[0] - both[1]) / (2 * h[i])
            exact = getattr(slope, name)
            assert np.abs(numeric - exact).max() <= 1e-7 * size / p[i], (i, name)


def test_pendulum_about_a_tilted_rest() -> None:
    """``J s^2 + b s + mgl cos(phi0)`` with ``mgl sin(phi0) = T``."""
    dynamics = dynamics_of(pendulum())
    p, s = dynamics.vector({}), 1j * np.array([0.3, 2.0, 7.7, 40.0])
    small = dynamics.small_signal(p, still(dynamics, T=1.5))
    by_hand = 1.0 / (0.05 * s**2 + 0.04 * s + 3.0 * np.cos(np.arcsin(0.5)))
    made = small.response(s, dynamics.drive(["T"], s))
    assert made[:, 0, 0] == pytest.approx(by_hand, rel=1e-9)


def test_rates_of_inputs_count() -> None:
    """A source right at a capacitor: ``I = (1 / R + s C) V``."""
    with BondGraph("leaky") as g:
        wire, node = One("wire"), Zero("node")
        Se("V", unit="V") >> wire >> node >> C("C", 2e-6, unit="F")
        node >> R("R", 5e3, unit="ohm")
        wire >> Df("i", unit="A")
    dynamics = dynamics_of(g)
    assert dynamics.input_rates == ("d_V",)
    assert dynamics.commands == ("V",)
    p, s = dynamics.vector({}), 1j * np.array([1.0, 100.0, 1e4])
    made = dynamics.small_signal(p, still(dynamics)).response(s, dynamics.drive(["V"], s))
    assert made[:, 0, 0] == pytest.approx(1 / 5e3 + s * 2e-6, rel=1e-12)


def test_without_a_rest_the_start_is_taken() -> None:
    """No angle carries 4 N*m; one that hangs does not move the others of a batch."""
    dynamics = dynamics_of(pendulum())
    p = np.stack([dynamics.vector({"mgl": w}) for w in (3.0, 8.0)])
    u = still(dynamics, T=4.0)
    assert isinstance(dynamics, GeneralDynamics)
    found = rests(dynamics.program, u, p)
    assert np.isnan(found[0]).all()
    assert found[1, 1] == pytest.approx(np.arcsin(0.5), rel=1e-9)
    a = dynamics.small_signal(p, u).a
    assert a[0, 0, 1] == pytest.approx(-3.0)
    assert a[1, 0, 1] == pytest.approx(-8.0 * np.cos(np.arcsin(0.5)), rel=1e-9)


def test_a_rest_with_components_of_zero_is_found() -> None:
    """The second spring of the drum stays slack while the first one carries the force."""
    dynamics = dynamics_of(drum())
    at = dynamics.at_rest(dynamics.vector({}), still(dynamics, F=16.0))
    assert at[list(dynamics.state_names).index("q_k")] == pytest.approx(16.0 / 200.0, rel=1e-9)
