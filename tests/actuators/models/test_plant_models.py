"""The models of the plants against state spaces written by hand from the same description."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from actuators.models.plants import PLANT_MODELS, plant_model
from bondgraph import UnknownName, UnusableInput
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Source, TwoPort, Valued
from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.generator.parameters import PLANTS
from tests.settled import simulate


def chain(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    # states x_1, x_2, x_3, v_1, v_2, v_3
    k, b = ([p[f"{c}_{i}"] for i in (1, 2, 3)] for c in "kb")

    def tied(c: list[float]) -> Array:
        return np.array([[c[0] + c[1], -c[1], 0], [-c[1], c[1] + c[2], -c[2]], [0, -c[2], c[2]]])

    lower = -np.hstack([tied(k), tied(b)]) / np.array([[p[f"m_{i}"]] for i in (1, 2, 3)])
    a = np.vstack([np.hstack([np.zeros((3, 3)), np.eye(3)]), lower])
    return a, np.array([0, 0, 0, 1 / p["m_1"], 0, 0]), np.eye(3, 6), np.zeros(3)


def stack(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    # states v_C, x, v
    ra, ca, al, m = p["R_a"], p["C_a"], p["alpha"], p["m"]
    a = np.array([[-1 / (ra * ca), 0, -al / ca], [0, 0, 1], [al / m, -p["k"] / m, -p["b"] / m]])
    c = np.array([[-1 / ra, 0, 0], [0, 1, 0]])
    return a, np.array([1 / (ra * ca), 0, 0]), c, np.array([1 / ra, 0])


def motor(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    # states i, w_1, twist, w_2
    n, ks, bs, j1, j2, km, lw = (p[x] for x in ("n", "k_s", "b_s", "J_1", "J_2", "K_m", "L_w"))
    a = np.array(
        [
            [-p["R_w"] / lw, -km / lw, 0, 0],
            [km / j1, -(p["b_1"] + bs / n**2) / j1, -ks / n / j1, bs / n / j1],
            [0, 1 / n, 0, -1],
            [0, bs / n / j2, ks / j2, -(bs + p["b_2"]) / j2],
        ]
    )
    return a, np.array([1 / lw, 0, 0, 0]), np.eye(4)[[0, 1, 3]], np.zeros(3)


def corner(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    # states of the tyre, v_u, stroke, v_b
    kt, bt, mu, ks, bs, mb = (p[x] for x in ("k_t", "b_t", "m_u", "k_s", "b_s", "m_b"))
    a = np.array(
        [
            [0, -1, 0, 0],
            [kt / mu, -(bt + bs) / mu, -ks / mu, bs / mu],
            [0, 1, 0, -1],
            [0, bs / mb, ks / mb, -bs / mb],
        ]
    )
    return a, np.array([1, bt / mu, 0, 0]), np.eye(4)[[1, 3, 2]], np.zeros(3)


def tanks(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    g12, g23, g3 = 1 / p["R_12"], 1 / p["R_23"], 1 / p["R_out"]
    a = np.array([[-g12, g12, 0], [g12, -g12 - g23, g23], [0, g23, -g23 - g3]])
    a = a / np.array([[p["C_1"]], [p["C_2"]], [p["C_3"]]])
    return a, np.array([1 / p["C_1"], 0, 0]), np.eye(3), np.zeros(3)


def probe(p: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    # states x, v, v_f
    m, kg, rg, cf = p["m"], p["K_g"], p["R_g"], p["C_f"]
    a = np.array(
        [
            [0, 1, 0],
            [-p["k"] / m, -(p["b"] + kg**2 / rg) / m, kg / rg / m],
            [0, kg / rg / cf, -1 / rg / cf],
        ]
    )
    return a, np.array([0, 1 / m, 0]), np.eye(3)[[0, 2]], np.zeros(2)


BY_HAND = {f.__name__: f for f in (chain, stack, motor, corner, tanks, probe)}


@pytest.mark.parametrize("plant", sorted(PLANTS))
def test_model_answers_as_the_equations_written_by_hand(plant: str) -> None:
    public, rng = PLANTS[plant], np.random.default_rng(5)
    # every value moved by its own factor, so that no two elements can be exchanged unseen
    values = {n: v * float(rng.uniform(0.8, 1.25)) for n, (v, _) in public.nominal.items()}
    graph = plant_model(plant)
    moved = graph.with_values({n: 1 / v if n in ("alpha", "n") else v for n, v in values.items()})
    t = np.arange(400) * public.step
    u = np.cumsum(rng.standard_normal(t.size))
    u -= u[0]  # both start at rest
    _, expected, _ = lsim(StateSpace(*_columns(*BY_HAND[plant](values))), u, t)
    command = public.source[0]
    got = simulate(moved, t, {command: u})
    for c, name in enumerate(public.sensors):
        scale = np.abs(expected[:, c]).max()
        assert np.abs(got[name] - expected[:, c]).max() < 1e-3 * scale, name


def _columns(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array, Array, Array]:
    return a, b[:, None], c, d[:, None]


@pytest.mark.parametrize("plant", sorted(PLANTS))
def test_names_values_and_units_are_the_public_ones(plant: str) -> None:
    graph, public = plant_model(plant), PLANTS[plant]
    assert graph.check() == ()
    elements = {e.name for e in graph.of_type(Valued, TwoPort)}
    assert elements == set(public.nominal)
    for name, (value, _) in public.nominal.items():
        own = graph.parameters[name].value
        assert (1 / own if name in ("alpha", "n") else own) == pytest.approx(value), name


def test_sensors_are_picked_and_unknown_ones_refused() -> None:
    graph = plant_model("chain", ["x_3", "x_1"])
    assert "x_1" in graph.elements
    assert "x_2" not in graph.elements
    with pytest.raises(UnknownName):
        plant_model("chain", ["x_4"])
    with pytest.raises(UnknownName):
        plant_model("chains")
    with pytest.raises(UnusableInput):
        plant_model("tanks", [])


def test_a_declared_dead_time_is_a_parameter_of_the_command() -> None:
    graph = plant_model("probe", None, 0.004)
    (source,) = graph.of_type(Source)
    assert source.drive == Drive(delay="delay_F")
    assert graph.parameters["delay_F"].value == 0.004
    assert plant_model("probe")["F"] == PLANT_MODELS["probe"]()["F"]
