"""The plants and laws that came with trial 2: against the tool's own equations and by hand."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.models.plants import PLANT_MODELS, plant_model
from bondgraph.graph.elements import TwoPort, Valued
from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.generator.excitation import command
from hardware.simulators.generator.laws_withheld import WITHHELD_LAWS
from hardware.simulators.generator.native import Row, run
from hardware.simulators.generator.parameters import ALL_PLANTS, SHAKEN_PLANTS, WITHHELD_PLANTS
from tests.hardware.simulators.generator.excited import excited, moved
from tests.settled import simulate

PLANTS = (*SHAKEN_PLANTS, *WITHHELD_PLANTS)


@pytest.mark.parametrize("plant", PLANTS)
def test_two_codes_agree_on_the_plain_plant(plant: str) -> None:
    public, graph = ALL_PLANTS[plant], plant_model(plant)
    u = command(plant, "multisine", 400, 1.0, np.random.default_rng(3))
    u[0] = 0  # both start at rest
    made = excited(plant, (), u)
    got = simulate(
        graph.with_values(moved(plant)), np.arange(400) * public.step, {public.source[0]: u}
    )
    for c, name in enumerate(public.sensors):
        expected = made.readings[:, c]
        assert np.abs(got[name] - expected).max() < 5e-4 * np.abs(expected).max(), name


@pytest.mark.parametrize("plant", PLANTS)
def test_the_model_has_the_public_names_and_values(plant: str) -> None:
    graph, public = plant_model(plant), ALL_PLANTS[plant]
    assert graph.check() == ()
    hardening = {n for n in public.nominal if n.startswith("a_3")}
    assert {e.name for e in graph.of_type(Valued, TwoPort)} | hardening == set(public.nominal)
    for name, (value, _) in public.nominal.items():
        assert graph.parameters[name].value == pytest.approx(value), name
    assert list(PLANT_MODELS) == list(ALL_PLANTS)


def test_what_comes_to_rest() -> None:
    force, volts = np.full(3000, 20.0), np.full(4000, 3.0)
    p = moved("frame")
    made = excited("frame", (), force, 20)
    assert made.readings[-1] == pytest.approx([0, 0, 20.0], abs=1e-6)
    p = moved("press")
    made = excited("press", (), force, 20)
    x = made.readings[-1, 0]
    assert p["k_1"] * x + p["a_3_k_1"] * (x / 1e-3) ** 3 == pytest.approx(20.0, rel=1e-6)
    assert made.readings[-1, 1:] == pytest.approx([0, 0], abs=1e-6)
    p = moved("table")
    made = excited("table", (), volts, 20)
    drag = p["b_1"] + p["b_2"]
    speed = p["K_f"] * 3 / (p["K_f"] ** 2 + p["R_w"] * drag)
    assert np.diff(made.readings[-2:, 1]) / 1e-3 == pytest.approx(speed, rel=1e-6)
    assert made.readings[-1, 0] == pytest.approx(drag * speed / p["K_f"], rel=1e-6)
    p = moved("speaker")
    made = excited("speaker", (), np.full(16000, 3.0), 20)
    assert made.readings[-1] == pytest.approx([3 / p["R_e"], 0, 0], abs=2e-6)


SPRUNG = [0.2, 8.0e3, 60.0, 1e-6, 200.0, 1e-5]
"""The probe well damped and without its coil: pushed slowly, it shows the spring's law."""


def pushed(law: str, numbers: tuple[float, ...], force: Array) -> Array:
    w = WITHHELD_LAWS[law]
    made = run("probe", SPRUNG, (Row(w.kind, 1, w.states, numbers),), force, sub=40, hold="linear")
    assert made is not None
    return made.readings[:, 0]


def test_a_magnet_pulls_by_the_square_of_its_distance() -> None:
    force = np.interp(np.arange(1500), [0, 700, 800, 1500], [0, 4, 4, 4])
    x, d = pushed("magnet", (1.5, 2e-3, 0.0), force)[-1], 2e-3
    assert 8e3 * x + 1.5 * (1 / (1 - x / d) ** 2 - 1) == pytest.approx(4.0, rel=1e-4)
    y = pushed("magnet", (1.5, 2e-3, 1.0), force)[-1]
    both = 1.5 * (1 / (1 - y / d) ** 2 - 1 / (1 + y / d) ** 2)
    assert 8e3 * y + both == pytest.approx(4.0, rel=1e-4)


def test_a_damped_contact_stands_by_hertz_and_takes_energy() -> None:
    force = np.interp(np.arange(1500), [0, 700, 1500], [0, 6, 6])
    x = pushed("damped_contact", (5e6, 2e-4, 1e3, 0.5), force)[-1]
    assert 8e3 * x + 5e6 * (x - 2e-4) ** 1.5 == pytest.approx(6.0, rel=1e-4)
    swing = 6 * np.sin(2 * np.pi * np.arange(2000) / 100)
    free, damped = (pushed("damped_contact", (5e6, 2e-4, 2e-4, c), swing) for c in (0.0, 200.0))
    assert np.sum(np.diff(damped) * swing[1:]) > 1.02 * np.sum(np.diff(free) * swing[1:]) > 0


def test_a_tilted_loop_turns_by_its_slopes() -> None:
    # far along one way the extra force runs beside the line `far q` at the distance of one length
    turn, length, far = 6e3, 2e-4, 1e3
    force = np.interp(np.arange(4000), [0, 3200, 4000], [0, 30, 30])
    x = pushed("tilted_loop", (turn, length, far), force)[-1]
    z = 30 - 8e3 * x
    assert z == pytest.approx(far * x + (turn - far) * length * (1 - np.exp(-x / length)), rel=1e-3)
    wave = np.interp(
        np.arange(6000), np.arange(0, 6001, 600), [0, 9, -9, 9, -9, 9, -9, 9, -9, 9, -9]
    )
    q = pushed("tilted_loop", (turn, length, far), wave)
    # the loop is closed, and as wide for the same corners
    assert q[3000] == pytest.approx(q[4200], rel=1e-3)
    assert abs(q[3600] + q[4200]) < 1e-3 * abs(q[4200])


def test_friction_falls_exponentially() -> None:
    p = moved("table")
    law = WITHHELD_LAWS["exponential_stribeck"]
    numbers = (0.6, 0.8, 0.05, 0, 0, 0, 0, 0, 0, 1e-3)
    made = excited("table", (Row(law.kind, 4, 0, numbers),), np.full(4000, 4.0), 40)
    speed = float(np.diff(made.readings[-2:, 1])[0]) / 1e-3
    drag = (p["b_1"] + p["b_2"]) * speed + 0.6 + 0.8 * np.exp(-speed / 0.05)
    assert p["K_f"] * made.readings[-1, 0] == pytest.approx(drag, rel=1e-5)


def test_a_film_resists_by_the_cube_of_its_gap() -> None:
    # held in the middle of its way by a constant force, small swings are damped by the local gap
    law = WITHHELD_LAWS["squeezed_film"]
    values = [0.2, 8e3, 4.0, 1e-6, 200.0, 1e-5]
    push = np.full(3000, 4.0)
    push[2000:] += 0.02 * np.sin(2 * np.pi * 0.06 * np.arange(1000))
    gap, factor, q = 1e-3, 3.0, 5e-4
    made = run("probe", values, (Row(law.kind, 2, 0, (factor, gap)),), push, sub=40, hold="linear")
    plain = [*values[:2], 4.0 + factor * (1 / (1 - q / gap) ** 3 - 1), *values[3:]]
    same = run("probe", plain, (), push, sub=40, hold="linear")
    assert made is not None
    assert same is not None
    a, b = made.readings[2500:, 0], same.readings[2500:, 0]
    assert np.std(a - b) < 0.01 * np.std(b)


def test_a_pendulum_keeps_the_energy() -> None:
    """Kinetic and potential energy of carriage, spring and pendulum, without any damping."""
    values = [0.2, 8.0e3, 1e-9, 1e-6, 200.0, 1e-5]
    m, length, rate = 0.1, 2e-3, 150.0
    law = WITHHELD_LAWS["hanging_pendulum"]
    push = np.zeros(2000)
    push[1:60] = 5.0
    row = Row(law.kind, 0, law.states, (m, length, rate, 0.0))
    x = run("probe", values, (row,), push, sub=200, over=8, hold="linear")
    assert x is not None
    q = x.readings[:, 0]
    h = (1 / 500) / 8
    v = np.gradient(q, h, edge_order=2)
    a = np.gradient(v, h, edge_order=2)
    free = slice(70 * 8, -16)
    # the force that the carriage feels is what the pendulum takes: momentum of both along the way
    reaction = 0.2 * a[free] + 8e3 * q[free]
    assert np.std(reaction) > 0.05 * np.std(8e3 * q[free])
    # nothing is lost: the largest swings at the end are those of the beginning
    early, late = np.abs(q[free][:4000]).max(), np.abs(q[free][-4000:]).max()
    assert late == pytest.approx(early, rel=0.05)


def test_a_limit_levels_by_the_arctangent() -> None:
    law = WITHHELD_LAWS["arctangent_limit"]
    values = [1.0, 1e12, 1.0, 1e12]
    made = run("oven", values, (Row(law.kind, 100, 0, (2.0,)),), np.full(50, 5.0), sub=20)
    assert made is not None
    assert np.diff(made.readings[:, 0])[-1] / 5.0 == pytest.approx(2 * np.arctan(2.5), rel=1e-6)
