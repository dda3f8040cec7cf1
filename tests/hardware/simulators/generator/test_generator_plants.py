"""The plants of the trial against hand calculations: rest, frequency response, energy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from hardware.simulators.generator.native import Row, run
from hardware.simulators.generator.parameters import PLANTS


def nominal(plant: str) -> dict[str, float]:
    return {k: v * (1 + 0.03 * i) for i, (k, (v, _)) in enumerate(PLANTS[plant].nominal.items())}


def at_rest(plant: str, p: Mapping[str, float], u: float) -> list[float]:
    """Return the sensors long after a step of the command."""
    match plant:
        case "chain":
            return [u / p["k_1"]] * 3
        case "stack":
            return [0.0, p["alpha"] * u / p["k"]]
        case "motor":
            load = p["b_1"] + p["b_2"] / p["n"] ** 2
            w = p["K_m"] * u / (p["K_m"] ** 2 + p["R_w"] * load)
            return [load * w / p["K_m"], w, w / p["n"]]
        case "corner":
            return [u, u, 0.0]
        case "tanks":
            third = p["R_out"] * u
            return [third + (p["R_23"] + p["R_12"]) * u, third + p["R_23"] * u, third]
        case _:
            return [u / p["k"], 0.0]


@pytest.mark.parametrize("plant", PLANTS)
def test_comes_to_rest_where_statics_say(plant: str) -> None:
    p = nominal(plant)
    made = run(plant, list(p.values()), (), np.full(4000, 0.7), sub=8)
    assert made is not None
    expected = at_rest(plant, p, 0.7)
    largest = np.max(np.abs(made.readings), axis=0)
    assert np.all(np.abs(made.readings[-1] - expected) < 1e-4 * largest)


def response(plant: str, p: Mapping[str, float], s: complex) -> np.ndarray:
    """Return sensors over command from impedance matrices."""
    match plant:
        case "chain":
            z = [p[f"k_{i}"] + s * p[f"b_{i}"] for i in (1, 2, 3)]
            a = np.array([[z[0] + z[1], -z[1], 0], [-z[1], z[1] + z[2], -z[2]], [0, -z[2], z[2]]])
            a = a + s * s * np.diag([p["m_1"], p["m_2"], p["m_3"]])
            return np.linalg.solve(a, [1, 0, 0])
        case "stack":
            dynamic = p["k"] + s * p["b"] + s * s * p["m"]
            x_per_v = p["alpha"] / dynamic
            y = s * p["C_a"] + p["alpha"] * s * x_per_v
            v = 1 / (1 + p["R_a"] * y)
            return np.array([y * v, x_per_v * v])
        case "motor":
            shaft = p["k_s"] / s + p["b_s"]
            n, k = p["n"], p["K_m"]
            a = np.array(
                [
                    [p["R_w"] + s * p["L_w"], k, 0],
                    [-k, s * p["J_1"] + p["b_1"] + shaft / n**2, -shaft / n],
                    [0, -shaft / n, s * p["J_2"] + p["b_2"] + shaft],
                ]
            )
            return np.linalg.solve(a, [1, 0, 0])
        case "corner":
            tyre, spring = p["k_t"] / s + p["b_t"], p["k_s"] / s + p["b_s"]
            a = np.array(
                [[s * p["m_u"] + tyre + spring, -spring], [-spring, s * p["m_b"] + spring]]
            )
            both = np.linalg.solve(a, [tyre, 0])
            return np.array([both[0], both[1], (both[0] - both[1]) / s])
        case "tanks":
            g = [1 / p["R_12"], 1 / p["R_23"], 1 / p["R_out"]]
            a = np.array([[g[0], -g[0], 0], [-g[0], g[0] + g[1], -g[1]], [0, -g[1], g[1] + g[2]]])
            a = a + s * np.diag([p["C_1"], p["C_2"], p["C_3"]])
            return np.linalg.solve(a, [1, 0, 0])
        case _:
            coil = 1 / (p["R_g"] + 1 / (s * p["C_f"]))
            back = p["K_g"] ** 2 * coil
            x = 1 / (p["k"] + s * (p["b"] + back) + s * s * p["m"])
            return np.array([x, s * x * p["K_g"] * coil / (s * p["C_f"])])


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("period", [25, 80, 200])
def test_follows_the_impedances(plant: str, period: int) -> None:
    p, step = nominal(plant), PLANTS[plant].step
    n = 30 * period + (2000 if plant == "chain" else 1000)
    w = 2 * np.pi / (period * step)
    u = np.cos(w * step * np.arange(n))
    made = run(plant, list(p.values()), (), u, sub=4, over=8, hold="linear")
    assert made is not None
    last = slice(8 * (n - 10 * period), 8 * n)
    probe = np.exp(-1j * w * step / 8 * np.arange(8 * n))[last]
    found = 2 * np.mean(made.readings[last] * probe[:, None], axis=0)
    # straight lines between the samples of a cosine hold this share of it
    share = np.sinc(1 / period) ** 2
    expected = response(plant, p, 1j * w) * share
    assert np.all(np.abs(found - expected) < 1e-3 * np.abs(expected))


def balance(*rows: Row) -> tuple[float, float]:
    """Return the work of a force on a chain from rest to rest, and what the dampers took."""
    p = nominal("chain")
    n, h = 5000, PLANTS["chain"].step / 8
    u = 40 * np.sin(0.11 * np.arange(n)) * (np.arange(n) < 1200)
    made = run("chain", list(p.values()), rows, u, sub=4, over=8, hold="linear")
    assert made is not None
    x = np.column_stack([np.zeros(n * 8), made.readings])
    force = np.interp(np.arange(n * 8) / 8, np.arange(n), u)
    work = np.sum((force[1:] + force[:-1]) / 2 * np.diff(x[:, 1]))
    rates = np.diff(np.diff(x, axis=1), axis=0) / h
    lost = np.sum(rates**2 @ np.array([p["b_1"], p["b_2"], p["b_3"]])) * h
    return float(work), float(lost)


def test_energy_of_the_chain() -> None:
    work, lost = balance()
    assert work == pytest.approx(lost, rel=2e-3)


def test_a_cubic_spring_stores_and_gives_back() -> None:
    work, lost = balance(Row(10, 3, 0, (0.0, 1e8)))
    assert work == pytest.approx(lost, rel=2e-3)
    assert abs(work / balance()[0] - 1) > 0.01


@pytest.mark.parametrize(
    "row",
    [
        Row(15, 4, 0, (1e4, 3e-3, 10, 1.0)),
        Row(16, 4, 1, (5e3, 2e-3, 1.5, 0.5)),
        Row(17, 4, 2, (0.3, 2, 0.05, 4.0)),
        Row(40, 7, 0, (5.0, 0, 0, 0, 0, 0, 0, 0, 0, 2e-3)),
        Row(42, 7, 1, (5.0, 5e4, 0.0, 0.0, 1.0)),
        Row(43, 6, 0, (200.0,)),
        Row(60, 7, 7, (2.0, 0.8)),
    ],
    ids=["stops", "bouc_wen", "creep", "coulomb", "dahl", "drag", "diffusion"],
)
def test_lossy_effects_take_energy(row: Row) -> None:
    """The work exceeds what the dampers took by what the effect took, which is not negative."""
    work, lost = balance(row)
    assert work - lost > 0.01 * work
